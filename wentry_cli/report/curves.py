"""Repeated drops: points and curves of one condition drawn once, as the mean with its spread."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
import pandas as pd

from wentry_cli.report.campaign import DropResults, doubts_of

Curve = tuple[np.ndarray, np.ndarray, np.ndarray]  # abscissa, value, standard uncertainty or spread


def conditions(drops: Iterable[DropResults]) -> list[list[DropResults]]:
    """Group repeated drops: those that share a condition, a sphere and its material.

    A drop without a condition stands alone, and one whose measurements contradict what was told of it.
    """
    groups: dict[tuple[str, ...], list[DropResults]] = {}
    for drop in drops:
        condition = drop.text("condition")
        sphere = (drop.text("kind"), drop.text("sphere_id"), f"{drop.number('g_inf_pa')} {drop.number('diameter_m')}")
        key = (condition, *sphere) if condition and not drop.text("doubts") else ("", drop.name)
        groups.setdefault(key, []).append(drop)
    return list(groups.values())


def mean_and_spread(values: np.ndarray, uncertainties: np.ndarray) -> tuple[float, float]:
    """Mean of repeated values and their spread (sample standard deviation), never less than the mean's uncertainty."""
    good = np.isfinite(values)
    values, uncertainties = values[good], uncertainties[good]
    if values.size == 0:
        return float("nan"), float("nan")
    if values.size == 1:
        return float(values[0]), float(uncertainties[0])
    own = float(np.sqrt(np.nansum(uncertainties**2))) / values.size
    return float(values.mean()), max(float(values.std(ddof=1)), own)


def grouped_points(
    drops: Iterable[DropResults], point: Callable[[DropResults], dict[str, float]]
) -> list[dict[str, object]]:
    """Average ``point`` (name → value, ``<name>_unc`` → uncertainty) over the repeats of each condition.

    Conditions without a finite value in every column are left out.
    """
    records: list[dict[str, object]] = []
    for group in conditions(drops):
        found = [(drop, point(drop)) for drop in group]
        found = [(drop, values) for drop, values in found if _complete(values)]
        if not found:
            continue
        record = _identity([drop for drop, _ in found])
        for name in (name for name in found[0][1] if not name.endswith("_unc")):
            values = np.array([values[name] for _, values in found], dtype=float)
            unc = np.array([values.get(f"{name}_unc", np.nan) for _, values in found], dtype=float)
            record[name], record[f"{name}_unc"] = mean_and_spread(values, unc)
        records.append(record)
    return records


def _complete(values: dict[str, float]) -> bool:
    return all(np.isfinite(value) for name, value in values.items() if not name.endswith("_unc"))


def _identity(drops: list[DropResults]) -> dict[str, object]:
    first = drops[0]
    return {
        "drop": " + ".join(drop.name for drop in drops),
        "repeats": len(drops),
        "rigid": first.rigid,
        "g_inf_pa": first.number("g_inf_pa"),
        "diameter_m": first.number("diameter_m"),
        "seal_type": first.seal,
        "doubts": doubts_of(drops),
    }


def mean_curve(curves: list[Curve], step: float = 0.01) -> Curve:
    """Average curves on a common abscissa; a single curve is returned as it is.

    The spread is the sample standard deviation where two or more curves are present.
    """
    if len(curves) == 1:
        return curves[0]
    start = max(float(x[0]) for x, _, _ in curves)
    stop = min(float(x[-1]) for x, _, _ in curves)
    grid = np.arange(np.ceil(start / step), np.floor(stop / step) + 1) * step
    table = np.array([np.interp(grid, x, y) for x, y, _ in curves])
    return grid, table.mean(axis=0), table.std(axis=0, ddof=1)


def measured(frame: pd.DataFrame, columns: list[str]) -> pd.DataFrame:
    """Rows in which all ``columns`` have a value, as floats, in the order of the first column."""
    numbers = frame.reindex(columns=columns).apply(pd.to_numeric, errors="coerce").astype(float)
    complete: pd.DataFrame = numbers.dropna(subset=columns).sort_values(columns[0], kind="stable")
    return complete.reset_index(drop=True)
