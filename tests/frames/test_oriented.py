"""Turning, mirroring and cropping: the same picture as NumPy makes of the whole frame, read through raw regions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from recording_bytes import cih, cine, grey, write_photron

from wentry_cli.errors import InputError
from wentry_cli.frames.formats import open_recording
from wentry_cli.frames.oriented import orient
from wentry_cli.frames.reader import Recording

LEVELS = grey(6, 4, frames=3).astype(np.uint8)


@pytest.fixture
def recording(tmp_path: Path) -> Recording:
    return open_recording(write_photron(tmp_path, cih(start=10), LEVELS.tobytes()))


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(rotate=st.sampled_from([0, 90, 180, 270]), flip=st.sampled_from(["none", "h", "v"]), data=st.data())
def test_a_region_is_the_part_of_the_turned_frame(
    recording: Recording, rotate: int, flip: str, data: st.DataObject
) -> None:
    expected = np.rot90(LEVELS[1], -rotate // 90)
    expected = {"none": expected, "h": np.fliplr(expected), "v": np.flipud(expected)}[flip]
    height, width = expected.shape
    x0, y0 = data.draw(st.integers(0, width - 2)), data.draw(st.integers(0, height - 2))
    x1, y1 = data.draw(st.integers(x0 + 2, width)), data.draw(st.integers(y0 + 2, height))
    seen = orient(recording, rotate=rotate, flip=flip, roi_px=(x0, y0, x1, y1))
    assert (seen.info.width, seen.info.height) == (x1 - x0, y1 - y0)
    assert seen.origin_px == (x0, y0)
    np.testing.assert_array_equal(seen.read(1), expected[y0:y1, x0:x1])
    np.testing.assert_array_equal(seen.read(1, (1, 0, x1 - x0, 1)), expected[y0 : y0 + 1, x0 + 1 : x1])


def test_ninety_degrees_is_clockwise(recording: Recording) -> None:
    turned = orient(recording, rotate=90).read(0)
    assert turned[0, -1] == LEVELS[0, 0, 0]
    assert turned[0, 0] == LEVELS[0, -1, 0]


def test_a_range_of_frames_keeps_the_numbers_of_the_camera(recording: Recording) -> None:
    part = orient(recording, frames=(1, 2))
    assert part.info.frame_count == 2
    assert part.camera_frames().tolist() == [11, 12]
    np.testing.assert_array_equal(part.read(0), LEVELS[1])
    with pytest.raises(IndexError):
        part.read(2)
    assert part.times_s() is None


def test_stamps_of_a_range_begin_at_zero(tmp_path: Path) -> None:
    path = tmp_path / "clip.cine"
    path.write_bytes(cine([bytes(8)] * 4, times=[1.0, 1.5, 2.5, 3.0]))
    np.testing.assert_allclose(orient(open_recording(path), frames=(1, 3)).times_s(), [0, 1.0, 1.5], atol=1e-8)


@pytest.mark.parametrize("frames", [(0, 3), (-1, 1), (2, 1)])
def test_a_range_outside_the_clip(recording: Recording, frames: tuple[int, int]) -> None:
    with pytest.raises(InputError, match="whose frames are 0 to 2"):
        orient(recording, frames=frames)


@pytest.mark.parametrize("roi", [(0, 0, 5, 6), (0, 0, 4, 7), (2, 2, 2, 4), (-1, 0, 2, 2)])
def test_a_region_outside_the_turned_image(recording: Recording, roi: tuple[int, int, int, int]) -> None:
    with pytest.raises(InputError, match="not within the image of 4 x 6 pixels"):
        orient(recording, rotate=90, roi_px=roi)


@pytest.mark.parametrize("wrong", [{"rotate": 45}, {"flip": "x"}])
def test_another_angle_or_mirror(recording: Recording, wrong: dict[str, object]) -> None:
    with pytest.raises(ValueError, match="is none of"):
        orient(recording, **wrong)  # type: ignore[arg-type]
