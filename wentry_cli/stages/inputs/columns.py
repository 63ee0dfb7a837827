"""What several stages need to read out of a drop's tables: columns as arrays, single numbers, first events."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wentry_cli.tables import has_table, read_table

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]
Row = dict[str, Any]


def column(frame: pd.DataFrame, name: str) -> Array:
    """Return a numeric column as floats, NaN where it is empty."""
    return frame[name].to_numpy(dtype=float, na_value=np.nan)


def number(row: Row, name: str, otherwise: float = math.nan) -> float:
    """Return a number of a row; ``otherwise`` where it is missing or empty."""
    value = np.asarray([row.get(name, math.nan)], dtype=object)
    known = [float(v) for v in value if isinstance(v, int | float | np.number) and math.isfinite(float(v))]
    return known[0] if known else otherwise


def text(row: Row, name: str) -> str:
    """Return a word of a row; an empty string where it is missing or empty."""
    value = row.get(name)
    return value if isinstance(value, str) else ""


def first_row(folder: Path, table: str, **wanted: str) -> Row:
    """Return the first row of a table whose columns equal ``wanted``; an empty row where there is none."""
    if not has_table(folder, table):
        return {}
    frame = read_table(folder, table)
    for name, value in wanted.items():
        frame = frame[frame[name] == value]
    return {str(k): v for k, v in frame.iloc[0].items()} if len(frame) else {}


def first_known(values: Array) -> float:
    """Return the first finite value, NaN where there is none."""
    known = values[np.isfinite(values)]
    return float(known[0]) if known.size else math.nan
