"""A table that somebody measured by hand, or with another program, made ready for comparison."""

from __future__ import annotations

import csv
import io
from collections.abc import Collection
from pathlib import Path

import numpy as np
import pandas as pd

from wentry_cli.errors import InputError, on_one_line
from wentry_cli.tables import has_table, read_table

GREATEST = 1e100  # its square is still a number


def read_hand_table(path: Path, folder: Path, accepted: Collection[str]) -> pd.DataFrame:
    """The rows of the CSV ``path`` by ``frame`` of the drop whose results lie in ``folder``.

    It has a column ``frame`` (from 0 in the clip) or ``t_s`` (s after impact; the nearest frame is meant, within half
    the time between frames), and one or more of ``accepted``. Raises ``InputError`` where it has none of these, or
    where a frame stands in several rows or not one of its rows belongs to a frame of the drop.
    """
    table = read_numbers(path, {"frame", "t_s", *accepted})
    if not {"frame", "t_s"} & set(table.columns) or not set(accepted) & set(table.columns):
        raise InputError(
            f"{path}: its columns are {', '.join(map(str, table.columns))}; needed are frame (from 0) or t_s "
            f"(s after impact), and one or more of {', '.join(accepted)}"
        )
    _refuse_repeated(path, table, "frame" if "frame" in table else "t_s")
    name = next((name for name in ("side", "kinematics", "stretch") if has_table(folder, name)), None)
    if name is None:
        raise InputError(f"{folder}: holds no measured frames to compare with; run `wentry process` first")
    known = read_table(folder, name)
    frames, times = known["frame"].to_numpy(float), known["t_s"].to_numpy(float)
    if "frame" not in table:
        table["frame"] = _nearest(table["t_s"].to_numpy(float), frames, times)
    table = table[table["frame"].isin(frames)]
    if table.empty:
        raise InputError(
            f"{path}: not one of its rows belongs to a frame of {folder.name}, which are {frames[0]:.0f} to "
            f"{frames[-1]:.0f}, {times[0]:.4g} to {times[-1]:.4g} s after impact"
        )
    return table


def _refuse_repeated(path: Path, table: pd.DataFrame, column: str) -> None:
    counts = table[column].value_counts()
    if len(counts) and counts.iloc[0] > 1:
        told = f"{counts.iloc[0]} of its rows have {column} {counts.index[0]:.9g}"
        raise InputError(f"{path}: {told}; keep one, or write all columns of a frame into one row")


def _nearest(wanted: np.ndarray, frames: np.ndarray, times: np.ndarray) -> np.ndarray:
    """The frame at each of the ``wanted`` times, NaN where there is none within half the time between frames."""
    apart = float(np.median(np.diff(times))) if times.size > 1 else 0.0
    at = np.clip(np.searchsorted(times, wanted - 0.5 * apart), 0, times.size - 1)
    return np.where(np.abs(times[at] - wanted) <= 0.5 * apart * (1.0 + 1e-9), frames[at], np.nan)


def read_numbers(path: Path, names: Collection[str]) -> pd.DataFrame:
    """The CSV ``path``; raises ``InputError`` where it cannot be read, or has no rows, or one with more cells than
    columns, or where one of ``names`` holds what is no number, or a number that nothing measured has.
    """
    try:
        frame = pd.read_csv(io.StringIO(_as_wide_as_its_header(path)))
    except (OSError, ValueError, csv.Error) as error:
        raise InputError(f"{path}: not a readable CSV table ({on_one_line(error)})") from error
    if frame.empty:
        raise InputError(f"{path}: has no rows; below the names of its columns stands what was measured")
    for name in set(names) & set(frame.columns):
        if not pd.api.types.is_numeric_dtype(frame[name]):
            raise InputError(f"{path}: column {name} holds what is no number; leave such cells empty")
        greatest = frame[name].abs().max()
        if greatest > GREATEST:
            raise InputError(f"{path}: column {name} holds {greatest:g}, which nobody measured; leave such cells empty")
    return frame


def _as_wide_as_its_header(path: Path) -> str:
    """The text of the CSV ``path`` without empty cells beyond the header, as a comma at the end of a line makes them.

    Raises ``InputError`` where such a cell is not empty: which column it belongs to is not known.
    """
    kept = io.StringIO()
    writer = csv.writer(kept)
    with path.open(encoding="utf-8-sig", newline="") as stream:
        rows = csv.reader(stream, strict=True)
        width = 0
        for row in rows:
            width = width or len(row)
            if any(cell.strip() for cell in row[width:]):
                raise InputError(f"{path}: line {rows.line_num} has {len(row)} cells, the header {width}")
            writer.writerow(row[:width])
    return kept.getvalue()
