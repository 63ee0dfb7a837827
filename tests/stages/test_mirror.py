"""A sphere with its mirror image in the water: the row of the surface, and no image taken for the sphere."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.stages.rendered import SIDE, change, measure, render, truth
from wentry_cli.tables import read_table

BIG = SIDE | {"width": 220, "height": 330, "scale_px_per_m": 1400.0, "surface_y_px": 120.4}
BAND = {"surface_band_px": 12.0, "surface_band_uneven": 0.2}


@pytest.fixture(scope="module")
def mirrored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("mirror") / "drop"
    clip = {"before_s": 0.009, "longest_s": 0.05}
    return render(folder, side=BIG, clip=clip, switches=BAND | {"mirror_image": True})


def test_the_surface_lies_midway_between_the_sphere_and_its_image(mirrored: Path, tmp_path: Path) -> None:
    measure(mirrored, tmp_path)
    geometry = read_table(tmp_path, "geometry").iloc[0]
    _, said = truth(mirrored)
    assert geometry.surface_y_px_unc < 0.3
    assert abs(geometry.surface_y_px - said["surface_y_px"]) < 3.0 * geometry.surface_y_px_unc


def test_without_an_image_the_band_leaves_the_row_open(tmp_path: Path) -> None:
    plain = render(tmp_path / "drop", side=BIG, clip={"before_s": 0.009, "longest_s": 0.02}, switches=BAND)
    measure(plain, tmp_path / "out")
    assert read_table(tmp_path / "out", "geometry").surface_y_px_unc.iloc[0] > 2.0


def test_a_row_that_was_given_stays(mirrored: Path, tmp_path: Path) -> None:
    change(mirrored, surface_y_px=118.0)
    try:
        measure(mirrored, tmp_path)
    finally:
        change(mirrored, surface_y_px="auto")
    assert read_table(tmp_path, "geometry").surface_y_px.iloc[0] == 118.0


def test_the_image_is_not_taken_for_the_sphere(mirrored: Path, tmp_path: Path) -> None:
    measure(mirrored, tmp_path)
    known, said = truth(mirrored)
    side = read_table(tmp_path, "side").iloc[: len(known)]
    ok = (side.status == "ok").to_numpy()
    off = (side.y_b_m.to_numpy(float) - known.y_b_m.to_numpy(float)) * said["scale_px_per_m"]
    assert np.abs(off[ok]).max() < 0.5
    assert ok[(known.measurable == 1).to_numpy()].mean() > 0.9


def test_an_image_through_the_water_hides_the_sphere_no_longer_than_it_does(tmp_path: Path) -> None:
    """Filmed fast, the sphere stays in front of its image for a hundred frames; then it is found again."""
    side = BIG | {"fps": 4000.0, "width": 200, "height": 300}
    switches = BAND | {"mirror_image": True, "wet_scale": 1.06}
    clip = {"before_s": 0.008, "longest_s": 0.05}
    folder = render(tmp_path / "drop", side=side, clip=clip, switches=switches, height_m=0.12)
    measure(folder, tmp_path / "out")
    known, _ = truth(folder)
    side_table = read_table(tmp_path / "out", "side").iloc[: len(known)]
    ok, can = (side_table.status == "ok").to_numpy(), (known.measurable == 1).to_numpy()
    wet = (known.t_s > 0).to_numpy()
    assert (~can & wet).sum() > 60
    assert ok[can & wet].mean() > 0.9
    off = side_table.stretch.to_numpy(float) - known.stretch.to_numpy(float)
    assert np.abs(off[ok & can]).max() < 0.01
    assert read_table(tmp_path / "out", "geometry").surface_y_px_unc.iloc[0] > 2.0
