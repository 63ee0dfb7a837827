"""Regressions as the table ``scaling.csv`` gives them: lines and bands to draw, words to print."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from wentry_cli.report.campaign import as_number, as_text
from wentry_cli.report.numbers import fixed
from wentry_cli.report.words import MEANINGS


def fit_rows(
    series: str, relation: Mapping[str, Any], x: np.ndarray, x_name: str, y_name: str, unit: float = 1.0
) -> pd.DataFrame:
    """Evaluate a fitted line with its 95 % interval at ``x``; no row where the relation has no number.

    ``unit`` turns the intercept into the unit of the panel (1e3 for seconds drawn as milliseconds).
    """
    slope, low, high = (as_number(relation.get(name)) for name in ("slope", "slope_low", "slope_high"))
    intercept = as_number(relation.get("intercept"))
    offset = unit * intercept if math.isfinite(intercept) else 0.0
    names = [x_name, y_name, f"{y_name}_low", f"{y_name}_high"]
    if not math.isfinite(slope):
        return pd.DataFrame({"series": [], **{name: [] for name in names}})
    columns = [x, offset + slope * x, offset + low * x, offset + high * x]
    return pd.DataFrame({"series": series, **dict(zip(names, columns, strict=True))})


def slope_text(relation: Mapping[str, Any]) -> str:
    """Say a slope with its interval, or why there is none."""
    slope, low, high = (as_number(relation.get(name)) for name in ("slope", "slope_low", "slope_high"))
    if not math.isfinite(slope):
        status = as_text(relation.get("status"))
        return f"no slope, {MEANINGS.get(status, 'relation not fitted')}"
    interval = (
        f", 95 % interval {fixed(low, 3)} to {fixed(high, 3)}" if math.isfinite(low) and math.isfinite(high) else ""
    )
    return f"slope {fixed(slope, 3)}{interval}, {as_number(relation.get('n')):.0f} drops"
