"""The crown is looked at in every few frames, and in every one of them while it may be closing."""

from types import SimpleNamespace

import numpy as np
import pytest

from wentry_cli.cavity.crown import Rim
from wentry_cli.cavity.dome_over import find_rim_closure
from wentry_cli.cavity.profile import SphereOutline
from wentry_cli.imaging.background import build_background
from wentry_cli.stages.cavity import crown
from wentry_cli.tracking.source import FrameArray

T = 0.0005 * np.arange(400)


def rim_width(closed_s: float) -> np.ndarray:
    """Open at first, falls ever faster to a tip of 20 px at ``closed_s``, and broadens as the dome sinks."""
    left = closed_s - T
    opening = 110.0 * np.clip(1.0 - np.maximum(1.0 - left / 0.012, 0.0) ** 4, 0.0, 1.0)
    return opening + 0.1 * left + 20.0 + np.clip(2000.0 * (-left - 0.004), 0.0, 60.0)


def looked_at(width: np.ndarray, frames: list[int]) -> dict[int, Rim]:
    return {k: Rim(float(width[k]), 50.0, "ok", 50) for k in frames}


@pytest.mark.parametrize("closed_s", [0.0213, 0.0508, 0.1001])
def test_the_closure_is_that_of_a_look_at_every_frame(closed_s: float) -> None:
    width, frames = rim_width(closed_s), list(range(T.size))
    rims = looked_at(width, frames[:: crown.COARSE])
    closing = crown._while_closing(rims, frames)
    rims |= looked_at(width, closing)
    assert len(rims) < 0.8 * len(frames)
    expected = find_rim_closure(T, width)
    found = find_rim_closure(T, crown._widths(rims, T.size))
    assert expected.status == found.status == "ok"
    assert found.t_s == pytest.approx(expected.t_s, abs=1e-9)


def test_a_crown_that_stays_open_or_is_not_seen_costs_no_second_look() -> None:
    frames = list(range(T.size))
    assert crown._while_closing(looked_at(np.full(T.size, 80.0), frames[:: crown.COARSE]), frames) == []
    assert crown._while_closing({}, frames) == []
    assert crown._while_closing({}, []) == []


class Counted(FrameArray):
    """Counts the rows that are read."""

    rows = 0

    def read(self, index, region=None):
        self.rows += region[3] - region[1]
        return super().read(index, region)


def test_no_more_rows_are_read_than_the_crown_fills_and_one_that_shoots_up_is_seen_whole() -> None:
    heights = [30, 34, 40, 120, 118, 20, 22, 21, 20]
    stack = np.full((len(heights), 200, 300), 180, np.uint8)
    for frame, height in zip(stack, heights, strict=True):
        frame[180 - height :, 110:191] = 60
    clip = Counted(stack)
    ground = build_background(np.full((3, 200, 300), 180, np.uint8), 255.0, empty=True)
    spheres = [SphereOutline(150.0, 230.0, 30.0, 30.0)] * len(heights)
    view = SimpleNamespace(spheres=spheres, radius_px=30.0, pixels=SimpleNamespace(surface_y_px=180.0))
    rims = crown._rims(clip, ground, view, range(len(heights)))
    assert [rims[k].top_y_px for k in range(len(heights))] == [180.0 - height for height in heights]
    assert all(rim.width_px == 81.0 for rim in rims.values())
    assert clip.rows < 0.65 * len(heights) * 174


def test_a_clip_ends_before_a_dome_over_only_where_the_crown_is_narrowest_at_its_end() -> None:
    width = rim_width(0.15)[:280]
    assert crown._narrows_to_the_end(width, width.size)
    assert not crown._narrows_to_the_end(width, width.size + 2 * crown.COARSE)  # it was not seen up to the end
    assert not crown._narrows_to_the_end(rim_width(0.05), T.size)  # it has broadened since
    assert not crown._narrows_to_the_end(np.full(5, np.nan), 5)
