"""What others do with the outline of a sphere, each recipe a named function that a reader can judge.

Every recipe gets what ours gets: the flat-fielded region, the radius in pixels and the row above which the outline is
not the sphere's. Each returns (stretch, lowest row) in pixels of the region, NaN where it fails.
"""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

Recipe = Callable[[NDArray[np.float32], float, float], tuple[float, float]]
NOTHING = (math.nan, math.nan)
HALF_LEVEL = 0.54


def largest_contour(region: NDArray[np.float32], top_y: float) -> NDArray[np.float64]:
    """Points (n, 2) of the largest dark contour below ``top_y``: centres of the outermost dark pixels (OpenCV)."""
    dark = (region < HALF_LEVEL).astype(np.uint8)
    contours, _ = cv2.findContours(dark, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    if not contours:
        return np.empty((0, 2))
    points = max(contours, key=len).reshape(-1, 2).astype(float)
    rows, columns = region.shape
    inside = (points[:, 0] > 0) & (points[:, 0] < columns - 1) & (points[:, 1] < rows - 1)
    return np.asarray(points[inside & (points[:, 1] > top_y)])


def ellipse_of(points: NDArray[np.float64], radius: float, outward: float) -> tuple[float, float]:
    """cv2.fitEllipse, its axes widened by ``outward`` px on each side."""
    if len(points) < 5:
        return NOTHING
    (_, y), (first, second), angle = cv2.fitEllipse(points.astype(np.float32))
    a, b = 0.5 * first + outward, 0.5 * second + outward
    turn = math.radians(angle)
    half_width = math.hypot(a * math.cos(turn), b * math.sin(turn))
    return half_width / radius, y + math.hypot(a * math.sin(turn), b * math.cos(turn))


def threshold_and_fit_ellipse(region: NDArray[np.float32], radius: float, top_y: float) -> tuple[float, float]:
    """The ordinary recipe: threshold at half level, largest contour, cv2.fitEllipse."""
    return ellipse_of(largest_contour(region, top_y), radius, 0.0)


def threshold_and_fit_ellipse_half_pixel(
    region: NDArray[np.float32], radius: float, top_y: float
) -> tuple[float, float]:
    """The same with the half pixel by which the centres of dark pixels lie inside of the edge."""
    return ellipse_of(largest_contour(region, top_y), radius, 0.5)


def longest_level_line(region: NDArray[np.float32], top_y: float) -> NDArray[np.float64]:
    """Points (x, y) of scikit-image's longest sub-pixel contour at half level below ``top_y``."""
    from skimage.measure import find_contours

    lines = find_contours(region, HALF_LEVEL)  # type: ignore[no-untyped-call]
    if not lines:
        return np.empty((0, 2))
    points = max(lines, key=len)[:, ::-1]
    return np.asarray(points[points[:, 1] > top_y])


def level_line_and_ellipse_model(region: NDArray[np.float32], radius: float, top_y: float) -> tuple[float, float]:
    """scikit-image: find_contours at half level and EllipseModel (five free parameters)."""
    from skimage.measure import EllipseModel

    points = longest_level_line(region, top_y)
    if len(points) < 6:
        return NOTHING
    model = EllipseModel.from_estimate(points)  # type: ignore[no-untyped-call]
    if not model:
        return NOTHING
    (_, y), (a, b), turn = model.center, model.axis_lengths, model.theta
    half_width = math.hypot(a * math.cos(turn), b * math.sin(turn))
    return half_width / radius, y + math.hypot(a * math.sin(turn), b * math.cos(turn))


def level_line_and_least_squares(region: NDArray[np.float32], radius: float, top_y: float) -> tuple[float, float]:
    """scikit-image's find_contours and SciPy's least squares on the ellipse of known volume (x, y, stretch)."""
    points = longest_level_line(region, top_y)
    if len(points) < 6:
        return NOTHING

    def misfit(p: NDArray[np.float64]) -> NDArray[np.float64]:
        u, v = (points[:, 0] - p[0]) / (radius * p[2]), (points[:, 1] - p[1]) * p[2] ** 2 / radius
        return np.asarray(radius * (np.hypot(u, v) - 1.0))

    low, high = points.min(axis=0), points.max(axis=0)
    stretch = 0.5 * (high[0] - low[0]) / radius
    start = [0.5 * (low[0] + high[0]), high[1] - radius / stretch**2, stretch]
    _, y, stretch = least_squares(misfit, start, method="lm").x
    return float(stretch), float(y + radius / stretch**2)


def recipes() -> dict[str, Recipe]:
    """The peers that are installed, by name."""
    found: dict[str, Recipe] = {
        "threshold + cv2.fitEllipse": threshold_and_fit_ellipse,
        "threshold + cv2.fitEllipse + half pixel": threshold_and_fit_ellipse_half_pixel,
    }
    if importlib.util.find_spec("skimage") is not None:
        found["find_contours + EllipseModel"] = level_line_and_ellipse_model
        found["find_contours + 3-parameter least squares"] = level_line_and_least_squares
    return found
