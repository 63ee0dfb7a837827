from __future__ import annotations

import numpy as np
import pytest

from tests.tracking.clips import SHAPE, clip, ground_of
from wentry_cli.contours.departure import Shape
from wentry_cli.imaging.background import Background
from wentry_cli.synthetic.still import StillBody
from wentry_cli.tracking.flight import air_plan, both_ways
from wentry_cli.tracking.prediction import Path
from wentry_cli.tracking.scale import PooledRadius
from wentry_cli.tracking.seed import find_seed
from wentry_cli.tracking.shape_check import (
    NO_CHECK,
    ShapeCheck,
    _significant,
    check_shape,
    corrected_radius,
    doubted_radius,
    learn_departure,
)
from wentry_cli.tracking.sighting import Sighting
from wentry_cli.tracking.source import FrameArray
from wentry_cli.tracking.wet_radius import constrain, pool_sightings

RADIUS, LINE = 36.0, 0.1


def check(misfit: tuple[float, float]) -> ShapeCheck:
    frames = clip(lambda k: StillBody(80.2, 50.0 + 6 * k, RADIUS, misfit=misfit), 16)
    ground = ground_of(frames)
    dry = air(frames, ground)
    wet = [Sighting(item.frame, "ok", item.fit, free_fit=item.fit, wet=True, line=LINE) for item in dry]
    return check_shape(frames, ground, dry, wet, "accurate")


def air(frames: FrameArray, ground: Background) -> list[Sighting]:
    seed = find_seed(frames, ground, range(0, 16, 2))
    assert isinstance(seed, Path)
    seen, _ = both_ways(frames, ground, seed, air_plan(SHAPE), 15)
    return constrain(seen, pool_sightings(seen, wet=False), wet=False)


def test_an_ellipse_passes_unchanged() -> None:
    found = check((0.0, 0.0))
    assert found.radius_ratio == pytest.approx(1.0, abs=1e-3)
    assert abs(found.stretch_offset) < 5e-4
    assert abs(found.bottom_offset_px) < 0.02


def test_half_an_outline_of_another_shape_is_told_apart() -> None:
    found = check((0.003, 0.004))
    assert abs(found.radius_ratio - 1.0) > 3e-3
    assert found.radius_ratio_unc == pytest.approx(0.35 * abs(found.radius_ratio - 1.0), rel=0.5)
    assert abs(found.bottom_offset_px) > 0.03
    assert found.stretch_doubt(0.6) > found.stretch_doubt(LINE) > 1e-3


def test_what_is_learnt_in_air_leaves_nothing_to_correct() -> None:
    frames = clip(lambda k: StillBody(80.2, 50.0 + 6 * k, RADIUS, misfit=(0.003, 0.004)), 16)
    ground = ground_of(frames)
    dry = air(frames, ground)
    shape = learn_departure(frames, ground, dry)
    assert shape.waves[:4] == pytest.approx((0.003, 0.0, 0.004, 0.0), abs=3e-4)
    wet = [Sighting(item.frame, "ok", item.fit, free_fit=item.fit, wet=True, line=LINE) for item in dry]
    plain = check_shape(frames, ground, dry, wet, "accurate")
    known = check_shape(frames, ground, dry, wet, "accurate", shape=shape)
    assert abs(known.radius_ratio - 1.0) < 0.2 * abs(plain.radius_ratio - 1.0)
    assert 0.0 < known.bottom_offset_px <= abs(plain.bottom_offset_px)
    assert known.stretch_offset > 0.003  # half-width or ellipse: .004 apart


def test_the_correction_divides_by_what_air_says_and_adds_its_doubt() -> None:
    water = PooledRadius(38.0, 0.01, 20, 0.05)
    corrected = corrected_radius(water, ShapeCheck(1.02, 0.007))
    assert corrected.value == pytest.approx(38.0 / 1.02)
    assert corrected.unc == pytest.approx(0.007 * 38.0 / 1.02, rel=0.01)
    assert corrected_radius(water, NO_CHECK) == water


def test_nothing_to_compare_with_is_no_check() -> None:
    frames = clip(lambda k: StillBody(80.2, 100.0, RADIUS), 3)
    assert check_shape(frames, ground_of(frames), [], [], "accurate") == NO_CHECK


def test_a_few_frames_that_agree_by_chance_say_nothing() -> None:
    rows = [(ratio, 0.0, 0.0, 0.01, 1e-3, 0.03) for ratio in (0.0142, -0.0095, 0.0140)]
    assert _significant(rows)[0].tolist() == [0.0, 0.0, 0.0]
    assert _significant([(0.014, 0.0, 0.0, 0.002, 1e-3, 0.03)] * 4)[0][0] == 0.014


def test_a_radius_that_goes_with_a_stretch_in_air_is_doubted() -> None:
    frames = clip(lambda k: StillBody(80.2, 50.0 + 6 * k, RADIUS), 16)
    dry = air(frames, ground_of(frames))
    pooled = pool_sightings(dry, wet=False)
    assert doubted_radius(pooled, dry) == pooled

    def part(item: Sighting) -> Sighting:
        """A fit of a part of the outline, whose radius goes with its stretch, and which is off by .001."""
        assert item.free_fit is not None
        covariance = np.diag([1e-4, 1e-4, 1e-4, 1e-8, 0.0])
        covariance[2, 3] = covariance[3, 2] = 8e-7
        return item._replace(free_fit=item.free_fit._replace(stretch=1.001 + 1e-5 * item.frame, covariance=covariance))

    partial = [part(item) for item in dry if item.ok]
    assert doubted_radius(pooled, partial).unc == pytest.approx(0.08, rel=0.15)
    assert doubted_radius(pooled, partial).value == pooled.value


def test_with_too_few_whole_outlines_the_waves_themselves_are_doubted() -> None:
    frames = clip(lambda k: StillBody(80.2, 50.0 + 6 * k, RADIUS), 16)
    ground = ground_of(frames)
    dry = air(frames, ground)
    wet = [Sighting(item.frame, "ok", item.fit, free_fit=item.fit, wet=True, line=LINE) for item in dry]
    shape = Shape((0.0, 0.0, 0.002, 0.0, 0.0, 0.0, 0.0, 0.0), 5e-4)
    found = check_shape(frames, ground, dry[:2], wet, "accurate", shape=shape)
    assert found.stretch_doubt(LINE) == pytest.approx(np.hypot(5e-4, 7e-4))
    assert found.radius_ratio == 1.0
    assert found.radius_ratio_unc == pytest.approx(4.0 * np.hypot(5e-4, 7e-4))


def test_a_shape_that_no_frame_shows_whole_is_doubted() -> None:
    frames = clip(lambda k: StillBody(80.2, 50.0 + 6 * k, RADIUS), 16)
    ground = ground_of(frames)
    dry = [item._replace(fit=item.fit._replace(arc_fraction=0.8)) for item in air(frames, ground) if item.fit]
    wet = [Sighting(item.frame, "ok", item.fit, free_fit=item.fit, wet=True, line=LINE) for item in dry]
    found = check_shape(frames, ground, dry, wet, "accurate")
    assert found.radius_ratio == 1.0
    assert 0.004 < found.radius_ratio_unc < 0.02
    assert 0.001 < found.stretch_doubt(LINE) < 0.005
    assert 0.03 < found.bottom_offset_px < 0.2
