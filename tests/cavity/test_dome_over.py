"""Dome-over from the grey level of a disc in the top view."""

from __future__ import annotations

import numpy as np
import pytest

from wentry_cli.cavity.dome_over import disc_level, find_dome_over, find_rim_closure

T = np.arange(40) * 5e-4


def levels(closure: float, *, sphere: float = 12.0, splash: float = 60.0, speed: float = 300.0) -> np.ndarray:
    opening = np.clip(speed * (closure - T), 0.0, 1.0)
    noise = np.random.default_rng(0).normal(0.0, 0.2, T.size)
    return splash + (sphere - splash) * opening**2 + noise


@pytest.mark.parametrize("closure", [0.0081, 0.0103, 0.0118])
def test_closure_of_the_crown_to_half_a_frame(closure: float) -> None:
    found = find_dome_over(T, levels(closure))
    assert found.status == "ok"
    assert found.t_s == pytest.approx(closure, abs=2.5e-4)
    assert abs(found.t_s - closure) < 3.0 * found.t_unc_s


def test_a_bright_sphere_behind_a_dark_splash_and_missing_frames() -> None:
    seen = levels(0.0103, sphere=150.0, splash=40.0)
    seen[5::7] = np.nan
    assert find_dome_over(T, seen).t_s == pytest.approx(0.0103, abs=4e-4)


def test_a_crown_that_closes_between_two_frames() -> None:
    found = find_dome_over(T, levels(0.0103, speed=9e4))
    assert found.status == "ok"
    assert found.t_s == pytest.approx(0.0103, abs=5e-4)
    assert found.t_unc_s == pytest.approx(5e-4)


def test_what_cannot_be_seen_has_a_status() -> None:
    assert find_dome_over(T, levels(0.05)).status in {"clip_ended", "no_edge"}
    assert find_dome_over(T, levels(0.01, sphere=58.0)).status == "no_edge"
    assert find_dome_over(T, np.full(T.size, np.nan)).status == "no_edge"
    assert find_dome_over(T[:5], levels(0.01)[:5]).status == "clip_ended"


def test_disc_level_is_the_mean_inside() -> None:
    y, x = np.mgrid[:40, :50]
    image = np.where((x - 20.0) ** 2 + (y - 15.0) ** 2 < 100.0, 7.0, 200.0)
    assert disc_level(image, 20.0, 15.0, 8.0) == pytest.approx(7.0)
    assert np.isnan(disc_level(image, -50.0, 15.0, 8.0))


def rim(closure: float, *, broadens: float = 2000.0) -> np.ndarray:
    left = closure - T
    opening = 110.0 * np.clip(1.0 - np.maximum(1.0 - left / 0.012, 0.0) ** 4, 0.0, 1.0)
    return opening + 20.0 + np.maximum(-left - 0.004, 0.0) * broadens


def test_rim_in_the_side_view_closes_before_its_tip_broadens() -> None:
    found = find_rim_closure(T, rim(0.0113))
    assert found.status == "ok"
    assert found.t_s == pytest.approx(0.0113, abs=4e-4)
    assert found.t_unc_s > 2.8e-4  # half a frame, and what is not known of the tip's 20 px


def test_jets_that_hide_a_rim_for_some_frames_do_not_close_it() -> None:
    width = rim(0.0113)
    width[[9, 13, 14, 17]] = 24.0
    assert find_rim_closure(T, width).t_s == pytest.approx(0.0113, abs=7e-4)


def test_a_rim_that_leaps_from_open_to_closed_is_refused() -> None:
    width = np.where(T < 0.0098, 179.0, 19.0) + np.random.default_rng(1).normal(0.0, 1.0, T.size)
    found = find_rim_closure(T, width)
    assert found.status == "poor_fit"
    assert np.isnan([found.t_s, found.t_unc_s]).all()


def test_a_rim_that_stays_open_or_was_not_seen() -> None:
    assert find_rim_closure(T, 100.0 - 500.0 * T).status == "clip_ended"
    assert find_rim_closure(T, np.full(T.size, np.nan)).status == "no_edge"


def test_a_crown_that_closes_faster_in_the_end() -> None:
    """Its film snaps shut when less than a third is open: a line through what was before leads far beyond that."""
    opening = np.where(T < 0.0111, np.clip(120.0 * (0.0140 - T), 0.0, 1.0), 0.0)
    found = find_dome_over(T, 60.0 - 48.0 * opening**2)
    assert found.status == "ok"
    assert abs(found.t_s - 0.0111) < 5e-4
    assert 5e-4 < found.t_unc_s < 3e-3
