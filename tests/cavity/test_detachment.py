"""When a cavity leaves the surface, from profiles whose uppermost rows a band hides."""

from __future__ import annotations

import numpy as np
import pytest

from wentry_cli.cavity.detachment import find_apex, find_detachment, hidden_rows

STEP, RADIUS = 5e-4, 45.0
HIDDEN = hidden_rows(0.02)


def width(depth: np.ndarray, apex: float, breadth: float = 30.0) -> np.ndarray:
    """Width of an ellipsoidal top: its square grows from the apex."""
    return np.sqrt(np.maximum(breadth**2 * (depth - apex) - 12.0 * (depth - apex) ** 2, 0.0))


@pytest.mark.parametrize("apex", [-4.0, -1.0, 0.3, 2.0, 6.7])
def test_the_apex_is_continued_into_the_band(apex: float) -> None:
    depth = np.arange(60) + 0.6
    assert find_apex(depth, width(depth, apex), HIDDEN) == pytest.approx(apex, abs=1e-6)


def test_a_step_of_the_smoothing_and_rows_that_were_not_seen_do_not_matter() -> None:
    depth = np.arange(60) + 0.6
    seen = width(depth, 0.5)
    seen[5] = seen[4]
    seen[8] = np.nan
    assert find_apex(depth, seen, HIDDEN) == pytest.approx(0.5, abs=0.15)


def test_no_apex_without_rows_or_without_a_closing_top() -> None:
    depth = np.arange(60) + 0.6
    assert np.isnan(find_apex(depth, np.full(60, np.nan), HIDDEN))
    assert np.isnan(find_apex(depth[:6], width(depth[:6], 0.0), HIDDEN))
    assert np.isnan(find_apex(depth, np.sqrt(900.0 + (depth - 6.0) ** 2), HIDDEN))


def path(frame: float, speed: float, frames: int = 120) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    apex = speed * (np.arange(frames) - frame)
    return np.arange(frames) * STEP, np.where(apex < HIDDEN, 1.6, np.ceil(apex)), apex


@pytest.mark.parametrize(("frame", "speed"), [(60.3, 0.4), (50.0, 1.0), (70.8, 2.0)])
def test_when_the_apex_crosses_the_surface(frame: float, speed: float) -> None:
    time, top, apex = path(frame, speed)
    found = find_detachment(time, top, apex, hidden_px=HIDDEN, radius_px=RADIUS)
    assert found.t_s == pytest.approx(frame * STEP, abs=0.1 * STEP)
    assert found.t_unc_s < 2.0 * max(STEP, STEP / speed)


@pytest.mark.parametrize(("frame", "speed"), [(60.3, 0.4), (50.0, 1.0)])
def test_without_an_apex_the_time_is_known_less_well(frame: float, speed: float) -> None:
    time, top, _ = path(frame, speed)
    found = find_detachment(time, top, np.full(top.size, np.nan), hidden_px=HIDDEN, radius_px=RADIUS)
    assert abs(found.t_s - frame * STEP) < 3.0 * found.t_unc_s
    assert found.t_unc_s > 0.2 * HIDDEN / speed * STEP


def test_a_cavity_that_stays_or_comes_back_or_loses_its_upper_part_has_not_left() -> None:
    time, top, apex = path(60.0, 0.4)
    stays = np.minimum(top, 1.6)
    back = np.where(np.arange(top.size) > 110, 1.6, top)
    lost = np.where(np.arange(top.size) > 60, 80.0, 1.6)
    brief = np.where(np.arange(top.size) > 117, top, 1.6)
    for rows in (stays, back, lost, brief, np.full(top.size, np.nan), top + 50.0):
        assert np.isnan(find_detachment(time, rows, apex, hidden_px=HIDDEN, radius_px=RADIUS).t_s)


def test_a_thick_band_hides_more_rows() -> None:
    assert hidden_rows(0.0) == pytest.approx(2.5)
    assert hidden_rows(20.0 / 12.0**0.5) == pytest.approx(1.0 + 0.5 * (20.0**2 + 3.0**2) ** 0.5)
