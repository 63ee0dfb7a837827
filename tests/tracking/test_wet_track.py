from __future__ import annotations

from tests.tracking.clips import SHAPE, clip, ground_of
from wentry_cli.contours.departure import Shape
from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.synthetic.still import StillBody
from wentry_cli.tracking.flight import air_plan
from wentry_cli.tracking.follow import follow
from wentry_cli.tracking.mirror import NO_MIRROR
from wentry_cli.tracking.prediction import Path
from wentry_cli.tracking.scale import NO_RADIUS
from wentry_cli.tracking.wet_plan import SideScene
from wentry_cli.tracking.wet_track import WetTracker

RADIUS, DRY, SPEED = 15.0, 10, 1.5


def depth(frame: int, gain: float) -> float:
    return 30.0 + SPEED * frame + 0.5 * gain * frame**2


def tracker(gain: float) -> WetTracker:
    frames = clip(lambda k: StillBody(80.0, depth(k, gain), RADIUS), DRY)
    ground = ground_of(clip(lambda k: StillBody(80.0, 30.0 + 14.0 * k, RADIUS), DRY))
    path = Path(RADIUS)
    for k in (0, 1):
        path.add(k, EllipseShape(80.0, depth(k, gain), RADIUS))
    dry = follow(frames, ground, path, range(DRY), air_plan(SHAPE))
    assert all(item.ok for item in dry)
    return WetTracker(frames, ground, SideScene(150.0), dry, shape=Shape(), mirror=NO_MIRROR)


def believed(found: WetTracker, frame: int, centre_px: float, stretch: float = 1.0) -> bool:
    last = found.dry[-1]
    assert last.fit is not None
    bottom = centre_px + RADIUS / stretch**2
    fit = last.fit._replace(center_y_px=centre_px, stretch=stretch, bottom_y_px=bottom)
    return found._believable(last._replace(frame=frame, fit=fit))


def test_gravity_goes_on_speeding_up_a_slow_fall() -> None:
    slow = tracker(0.1)
    assert believed(slow, 40, depth(40, 0.1))
    assert not believed(slow, 40, depth(40, 0.1) + 30.0)


def test_a_fall_that_gains_no_speed_is_bounded_by_its_speed() -> None:
    fast = tracker(0.0)
    assert fast.gain == 0.0
    assert believed(fast, 40, depth(40, 0.0))
    assert not believed(fast, 40, depth(40, 0.0) + 12.0)


def test_a_soft_sphere_that_gets_longer_is_not_taken_for_one_that_outruns_its_fall() -> None:
    assert believed(tracker(0.0), 40, depth(40, 0.0), stretch=0.7)


def test_a_sphere_of_unknown_size_is_left_as_it_was_seen() -> None:
    """Where neither air nor water told a radius there is none to hold: no frame is predicted with it."""
    found = tracker(0.0)
    seen = [item._replace(wet=True) for item in found.dry]
    found.plan.pilot = seen[:5]
    assert found.settle(seen, NO_RADIUS) == seen
    assert found.deformation(seen, NO_RADIUS) is None
