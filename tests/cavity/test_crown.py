"""Width of the crown's rim in drawn side views."""

from __future__ import annotations

from dataclasses import astuple, replace

import numpy as np
import pytest

from wentry_cli.cavity.crown import find_rim
from wentry_cli.imaging.patch import Patch


def crown(rim: float, *, height: int = 60, mouth: float = 80.0, droplet: bool = False) -> Patch:
    """A translucent film between a mouth at the last row and a rim ``height`` rows above it, axis at column 100."""
    rows, columns = 120, 200
    y, x = np.mgrid[:rows, :columns]
    share = (rows - 1 - y) / height
    half = 0.5 * (mouth + (rim - mouth) * share)
    image = np.where((np.abs(x - 100.0) < half) & (share <= 1.0), 0.5, 1.0)
    if droplet:
        image[(x - 103.0) ** 2 + (y - 30.0) ** 2 < 20.0] = 0.1
    noise = np.random.default_rng(0).normal(0.0, 0.02, image.shape)
    return Patch((image + noise).astype(np.float32), x0=40, y0=10, noise_floor=0.02)


@pytest.mark.parametrize("rim", [120.0, 60.0, 20.0])
@pytest.mark.parametrize("droplet", [False, True])
def test_width_and_height_of_the_rim(rim: float, droplet: bool) -> None:
    found = find_rim(crown(rim, droplet=droplet), 140.0)
    assert found.status == "ok"
    assert found.width_px == pytest.approx(rim, abs=3.0)
    assert found.top_y_px == pytest.approx(10.0 + 119.0 - 60.0, abs=1.0)


JETS = {"on both ends": (-52, 50), "one group": (12, 19, 26), "many": (-55, -40, -22, -3, 9, 31, 47)}


@pytest.mark.parametrize("film", [0.15, 0.5])
@pytest.mark.parametrize("name", JETS)
def test_jets_on_a_ragged_crown_are_not_its_rim(name: str, film: float) -> None:
    patch = crown(120.0, height=60)
    image = np.where(patch.values < 0.8, patch.values - 0.5 + film, patch.values)
    for order, at in enumerate(JETS["many"]):
        image[119 - 60 - 4 - order % 3 : 119 - 60, 100 + at : 100 + at + 5] = film
    for order, at in enumerate(JETS[name]):
        image[119 - 60 - 22 - order : 119 - 60, 100 + at : 100 + at + 5] = film
    found = find_rim(Patch(image, x0=40, y0=10, noise_floor=0.02), 140.0)
    assert found.status == "ok"
    assert found.width_px == pytest.approx(120.0, abs=3.0)
    assert found.top_y_px == pytest.approx(10.0 + 119.0 - 60.0, abs=2.0)


@pytest.mark.parametrize("axis", [140.0, 45.0])
def test_rows_above_all_that_stands_there_tell_nothing(axis: float) -> None:
    patch = crown(60.0, droplet=True)
    whole = find_rim(patch, axis)
    assert whole.highest_y_px == 69
    cut = find_rim(replace(patch, values=patch.values[58:], y0=10 + 58), axis)
    np.testing.assert_equal(astuple(cut), astuple(whole))
    assert find_rim(replace(patch, values=patch.values[62:], y0=10 + 62), axis).highest_y_px == 72  # there may be more


def test_nothing_over_the_axis_is_no_edge() -> None:
    for patch, axis in (
        (Patch(np.ones((50, 80), np.float32)), 40.0),
        (crown(60.0), 45.0),
        (crown(60.0, height=2), 140.0),
    ):
        found = find_rim(patch, axis)
        assert found.status == "no_edge"
        assert np.isnan([found.width_px, found.top_y_px]).all()


def test_a_crown_that_reaches_beyond_the_picture_has_no_rim() -> None:
    assert find_rim(crown(60.0, height=150), 140.0).status == "out_of_frame"
