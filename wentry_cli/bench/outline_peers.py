"""What others do with the outline of a sphere, each recipe a named function that a reader can judge.

Every recipe gets what ours gets: the flat-fielded region, the radius in pixels, the row above which the outline is
not the sphere's, and that the sphere keeps its volume. Each returns (x, y, stretch, lowest row) in pixels of the
region, NaN where it has nothing to say.
"""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

Points = NDArray[np.float64]
Answer = tuple[float, float, float, float]
Recipe = Callable[[NDArray[np.float32], float, float], Answer]
NOTHING = (math.nan, math.nan, math.nan, math.nan)
TRIALS, INLIER_PX = 100, 0.7


def half_level(region: NDArray[np.float32]) -> float:
    """Halfway between the dark and the bright part of the region."""
    return 0.5 * float(np.percentile(region, 10) + np.percentile(region, 90))


def largest_contour(region: NDArray[np.float32], top_y: float) -> Points:
    """Points (n, 2) of the largest dark contour below ``top_y``: centres of the outermost dark pixels (OpenCV)."""
    dark = (region < half_level(region)).astype(np.uint8)
    contours, _ = cv2.findContours(dark, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    if not contours:
        return np.empty((0, 2))
    points = max(contours, key=len).reshape(-1, 2).astype(float)
    rows, columns = region.shape
    inside = (points[:, 0] > 0) & (points[:, 0] < columns - 1) & (points[:, 1] > 0) & (points[:, 1] < rows - 1)
    return np.asarray(points[inside & (points[:, 1] > top_y)])


def answer_of(center: tuple[float, float], axes: tuple[float, float], turn: float, radius: float) -> Answer:
    """From a general ellipse (semi-axes, turn in radians) to half-width over R and lowest row."""
    (x, y), (a, b) = center, axes
    half_width = math.hypot(a * math.cos(turn), b * math.sin(turn))
    return x, y, half_width / radius, y + math.hypot(a * math.sin(turn), b * math.cos(turn))


def ellipse_of(points: Points, radius: float, outward: float, direct: bool = False) -> Answer:
    """cv2.fitEllipse or fitEllipseDirect, its axes widened by ``outward`` px on each side."""
    if len(points) < 6:
        return NOTHING
    fit = cv2.fitEllipseDirect if direct else cv2.fitEllipse
    (x, y), (first, second), angle = fit(points.astype(np.float32))
    return answer_of((x, y), (0.5 * first + outward, 0.5 * second + outward), math.radians(angle), radius)


def fit_ellipse(region: NDArray[np.float32], radius: float, top_y: float) -> Answer:
    """The ordinary recipe: threshold at half level, largest contour, cv2.fitEllipse."""
    return ellipse_of(largest_contour(region, top_y), radius, 0.0)


def fit_ellipse_half_pixel(region: NDArray[np.float32], radius: float, top_y: float) -> Answer:
    """The same with the half pixel by which the centres of dark pixels lie inside of the edge."""
    return ellipse_of(largest_contour(region, top_y), radius, 0.5)


def fit_ellipse_direct(region: NDArray[np.float32], radius: float, top_y: float) -> Answer:
    """cv2.fitEllipseDirect, half a pixel added."""
    return ellipse_of(largest_contour(region, top_y), radius, 0.5, direct=True)


def min_enclosing_circle(region: NDArray[np.float32], radius: float, top_y: float) -> Answer:
    """cv2.minEnclosingCircle about the contour, half a pixel added: a circle, whatever the sphere is."""
    points = largest_contour(region, top_y)
    if len(points) < 3:
        return NOTHING
    (x, y), r = cv2.minEnclosingCircle(points.astype(np.float32))
    return x, y, (r + 0.5) / radius, y + r + 0.5


def hough_circles(region: NDArray[np.float32], radius: float, top_y: float) -> Answer:
    """cv2.HoughCircles (gradient, alternative method) on the blurred region, radius about the known one: a circle."""
    gray = cv2.GaussianBlur(np.clip(200.0 * region, 0.0, 255.0).astype(np.uint8), (0, 0), 2.0)
    low, high = int(0.7 * radius), int(1.6 * radius)
    found = cv2.HoughCircles(
        gray, cv2.HOUGH_GRADIENT_ALT, 1.5, 20.0, param1=100, param2=0.6, minRadius=low, maxRadius=high
    )
    if found is None:
        return NOTHING
    x, y, r = (float(value) for value in np.asarray(found).reshape(-1, np.shape(found)[-1])[0][:3])
    return x, y, r / radius, y + r


def lowest_dark_pixel(region: NDArray[np.float32], radius: float, top_y: float) -> Answer:
    """The lowest row that has a dark pixel, half a pixel added; the column is its mean."""
    rows, columns = np.nonzero(region[2:-2, 2:-2] < half_level(region))
    if rows.size == 0:
        return NOTHING
    low = int(rows.max())
    return float(columns[rows == low].mean()) + 2.0, math.nan, math.nan, low + 2.5


def level_line(region: NDArray[np.float32], top_y: float) -> Points:
    """Points (x, y) of scikit-image's longest sub-pixel contour at half level below ``top_y``."""
    from skimage.measure import find_contours

    lines = find_contours(region, half_level(region))  # type: ignore[no-untyped-call]
    if not lines:
        return np.empty((0, 2))
    points = max(lines, key=len)[:, ::-1]
    return np.asarray(points[points[:, 1] > top_y])


def canny_points(region: NDArray[np.float32], top_y: float) -> Points:
    """Pixels (x, y) that scikit-image's Canny detector calls an edge (sigma 2), below ``top_y``."""
    from skimage.feature import canny

    rows, columns = np.nonzero(canny(region, sigma=2.0))  # type: ignore[no-untyped-call]
    points = np.column_stack([columns, rows]).astype(float)
    return np.asarray(points[points[:, 1] > top_y])


def model_of(points: Points, radius: float) -> Answer:
    """scikit-image's EllipseModel (five free parameters) through all points."""
    from skimage.measure import EllipseModel

    if len(points) < 6:
        return NOTHING
    model = EllipseModel.from_estimate(points)  # type: ignore[no-untyped-call]
    return answer_of(tuple(model.center), tuple(model.axis_lengths), model.theta, radius) if model else NOTHING


def ransac_of(points: Points, radius: float) -> Answer:
    """scikit-image's ransac about EllipseModel: 100 trials of 8 points, inliers within 0.7 px, fixed seed."""
    from skimage.measure import EllipseModel, ransac

    if len(points) < 10:
        return NOTHING
    model, _ = ransac(points, EllipseModel, 8, INLIER_PX, max_trials=TRIALS, rng=1)  # type: ignore[no-untyped-call]
    return answer_of(tuple(model.center), tuple(model.axis_lengths), model.theta, radius) if model else NOTHING


def three_parameters(points: Points, radius: float) -> Answer:
    """SciPy's least squares on the ellipse of known volume (x, y, stretch)."""
    if len(points) < 6:
        return NOTHING

    def misfit(p: Points) -> Points:
        u, v = (points[:, 0] - p[0]) / (radius * p[2]), (points[:, 1] - p[1]) * p[2] ** 2 / radius
        return np.asarray(radius * (np.hypot(u, v) - 1.0))

    low, high = points.min(axis=0), points.max(axis=0)
    stretch = 0.5 * (high[0] - low[0]) / radius
    start = [0.5 * (low[0] + high[0]), high[1] - radius / stretch**2, stretch]
    x, y, stretch = least_squares(misfit, start, method="lm").x
    return float(x), float(y), float(stretch), float(y + radius / stretch**2)


def find_contours_ellipse(region: NDArray[np.float32], radius: float, top_y: float) -> Answer:
    """Sub-pixel level line and EllipseModel."""
    return model_of(level_line(region, top_y), radius)


def find_contours_ransac(region: NDArray[np.float32], radius: float, top_y: float) -> Answer:
    """Sub-pixel level line and RANSAC about EllipseModel."""
    return ransac_of(level_line(region, top_y), radius)


def find_contours_least_squares(region: NDArray[np.float32], radius: float, top_y: float) -> Answer:
    """Sub-pixel level line and the ellipse of known volume."""
    return three_parameters(level_line(region, top_y), radius)


def canny_ellipse(region: NDArray[np.float32], radius: float, top_y: float) -> Answer:
    """Canny edges and EllipseModel."""
    return model_of(canny_points(region, top_y), radius)


def canny_ransac(region: NDArray[np.float32], radius: float, top_y: float) -> Answer:
    """Canny edges and RANSAC about EllipseModel."""
    return ransac_of(canny_points(region, top_y), radius)


OPENCV: dict[str, Recipe] = {
    "fitEllipse": fit_ellipse,
    "fitEllipse + ½ px": fit_ellipse_half_pixel,
    "fitEllipseDirect": fit_ellipse_direct,
    "minEnclosingCircle": min_enclosing_circle,
    "HoughCircles": hough_circles,
    "lowest dark pixel": lowest_dark_pixel,
}
SCIKIT_IMAGE: dict[str, Recipe] = {
    "find_contours + EllipseModel": find_contours_ellipse,
    "find_contours + RANSAC": find_contours_ransac,
    "find_contours + 3 parameters": find_contours_least_squares,
    "canny + EllipseModel": canny_ellipse,
    "canny + RANSAC": canny_ransac,
}
SLOW = {"find_contours + RANSAC", "canny + RANSAC"}


def recipes() -> dict[str, Recipe]:
    """The peers that are installed, by name."""
    return OPENCV | (SCIKIT_IMAGE if importlib.util.find_spec("skimage") is not None else {})
