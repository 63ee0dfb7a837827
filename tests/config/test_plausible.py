"""Keys that contradict each other, or that no laboratory has: each is told with its place, before anything is read."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from wentry_cli.config.blame import wrong_key
from wentry_cli.config.campaign import read_drop
from wentry_cli.errors import ConfigurationError
from wentry_cli.runner.commands import overrides_document

GOOD = """\
kind: water_entry
sphere: {diameter_m: 0.051}
views:
  side: {source: side, fps: 2000, exposure_s: 5e-4}
  top: {source: top, fps: 2000, scale_px_per_m: 1000, camera_distance_m: 1.5}
"""


def _folder(tmp_path: Path, text: str) -> Path:
    (tmp_path / "experiment.yaml").write_text(text)
    return tmp_path


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (
            ("exposure_s: 5e-4", "exposure_s: 5"),
            "4:35: error: views.side.exposure_s: 5 s is longer than a frame at 2000",
        ),
        (("exposure_s: 5e-4", "exposure_s: 5.1e-4"), "views.side.exposure_s: 0.00051 s is longer than a frame"),
        (("1000", "1e300"), "5:33: error: views.top.scale_px_per_m: 1e+300 makes the sphere 5.1e+298 px wide"),
        (("1000", "{air: auto, water: 1}"), "5:61: error: views.top.scale_px_per_m.water: 1 makes the sphere 0.051 px"),
        (("1000", "1000, scale_px_per_m_unc: 1e3"), "views.top.scale_px_per_m_unc: must be less than the scale 1000"),
        (
            ("1.5", "0.05"),
            "5:55: error: views.top.camera_distance_m: must be greater than the sphere's diameter 0.051 m",
        ),
        (
            ("1.5", "1.5, camera_distance_m_unc: 2"),
            "views.top.camera_distance_m_unc: must be less than the distance 1.5",
        ),
        (("source: top", "source: ./side/"), "5:9: error: views.top.source: is the recording of the side view"),
        (("fps: 2000, e", "roi_px: [0, 0, 1, 1], e"), "4:24: error: views.side.roi_px: 1 x 1 pixels hold no sphere"),
        (("0.051", "0.051, mass_kg: 1e9"), "2:29: error: sphere.mass_kg: with diameter_m it gives 1.44e+13 kg/m"),
        (
            ("0.051", "0.051, diameter_m_unc: 1"),
            "2:29: error: sphere.diameter_m_unc: must be less than diameter_m 0.051",
        ),
        (("views:", "gravity_m_s2: 1e9\nviews:"), "3:1: error: gravity_m_s2: must be at most 1000"),
        (("views:", "liquid: {viscosity_pa_s: 1e-308}\nviews:"), "liquid.viscosity_pa_s: must be at least 1e-07"),
        (("views:", "liquid: {surface_tension_n_m: 1e-308}\nviews:"), "liquid.surface_tension_n_m: must be at least"),
        (("exposure_s: 5e-4", "surface_y_px_unc: 1e308"), "views.side.surface_y_px_unc: must be at most 1000"),
        (("views:", "drop: {height_m: 1e300}\nviews:"), "3:8: error: drop.height_m: must be at most 1000"),
    ],
)
def test_what_no_laboratory_has_is_refused(tmp_path: Path, change: tuple[str, str], expected: str) -> None:
    assert change[0] in GOOD
    with pytest.raises(ConfigurationError) as caught:
        read_drop("drop", _folder(tmp_path, GOOD.replace(*change)))
    (line,) = str(caught.value).splitlines()
    assert line.startswith(str(tmp_path / "experiment.yaml"))
    assert expected in line


def test_all_contradictions_are_told_at_once(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError) as caught:
        read_drop("drop", _folder(tmp_path, GOOD.replace("5e-4", "5").replace("1000", "1e9").replace("1.5", "1e-9")))
    assert str(caught.value).count("error:") == 3


def test_one_camera_may_see_both_views_through_a_mirror(tmp_path: Path) -> None:
    shared = GOOD.replace("source: top", "source: side, roi_px: [200, 0, 400, 200]")
    halves = shared.replace("source: side, fps: 2000, e", "source: side, roi_px: [0, 0, 200, 200], fps: 2000, e")
    assert read_drop("drop", _folder(tmp_path, halves)).experiment.sides == ["side", "top"]
    with pytest.raises(ConfigurationError, match="is the recording of the side view"):
        read_drop("drop", _folder(tmp_path, halves.replace("[0, 0, 200", "[200, 0, 400")))
    with pytest.raises(ConfigurationError, match="is the recording of the side view"):
        read_drop("drop", _folder(tmp_path, shared))


def test_a_shutter_that_is_always_open_is_one(tmp_path: Path) -> None:
    assert read_drop("drop", _folder(tmp_path, GOOD)).view("side").exposure_s == 1 / 2000


def test_what_the_recording_shows_to_be_wrong_is_found_in_the_file_again(tmp_path: Path) -> None:
    campaign = tmp_path / "campaign.yaml"
    campaign.write_text("views: {top: {offset_s: 3}}\n")
    folder = tmp_path / "drop"
    folder.mkdir()
    drop = read_drop("drop", _folder(folder, GOOD), top=tmp_path)
    assert f"{folder / 'experiment.yaml'}:4:24: error: views.side.fps: no" == str(
        wrong_key(drop, "views.side.fps", 2000, "no")
    )
    assert f"{campaign}:1:15: error: views.top.offset_s: no" == str(wrong_key(drop, "views.top.offset_s", 3, "no"))
    given = read_drop("drop", folder, overrides_document(("views.side.fps=1000",)), tmp_path)
    assert str(wrong_key(given, "views.side.fps", 1000, "no")) == "--set views.side.fps: error: views.side.fps: no"
    (folder / "experiment.yaml").write_text("views: {side: {fps: }}\n")
    near = {"side.fps": f"{folder / 'experiment.yaml'}:1:16", "top.flip": f"{campaign}:1:9"}
    for key, place in near.items():  # left empty or to its default
        assert str(wrong_key(drop, f"views.{key}", "x", "no")).startswith(f"{place}: error: views.{key}")
    gone = replace(drop, folder=tmp_path / "gone")
    assert "gone" in str(wrong_key(gone, "views.side.fps", 2000, "no"))
