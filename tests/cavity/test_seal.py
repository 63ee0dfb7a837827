"""Kind of seal from tracked necks."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from wentry_cli.cavity.neck import NeckTrack
from wentry_cli.cavity.seal import Scene, find_seal

Floats = NDArray[np.float64]
FRAMES = 80
STEP = 5e-4


def scene(top: float = 400.0, cavity_top: Floats | float = 101.0) -> Scene:
    time = (np.arange(FRAMES) - 10) * STEP
    tops = np.full(FRAMES, cavity_top) if np.isscalar(cavity_top) else np.asarray(cavity_top)
    return Scene(time, np.full(FRAMES, top), tops, 100.0, 60.0, 1e-4)


def closing(closure: float, row: float, *, last: int | None = None, first: int = 20, seed: int = 0) -> NeckTrack:
    """A neck that closes at frame ``closure`` and is followed until then or to frame ``last``."""
    rng = np.random.default_rng(seed)
    frames = np.arange(first, int(closure) + 1 if last is None else last)
    radius = np.maximum(7.0 * np.sqrt(np.maximum(closure - frames, 0.0)) + rng.normal(0.0, 0.05, frames.size), 0.0)
    return NeckTrack(frames, np.full(frames.size, row) + 0.1 * (frames - closure), radius, np.full(frames.size, 0.05))


def test_a_neck_at_depth_is_a_deep_seal() -> None:
    seal = find_seal([closing(60.4, 250.0)], scene())
    assert (seal.value, seal.status) == ("deep_seal", "ok")
    assert seal.t_s == pytest.approx((60.4 - 10) * STEP, abs=0.12 * STEP)
    assert abs(seal.t_s - (60.4 - 10) * STEP) < 3.0 * seal.t_unc_s
    assert seal.y_px == pytest.approx(250.0, abs=0.5)


def test_the_first_closure_counts() -> None:
    seal = find_seal([closing(70.2, 200.0, seed=1), closing(60.4, 300.0)], scene())
    assert seal.y_px == pytest.approx(300.0, abs=0.5)


def test_a_neck_on_the_top_of_the_sphere_is_a_sphere_seal() -> None:
    assert find_seal([closing(60.4, 398.0)], scene()).value == "sphere_seal"
    assert find_seal([closing(60.4, 380.0)], scene()).value == "deep_seal"


def test_a_cavity_that_leaves_the_surface_first_is_a_surface_seal() -> None:
    tops = np.where(np.arange(FRAMES) < 45, 101.0, 100.0 + 3.0 * (np.arange(FRAMES) - 35.0))
    seal = find_seal([closing(60.4, 250.0)], scene(cavity_top=tops))
    assert (seal.value, seal.status) == ("surface_seal", "ok")
    assert seal.t_s == pytest.approx((45 - 10) * STEP, abs=4.0 * STEP)
    assert find_seal([], scene(cavity_top=tops)).value == "surface_seal"


def test_leaving_the_surface_after_the_closure_changes_nothing() -> None:
    tops = np.where(np.arange(FRAMES) < 66, 101.0, 100.0 + 4.0 * (np.arange(FRAMES) - 50.0))
    assert find_seal([closing(60.4, 250.0)], scene(cavity_top=tops)).value == "deep_seal"


def test_a_clip_that_ends_first_gives_no_time() -> None:
    seal = find_seal([closing(88.0, 250.0, last=FRAMES)], scene())
    assert (seal.value, seal.status) == ("", "clip_ended")
    assert np.isnan(seal.t_s)


def test_no_neck_says_so() -> None:
    vanished = np.where(np.arange(FRAMES) < 60, 101.0, np.nan)
    assert find_seal([], scene(cavity_top=vanished)).status == "no_neck"
    frames = np.arange(20, 50)
    steady = NeckTrack(frames, np.full(30, 250.0), np.full(30, 40.0), np.full(30, 0.05))
    assert find_seal([steady], scene(cavity_top=vanished)).status == "no_neck"


def test_a_cavity_that_is_open_to_the_end_has_not_closed_yet() -> None:
    assert find_seal([], scene()).status == "clip_ended"


def test_a_neck_that_is_lost_while_still_wide_has_not_closed() -> None:
    seal = find_seal([closing(60.4, 250.0, last=40)], scene())
    assert seal.status != "ok"
    assert np.isnan(seal.t_s)


def test_a_neck_that_opens_again_has_not_closed() -> None:
    track = closing(60.4, 250.0)
    frames = np.concatenate([track.frame, np.arange(63, 75)])
    more = np.full(12, 25.0)
    radius, rows = np.concatenate([track.radius_px, more]), np.full(frames.size, 250.0)
    seal = find_seal([NeckTrack(frames, rows, radius, np.full(frames.size, 0.05))], scene())
    assert seal.status != "ok"
