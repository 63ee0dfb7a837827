"""Necks of the cavity: interior minima of its width, followed from frame to frame."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from operator import mul

import numpy as np
from numpy.typing import NDArray

from wentry_cli.cavity.minimum import find_vertex, interior_minima, prominence_of
from wentry_cli.compiled import compiled

Floats = NDArray[np.float64]

MIN_PROMINENCE_PX = 1.5  # in width; below it an undulation is noise
NO_LEDGES: Floats = np.empty(0)
MAX_GAP_FRAMES = 4
REACH_PX = 8.0  # how far a neck may lie from where its track foretells it
SECOND_CHOICE = 2.0  # more than any misfit of a neck that lies where its track foretells it


@dataclass(frozen=True)
class Neck:
    """One minimum of the width in one frame; pixels of the full frame, the radius is half the width.

    ``common_unc_px`` is what of its uncertainty is the same in all frames, as that of the row of a ledge.
    """

    y_px: float
    radius_px: float
    radius_unc_px: float
    prominence_px: float
    common_unc_px: float = 0.0


@dataclass(frozen=True)
class NeckTrack:
    """One neck through time: frame numbers, its row, radius and uncertainty, each of shape (n,).

    ``common_unc_px`` (n,) is the part of the uncertainty by which all radii may be off alike; empty without any.
    """

    frame: NDArray[np.int64]
    y_px: Floats
    radius_px: Floats
    radius_unc_px: Floats
    common_unc_px: Floats = field(default_factory=lambda: np.empty(0))

    def until(self, stop: int) -> NeckTrack:
        """The first ``stop`` samples."""
        return NeckTrack(
            self.frame[:stop],
            self.y_px[:stop],
            self.radius_px[:stop],
            self.radius_unc_px[:stop],
            self.common_unc_px[:stop],
        )


def find_necks(
    y_px: Floats,
    width_px: Floats,
    *,
    edge_unc_px: float,
    blur_px: float = 0.0,
    ledges_y_px: Floats = NO_LEDGES,
    min_prominence_px: float = MIN_PROMINENCE_PX,
) -> list[Neck]:
    """Find the interior minima of a width profile, from the top down.

    Parameters
    ----------
    y_px, width_px : (n,) arrays
        Rows in increasing order and the width there, NaN where an edge was not seen.
    edge_unc_px : float
        Standard uncertainty of one smoothed edge, of which the width has two.
    blur_px : float
        Standard deviation of the blur along the wall: it draws a curved wall outward, which is taken off.
    ledges_y_px : (m,) array
        Rows of the ledges of the wall (``ledge.find_ledges``).
    min_prominence_px : float
        How far the width must rise on both sides of a minimum before it falls below it again.
    """
    least = max(min_prominence_px, 6.0 * edge_unc_px)
    return [Neck(*row) for row in _minima(y_px, width_px, ledges_y_px, (edge_unc_px, blur_px), least).tolist()]


@compiled
def _minima(y_px: Floats, width_px: Floats, ledges_y_px: Floats, doubts: tuple[float, float], least: float) -> Floats:
    """The fields of the necks that are so prominent, (n, 5); ``doubts`` are those of an edge and of the blur."""
    edge_unc, blur = doubts
    seen = np.isfinite(width_px)
    y, width = y_px[seen], width_px[seen]
    minima = interior_minima(width)
    found, count = np.empty((minima.size, 5)), 0
    for index in minima:
        prominence = prominence_of(width, index)
        if prominence >= least:
            row, narrowest, misfit = find_vertex(y, width, index, ledges_y_px, (math.sqrt(2.0) * edge_unc, blur))
            if math.isnan(narrowest):
                continue
            found[count, 0], found[count, 1] = row, 0.5 * narrowest
            found[count, 2], found[count, 3] = math.hypot(edge_unc / math.sqrt(2.0), misfit), prominence
            found[count, 4] = misfit if np.any(ledges_y_px == row) else 0.0
            count += 1
    return found[:count]


@dataclass
class _OpenTrack:
    frame: list[int] = field(default_factory=list)
    necks: list[Neck] = field(default_factory=list)

    def foretell(self, frame: int) -> float:
        """Row in ``frame`` from a straight line through the last eight samples."""
        rows = [neck.y_px for neck in self.necks[-8:]]
        if len(rows) < 4:
            return rows[-1]
        offset, slope = _line([at - self.frame[-1] for at in self.frame[-8:]], rows)
        ahead = min(frame - self.frame[-1], MAX_GAP_FRAMES)
        return offset + min(max(slope, -4.0), 4.0) * ahead

    def misfit(self, frame: int, neck: Neck) -> float:
        """Distance of ``neck`` from this track in units of what may change, infinite beyond it.

        What lies between the last sample and where the track leads comes after what lies where it leads: dust or a
        caustic leads a track astray for a few frames, and a neck closes within one.
        """
        gap = frame - self.frame[-1]
        last, foretold = self.necks[-1], self.foretell(frame)
        reach_y = REACH_PX + 2.0 * (gap - 1)
        reach_r = 4.0 + 0.2 * last.radius_px + 2.0 * (gap - 1)
        off_y = abs(neck.y_px - foretold) / reach_y
        off_r = abs(neck.radius_px - last.radius_px) / reach_r
        if max(off_y, off_r) <= 1.0:
            return math.hypot(off_y, off_r)
        off_y = _beyond(neck.y_px, last.y_px, foretold) / reach_y
        off_r = _beyond(neck.radius_px, last.radius_px, self._narrowed(frame)) / reach_r
        return SECOND_CHOICE + math.hypot(off_y, off_r) if max(off_y, off_r) <= 1.0 else math.inf

    def _narrowed(self, frame: int) -> float:
        """Radius in ``frame`` of a neck that goes on narrowing: its square falls evenly, as that of a closing ring."""
        radius = self.necks[-1].radius_px
        if len(self.necks) < 2 or self.necks[-2].radius_px <= radius:
            return radius
        fall = (self.necks[-2].radius_px ** 2 - radius**2) / (self.frame[-1] - self.frame[-2])
        return math.sqrt(max(radius**2 - fall * (frame - self.frame[-1]), 0.0))


def _beyond(value: float, one: float, other: float) -> float:
    """How far a value lies outside of the interval between two others."""
    return abs(value - min(max(value, min(one, other)), max(one, other)))


def _line(at: Sequence[int], values: Sequence[float]) -> tuple[float, float]:
    """Value at 0 and slope of the least-squares line: for eight numbers faster than arrays."""
    count, first, total = len(at), sum(at), sum(values)
    slope = (count * sum(map(mul, at, values)) - first * total) / (count * sum(map(mul, at, at)) - first * first)
    return (total - slope * first) / count, slope


class NeckFollower:
    """Links the necks of successive frames into tracks; holds only the necks, never a frame."""

    def __init__(self) -> None:
        """Start without tracks."""
        self._tracks: list[_OpenTrack] = []

    def add(self, frame: int, necks: Sequence[Neck]) -> None:
        """Attach the necks of ``frame`` to the tracks that foretell them best; the others open tracks."""
        alive = [(i, track) for i, track in enumerate(self._tracks) if frame - track.frame[-1] <= MAX_GAP_FRAMES]
        pairs = [(track.misfit(frame, neck), i, j) for i, track in alive for j, neck in enumerate(necks)]
        taken_tracks: set[int] = set()
        taken_necks: set[int] = set()
        for misfit, i, j in sorted(pairs):
            if misfit == math.inf:
                break
            if i not in taken_tracks and j not in taken_necks:
                taken_tracks.add(i)
                taken_necks.add(j)
                self._append(self._tracks[i], frame, necks[j])
        for j, neck in enumerate(necks):
            if j not in taken_necks:
                self._tracks.append(_OpenTrack())
                self._append(self._tracks[-1], frame, neck)

    @staticmethod
    def _append(track: _OpenTrack, frame: int, neck: Neck) -> None:
        track.frame.append(frame)
        track.necks.append(neck)

    def tracks(self, *, min_samples: int = 6) -> list[NeckTrack]:
        """Return the tracks of at least ``min_samples`` frames, in the order of their first frame."""
        return [
            NeckTrack(
                frame=np.array(track.frame, dtype=np.int64),
                y_px=np.array([neck.y_px for neck in track.necks]),
                radius_px=np.array([neck.radius_px for neck in track.necks]),
                radius_unc_px=np.array([neck.radius_unc_px for neck in track.necks]),
                common_unc_px=np.array([neck.common_unc_px for neck in track.necks]),
            )
            for track in self._tracks
            if len(track.frame) >= min_samples
        ]
