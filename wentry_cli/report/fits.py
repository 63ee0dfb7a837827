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
from wentry_cli.scaling.regression import MINIMUM_POINTS


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
    return _number_text(relation, "slope")


def exponent_text(relation: Mapping[str, Any]) -> str:
    """Say an exponent with its interval, or why there is none."""
    return _number_text(relation, "exponent")


def _number_text(relation: Mapping[str, Any], name: str) -> str:
    value, low, high = (as_number(relation.get(key)) for key in (name, f"{name}_low", f"{name}_high"))
    if not math.isfinite(value):
        return f"no {name}, {_why_counted(relation) or 'relation not fitted'}"
    if not (math.isfinite(low) and math.isfinite(high)):
        why = _why_counted(relation)
        return f"{name} {fixed(value, 3)}, 95 % interval not known ({why})" if why else f"{name} {fixed(value, 3)}"
    return f"{name} {fixed(value, 3)}, 95 % interval {fixed(low, 3)} to {fixed(high, 3)}, {_counted(relation)}"


def why_nothing(relation: Mapping[str, Any]) -> str:
    """Why a relation lacks its slope or its interval, in words; empty where it lacks nothing."""
    status, n = as_text(relation.get("status")), as_number(relation.get("n"))
    if status != "too_few" or not math.isfinite(n):
        return MEANINGS.get(status, "") if status != "ok" else ""
    if n < MINIMUM_POINTS:
        return f"too few: {MINIMUM_POINTS} drops needed"
    return "too few groups" if math.isfinite(as_number(relation.get("slope"))) else "drops hardly apart in x"


def _why_counted(relation: Mapping[str, Any]) -> str:
    """``why_nothing`` with the drops that there are."""
    why, n = why_nothing(relation), as_number(relation.get("n"))
    return f"{why}: {_counted(relation)}" if why and math.isfinite(n) else why


def _counted(relation: Mapping[str, Any]) -> str:
    """``5 drops in 3 conditions, 2 spheres``, as far as the table counts them."""
    n, conditions, spheres = (as_number(relation.get(name)) for name in ("n", "n_conditions", "n_spheres"))
    told = _count(n, "drop")
    told += f" in {_count(conditions, 'condition')}" if conditions > 0 else ""
    return told + (f", {_count(spheres, 'sphere')}" if spheres > 0 else "")


def _count(number: float, noun: str) -> str:
    return f"{number:.0f} {noun}{'' if number == 1 else 's'}"
