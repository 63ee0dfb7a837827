"""What was asked of the measurement and what it reached, from the rows of the benchmark."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace

import numpy as np
from scipy.stats import chi2

from wentry_cli.bench.ball import CHANGING
from wentry_cli.bench.contours import TOLD
from wentry_cli.bench.mechanics_targets import list_mechanics
from wentry_cli.bench.outline_cases import find_case
from wentry_cli.bench.row import BenchRow
from wentry_cli.bench.speed_targets import list_speed
from wentry_cli.bench.target import Target

OURS = "wentry accurate"
CLEAN = (
    "noise 0.5 %", "noise 1 %", "noise 2 %, 8 bit", "noise 5 %", "noise 10 %", "λ 0.85", "λ 1.0", "λ 1.8",
    "λ 1.8, R 90", "70 % of the arc", "35 % of the arc", "R 90", "R 125",
)  # fmt: skip
DROPLETS = ("droplets on 20 %", "droplets on 32 %", "droplets on 42 %")
OCCLUDED = (*DROPLETS, "bright spots inside", "30 % out of the frame")
BESIDE = {"20 % of the arc": 1.5, "contrast 15 %": 1.3, "motion 3.6 px": 1.3, "30 % out of the frame": 1.2}
FIT = ("x", "y", "stretch", "bottom_y")


class Rows:
    """The rows of our fit, looked up by case and quantity."""

    def __init__(self, rows: list[BenchRow]) -> None:
        """Keep the rows of our accurate fit, and all of the chapters that have no peers in the question."""
        self._told = {(row.case, row.quantity): row for row in rows if row.method == TOLD}
        self._rows = {(row.chapter, row.case, row.quantity): row for row in rows if row.method in {OURS, "wentry"}}

    def has(self, chapter: str) -> bool:
        """Whether a chapter was run."""
        return any(name == chapter for name, *_ in self._rows)

    def of(self, case: str, quantity: str, chapter: str = "contours") -> BenchRow:
        """One row."""
        return self._rows[chapter, case, quantity]

    def left(self, case: str) -> str:
        """How near our fit of a case is to the bound of what is left; empty where an earlier run did not look."""
        worst = max((self.of(case, quantity) for quantity in FIT), key=lambda row: row.ratio_to_bound)
        if math.isnan(worst.limit):
            return ""
        return f"; of what is left {worst.ratio_to_left:.2f}, whose limit is {worst.limit:.2f}"

    def told(self, case: str) -> str:
        """What our fit reaches on the frames of a case when it is told what is hidden; empty where that was not run."""
        found = [self._told[case, quantity] for quantity in FIT if (case, quantity) in self._told]
        if not found:
            return ""
        worst = max(found, key=lambda row: row.ratio_to_bound)
        return f"; told what is hidden {worst.ratio_to_bound:.2f}, with {worst.failures:.0%} of the frames not measured"

    def chapter(self, name: str) -> list[BenchRow]:
        """All rows of a chapter."""
        return [row for (chapter, *_), row in self._rows.items() if chapter == name]

    def worst(
        self, cases: tuple[str, ...], quantities: tuple[str, ...], value: Callable[[BenchRow], float]
    ) -> tuple[float, str]:
        """Greatest value over cases and quantities, and where it is reached."""
        found = [(value(self.of(case, quantity)), f"{quantity}, {case}") for case in cases for quantity in quantities]
        return max((pair for pair in found if not math.isnan(pair[0])), default=(math.nan, "–"))


def list_targets(rows: list[BenchRow]) -> list[Target]:
    """The targets of the chapters that were run in full; none of a quick run."""
    known = Rows(rows)
    targets: list[Target] = []
    for part in (_contours, _separation, _pinch_off):
        with suppress(KeyError):  # a case was not run
            targets += part(known)
    return targets + _ball(rows) + list_mechanics(rows) + list_speed(rows)


def _contours(rows: Rows) -> list[Target]:
    if not rows.has("contours"):
        return []

    def ratio(row: BenchRow) -> float:
        return row.ratio_to_bound

    found = [
        _at_most(rows, "clean: RMSE / bound of x₀, y₀, λ", 1.2, (CLEAN, ("x", "y", "stretch")), ratio),
        _at_most(rows, "clean: RMSE / bound of y_b", 1.35, (CLEAN, ("bottom_y",)), ratio),
        _bias(rows),
        _at_least(rows, "clean: frames called ok", 0.98, CLEAN),
    ]
    for case, most in BESIDE.items():
        found.append(_at_most(rows, f"{case}: RMSE / bound", most, ((case,), FIT), ratio))
    found.append(_at_most(rows, "bright spots inside: RMSE / bound", 1.6, (("bright spots inside",), FIT), ratio))
    for case, most in zip(DROPLETS, (1.8, 2.1, 2.4), strict=True):
        one = _at_most(rows, f"{case}: RMSE / unoccluded bound", most, ((case,), FIT), ratio)
        found.append(replace(one, measured=one.measured + rows.left(case) + rows.told(case)))
    gross = max(rows.of(case, "y").failures - (1.0 - rows.of(case, "y").measured) for case in DROPLETS)
    false = max(rows.of(case, "y").false_ok for case in DROPLETS)
    found += [
        Target("droplets: gross failures", "none", f"{gross:.1%}", gross < 1e-9),
        _at_least(rows, "droplets: frames called ok", 0.9, DROPLETS),
        Target("droplets: false ok", "≤ 1 %", f"{false:.1%}", false <= 0.01),
    ]
    return found + _uncertainties(rows) + [_misfit(rows)]


def _bias(rows: Rows) -> Target:
    """Bias within a quarter of the bound or .002 px (of the half-width for the stretch), whichever allows more."""

    def excess(row: BenchRow) -> float:
        scale = find_case(row.case).radius if row.quantity == "stretch" else 1.0
        allowed = max(0.25 * row.rmse / row.ratio_to_bound, 0.002 / scale)
        return abs(row.bias) / allowed

    worst, where = rows.worst(CLEAN, FIT, excess)
    text = f"{worst:.2f} of what is allowed ({where})"
    return Target("clean: bias", "≤ 0.25 bound or 0.002 px", text, worst <= 1.0)


def _uncertainties(rows: Rows) -> list[Target]:
    high, where = rows.worst(CLEAN, FIT, lambda row: row.pull)
    low, where_low = rows.worst(CLEAN, FIT, lambda row: -row.pull)
    hidden, where_hidden = rows.worst(OCCLUDED, FIT, lambda row: row.pull)
    beyond, where_beyond = rows.worst(CLEAN + OCCLUDED, FIT, lambda row: row.beyond_3)
    pulls = f"{-low:.2f} ({where_low}) to {high:.2f} ({where})"
    met = -low >= 0.85 and high <= 1.15
    return [
        Target("uncertainty: standard deviation of error/unc, clean", "0.85 to 1.15", pulls, met),
        Target("the same, occluded", "≤ 1.3", f"{hidden:.2f} ({where_hidden})", hidden <= 1.3),
        Target("beyond 3 uncertainties", "≤ 2 %", f"{beyond:.1%} ({where_beyond})", beyond <= 0.02),
    ]


def _misfit(rows: Rows) -> Target:
    row = rows.of("shape misfit 0.5 %", "local_bottom_y")
    text = f"{row.ratio_to_bound:.2f} × its bound"
    return Target("shape misfit 0.5 %: local y_b", "≤ 3 × its own bound", text, row.ratio_to_bound <= 3.0)


def _at_most(
    rows: Rows,
    what: str,
    most: float,
    where: tuple[tuple[str, ...], tuple[str, ...]],
    value: Callable[[BenchRow], float],
) -> Target:
    worst, place = rows.worst(*where, value)
    return Target(what, f"≤ {most:g}", f"{worst:.2f} ({place})", worst <= most)


def _at_least(rows: Rows, what: str, least: float, cases: tuple[str, ...]) -> Target:
    share, case = min((rows.of(case, "y").measured, case) for case in cases)
    return Target(what, f"≥ {least:.0%}", f"{share:.1%} ({case})", share >= least)


def _separation(rows: Rows) -> list[Target]:
    found = []
    for row in rows.chapter("separation"):
        if math.isnan(row.rmse):
            found.append(
                Target(f"separation line, {row.case}", "empty", f"{row.measured:.0%} found", row.measured == 0.0)
            )
            continue
        most = 0.7 if row.case.startswith("λ 0.85") else 1.3
        text = f"{row.rmse:.2f} px, {row.measured:.0%} found"
        found.append(Target(f"separation line, {row.case}", f"≤ {most:g} px", text, row.rmse <= most))
    return found


def _pinch_off(rows: Rows) -> list[Target]:
    chapter = rows.chapter("pinch_off")
    if not chapter:
        return []
    bias = max(chapter, key=lambda row: abs(row.bias))
    rmse = max(chapter, key=lambda row: row.rmse)
    error = bias.rmse / math.sqrt(max(1, bias.items))
    return [
        Target(
            "t_p: bias at 0.2 px",
            "≤ 0.06 frame",
            f"{bias.bias:+.3f} ± {error:.3f} ({bias.case})",
            abs(bias.bias) <= 0.06,
        ),
        Target("t_p: RMSE at 0.2 px", "≤ 0.12 frame", f"{rmse.rmse:.3f} ({rmse.case})", rmse.rmse <= 0.12),
    ]


def _ball(rows: list[BenchRow]) -> list[Target]:
    """The scatter of a real ball about its parabola against what is stated of it, with the interval of 95 %."""
    found = [row for row in rows if row.chapter == "ball" and row.method.endswith(CHANGING)]
    if not found:
        return []
    freedom = round(found[0].items * found[0].measured) - 3
    low, high = np.sqrt(chi2.ppf([0.025, 0.975], freedom) / freedom)
    text = ", ".join(f"{row.pull:.2f} ({row.quantity})" for row in found)
    what = "a real ball: √(χ²/ν) about a parabola, of what changes from frame to frame"
    return [Target(what, f"{low:.2f} to {high:.2f}", text, all(low <= row.pull <= high for row in found))]
