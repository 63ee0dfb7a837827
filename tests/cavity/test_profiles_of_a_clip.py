"""The cavity through a clip of drawn frames."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from wentry_cli.cavity.follow import measure_profiles, sphere_outlines
from wentry_cli.errors import FrameUnreadableError
from wentry_cli.imaging.background import build_background
from wentry_cli.tracking.source import FrameArray

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
