"""Calibration of materials into ``materials.csv``: from measured drops on a rigid surface, from a compression test."""

from __future__ import annotations

import csv as csv_format
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wentry_cli.errors import ConfigurationError, InputError, TooFewMeasurementsError
from wentry_cli.mechanics.calibration import Calibration, Ringing, fit_flow
from wentry_cli.mechanics.compression import CompressionFit, compression_force, fit_compression
from wentry_cli.stages.drop_tables import column
from wentry_cli.stages.model import first_peak, sphere_material
from wentry_cli.tables import has_table, new_table, read_table, table_path, write_table

if TYPE_CHECKING:
    import pandas as pd

    from wentry_cli.config.campaign import Drop

FORCE = "force_N"
DISPLACEMENTS = {"displacement_m": 1.0, "displacement_mm": 1e-3}
LARGEST_M = 1.0  # a diameter above this was given in millimetres
Row = dict[str, Any]
_KEYS = ("material", "sphere_id", "source")
_MEND = "write commas between columns and decimal points"


def calibrate_impact(results: Path, drops: Sequence[Drop]) -> list[str]:
    """Fit ε̇₀ and n of every sphere to its measured ``surface_impact`` drops in ``results``; returns the warnings.

    All heights of a sphere are fitted together. Rows of other spheres and of compression tests stay in
    ``materials.csv``, and so does a good row where the new fit is not ``ok``. Raises ``InputError`` where no such drop
    was measured, ``ConfigurationError`` where a sphere has no material to start from (G∞ must be known),
    ``TooFewMeasurementsError`` where no sphere could be fitted; the table is written before that.
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
    kept = [f"{row['sphere_id']}: {_kept(results)}" for row in _merge_rows(results, rows)]
    if all(row["status"] == "too_few" for row in rows):
        raise TooFewMeasurementsError(f"{results}: no sphere could be calibrated; {'; '.join(warnings[:1] + kept[:1])}")
    return warnings + kept


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
    after = times >= 0.0
    return Ringing(times[after], column(stretch, "stretch")[after], column(stretch, "stretch_unc")[after])


def _impact_row(drop: Drop, sphere_id: str, fit: Calibration) -> Row:
    """The row of a sphere; ε̇₀ and n are empty where the drops do not tell them apart."""
    material, known, nan = fit.material, drop.material, math.nan
    identified = fit.status == "ok"
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
        "eps0_dot_1_s": material.eps0_dot_1_s if identified else nan,
        "eps0_dot_1_s_unc": fit.eps0_dot_unc_1_s if identified else nan,
        "correlation": fit.correlation,
        "source": "impact",
        "status": fit.status,
    }


@dataclass(frozen=True)
class CompressionTest:
    """A force–displacement test: displacement in m and force in N, finite; ``warning`` tells of rows left out."""

    path: Path
    displacement_m: NDArray[np.float64]
    force_n: NDArray[np.float64]
    warning: str


def calibrate_compression(
    test: CompressionTest, diameter_m: float, results: Path, *, material: str = "sphere", sphere_id: str = ""
) -> None:
    """Fit G∞ to a force–displacement test; its row goes into ``materials.csv``, its curve into ``compression.csv``.

    Raises ``ConfigurationError`` for an impossible diameter, ``TooFewMeasurementsError`` where the test does not
    determine G∞; a row without values is written before that, unless an earlier test of the material was good.
    """
    if not 0.0 < diameter_m <= LARGEST_M:
        raise ConfigurationError(
            f"--diameter-m {diameter_m:g}: must be positive, finite and at most {LARGEST_M:g}; give it in metres"
        )
    fit = fit_compression(test.displacement_m, test.force_n, diameter_m)
    row = {
        "material": material,
        "sphere_id": sphere_id or None,
        "diameter_m": diameter_m,
        "g_inf_pa": fit.g_inf_pa,
        "g_inf_pa_unc": fit.g_inf_pa_unc,
        "source": "compression",
        "status": fit.status,
    }
    refused = _merge_rows(results, [row])
    if fit.status == "ok":
        _keep_curve(results, test, row, fit)
    if fit.status != "ok":
        reason = "too few points with a load" if fit.status == "too_few" else "the force does not follow the curve"
        raise TooFewMeasurementsError(
            f"{test.path}: G_inf is not determined, {reason}; check the units in the header, the signs and --diameter-m"
            + (f"; {_kept(results)}" if refused else "")
        )


def _keep_curve(results: Path, test: CompressionTest, row: Row, fit: CompressionFit) -> None:
    """Write the points of a test and the fitted curve into ``compression.csv``; those of the same sphere go."""
    import pandas as pd

    diameter = row["diameter_m"]
    curve = compression_force((test.displacement_m - fit.zero_offset_m) / diameter)
    names = {name: row[name] for name in ("material", "sphere_id", "diameter_m")}
    points = {"displacement_m": test.displacement_m, "force_n": test.force_n}
    columns = {name: [value] * len(curve) for name, value in names.items()} | points
    table = new_table("compression", {**columns, "force_model_n": fit.g_inf_pa * diameter**2 * curve})
    if has_table(results, "compression"):
        old = read_table(results, "compression")
        own = (old["material"] == row["material"]) & (old["sphere_id"].fillna("") == (row["sphere_id"] or ""))
        table = pd.concat([part for part in (old[~own], table) if len(part)], ignore_index=True)
    table = table.sort_values(["material", "sphere_id"], kind="stable", ignore_index=True)
    write_table(results, "compression", table)


def read_compression(path: Path) -> CompressionTest:
    """Read a compression test: a CSV table with ``force_N`` and either ``displacement_m`` or ``displacement_mm``.

    Rows with an empty cell, NaN or infinity are left out and told. Raises ``InputError`` where the file cannot be
    read, a column is missing or stands there twice, and with the line where a cell is no number or where semicolons,
    tabs or decimal commas take the place of commas and points.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            lines = list(csv_format.reader(stream))
    except (OSError, UnicodeDecodeError, csv_format.Error) as error:
        raise InputError(f"{path}: cannot be read as a CSV table ({error}); give a text file with a header") from error
    header = [name.strip() for name in lines[0]] if lines else []
    unit = _displacement_column(path, header)
    places = (header.index(unit), header.index(FORCE))
    pairs, left_out = [], []
    for number, line in enumerate(lines[1:], start=2):
        if not any(cell.strip() for cell in line):
            continue
        pair = _numbers(f"{path}:{number}", line, places, len(header))
        if np.isfinite(pair).all():
            pairs.append(pair)
        else:
            left_out.append(number)
    table = np.array(pairs, dtype=np.float64).reshape(-1, 2)
    some = ", ".join(str(number) for number in left_out[:5])
    more = f" and {len(left_out) - 5} more" if len(left_out) > 5 else ""
    warning = f"{path}: left out for want of two finite numbers: line {some}{more}" if left_out else ""
    return CompressionTest(path, table[:, 0] * DISPLACEMENTS[unit], table[:, 1], warning)


