"""Calibration of materials into ``materials.csv``: from measured drops on a rigid surface, from a compression test."""

from __future__ import annotations

import csv as csv_format
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wentry_cli.errors import ConfigurationError, InputError, TooFewMeasurementsError
from wentry_cli.mechanics.calibration import Calibration, Ringing, fit_flow
from wentry_cli.mechanics.compression import fit_compression
from wentry_cli.stages.drop_tables import column
from wentry_cli.stages.model import first_peak, sphere_material
from wentry_cli.tables import has_table, new_table, read_table, write_table

if TYPE_CHECKING:
    import pandas as pd

    from wentry_cli.config.campaign import Drop

FORCE = "force_N"
DISPLACEMENTS = {"displacement_m": 1.0, "displacement_mm": 1e-3}
Row = dict[str, Any]
_KEYS = ("material", "sphere_id", "source")


def calibrate_impact(results: Path, drops: Sequence[Drop]) -> list[str]:
    """Fit ε̇₀ and n of every sphere to its measured ``surface_impact`` drops in ``results``; returns the warnings.

    All heights of a sphere are fitted together. Rows of other spheres and of compression tests stay in
    ``materials.csv``. Raises ``InputError`` where no such drop was measured, ``ConfigurationError`` where a sphere has
    no material to start from (G∞ must be known), ``TooFewMeasurementsError`` where no sphere could be fitted; the
    table is written before that.
    """
    groups: dict[str, list[Drop]] = {}
    for drop in sorted(drops, key=lambda each: each.name):
        if drop.experiment.kind == "surface_impact" and drop.experiment.deformable:
            groups.setdefault(drop.experiment.sphere.group, []).append(drop)
    if not groups:
        raise InputError(
            f"{results}: holds no drop of kind surface_impact; process drops on a rigid surface first, "
            "at several heights for each sphere"
        )
    rows, warnings = [], []
    for sphere_id, given in groups.items():
        own = [_with_compression(results, drop) for drop in given]
        fit = _fit_sphere(results, own)
        rows.append(_impact_row(own[0], sphere_id, fit))
        if fit.warning:
            warnings.append(f"{sphere_id}: {fit.warning}")
    _merge_rows(results, rows)
    if all(row["status"] == "too_few" for row in rows):
        raise TooFewMeasurementsError(f"{results}: no sphere could be calibrated; {warnings[0]}")
    return warnings


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


def _fit_sphere(results: Path, drops: list[Drop]) -> Calibration:
    for drop in drops:
        if drop.material is None:
            raise ConfigurationError(
                f"{drop.folder / 'experiment.yaml'}: sphere.material is missing; calibration needs its G_inf and G_T, "
                "so name a material of materials.yaml"
            )
    ringings = [ringing for drop in drops if (ringing := _ringing(results / drop.name)) is not None]
    return fit_flow(sphere_material(drops[0]), ringings)


def _ringing(folder: Path) -> Ringing | None:
    """λ(t) of a drop after its first peak; None where no peak was measured."""
    if not (has_table(folder, "stretch") and has_table(folder, "periods")):
        return None
    stretch, first = read_table(folder, "stretch"), first_peak(read_table(folder, "periods"))
    if not first.found:
        return None
    times = column(stretch, "t_s") - first.time_s
    after = times >= 0.0
    return Ringing(times[after], column(stretch, "stretch")[after], column(stretch, "stretch_unc")[after])


def _impact_row(drop: Drop, sphere_id: str, fit: Calibration) -> Row:
    material, known = fit.material, drop.material
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
        "n": material.n,
        "n_unc": fit.n_unc,
        "eps0_dot_1_s": material.eps0_dot_1_s,
        "eps0_dot_1_s_unc": fit.eps0_dot_unc_1_s,
        "correlation": fit.correlation,
        "source": "impact",
        "status": fit.status,
    }


def calibrate_compression(
    csv: Path, diameter_m: float, results: Path, *, material: str = "sphere", sphere_id: str = ""
) -> None:
    """Fit G∞ to a force–displacement test and write its row into ``materials.csv`` in ``results``.

    ``csv`` has a header with ``force_N`` and ``displacement_m`` or ``displacement_mm``. Raises ``InputError`` where it
    cannot be read, ``ConfigurationError`` for an impossible diameter, ``TooFewMeasurementsError`` where the test does
    not determine G∞; the row is written before that.
    """
    if not (math.isfinite(diameter_m) and diameter_m > 0.0):
        raise ConfigurationError(f"--diameter-m {diameter_m:g}: must be a positive number of metres")
    displacement, force = read_compression(csv)
    fit = fit_compression(displacement, force, diameter_m)
    row = {
        "material": material,
        "sphere_id": sphere_id or None,
        "diameter_m": diameter_m,
        "g_inf_pa": fit.g_inf_pa,
        "g_inf_pa_unc": fit.g_inf_pa_unc,
        "source": "compression",
        "status": fit.status,
    }
    _merge_rows(results, [row])
    if fit.status != "ok":
        reason = "too few points with a load" if fit.status == "too_few" else "the force does not follow the curve"
        raise TooFewMeasurementsError(
            f"{csv}: G_inf is not determined, {reason}; check the units in the header and --diameter-m"
        )


def read_compression(path: Path) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Displacement in m and force in N of a compression test; rows with an empty cell are left out.

    Raises ``InputError`` with the line where a cell is no number, and where the file or a column is missing.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            lines = list(csv_format.reader(stream))
    except (OSError, UnicodeDecodeError, csv_format.Error) as error:
        raise InputError(f"{path}: cannot be read as a CSV table ({error}); give a text file with a header") from error
    header = [name.strip() for name in lines[0]] if lines else []
    unit = next((name for name in DISPLACEMENTS if name in header), None)
    if FORCE not in header or unit is None:
        raise InputError(
            f"{path}: the header needs {FORCE} and displacement_m or displacement_mm, and is "
            f"{', '.join(header) or 'empty'}; rename the columns, with their units"
        )
    places = (header.index(unit), header.index(FORCE))
    pairs = []
    for number, line in enumerate(lines[1:], start=2):
        cells = [line[place].strip() if place < len(line) else "" for place in places]
        if "" in cells:
            continue
        try:
            pairs.append([float(cell) for cell in cells])
        except ValueError:
            raise InputError(f"{path}:{number}: {', '.join(cells)} are not two numbers; mend the line") from None
    table = np.array(pairs, dtype=np.float64).reshape(-1, 2)
    return table[:, 0] * DISPLACEMENTS[unit], table[:, 1]


def _merge_rows(results: Path, rows: list[Row]) -> None:
    """Write ``rows`` into ``materials.csv`` in place of those of the same material, sphere and source."""
    import pandas as pd

    names = sorted({name for row in rows for name in row})
    table = new_table("materials", {name: [row.get(name) for row in rows] for name in names})
    if has_table(results, "materials"):
        old = read_table(results, "materials")
        kept = old[~_identities(old).isin(_identities(table))]
        table = pd.concat([kept, table], ignore_index=True) if len(kept) else table
    table = table.sort_values(list(_KEYS), kind="stable", ignore_index=True)
    write_table(results, "materials", table)


def _identities(table: pd.DataFrame) -> pd.Series[Any]:
    columns = table[list(_KEYS)].fillna("")
    return columns[_KEYS[0]] + "\t" + columns[_KEYS[1]] + "\t" + columns[_KEYS[2]]
