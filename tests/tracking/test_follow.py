from __future__ import annotations

import numpy as np

from tests.tracking.clips import SHAPE, clip, ground_of
from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.contours.fitting import assemble_fit
from wentry_cli.errors import FrameUnreadableError
from wentry_cli.imaging.background import Background
from wentry_cli.synthetic.still import StillBody
from wentry_cli.tracking.flight import air_plan
from wentry_cli.tracking.follow import Watch, _jumps, follow
from wentry_cli.tracking.prediction import Path
from wentry_cli.tracking.sighting import Sighting
from wentry_cli.tracking.source import FrameArray

RADIUS = 22.0


def body(frame: int) -> StillBody:
    return StillBody(80.0, 40.0 + 5 * frame, RADIUS)


def start() -> Path:
    path = Path(RADIUS)
    for frame in (0, 1):
        path.add(frame, EllipseShape(80.0, body(frame).center_y_px, RADIUS))
    return path


class Damaged(FrameArray):
    """Frames of which one cannot be read."""

    def read(self, index: int, region: tuple[int, int, int, int] | None = None) -> np.ndarray:
        if index == 6:
            raise FrameUnreadableError("frame 6 is cut off", "bad_frame")
        return super().read(index, region)


def scene() -> tuple[FrameArray, Background]:
    frames = clip(body, 20)
    return frames, ground_of(frames)


def test_a_bad_frame_is_passed_over() -> None:
    frames, ground = scene()
    damaged = Damaged(np.stack([frames.read(k) for k in range(20)]))
    seen = follow(damaged, ground, start(), range(20), air_plan(SHAPE))
    assert [item.status for item in seen] == ["ok"] * 6 + ["bad_frame"] + ["ok"] * 13


def test_what_is_refused_is_a_poor_fit_and_the_path_does_not_follow_it() -> None:
    frames, ground = scene()
    watch = Watch(accept=lambda item: item.frame != 4)
    seen = follow(frames, ground, start(), range(20), air_plan(SHAPE), watch)
    assert seen[4].status == "poor_fit"
    assert all(item.ok for item in seen if item.frame != 4)


def test_another_object_is_not_jumped_to() -> None:
    frames, ground = scene()
    values = np.stack([frames.read(k) for k in range(20)])
    values[8:] = values[0]
    seen = follow(FrameArray(values), ground, start(), range(20), air_plan(SHAPE), Watch(patience=5))
    assert not any(item.ok for item in seen if item.frame >= 8)
    assert len(seen) == 13


def test_a_lost_sphere_is_found_again_in_the_whole_frame() -> None:
    frames, ground = scene()
    values = np.stack([frames.read(k) for k in range(20)])
    values[4:9] = np.round(ground.level).astype(values.dtype)
    seen = follow(FrameArray(values), ground, start(), range(20), air_plan(SHAPE), Watch(search_from_px=0.0))
    assert not any(item.ok for item in seen[4:9])
    assert sum(item.ok for item in seen[9:]) >= 10


def test_a_sphere_that_was_held_back_out_of_sight_is_found_where_it_is() -> None:
    def slowed(frame: int) -> StillBody:
        return body(frame) if frame < 4 else StillBody(80.0, body(3).center_y_px + 0.5 * (frame - 3), RADIUS)

    frames = clip(slowed, 24)
    ground = ground_of(clip(body, 24))
    values = np.stack([frames.read(k) for k in range(24)])
    values[4:12] = np.round(ground.level).astype(values.dtype)
    seen = follow(FrameArray(values), ground, start(), range(24), air_plan(SHAPE), Watch(search_from_px=0.0))
    found = {item.frame: item.fit for item in seen if item.ok and item.frame >= 12}
    assert len(found) >= 10
    assert all(abs(fit.center_y_px - slowed(k).center_y_px) < 0.1 for k, fit in found.items() if fit)


def test_a_poor_last_sighting_does_not_lead_astray_sideways() -> None:
    """Seen once 7 px beside where it was, then hidden until that would have led out of the frame."""
    frames = clip(body, 24)
    ground = ground_of(frames)
    values = np.stack([frames.read(k) for k in range(24)])
    values[2:15] = np.round(ground.level).astype(values.dtype)
    path = start()
    path.add(2, EllipseShape(87.0, body(2).center_y_px, RADIUS))
    seen = follow(FrameArray(values), ground, path, range(3, 24), air_plan(SHAPE), Watch(search_from_px=0.0))
    assert sum(item.ok for item in seen if item.frame >= 15) >= 7


def test_a_path_that_leads_astray_does_not_say_that_the_sphere_left() -> None:
    """As above: nobody knows where the hidden sphere is, though the path goes on to the side and out of the frame."""
    frames = clip(body, 24)
    ground = ground_of(frames)
    values = np.stack([np.round(ground.level).astype(frames.read(0).dtype)] * 24)
    path = start()
    path.add(2, EllipseShape(95.0, body(2).center_y_px, RADIUS))
    seen = follow(FrameArray(values), ground, path, range(3, 24), air_plan(SHAPE), Watch(patience=40))
    assert len(seen) == 21
    assert "occluded" in {item.status for item in seen}
    assert "out_of_frame" not in {item.status for item in seen}


def test_a_sphere_that_was_followed_to_the_edge_left() -> None:
    frames, ground = clip(body, 40), ground_of(clip(body, 20))
    seen = follow(frames, ground, start(), range(2, 40), air_plan(SHAPE))
    assert seen[-1].status == "out_of_frame"
    assert len(seen) < 38


def _seen(stretch: float, gated: float) -> Sighting:
    shape = EllipseShape(50.0, 80.0, 30.0, stretch)
    nothing = np.zeros((5, 5))
    quality = {"blur": 1.0, "arc": 0.5, "gated": gated, "residual": 0.01}
    return Sighting(5, "ok", assemble_fit(shape, nothing, quality, "ok"))


def test_a_sphere_that_is_mostly_hidden_keeps_its_shape_from_frame_to_frame() -> None:
    path = Path(30.0)
    for frame in (3, 4):
        path.add(frame, EllipseShape(50.0, 80.0, 30.0, 1.0))
    expected = EllipseShape(50.0, 80.0, 30.0, 1.0)
    assert _jumps(_seen(1.12, gated=0.65), path, expected)  # bubbles on an ellipse of their own
    assert not _jumps(_seen(1.04, gated=0.65), path, expected)
    assert not _jumps(_seen(1.12, gated=0.2), path, expected)
