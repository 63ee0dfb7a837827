"""Calibration from a compression test: a force–displacement table to G∞ in ``materials.csv``, its curve beside it."""

from __future__ import annotations

import csv as csv_format
import io
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from wentry_cli.errors import ConfigurationError, InputError, TooFewMeasurementsError
from wentry_cli.mechanics.compression import (
    FEWEST_POINTS,
    CompressionFit,
    compression_force,
    fit_compression,
    loading_branch,
)
from wentry_cli.stages.calibrate.rows import Row, merge_rows, say_kept
from wentry_cli.tables import has_table, new_table, read_table, write_table

FORCE = "force_n"  # names as in compression.csv; a header may write them in any case
DISPLACEMENTS = {"displacement_m": 1.0, "displacement_mm": 1e-3}
LARGEST_M = 1.0  # a diameter above this was given in millimetres
LARGEST = 1e9  # number of metres, millimetres or newtons that a test can have
MODULI_PA = (10.0, 1e8)  # from the softest gel to the hardest rubber
MOST_OF_HEADER = 120  # characters that are repeated in a message
_MEND = "write commas between columns and decimal points"


@dataclass(frozen=True)
class CompressionTest:
    """A force–displacement test: displacement in m and force in N, finite; ``warnings`` tell of rows left out."""

    path: Path
    displacement_m: NDArray[np.float64]
    force_n: NDArray[np.float64]
    warnings: tuple[str, ...] = ()


def calibrate_compression(
    test: CompressionTest, diameter_m: float, results: Path, *, material: str = "sphere", sphere_id: str = ""
) -> CompressionFit:
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
        "g_inf_low_pa": fit.g_inf_low_pa,
        "g_inf_high_pa": fit.g_inf_high_pa,
        "source": "compression",
        "status": fit.status,
    }
    refused = merge_rows(results, [row])
    if fit.status != "ok":
        raise TooFewMeasurementsError(
            f"{test.path}: G_inf is not determined, {_why_not(test, fit, diameter_m)}; check the units in the header, "
            "the signs and --diameter-m" + (f"; {say_kept(results)}" if refused else "")
        )
    _keep_curve(results, test, row, fit)
    return fit


def doubt_of(fit: CompressionFit) -> str:
    """What is odd about a modulus, or nothing."""
    low, high = MODULI_PA
    if low <= fit.g_inf_pa <= high:
        return ""
    kind = "softer than any gel" if fit.g_inf_pa < low else "harder than any rubber"
    return f"G_inf = {fit.g_inf_pa:.3g} Pa is {kind}; check the units in the header"


def _why_not(test: CompressionTest, fit: CompressionFit, diameter_m: float) -> str:
    way = float(np.ptp(test.displacement_m)) if test.displacement_m.size else 0.0
    if way > diameter_m:
        return f"the plates move by {way:.3g} m, more than the diameter {diameter_m:g} m"
    if fit.status == "too_few":
        return f"it has {fit.points} of the {FEWEST_POINTS} points with a load that are needed"
    return "the force does not follow the curve"


