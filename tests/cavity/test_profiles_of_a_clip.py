"""The cavity through a clip of drawn frames."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from wentry_cli.cavity.follow import measure_profiles, sphere_outlines
from wentry_cli.errors import FrameUnreadableError
from wentry_cli.imaging.background import build_background
from wentry_cli.tracking.source import FrameArray, StoredRows

NAN = np.nan


class Torn(FrameArray):
    """Frame 2 cannot be read."""

    def read(self, index, region=None):
        if index == 2:
            raise FrameUnreadableError("torn", "bad_frame")
        return super().read(index, region)


def test_gaps_are_bridged_and_the_sphere_goes_on_after_its_last_frame() -> None:
    x = np.array([NAN, 100.0, 101.0, NAN, 103.0, NAN, NAN])
    y = np.array([NAN, 50.0, 60.0, NAN, 80.0, NAN, NAN])
    spheres = sphere_outlines(x, y, 30.0, np.full(7, NAN))
    assert spheres[0] is None
    assert [sphere.y_px for sphere in spheres[1:]] == [50.0, 60.0, 70.0, 80.0, 90.0, 100.0]
    assert spheres[3].x_px == 102.0
    assert spheres[3].across_px == spheres[3].along_px == 30.0


def test_stretched_spheres_keep_their_volume() -> None:
    stretch = np.array([1.2, 1.2, 0.9])
    spheres = sphere_outlines(np.zeros(3), np.arange(3.0), 30.0, stretch)
    for sphere, value in zip(spheres, stretch, strict=True):
        assert np.isclose(sphere.across_px, 30.0 * value)
        assert np.isclose(sphere.across_px**2 * sphere.along_px, 30.0**3)


def test_a_sphere_that_was_never_seen_has_no_outlines() -> None:
    assert sphere_outlines(np.full(3, NAN), np.full(3, NAN), 30.0, np.full(3, NAN)) == [None] * 3


def test_every_frame_below_the_surface_is_measured_and_a_torn_one_says_so(drawing) -> None:
    rows = [20.0, 160.0, 180.0, 200.0, 220.0]
    pictures = [
        drawing(lambda y: 40.0 + 0.1 * y, sphere=(row, 55.0, 40.0), noise=0.01, core_level=0.06) for row in rows
    ]
    stack = np.stack([(picture.patch().values.clip(0.0, 1.2) * 180.0).astype(np.uint8) for picture in pictures])
    ground = build_background(np.full((3, 300, 300), 180, np.uint8), 255.0, empty=True)
    x = np.full(5, pictures[0].axis)
    outlines = sphere_outlines(x, np.array(rows), 47.0, np.full(5, 1.1))
    outlines = [replace(item, across_px=55.0, along_px=40.0) for item in outlines if item is not None]
    found = dict(measure_profiles(Torn(stack), ground, outlines, surface_y_px=30.0, radius_px=47.0))
    assert sorted(found) == [1, 2, 3, 4]
    assert [found[k].status for k in (1, 2, 3, 4)] == ["ok", "bad_frame", "ok", "ok"]
    profile = found[4]
    use = (profile.y_px > 50) & (profile.y_px < 175)
    np.testing.assert_allclose(0.5 * profile.width_px[use], 40.0 + 0.1 * profile.y_px[use], atol=0.25)


class Stored(FrameArray):
    """Frames as they lie in the file: of the rows that were not read nothing is known, here all dark."""

    def __init__(self, values):
        super().__init__(values)
        self.unread = []

    def stored_rows(self, index: int, rows: tuple[int, int], unread: tuple[int, int]) -> StoredRows:
        levels = self.read(index)[rows[0] : rows[1]].copy()
        levels[unread[0] - rows[0] : unread[1] - rows[0]] = 0
        self.unread.append(unread[1] - unread[0])
        return levels, 0, False


def closed_cavity(drawing, end: float):
    """A cavity whose upper part ends in the row ``end`` and whose lower part sits on the sphere."""

    def half_width(y):
        return np.where(y < end, 30.0, np.where(y > 420.0, 30.0, 0.0))

    return drawing(half_width, sphere=(480.4, 50.0, 48.0), core=0.0, noise=0.01, shape=(560, 300))


def test_rows_between_the_parts_of_a_closed_cavity_are_not_read_and_not_missed(drawing) -> None:
    ends = [100.0, 97.0, 104.0, 240.0, 98.0, 98.0]  # a jet in the fourth frame
    pictures = [closed_cavity(drawing, end) for end in ends]
    stack = np.stack(
        [(picture.patch(k).values.clip(0.0, 1.2) * 3000.0).astype(np.uint16) for k, picture in enumerate(pictures)]
    )
    ground = build_background(np.full((3, 560, 300), 3000, np.uint16), 4095.0, empty=True)
    outlines = [pictures[0].outline()] * len(ends)
    stored = Stored(stack)
    found = dict(measure_profiles(stored, ground, outlines, surface_y_px=30.0, radius_px=47.0))
    assert [unread > 80 for unread in stored.unread] == [False, True, True, True, False, True, True]
    whole = dict(measure_profiles(FrameArray(stack), ground, outlines, surface_y_px=30.0, radius_px=47.0))
    for frame, end in enumerate(ends):
        assert found[frame].status == whole[frame].status == "ok"
        open_rows = found[frame].width_px > 0
        np.testing.assert_array_equal(open_rows, whole[frame].width_px > 0)
        assert found[frame].y_px[open_rows][found[frame].y_px[open_rows] < 400][-1] == pytest.approx(end, abs=2.0)
        np.testing.assert_allclose(found[frame].width_px[open_rows], whole[frame].width_px[open_rows], atol=0.02)
