"""The cavity through a clip: the region to look at in every frame, its profile there, one frame in memory at a time."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from wentry_cli.cavity.profile import CLEAR_ROWS, CavityProfile, SphereOutline, empty_profile, measure_region, rows_of
from wentry_cli.cavity.region import read_region
from wentry_cli.compiled import compiled
from wentry_cli.errors import FrameUnreadableError
from wentry_cli.imaging.background import Background
from wentry_cli.tracking.source import Frames

Floats = NDArray[np.float64]

SHALLOWEST = 0.35  # in radii: the equator below the surface before there is a cavity to measure
NARROWEST_REACH, WIDEST_REACH = 2.0, 6.0
NARROWEST_PX = 8
GROWTH = 0.15  # radii by which the body grows between two frames; where it grows more, a frame is read again
FEWEST_SPARED = 64  # rows that are worth not to be read


def sphere_outlines(x_px: Floats, y_px: Floats, radius_px: float, stretch: Floats) -> list[SphereOutline | None]:
    """Return the sphere in every frame, from arrays of shape (n,) with NaN where it was not measured.

    Gaps are bridged linearly; after its last measured frame the sphere goes on at its last speed, so that the cavity
    above a sphere that has left the frame is still measured. None before the first frame in which it was seen.
    """
    seen = np.flatnonzero(np.isfinite(x_px) & np.isfinite(y_px))
    if seen.size < 2:
        return [None] * x_px.size
    frames = np.arange(x_px.size)
    across = np.interp(frames, seen, np.nan_to_num(stretch[seen], nan=1.0))
    x, y = np.interp(frames, seen, x_px[seen]), np.interp(frames, seen, y_px[seen])
    last = seen[-8:]
    beyond = frames > seen[-1]
    for line, values in ((x, x_px), (y, y_px)):
        slope = (values[last[-1]] - values[last[0]]) / (last[-1] - last[0])
        line[beyond] += slope * (frames[beyond] - seen[-1])
    across[beyond] = 1.0
    return [
        SphereOutline(float(x[k]), float(y[k]), float(across[k] * radius_px), float(radius_px / across[k] ** 2))
        if k >= seen[0]
        else None
        for k in frames
    ]


def measure_profiles(
    frames: Frames,
    ground: Background,
    spheres: Sequence[SphereOutline | None],
    *,
    surface_y_px: float,
    radius_px: float,
) -> Iterator[tuple[int, CavityProfile]]:
    """Measure the cavity in every frame with a sphere below the surface; yields frame and profile.

    Only the rows between surface and sphere are read, without those between both parts of a cavity that has closed, and
    the columns that the cavity of the frame before leaves room to grow into. A frame that cannot be read yields an
    empty profile with its status.
    """
    reach, empty = NARROWEST_REACH * radius_px, (0, 0)
    for index, sphere in enumerate(spheres):
        if sphere is None or sphere.y_px - surface_y_px < SHALLOWEST * radius_px:
            continue
        x0, x1 = max(0, int(sphere.x_px - reach)), min(frames.shape[1], int(sphere.x_px + reach) + 2)
        y0, y1 = rows_of(sphere, surface_y_px, (0, frames.shape[0]))
        profile = _profile_within(frames, index, ground, sphere, box=(x0, y0, x1, y1), empty=empty)
        yield index, profile
        reach = _next_reach(profile, sphere, reach, radius_px)
        empty = _next_empty(profile, radius_px)


def _profile_within(
    frames: Frames,
    index: int,
    ground: Background,
    sphere: SphereOutline,
    *,
    box: tuple[int, int, int, int],
    empty: tuple[int, int],
) -> CavityProfile:
    """The profile of frame ``index`` within ``box``; rows ``empty`` show nothing of it if it is as foretold."""
    x0, y0, x1, y1 = box
    if x1 - x0 < NARROWEST_PX or y1 <= y0:
        return empty_profile("out_of_frame")
    last = _rows_of_sphere(sphere, y1)
    unread = (empty[0], min(empty[1], last)) if y0 < empty[0] < min(empty[1], last) - FEWEST_SPARED else None
    try:
        region = read_region(frames, index, box, ground, unread)
        profile = measure_region(region, sphere, corner=(x0, y0), noise=ground.noise)
        if unread and (profile is None or profile.status != "ok"):  # it is not
            region = read_region(frames, index, box, ground)
            profile = measure_region(region, sphere, corner=(x0, y0), noise=ground.noise)
    except FrameUnreadableError as error:
        return empty_profile(error.status)
    assert profile is not None  # all was read
    return profile


def _rows_of_sphere(sphere: SphereOutline, end: int) -> int:
    """First of the rows before ``end`` that tell where the sphere is and how black."""
    return int(min(sphere.y_px, end - 1) - sphere.across_px)


def _next_empty(profile: CavityProfile, radius_px: float) -> tuple[int, int]:
    """Rows (first, behind the last) that will show nothing of it in the next frame, as far as can be foretold."""
    margin = CLEAR_ROWS + int(GROWTH * radius_px)
    return profile.empty_px[0] + margin, profile.empty_px[1] - margin


def _next_reach(profile: CavityProfile, sphere: SphereOutline, reach: float, radius_px: float) -> float:
    if profile.cut_off:
        return min(1.4 * reach, WIDEST_REACH * radius_px)
    if profile.status != "ok":
        return reach
    wanted = 1.12 * _widest(sphere.x_px, profile.left_px, profile.right_px) + 0.35 * radius_px
    return min(max(wanted, 0.97 * reach, NARROWEST_REACH * radius_px), WIDEST_REACH * radius_px)


@compiled
def _widest(axis: float, left: Floats, right: Floats) -> float:
    """How far the walls that are seen reach from the axis; 0 where none is."""
    widest = -math.inf
    for row in range(left.size):
        for away in (axis - left[row], right[row] - axis):
            if math.isfinite(away):
                widest = max(widest, away)
    return widest if widest > -math.inf else 0.0
