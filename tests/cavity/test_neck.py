"""Minima of a width, their vertex, and necks followed in time."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from wentry_cli.cavity.neck import Neck, NeckFollower, find_necks

Floats = NDArray[np.float64]
ROWS = np.arange(40.0, 200.0)


def blurred(width: Floats, sigma: float = 1.0) -> Floats:
    kernel = np.exp(-0.5 * (np.arange(-5, 6) / sigma) ** 2)
    padded = np.pad(width, 5, mode="edge")
    return np.convolve(padded, kernel / kernel.sum(), mode="valid")


@given(st.floats(70, 170), st.floats(2, 40), st.floats(0.3, 1.2))
def test_a_hyperboloid_is_found_exactly(row: float, radius: float, slope: float) -> None:
    width = 2.0 * np.sqrt(radius**2 + (slope * (ROWS - row)) ** 2)
    necks = find_necks(ROWS, width, edge_unc_px=0.01)
    assert len(necks) == 1
    assert necks[0].y_px == pytest.approx(row, abs=0.02)
    assert necks[0].radius_px == pytest.approx(radius, abs=0.02)


@pytest.mark.parametrize("row", [110.0, 110.3, 110.5, 110.8])
def test_a_kink_is_found_behind_its_blur(row: float) -> None:
    d = ROWS - row
    width = blurred(2.0 * (12.5 + np.where(d < 0, -0.45 * d, 0.72 * d)))
    (neck,) = find_necks(ROWS, width, edge_unc_px=0.03)
    assert neck.radius_px == pytest.approx(12.5, abs=0.12)
    assert neck.y_px == pytest.approx(row, abs=0.35)


def test_a_ledge_above_a_flaring_wall() -> None:
    width = np.where(ROWS < 110.5, 160.0, 2.0 * (10.0 + 0.5 * (ROWS - 110.5) + 0.05 * (ROWS - 110.5) ** 2))
    (neck,) = find_necks(ROWS, width, edge_unc_px=0.03)
    assert neck.radius_px == pytest.approx(10.0, abs=0.3)
    assert neck.radius_unc_px > 0.3


def test_undulations_within_the_noise_are_no_necks() -> None:
    rng = np.random.default_rng(2)
    width = 80.0 + 0.2 * (ROWS - 40.0) + rng.normal(0.0, 0.2, ROWS.size)
    assert find_necks(ROWS, width, edge_unc_px=0.15) == []


def test_a_closed_cavity_has_a_neck_of_no_radius() -> None:
    width = np.where(np.abs(ROWS - 120.0) < 6.0, 0.0, 30.0 + 0.2 * np.abs(ROWS - 120.0))
    (neck,) = find_necks(ROWS, width, edge_unc_px=0.03)
    assert neck.radius_px == 0.0


def test_two_necks_from_the_top_down_and_gaps_are_bridged() -> None:
    width = 60.0 + 10.0 * np.cos((ROWS - 40.0) / 160.0 * 4.0 * np.pi)
    width[30:34] = np.nan
    necks = find_necks(ROWS, width, edge_unc_px=0.03)
    assert [round(neck.y_px) for neck in necks] == [80, 160]


def test_too_few_rows_have_no_neck() -> None:
    assert find_necks(ROWS[:3], np.array([3.0, 1.0, 3.0]), edge_unc_px=0.1) == []
    assert find_necks(ROWS, np.full(ROWS.size, np.nan), edge_unc_px=0.1) == []


def _neck(y: float, radius: float) -> Neck:
    return Neck(y, radius, 0.05, 5.0)


def test_necks_keep_their_track_while_another_is_narrower() -> None:
    follower = NeckFollower()
    for frame in range(30):
        upper = _neck(100.0 + 0.5 * frame, 30.0 - 0.2 * frame)
        lower = _neck(180.0 + 2.0 * frame, 26.0 + 0.3 * frame)
        follower.add(frame, [upper, lower] if frame % 7 else [upper])
    tracks = follower.tracks()
    assert [track.frame.size for track in tracks] == [30, 25]
    np.testing.assert_allclose(tracks[0].y_px, 100.0 + 0.5 * np.arange(30))


def test_a_long_absence_ends_a_track_and_short_tracks_are_left_out() -> None:
    follower = NeckFollower()
    for frame in [*range(10), *range(20, 30)]:
        follower.add(frame, [_neck(100.0, 20.0)])
    follower.add(30, [_neck(250.0, 20.0)])
    assert [track.frame[0] for track in follower.tracks()] == [0, 20]


def test_a_neck_that_closes_within_one_frame_keeps_its_track() -> None:
    follower = NeckFollower()
    for frame in range(40):
        follower.add(frame, [_neck(100.0 + 0.5 * frame, float(np.sqrt(max(140.0 * (30.9 - frame), 0.0))))])
    (track,) = follower.tracks()
    assert track.frame.tolist() == list(range(40))
    assert track.radius_px[30] > 11.0
    assert not track.radius_px[31:].any()


def test_dust_that_leads_a_neck_astray_does_not_split_its_track() -> None:
    follower = NeckFollower()
    rows = [188.6, 188.4, 188.7, 188.5, 188.6, 191.6, 196.6, 196.8, 197.2, 197.4, 191.3, 191.0, 191.6]
    radii = [39.3, 38.6, 37.8, 36.9, 35.9, 34.8, 31.4, 28.6, 27.8, 27.9, 27.3, 25.2, 22.8]
    for frame, (row, radius) in enumerate(zip(rows, radii, strict=True)):
        follower.add(frame, [_neck(row, radius)])
    (track,) = follower.tracks()
    assert track.frame.tolist() == list(range(len(rows)))


def test_a_wide_neck_that_narrows_slowly_is_not_the_closed_one_elsewhere() -> None:
    follower = NeckFollower()
    for frame in range(20):
        follower.add(frame, [_neck(100.0, 30.0 - 0.1 * frame)] if frame < 12 else [_neck(100.0, 0.0)])
    assert [track.frame.size for track in follower.tracks()] == [12, 8]


def test_order_of_the_necks_in_a_frame_does_not_matter() -> None:
    one, other = NeckFollower(), NeckFollower()
    for frame in range(12):
        necks = [_neck(100.0 + frame, 20.0), _neck(130.0, 15.0), _neck(160.0 - frame, 25.0)]
        one.add(frame, necks)
        other.add(frame, necks if frame == 0 else necks[::-1])
    for a, b in zip(one.tracks(), other.tracks(), strict=True):
        np.testing.assert_array_equal(a.y_px, b.y_px)


def test_a_wall_that_bends_away_right_above_a_neck_does_not_move_it() -> None:
    """Beyond two rows the wall is no part of the vertex, however near it is."""
    d = ROWS - 110.3
    width = 2.0 * np.sqrt(12.0**2 + 4.0 * d**2 + np.where(d < -2.0, 30.0 * (d + 2.0) ** 4, 0.0))
    (neck,) = find_necks(ROWS, width, edge_unc_px=0.03)
    assert neck.radius_px == pytest.approx(12.0, abs=0.1)
    assert neck.y_px == pytest.approx(110.3, abs=0.2)
