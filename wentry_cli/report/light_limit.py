"""Stated uncertainties beside the least that the light allows, the Cramér–Rao bound of the same frames."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np

from wentry_cli.contours.bounds import cramer_rao_bound
from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.report.campaign import Campaign, DropResults, as_number
from wentry_cli.report.numbers import DASH, true_minus
from wentry_cli.report.tabulation import TextTable

HEADER = (
    "drop", "view", "noise", "R (px)", "unc of λ", "bound", "ratio", "unc of y_b (px)", "bound", "ratio",
)  # fmt: skip
# Frames that are looked at, evenly over the clip.
FRAMES = 9
# Share of the variance of bright ground that is there in the dark too; a usual camera.
READ_SHARE = 0.4
LEAST_ARC = 0.15


def light_limit_table(campaign: Campaign) -> TextTable:
    """A row a drop and view: medians over nine frames called ok of uncertainty, bound and their ratio.

    The bound takes the noise of the ground from geometry.csv, an edge as sharp as good optics make it, and all of the
    contrast; a drop whose tables do not tell the noise has no row.
    """
    rows = [row for drop in campaign.drops for view in ("side", "top") for row in _rows(drop, view)]
    return TextTable(HEADER, tuple(rows))


def _rows(drop: DropResults, view: str) -> list[tuple[str, ...]]:
    geometry, table = drop.table("geometry"), drop.table(view)
    here = geometry[geometry["view"] == view]
    if here.empty or "ground_noise" not in here or table.empty:
        return []
    noise, radius = as_number(here["ground_noise"].iloc[0]), as_number(here["radius_px"].iloc[0])
    # before impact size and stretch are both free: other bounds
    good = table[(table["status"] == "ok") & ((table["t_s"] > 0.0) | (drop.kind == "free_flight"))]
    if good.empty or not (noise > 0.0 and radius > 0.0):
        return []
    chosen = good.iloc[np.unique(np.linspace(0, len(good) - 1, FRAMES).astype(int))]
    found = np.array([_compare(row, view, noise, radius) for row in chosen.to_dict("records")])
    cells = [word for column in (0, 2) for word in _medians(found[:, column], found[:, column + 1])]
    return [(drop.name, view, f"{noise:.2%}", f"{radius:.1f}", *cells)]


def _compare(row: dict[Any, Any], view: str, noise: float, radius: float) -> tuple[float, float, float, float]:
    """Uncertainty and bound of the stretch and of the lowest point (px) in one frame, NaN where there is none."""
    stretch, unc = as_number(row.get("stretch")), as_number(row.get("stretch_unc"))
    arc = as_number(row.get("arc_fraction", 1.0)) * (1.0 - as_number(row.get("gated_fraction")))
    nan = math.nan
    if not arc > LEAST_ARC:
        return nan, nan, nan, nan
    bound = partial(cramer_rao_bound, noise=noise, noise_dark=noise * math.sqrt(READ_SHARE), visible=min(arc, 1.0))
    if view == "top":
        size = radius * (stretch if math.isfinite(stretch) else 1.0)
        least = bound(EllipseShape(0.0, 0.0, size), free="x y R")
        return unc, least.radius_px / radius, nan, nan
    rigid = not math.isfinite(unc)
    free = "x y" if rigid else "x y stretch"
    if math.isfinite(unc) and row["t_s"] <= 0.0:
        free = "x y R stretch"
    least = bound(EllipseShape(0.0, 0.0, radius, 1.0 if rigid else stretch), free=free)
    return unc, least.stretch, as_number(row.get("bottom_y_px_unc")), least.bottom_y_px


def _medians(unc: np.ndarray[Any, Any], least: np.ndarray[Any, Any]) -> tuple[str, str, str]:
    seen = np.isfinite(unc) & np.isfinite(least)
    if not seen.any():
        return DASH, DASH, DASH
    unc, least = unc[seen], least[seen]
    numbers = f"{np.median(unc):.2g}", f"{np.median(least):.2g}", f"{np.median(unc / least):.2f}"
    stated, bound, ratio = map(true_minus, numbers)
    return stated, bound, ratio
