"""Rows of the side view: what a moving and deforming sphere leaves open."""

from __future__ import annotations

import numpy as np
import pytest

from wentry_cli.stages.track.rows import (
    blurred_stretch,
    contradicted_bottom,
    local_bottom_holds,
    local_bottom_unc,
    lowest_rows,
)


def columns(stretch: np.ndarray, y: np.ndarray) -> dict[str, np.ndarray]:
    return {"stretch": stretch, "center_x_px": np.zeros_like(y), "center_y_px": y, "radius_px": np.full_like(y, 100.0)}


def test_the_blur_of_a_deformation_is_the_product_of_both_changes() -> None:
    frames = np.arange(6.0)
    doubt = blurred_stretch(columns(1.0 + 0.1 * frames, 20.0 * frames), 0.2)
    assert doubt == pytest.approx(0.02 * 4.0 / 100.0)


def test_without_exposure_deformation_or_motion_there_is_none() -> None:
    frames = np.arange(6.0)
    assert not blurred_stretch(columns(1.0 + 0.1 * frames, 20.0 * frames), 0.0).any()
    assert not blurred_stretch(columns(np.ones(6), 20.0 * frames), 0.2).any()
    assert not blurred_stretch(columns(1.0 + 0.1 * frames, np.zeros(6)), 0.2).any()


def test_gaps_take_the_neighbour_that_is_there() -> None:
    stretch = np.array([1.0, 1.1, np.nan, 1.3, np.nan, 1.5])
    doubt = blurred_stretch(columns(stretch, 20.0 * np.arange(6.0)), 0.2)
    assert doubt[:2] == pytest.approx(0.02 * 4.0 / 100.0)
    assert np.isfinite(doubt).all()


def test_a_bottom_with_something_on_it_is_contradicted() -> None:
    apart = np.array([0.01, 0.0, 0.02, 0.3, 0.01, np.nan])
    told = {"bottom_y_px": np.full(6, 100.0), "bottom_local_y_px": 100.0 + apart}
    told |= {"bottom_y_px_unc": np.full(6, 0.01), "bottom_local_y_px_unc": np.full(6, 0.01)}
    assert contradicted_bottom(told, deforms=False).tolist() == [False, False, False, True, False, False]


def test_beside_frames_that_drift_together_one_that_leaps_is_contradicted() -> None:
    """The outline of a soft sphere departs from an ellipse by itself, as slowly as it oscillates."""
    apart = 0.3 * np.sin(np.arange(60.0) / 12.0)
    apart[33] += 0.25
    told = {"bottom_y_px": np.full(60, 100.0), "bottom_local_y_px": 100.0 + apart}
    told |= {"bottom_y_px_unc": np.full(60, 0.01), "bottom_local_y_px_unc": np.full(60, 0.02)}
    assert np.flatnonzero(contradicted_bottom(told, deforms=True)).tolist() == [33]


def test_a_bottom_of_which_little_is_left_gives_way_to_the_outline() -> None:
    told = {"bottom_y_px": np.full(4, 100.0), "bottom_local_y_px": np.array([100.01, 100.2, 100.0, np.nan])}
    told |= {"bottom_y_px_unc": np.full(4, 0.01), "bottom_local_y_px_unc": np.array([0.02, 0.3, 0.02, np.nan])}
    told["gated_fraction"] = np.zeros(4)
    assert local_bottom_holds(told, 0.0, deforms=True).tolist() == [True, False, True, False]
    assert local_bottom_holds(told, 0.8, deforms=True).tolist() == [True, True, True, False]
    told["gated_fraction"] = np.array([0.4, 0.4, 0.0, 0.0])
    assert local_bottom_holds(told, 0.0, deforms=True).tolist() == [False, False, True, False]


def test_in_a_crowd_of_bubbles_what_the_bottom_lies_off_the_outline_is_doubt() -> None:
    told = {"bottom_y_px": np.full(3, 100.0), "bottom_local_y_px": np.array([100.3, 100.3, 100.1])}
    told |= {"bottom_y_px_unc": np.full(3, 0.1), "bottom_local_y_px_unc": np.full(3, 0.05)}
    told["gated_fraction"] = np.array([0.4, 0.1, 0.4])
    assert local_bottom_unc(told, 0.0) == pytest.approx([np.sqrt(0.08), 0.05, 0.05])
    assert local_bottom_unc(told, 0.4) == pytest.approx(np.full(3, 0.05))


def test_in_air_the_outline_goes_on_where_the_bottom_left_off() -> None:
    apart = np.array([0.3, 0.31, 0.29, 0.3, 0.31, 0.29, np.nan, np.nan, 0.3, np.nan])
    told = {"bottom_y_px": 100.0 + np.arange(10.0), "bottom_local_y_px": 100.0 + np.arange(10.0) + apart}
    told |= {"bottom_y_px_unc": np.full(10, 0.01), "bottom_local_y_px_unc": np.where(np.isnan(apart), np.nan, 0.02)}
    air = np.arange(10) < 8
    rows, unc = lowest_rows(told, np.isfinite(apart), air)
    expected = np.array([*(told["bottom_local_y_px"][:6]), 106.3, 107.3, 108.3, 109.0])
    assert rows == pytest.approx(expected)
    assert unc[:6] == pytest.approx(0.02)
    assert unc[6] == pytest.approx(np.hypot(0.01, np.std(apart[:6], ddof=1) / np.sqrt(6)))
    assert unc[9] == 0.01
    few, _ = lowest_rows(told, np.isfinite(apart) & (np.arange(10) > 2), air)
    assert few[6] == 106.0
