"""A table that somebody measured by hand, or with another program, made ready for comparison."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

import numpy as np
import pandas as pd

from wentry_cli.errors import InputError
from wentry_cli.tables import has_table, read_table


def read_hand_table(path: Path, folder: Path, accepted: Collection[str]) -> pd.DataFrame:
    """The rows of the CSV ``path`` by ``frame`` of the drop whose results lie in ``folder``.

    It has a column ``frame`` (from 0 in the clip) or ``t_s`` (s after impact; the nearest frame is meant, within half
    the time between frames), and one or more of ``accepted``. Raises ``InputError`` where it has none of these, or
    where not one of its rows belongs to a frame of the drop.
    """
    table = read_numbers(path, {"frame", "t_s", *accepted})
    if not {"frame", "t_s"} & set(table.columns) or not set(accepted) & set(table.columns):
        raise InputError(
            f"{path}: its columns are {', '.join(map(str, table.columns))}; needed are frame (from 0) or t_s "
            f"(s after impact), and one or more of {', '.join(accepted)}"
        )
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


def _nearest(wanted: np.ndarray, frames: np.ndarray, times: np.ndarray) -> np.ndarray:
    """The frame at each of the ``wanted`` times, NaN where there is none within half the time between frames."""
    apart = float(np.median(np.diff(times))) if times.size > 1 else 0.0
    at = np.clip(np.searchsorted(times, wanted - 0.5 * apart), 0, times.size - 1)
    return np.where(np.abs(times[at] - wanted) <= 0.5 * apart * (1.0 + 1e-9), frames[at], np.nan)


def read_numbers(path: Path, names: Collection[str]) -> pd.DataFrame:
    """The CSV ``path``; raises ``InputError`` where it cannot be read, or one of ``names`` holds what is no number."""
    try:
        frame = pd.read_csv(path)
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: not a readable CSV table ({error})") from error
    for name in set(names) & set(frame.columns):
        if not pd.api.types.is_numeric_dtype(frame[name]):
            raise InputError(f"{path}: column {name} holds what is no number; leave such cells empty")
    return frame
