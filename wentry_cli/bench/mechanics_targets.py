"""What was asked of the derivatives and of the mechanics and what they reached, from the rows of the benchmark."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

from wentry_cli.bench.calibrations import ADDED_MASS, COMPRESSION, FLOW, RATIO
from wentry_cli.bench.row import BenchRow
from wentry_cli.bench.smoother_peers import ORACLE
from wentry_cli.bench.smoothers import NOISE_PX, OURS
from wentry_cli.bench.target import Target

Found = dict[tuple[str, str, str], BenchRow]
PLAIN, OUTLIERS, LONG = (
    f"hard: {name}, inside" for name in ("0.1 px, white", "5 % outliers of 20 px", "100 000 frames")
)


def list_mechanics(rows: list[BenchRow]) -> list[Target]:
    """The targets of the chapters smoothers, delta_u, solvers and calibrations, those that were run in full."""
    parts: dict[str, Callable[[Found], list[Target]]] = {
        "smoothers": _smoothers, "delta_u": _delta_u, "solvers": _solvers, "calibrations": _calibrations,
    }  # fmt: skip
    targets: list[Target] = []
    for chapter, part in parts.items():
        found = {(row.case, row.method, row.quantity): row for row in rows if row.chapter == chapter}
        if found:
            with suppress(KeyError):  # a case was not run
                targets += part(found)
    return targets


def _smoothers(found: Found) -> list[Target]:
    targets = []
    for quantity, most in (("velocity", 1.6), ("acceleration", 2.2)):
        ratios = {
            f"{px:g} px": found[f"{px:g} px, inside", OURS, quantity].rmse
            / found[f"{px:g} px, inside", ORACLE, quantity].rmse
            for px in NOISE_PX
        }
        targets.append(_most(f"{quantity} inside: RMSE / oracle", most, ratios))
    for place, limits in (("inside", (2.0, 1.2)), ("at impact", (13.0, 23.0))):
        v, a = (found[f"0.1 px, {place}", OURS, quantity].rmse for quantity in ("velocity", "acceleration"))
        targets.append(_one(f"0.1 px, {place}: velocity", limits[0], 1e3 * v, "mm/s"))
        targets.append(_one(f"0.1 px, {place}: acceleration", limits[1], a, "m/s²"))
    inside, strike = (
        {
            f"{q}, {px:g} px": found[f"{px:g} px, {place}", OURS, q].held
            for px in NOISE_PX
            for q in ("velocity", "acceleration")
        }
        for place in ("inside", "at impact")
    )
    low, high = min(inside, key=inside.__getitem__), max(inside, key=inside.__getitem__)
    least = min(strike, key=strike.__getitem__)
    cost = found[OUTLIERS, OURS, "velocity"].rmse / found[PLAIN, OURS, "velocity"].rmse - 1.0
    held = f"{inside[low]:.1%} ({low}) to {inside[high]:.1%} ({high})"
    return [
        *targets,
        Target("95 % band inside holds", "91 to 98 %", held, inside[low] >= 0.91 and inside[high] <= 0.98),
        Target("95 % band at impact holds", "≥ 90 %", f"{strike[least]:.1%} ({least})", strike[least] >= 0.9),
        Target("5 % outliers cost, velocity", "< 10 %", f"{cost:.1%}", cost < 0.1),
        _one("340 frames", 50.0, 1e-3 * found["0.1 px, inside", OURS, "velocity"].time_us, "ms"),
        _one("100 000 frames", 5.0, 1e-6 * found[LONG, OURS, "velocity"].time_us, "s"),
    ]


def _delta_u(found: Found) -> list[Target]:
    errors = {case: row.rmse for (case, method, _), row in found.items() if method == "λ measured"}
    return [_most("ΔU from rendered frames, mm/s", 2.0, errors)]


def _solvers(found: Found) -> list[Target]:
    times = {method: row.time_us for (_, method, _), row in found.items()}
    tight, loose = times["wentry, all events, 1e-08"], times["wentry, all events, 2e-04"]
    text = f"{tight:.0f} µs, {tight / times['odeint, 1e-08']:.3f} of odeint"
    return [
        Target("trajectory with extrema at 1e-8", "≤ 130 µs", text, tight <= 130.0),
        _one("trajectory with extrema at 2e-4", 30.0, loose, "µs"),
    ]


def _calibrations(found: Found) -> list[Target]:
    flow, ratio = found[FLOW, "wentry", "ln flow"], found[RATIO, "wentry", "ratio"]
    held = {quantity: found[FLOW, "wentry", quantity].held for quantity in ("n", "ln ε̇₀")}
    text = ", ".join(f"{share:.1%} ({quantity})" for quantity, share in held.items())
    mass, modulus = found[ADDED_MASS, "wentry", "C_m"], found[COMPRESSION, "wentry", "G∞"]
    return [
        _one("joint fit of three drops", 60.0, 1e-3 * flow.time_us, "ms"),
        Target(
            "joint fits solved from no start", "all", f"{1.0 - flow.failures:.2%} of {flow.items}", flow.failures == 0.0
        ),
        Target("intervals of ε̇₀ and n hold", "93 to 97 %", text, all(0.93 <= share <= 0.97 for share in held.values())),
        _one("bias of the ratio of periods", 0.002, abs(ratio.bias), ""),
        _one("C_m, relative", 1e-12, mass.rmse, ""),
        _one("G∞ at 1 % noise and an unknown zero", 1.0, 1e2 * modulus.rmse, "%"),
    ]


def _most(what: str, most: float, values: dict[str, float]) -> Target:
    worst = max(values, key=values.__getitem__)
    return Target(what, f"≤ {most:g}", f"{values[worst]:.2f} ({worst})", values[worst] <= most)


def _one(what: str, most: float, value: float, unit: str) -> Target:
    return Target(what, f"≤ {most:g} {unit}".rstrip(), f"{value:.3g} {unit}".rstrip(), value <= most)