def _displacement_column(path: Path, header: list[str]) -> str:
    """The one displacement column of a header that also has one force column."""
    units = [name for name in header if name in DISPLACEMENTS]
    if len(units) == 1 and header.count(FORCE) == 1:
        return units[0]
    if len(units) > 1 or header.count(FORCE) > 1:
        twice = " and ".join(units) if len(units) > 1 else f"{FORCE} twice"
        raise InputError(f"{path}: the header has {twice}; keep one column of displacement and one of force")
    if separator := _separator(header):
        raise InputError(f"{path}:1: the columns are separated by {separator}; {_MEND}")
    raise InputError(
        f"{path}: the header needs {FORCE} and displacement_m or displacement_mm, and is "
        f"{', '.join(header) or 'empty'}; rename the columns, with their units"
    )


def _numbers(where: str, line: list[str], places: tuple[int, int], width: int) -> list[float]:
    """Displacement and force of a line as they stand; NaN for an empty cell."""
    cells = [line[place].strip() if place < len(line) else "" for place in places]
    if separator := _separator(cells):
        raise InputError(f"{where}: the columns are separated by {separator}; {_MEND}")
    if any(cell.strip() for cell in line[width:]):
        raise InputError(f"{where}: {len(line)} columns, and the header has {width}, as decimal commas give; {_MEND}")
    try:
        return [float(cell or "nan") for cell in cells]
    except ValueError:
        mend = f"decimal commas? {_MEND}" if any("," in cell for cell in cells) else "mend the line"
        raise InputError(f"{where}: {' and '.join(cells)} are not two numbers; {mend}") from None


def _separator(cells: list[str]) -> str:
    """The name of a separator other than the comma that stands in ``cells``; empty if there is none."""
    return next((name for sign, name in {";": "semicolons", "\t": "tabs"}.items() if sign in "".join(cells)), "")


def _kept(results: Path) -> str:
    return f"the good row of an earlier calibration stays in {table_path(results, 'materials')}"


def _merge_rows(results: Path, rows: list[Row]) -> list[Row]:
    """Write ``rows`` into ``materials.csv`` in place of those of the same material, sphere and source.

    Returns the failed rows that were not written, because a good row of an earlier calibration stands in their place.
    """
    import pandas as pd

    names = sorted({name for row in rows for name in row})
    table = new_table("materials", {name: [row.get(name) for row in rows] for name in names})
    refused: list[Row] = []
    if has_table(results, "materials"):
        old = read_table(results, "materials")
        good = _identities(old[old["status"] == "ok"])
        worse = ((table["status"] != "ok") & _identities(table).isin(good)).to_numpy(dtype=bool)
        refused = [row for row, out in zip(rows, worse, strict=True) if out]
        table = table[~worse]
        kept = old[~_identities(old).isin(_identities(table))]
        table = pd.concat([part for part in (kept, table) if len(part)], ignore_index=True)
    table = table.sort_values(list(_KEYS), kind="stable", ignore_index=True)
    write_table(results, "materials", table)
    return refused


def _identities(table: pd.DataFrame) -> pd.Series[Any]:
    columns = table[list(_KEYS)].fillna("")
    return columns[_KEYS[0]] + "\t" + columns[_KEYS[1]] + "\t" + columns[_KEYS[2]]