def _keep_curve(results: Path, test: CompressionTest, row: Row, fit: CompressionFit) -> None:
    """Write the points of a test and the fitted curve into ``compression.csv``; those of the same sphere go."""
    import pandas as pd

    diameter = row["diameter_m"]
    curve = compression_force((test.displacement_m - fit.zero_offset_m) / diameter)
    names = {name: row[name] for name in ("material", "sphere_id", "diameter_m")}
    names |= {"zero_m": fit.zero_offset_m, "zero_m_unc": fit.zero_offset_m_unc}
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
    """Read a compression test: a CSV table with ``force_N`` and either ``displacement_m`` or ``displacement_mm``,
    in capitals or small letters.

    Rows with an empty cell, NaN or infinity are left out and told, and so are those after the plates have turned, where
    the force lags behind. Raises ``InputError`` where the file cannot be read, a column is missing or stands there
    twice, and with the line where a cell is no number, or none that a test can have, or where semicolons, tabs or
    decimal commas take the place of commas and points.
    """
    if not os.path.isfile(path):
        what = "is a folder" if os.path.isdir(path) else "no such file"
        raise InputError(f"{path}: {what}; give the CSV file of the compression test")
    lines = _lines(path)
    header = [name.strip() for name in lines[0]] if lines else []
    unit = _displacement_column(path, header)
    header = [name.lower() for name in header]
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
    warnings = [f"{path}: left out for want of two finite numbers: {_listed(left_out)}"] if left_out else []
    loading = loading_branch(table[:, 0])
    if loading < len(table):
        warnings.append(f"{path}: left out after the plates have turned: the last {len(table) - loading} points")
    displacement, force = table[:loading].T
    return CompressionTest(path, displacement * DISPLACEMENTS[unit], force, tuple(warnings))


def _lines(path: Path) -> list[list[str]]:
    """The cells of every line of a text file."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            text = stream.read()
        if "\0" in text:
            raise csv_format.Error("it holds zero bytes")
        return list(csv_format.reader(io.StringIO(text, newline="")))
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check the rights") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is no text in UTF-8; save the table of the test as CSV in UTF-8") from error
    except csv_format.Error as error:
        raise InputError(f"{path}: cannot be read as a CSV table ({error}); give a text file with a header") from error


def _listed(numbers: list[int]) -> str:
    some = ", ".join(str(number) for number in numbers[:5])
    more = f" and {len(numbers) - 5} more" if len(numbers) > 5 else ""
    return f"{'lines' if len(numbers) > 1 else 'line'} {some}{more}"


def _displacement_column(path: Path, header: list[str]) -> str:
    """The one displacement column, in small letters, of a header that also has one force column."""
    units = [name.lower() for name in header if name.lower() in DISPLACEMENTS]
    forces = [name for name in header if name.lower() == FORCE]
    if len(units) == 1 and len(forces) == 1:
        return units[0]
    if len(units) > 1 or len(forces) > 1:
        twice = " and ".join(units) if len(units) > 1 else f"{forces[0]} twice"
        raise InputError(f"{path}: the header has {twice}; keep one column of displacement and one of force")
    if separator := _separator(header):
        raise InputError(f"{path}:1: the columns are separated by {separator}; {_MEND}")
    told = ", ".join(header) or "empty"
    told = told if len(told) <= MOST_OF_HEADER else f"{told[:MOST_OF_HEADER]}…"
    raise InputError(
        f"{path}: the header needs force_N and displacement_m or displacement_mm, and is {told}; rename the columns, "
        "with their units"
    )


def _numbers(where: str, line: list[str], places: tuple[int, int], width: int) -> list[float]:
    """Displacement and force of a line as they stand; NaN for an empty cell."""
    cells = [line[place].strip() if place < len(line) else "" for place in places]
    if separator := _separator(cells):
        raise InputError(f"{where}: the columns are separated by {separator}; {_MEND}")
    if any(cell.strip() for cell in line[width:]):
        raise InputError(f"{where}: {len(line)} columns, and the header has {width}, as decimal commas give; {_MEND}")
    try:
        pair = [float(cell or "nan") for cell in cells]
    except ValueError:
        mend = f"decimal commas? {_MEND}" if any("," in cell for cell in cells) else "mend the line"
        raise InputError(f"{where}: {' and '.join(cells)} are not two numbers; {mend}") from None
    if any(LARGEST < abs(number) < np.inf for number in pair):
        raise InputError(f"{where}: {' and '.join(cells)} are beyond any test; check the columns and their units")
    return pair


def _separator(cells: list[str]) -> str:
    """The name of a separator other than the comma that stands in ``cells``; empty if there is none."""
    return next((name for sign, name in {";": "semicolons", "\t": "tabs"}.items() if sign in "".join(cells)), "")
