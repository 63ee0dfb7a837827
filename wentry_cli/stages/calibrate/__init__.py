"""Calibration of materials into ``materials.csv`` from measured drops on a rigid surface."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from wentry_cli.errors import ConfigurationError, InputError, TooFewMeasurementsError
from wentry_cli.mechanics.calibration import FEWEST_POINTS, Calibration, fit_flow
from wentry_cli.mechanics.ringing import Ringing
from wentry_cli.mechanics.solver import solve_oscillation
from wentry_cli.stages.calibrate.rows import Row, merge_rows, say_kept
from wentry_cli.stages.inputs.columns import column, first_row, number
from wentry_cli.stages.model import first_peak, sphere_material
from wentry_cli.tables import has_table, new_table, read_table, table_path, write_table

if TYPE_CHECKING:
    import pandas as pd

    from wentry_cli.config.campaign import Drop

CURVE_ROWS = 400  # of the fitted model of one drop
LEAST_KNOWN = 0.5  # relative uncertainty of the flow beyond which it is no number
LEAST_COMMON = 1e-4  # of λ in all frames of a clip: how far even clean outlines are off (docs/accuracy.md)


def calibrate_impact(results: Path, drops: Sequence[Drop]) -> list[str]:
    """Fit ε̇₀ and n of every sphere to its measured ``surface_impact`` drops in ``results``; returns the warnings.

    All heights of a sphere are fitted together. Rows of other spheres and of compression tests stay in
    ``materials.csv``, and so does a good row where the new fit is not ``ok``. ``calibration.csv`` has the fitted λ(t)
    of the drops behind each row. Raises ``InputError`` where no such drop was measured, ``ConfigurationError`` where a
    sphere has no material to start from (G∞ must be known), ``TooFewMeasurementsError`` where no sphere could be
    fitted; the tables are written before that.
    """
    rows, warnings, curves = [], [], {}
    for sphere_id, given in drops_by_sphere(results, drops).items():
        own = [_with_compression(results, drop) for drop in given]
        reasons = {drop.name: why_unused(results, drop) for drop in own}
        seen = {name: ringing for name in reasons if not reasons[name] and (ringing := _ringing(results / name))}
        fit = _fit_sphere(own, list(seen.values()))
        fitted = () if fit.status == "too_few" else seen
        curves[sphere_id] = [_curve(results, sphere_id, name, (fit, k)) for k, name in enumerate(fitted)]
        rows.append(_impact_row(own[0], sphere_id, fit))
        warnings += [f"{sphere_id}: {name} is left out: {reason}" for name, reason in reasons.items() if reason]
        if fit.warning and seen:
            warnings.append(f"{sphere_id}: {fit.warning}")
    refused = [str(row["sphere_id"]) for row in merge_rows(results, rows)]
    _merge_curves(results, {sphere_id: own for sphere_id, own in curves.items() if sphere_id not in refused})
    kept = [f"{sphere_id}: {say_kept(results)}" for sphere_id in refused]
    if all(row["status"] == "too_few" for row in rows):
        told = "; ".join([*warnings[:1], *kept[:1]])
        raise TooFewMeasurementsError(
            f"{results}: no sphere could be calibrated; {told}; `wentry calibrate impact {results} --dry-run` says of "
            "each drop why it is not used"
        )
    return warnings + kept


def drops_by_sphere(results: Path, drops: Sequence[Drop]) -> dict[str, list[Drop]]:
    """The drops of each sphere that are fitted together; raises ``InputError`` where there is none."""
    groups: dict[str, list[Drop]] = {}
    for drop in sorted(drops, key=lambda each: each.name):
        if drop.experiment.kind == "surface_impact" and drop.experiment.deformable:
            groups.setdefault(drop.experiment.sphere.group, []).append(drop)
    if not groups:
        raise InputError(
            f"{results}: holds no drop of kind surface_impact; process drops on a rigid surface first, "
            "at several heights for each sphere"
        )
    return groups


def why_unused(results: Path, drop: Drop) -> str | None:
    """Why ``drop`` adds nothing to a calibration, or ``None`` where it does."""
    if not has_table(results / drop.name, "stretch"):
        return "its stretch was not measured"
    ringing = _ringing(results / drop.name)
    if ringing is None:
        return "its first peak was not measured"
    few = ringing.clean().times_s.size < FEWEST_POINTS
    return f"fewer than {FEWEST_POINTS} frames were measured after its first peak" if few else None


def _with_compression(results: Path, drop: Drop) -> Drop:
    """The drop with G∞ of its material from a compression test in ``results``, where there was one."""
    if drop.material is None or not has_table(results, "materials"):
        return drop
    rows = read_table(results, "materials")
    rows = rows[(rows["material"] == drop.experiment.sphere.material) & (rows["source"] == "compression")]
    rows = rows[rows["status"] == "ok"]
    if not len(rows):
        return drop
    known = {name: float(rows[name].iloc[-1]) for name in ("g_inf_pa", "g_inf_pa_unc")}
    return replace(drop, material=drop.material.model_copy(update=known))


def _merge_curves(results: Path, curves: dict[str, list[pd.DataFrame]]) -> None:
    """Write the curves of the spheres into ``calibration.csv`` in place of earlier ones; those of others stay."""
    import pandas as pd

    parts = [curve for own in curves.values() for curve in own]
    if has_table(results, "calibration"):
        old = read_table(results, "calibration")
        parts.insert(0, old[~old["sphere_id"].isin(list(curves))])
    parts = [part for part in parts if len(part)]
    table = pd.concat(parts, ignore_index=True) if parts else new_table("calibration", {})
    write_table(results, "calibration", table.sort_values(["sphere_id", "drop"], kind="stable", ignore_index=True))


def _curve(results: Path, sphere_id: str, name: str, fitted: tuple[Calibration, int]) -> pd.DataFrame:
    """The fitted model of one drop over its clip: what the calibration saw beside the measured stretch."""
    fit, k = fitted
    stretch, first = read_table(results / name, "stretch"), first_peak(read_table(results / name, "periods"))
    times = np.linspace(0.0, max(float(stretch["t_s"].max()) - first.time_s, 0.0), CURVE_ROWS)
    own = np.maximum(times - fit.shift_s[k], 0.0)
    model = solve_oscillation(
        fit.material, float(fit.stretch_0[k]), own, viscous_0=float(fit.stretch_viscous_0[k]), tolerance=1e-8
    )
    columns = {"t_s": first.time_s + times, "stretch": model.stretch, "stretch_viscous": model.stretch_viscous}
    return new_table("calibration", {"drop": [name] * CURVE_ROWS, "sphere_id": [sphere_id] * CURVE_ROWS, **columns})


def _fit_sphere(drops: list[Drop], ringings: list[Ringing]) -> Calibration:
    for drop in drops:
        if drop.material is None:
            raise ConfigurationError(
                f"{drop.folder / 'experiment.yaml'}: sphere.material is missing; calibration needs its G_inf and G_T, "
                "so name a material of materials.yaml"
            )
    known = drops[0].material
    return fit_flow(sphere_material(drops[0]), ringings, g_inf_unc_pa=known.g_inf_pa_unc if known is not None else 0.0)


def _ringing(folder: Path) -> Ringing | None:
    """λ(t) of a drop after its first peak; None where no peak was measured."""
    if not (has_table(folder, "stretch") and has_table(folder, "periods")):
        return None
    stretch, first = read_table(folder, "stretch"), first_peak(read_table(folder, "periods"))
    if not first.found:
        return None
    times = column(stretch, "t_s") - first.time_s
    if not np.all(np.diff(times) > 0.0):
        raise InputError(f"{table_path(folder, 'stretch')}: t_s does not rise; run the stage stretch again")
    after = times >= 0.0
    value, unc = (column(stretch, name)[after] for name in ("stretch", "stretch_unc"))
    return Ringing(times[after], value, unc, max(LEAST_COMMON, _of_radius(folder)))


def _of_radius(folder: Path) -> float:
    """Relative uncertainty of the radius that the stretch of the side view is measured against; 0 if not known."""
    geometry = first_row(folder, "geometry", view="side")
    relative = number(geometry, "radius_px_unc") / number(geometry, "radius_px")
    return relative if math.isfinite(relative) else 0.0


def _impact_row(drop: Drop, sphere_id: str, fit: Calibration) -> Row:
    """The row of a sphere; ε̇₀ and n are empty where the drops do not tell them apart, their product is not."""
    material, known, nan = fit.material, drop.material, math.nan
    identified = fit.status == "ok"
    known_flow = fit.flow_unc_1_s < LEAST_KNOWN * fit.flow_1_s
    return {
        "material": drop.experiment.sphere.material or sphere_id,
        "sphere_id": sphere_id,
        "diameter_m": drop.experiment.sphere.diameter_m,
        "g_inf_pa": material.g_inf_pa,
        "g_inf_pa_unc": known.g_inf_pa_unc if known is not None and known.g_inf_pa_unc > 0.0 else math.nan,
        "g_t_pa": material.g_t_pa,
        "xi": material.xi,
        "tau0_pa": material.tau0_pa,
        "m": material.m,
        "n": material.n if identified else nan,
        "n_unc": fit.n_unc if identified else nan,
        "n_low": fit.n_low if identified else nan,
        "n_high": fit.n_high if identified else nan,
        "eps0_dot_1_s": material.eps0_dot_1_s if identified else nan,
        "eps0_dot_1_s_unc": fit.eps0_dot_unc_1_s if identified else nan,
        "eps0_dot_low_1_s": fit.eps0_dot_low_1_s if identified else nan,
        "eps0_dot_high_1_s": fit.eps0_dot_high_1_s if identified else nan,
        "flow_1_s": fit.flow_1_s if known_flow else nan,
        "flow_1_s_unc": fit.flow_unc_1_s if known_flow else nan,
        "correlation": fit.correlation,
        "source": "impact",
        "status": fit.status,
    }
