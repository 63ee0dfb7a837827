"""Kind of seal from tracked necks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from wentry_cli.cavity.neck import NeckTrack
from wentry_cli.cavity.seal import Scene, find_seal

Floats = NDArray[np.float64]
FRAMES = 80
STEP = 5e-4


def scene(top: float = 400.0, apex: Floats | float = -40.0, dome_over_s: float = np.nan) -> Scene:
    """A cavity whose apex is at the depth ``apex`` below a surface in row 100, whose band hides three rows."""
    time = (np.arange(FRAMES) - 10) * STEP
    apexes = np.broadcast_to(np.asarray(apex, dtype=float), FRAMES)
    tops = 100.0 + np.where(apexes < 2.5, 1.6, np.ceil(apexes))
    tops = np.where(np.isfinite(apexes), tops, np.nan)
    return Scene(time, np.full(FRAMES, top), tops, apexes, 100.0, 60.0, 1e-4, 0.02, dome_over_s)


def leaving(frame: float, speed: float = 0.5) -> Floats:
    """Depth of an apex that leaves the surface at ``frame``, px a frame."""
    return speed * (np.arange(FRAMES) - frame)


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
    for necks in ([closing(60.4, 250.0)], []):
        seal = find_seal(necks, scene(apex=leaving(35.3)))
        assert (seal.value, seal.status) == ("surface_seal", "ok")
        assert seal.t_s == pytest.approx((35.3 - 10) * STEP, abs=0.5 * STEP)
        assert abs(seal.t_s - (35.3 - 10) * STEP) < 2.0 * seal.t_unc_s
        assert seal.y_px == 100.0


def test_leaving_the_surface_after_the_closure_changes_nothing() -> None:
    assert find_seal([closing(60.4, 250.0)], scene(apex=leaving(66.0))).value == "deep_seal"


def test_two_closures_at_once_have_no_order() -> None:
    seal = find_seal([closing(60.4, 250.0)], scene(apex=leaving(60.0)))
    assert (seal.value, seal.status) == ("", "not_identified")
    assert np.isnan([seal.t_s, seal.t_unc_s, seal.y_px]).all()


def test_a_surface_seal_needs_a_splash_that_has_domed_over() -> None:
    early, late = ((frame - 10) * STEP for frame in (25.0, 50.0))
    assert find_seal([], scene(apex=leaving(35.0), dome_over_s=early)).value == "surface_seal"
    assert find_seal([], scene(apex=leaving(35.0), dome_over_s=late)).status == "not_identified"


def test_a_clip_that_ends_first_gives_no_time() -> None:
    seal = find_seal([closing(88.0, 250.0, last=FRAMES)], scene())
    assert (seal.value, seal.status) == ("", "clip_ended")
    assert np.isnan(seal.t_s)


def test_no_neck_says_so() -> None:
    vanished = np.where(np.arange(FRAMES) < 60, -40.0, np.nan)
    assert find_seal([], scene(apex=vanished)).status == "no_neck"
    frames = np.arange(20, 50)
    steady = NeckTrack(frames, np.full(30, 250.0), np.full(30, 40.0), np.full(30, 0.05))
    assert find_seal([steady], scene(apex=vanished)).status == "no_neck"


def test_what_was_never_seen_is_not_called_a_cavity_without_a_neck() -> None:
    assert find_seal([], scene(apex=np.full(FRAMES, np.nan))).status == "no_edge"


def test_a_cavity_that_is_open_to_the_end_has_not_closed_yet() -> None:
    assert find_seal([], scene()).status == "clip_ended"


def test_a_recording_that_was_cut_off_ends_with_its_last_readable_frame() -> None:
    """Behind the cut there are rows of frames that cannot be read, which show no cavity, closed or open."""
    cut = scene(apex=np.where(np.arange(FRAMES) < 50, -40.0, np.nan))
    assert find_seal([], replace(cut, unreadable=frozenset(range(50, FRAMES)))).status == "clip_ended"
    assert find_seal([], cut).status == "no_neck"


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


def test_what_is_seen_long_after_the_closure_is_not_the_neck() -> None:
    track = closing(60.4, 250.0, last=64)
    frames = np.concatenate([track.frame, np.arange(72, 78)])
    radius, rows = np.concatenate([track.radius_px, np.full(6, 9.0)]), np.full(frames.size, 250.0)
    seal = find_seal([NeckTrack(frames, rows, radius, np.full(frames.size, 0.05))], scene())
    assert (seal.value, seal.status) == ("deep_seal", "ok")


def test_a_neck_that_leaps_to_another_place_at_its_end_is_followed_up_to_there() -> None:
    neck = closing(60.4, 250.0)
    rows, radius = neck.y_px.copy(), neck.radius_px.copy()
    rows[-3:] -= 2.2
    radius[-3:] *= 0.6
    leaping = replace(neck, y_px=rows, radius_px=radius)
    seal = find_seal([leaping], scene())
    assert (seal.value, seal.status) == ("deep_seal", "ok")
    assert abs(seal.t_s - (60.4 - 10) * STEP) < 3.0 * seal.t_unc_s
    assert seal.t_unc_s < 0.4 * STEP


def test_the_noise_of_closed_frames_is_not_that_of_the_neck() -> None:
    track = closing(60.4, 250.0, last=78)
    kinked = track.radius_px + np.where(track.radius_px > 0.0, 0.5 * np.sin(track.frame), 0.0)
    unc = np.where(track.radius_px > 0.0, 0.7, 0.0)
    seal = find_seal([NeckTrack(track.frame, track.y_px, np.maximum(kinked, 0.0), unc)], scene())
    assert seal.status == "ok"
    assert abs(seal.t_s - (60.4 - 10) * STEP) < 3.0 * seal.t_unc_s


def test_a_neck_that_stays_closed_in_view_is_a_pinch_off_whatever_its_law_says() -> None:
    """Where the radii follow no law the closure lies between the last open and the first closed frame."""
    neck = closing(60.4, 250.0, last=75)
    wild = np.maximum(neck.radius_px + 6.0 * np.sin(1.7 * neck.frame), 2.0)
    wild = np.where(neck.frame < 60.4, wild, 0.0)
    seal = find_seal([replace(neck, radius_px=wild)], scene())
    assert (seal.value, seal.status) == ("deep_seal", "ok")
    assert abs(seal.t_s - (60.4 - 10) * STEP) < 3.0 * seal.t_unc_s
    assert seal.t_unc_s < STEP
    assert seal.y_px == pytest.approx(250.0, abs=1.0)


def test_frames_in_which_a_neck_is_closed_are_no_recording_that_ends_before() -> None:
    frames = np.arange(74, FRAMES)
    shut = NeckTrack(frames, np.full(frames.size, 250.0), np.zeros(frames.size), np.full(frames.size, 0.05))
    vanished = np.where(np.arange(FRAMES) < 60, -40.0, np.nan)
    assert find_seal([shut], scene(apex=vanished)).status != "clip_ended"


@pytest.mark.parametrize("above", [0.0, 5.0, 20.0])
def test_a_sphere_wetted_all_round_has_no_cavity_to_seal(above: float) -> None:
    """What leaves the surface is the sphere's own top, whose blur, or the bubbles on it, begin some rows higher."""
    alone = scene(apex=leaving(25.0, speed=3.0))
    own = alone.cavity_top_px + above
    found = find_seal([], replace(alone, sphere_top_px=own))
    assert (found.status, found.value) == ("no_neck", "")
    assert np.isnan(found.t_s)
    assert find_seal([], replace(alone, sphere_top_px=own + 60.0)).value == "surface_seal"


def test_a_clip_that_ends_with_a_sphere_at_the_surface_shows_no_open_cavity() -> None:
    alone = scene(apex=leaving(FRAMES - 3.0))
    assert find_seal([], replace(alone, sphere_top_px=alone.cavity_top_px)).status == "no_neck"
    assert find_seal([], alone).status == "clip_ended"


def test_what_is_uncertain_in_all_radii_alike_counts_in_the_time() -> None:
    """A ledge is read too low in every frame, so that all squares are too large: the law fits as well, but later."""
    neck = closing(60.4, 250.0, last=60)
    off = 10.0 / neck.radius_px
    sure, unsure, shifted = (
        find_seal([track], scene())
        for track in (
            neck,
            replace(neck, common_unc_px=off),
            replace(neck, radius_px=neck.radius_px + off),
        )
    )
    late = shifted.t_s - sure.t_s
    assert late > 3.0 * sure.t_unc_s
    assert 0.5 * late < unsure.t_unc_s < 2.0 * late


def test_a_closure_of_which_hardly_anything_is_known_is_none() -> None:
    neck = closing(60.4, 250.0, last=60)
    assert find_seal([replace(neck, common_unc_px=300.0 / neck.radius_px)], scene()).status != "ok"
