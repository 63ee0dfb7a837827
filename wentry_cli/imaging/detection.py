"""The first coarse look: where in a frame a sphere is, before anything is known about it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled

COARSE_SIZE = 360
HALF_LEVEL = 0.6
FAINT_LEVELS = (0.8, 0.9)  # for spheres of less contrast, where nothing is darker
ABOVE_NOISE = 5.0  # standard deviations of the noise of the coarse image
SMALLEST_SPAN = 140.0
WHOLE_SPAN = 330.0
FEWEST_POINTS = 12


@dataclass(frozen=True)
class Candidate:
    """A round object: centre and radius in full-frame pixels.

    ``span_deg`` is how much of its outline lies inside the image, ``departure`` the rms distance of that from the
    circle over the radius.
    """

    x: float
    y: float
    radius: float
    span_deg: float
    departure: float


def shrink_factor(shape: tuple[int, int]) -> int:
    """By how much ``shrink`` makes an image of so many rows and columns smaller."""
    return -(-max(shape) // COARSE_SIZE)


def shrink(image: NDArray[Any]) -> tuple[NDArray[np.float32], float]:
    """A coarse copy of an image, area averages, and the factor by which it is smaller."""
    factor = shrink_factor((image.shape[0], image.shape[1]))
    rows, columns = image.shape[0] // factor, image.shape[1] // factor
    if factor == 1 or min(rows, columns) < 1:
        return image.astype(np.float32), 1.0
    coarse = np.empty((rows, columns), np.float32)
    _add_blocks(np.ascontiguousarray(image), factor, coarse)
    return coarse, float(factor)


@compiled
def _add_blocks(image: NDArray[Any], factor: int, coarse: NDArray[np.float32]) -> None:
    share = np.float32(1.0 / (factor * factor))
    total = np.empty(image.shape[1], np.float32)
    for row in range(coarse.shape[0]):
        total[:] = 0.0
        for line in range(factor * row, factor * row + factor):
            source = image[line, :]
            for column in range(total.size):
                total[column] += np.float32(source[column])
        # of a factor that it knows the compiler makes vector instructions
        if factor == 2:
            _add_across(total, 2, share, coarse[row, :])
        elif factor == 3:
            _add_across(total, 3, share, coarse[row, :])
        else:
            _add_across(total, factor, share, coarse[row, :])


@compiled
def _add_across(total: NDArray[np.float32], factor: int, share: np.float32, target: NDArray[np.float32]) -> None:
    for column in range(target.size):
        block = np.float32(0.0)
        for near in range(factor):
            block += total[factor * column + near]
        target[column] = block * share


def find_spheres(
    coarse: NDArray[np.float32],
    factor: float = 1.0,
    *,
    radius_range: tuple[float, float] = (7.0, math.inf),
    departure: float = 0.035,
    level: float = HALF_LEVEL,
) -> list[Candidate]:
    """Find round dark objects in a transmission image (dark on 1.0), whole ones first, then the roundest.

    ``coarse`` and ``factor`` are those of ``shrink``, the results in pixels of the full image. Outer outlines only, so
    a bright spot inside does not matter. A sphere that the edge of the image cuts is found where 140° of its outline
    are seen; a bar, a band or a shadow at the edge is not round. Darker than
    ``level`` is dark. Accuracy is a pixel or two of the coarse image.
    """
    dark = (~(coarse >= level)).astype(np.uint8)
    contours, _ = cv2.findContours(dark, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    largest = min(radius_range[1], 0.6 * factor * max(coarse.shape))
    found = (_candidate(np.asarray(contour), coarse.shape, factor) for contour in contours)
    kept = [
        item
        for item in found
        if item is not None
        and radius_range[0] <= item.radius <= largest
        and item.span_deg >= SMALLEST_SPAN
        and item.departure <= departure + 0.5 * factor / item.radius
    ]
    return sorted(kept, key=lambda item: (item.span_deg < WHOLE_SPAN, item.departure))


def _candidate(contour: NDArray[np.int32], shape: tuple[int, ...], factor: float) -> Candidate | None:
    angles = np.empty(len(contour))
    x, y, radius, spread, count = _circle_through(contour[:, 0, :], (shape[0], shape[1]), angles)
    if count < FEWEST_POINTS or not 2.0 < radius < max(shape):
        return None
    angles = np.sort(angles[:count])
    gap = float(np.max(np.diff(np.append(angles, angles[0] + 2.0 * math.pi))))
    centre = ((x + 0.5) * factor - 0.5, (y + 0.5) * factor - 0.5)
    return Candidate(*centre, (radius + 0.5) * factor, 360.0 - math.degrees(gap), spread)


@compiled
def _circle_through(
    points: NDArray[np.int32], size: tuple[int, int], angles: NDArray[np.float64]
) -> tuple[float, float, float, float, int]:
    """Algebraic least-squares circle (Kåsa 1976) through the points (x, y) that are not at the edge of the image.

    Returns centre, radius, the rms distance of the points from the circle over the radius (NaN where no circle goes
    through them), and how many they are; ``angles`` is filled with where they lie on it.
    """
    inside = np.empty((points.shape[0], 2))
    count, middle_x, middle_y = 0, 0.0, 0.0
    for k in range(points.shape[0]):
        x, y = points[k]
        if 0 < x < size[1] - 1 and 0 < y < size[0] - 1:
            inside[count, 0], inside[count, 1] = x, y
            middle_x, middle_y, count = middle_x + x, middle_y + y, count + 1
    if count < FEWEST_POINTS:
        return math.nan, math.nan, math.nan, math.nan, count
    middle_x, middle_y = middle_x / count, middle_y / count
    uu, uv, vv, uw, vw = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(count):
        u, v = inside[k, 0] - middle_x, inside[k, 1] - middle_y
        w = u * u + v * v
        uu, uv, vv, uw, vw = uu + u * u, uv + u * v, vv + v * v, uw + u * w, vw + v * w
    area = uu * vv - uv * uv
    a, b = 0.5 * (uw * vv - vw * uv) / area, 0.5 * (vw * uu - uw * uv) / area
    radius = math.sqrt((uu + vv) / count + a * a + b * b)
    squares = 0.0
    for k in range(count):
        right, down = inside[k, 0] - middle_x - a, inside[k, 1] - middle_y - b
        squares += (math.sqrt(right * right + down * down) - radius) ** 2
        angles[k] = math.atan2(down, right)
    return middle_x + a, middle_y + b, radius, math.sqrt(squares / count) / radius, count


def faint_levels(noise: float, factor: float) -> list[float]:
    """The levels below ``HALF_LEVEL``'s contrast at which to look for a faint sphere, as far as the noise allows.

    ``noise`` is that of the transmission of plain ground, ``factor`` the one of ``shrink``.
    """
    return [level for level in FAINT_LEVELS if 1.0 - level > ABOVE_NOISE * noise / factor]


def find_bottom(
    transmission: NDArray[np.float32],
    x0: int,
    y0: int,
    x_px: float,
    half_width: float,
    *,
    level: float = HALF_LEVEL,
) -> float:
    """Row of the lowest dark-to-ground step near column ``x_px`` in a region that starts at ``x0``, ``y0``.

    The median over the columns within ``half_width``, where three rows of ground follow below; NaN where there is none.
    """
    first = max(0, round(x_px - half_width) - x0)
    last = min(transmission.shape[1], round(x_px + half_width) - x0 + 1)
    if last - first < 1:
        return math.nan
    dark = transmission[:, first : last : max(1, (last - first) // 9)] < level
    lowest = dark.shape[0] - 1 - np.argmax(dark[::-1], axis=0)
    good = dark.any(axis=0) & (lowest < dark.shape[0] - 3)
    if np.count_nonzero(good) < max(1, dark.shape[1] // 3):
        return math.nan
    return float(np.median(lowest[good])) + 0.5 + y0


def find_lowest_cap(
    transmission: NDArray[np.float32], radius: float, *, top_y: float = 0.0, level: float = HALF_LEVEL
) -> Candidate | None:
    """Find a sphere that hangs below something dark (a cavity) by its lowest cap; ``None`` where nothing is dark.

    ``transmission`` is a whole frame; rows above ``top_y`` are not looked at. The radius is taken as given.
    """
    dark = transmission < level
    dark[: max(0, round(top_y))] = False
    dark[-2:] = False
    opened = cv2.morphologyEx(dark.astype(np.uint8), cv2.MORPH_OPEN, np.ones((5, 5), np.uint8))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(opened)
    sized = [label for label in range(1, count) if stats[label][4] > 0.5 * radius**2]
    if not sized:
        return None
    label = max(sized, key=lambda item: int(stats[item][4]))
    mask = labels == label
    lowest = np.where(mask.any(axis=0), mask.shape[0] - 1 - np.argmax(mask[::-1], axis=0), -1)
    bottom = float(lowest.max())
    columns = np.flatnonzero(lowest >= bottom - 0.2 * radius)
    middle = float(np.mean(columns))
    return Candidate(middle, bottom + 0.5 - radius, radius, 180.0, 0.0)
