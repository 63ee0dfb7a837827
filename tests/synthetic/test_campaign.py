from __future__ import annotations

import csv
import hashlib
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import pytest
import yaml

from tests.synthetic.drops import SOFT, make_scene
from wentry_cli.config.models import Experiment
from wentry_cli.errors import InputError
from wentry_cli.synthetic.camera_view import place_side
from wentry_cli.synthetic.campaign import FIRST_NUMBER, describe_experiment, plan_scene, render_campaign, render_drop
from wentry_cli.synthetic.film import Film
from wentry_cli.synthetic.nuisance import draw_static
from wentry_cli.synthetic.side_view import draw_side_instant, see_instant
from wentry_cli.synthetic.top_view import draw_top_instant

TOP = {"width": 96, "height": 96, "scale_px_per_m": 900.0, "camera_distance_m": 1.5, "fps": 500.0}
SIDE = {"width": 120, "height": 200, "scale_px_per_m": 500.0, "surface_y_px": 60.3, "fps": 500.0}
SPOILT = {
    "misfit": [0.003, 0.004], "droplets": 20, "bubbles": 10, "wet_scale": 1.05, "mirror_image": True,
    "surface_band_px": 12.0, "surface_band_uneven": 0.5, "opaque_crown": True, "ragged_crown": 1.0,
    "translucent_sphere": True, "tilt_deg": 3.0, "drift_m_s": 0.2, "flicker": 0.01, "hot_pixels": 9,
    "second_object": True, "jets": True, "lamp_image": True,
}  # fmt: skip


def digest(folder: Path) -> dict[str, str]:
    files = sorted(p for p in folder.rglob("*") if p.is_file())
    return {str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


def film(scene) -> Film:
    course, _ = plan_scene(scene)
    return Film(course, scene.side, draw_side_instant, draw_static(scene, place_side(scene)), 3)


def test_same_seed_same_bytes_with_every_switch(tmp_path):
    scene = make_scene(side={**SIDE, "bits": 12, "format": "mraw"}, top=TOP, switches=SPOILT, clip={"longest_s": 0.035})
    render_drop(scene, tmp_path / "a")
    render_drop(scene, tmp_path / "b")
    first = digest(tmp_path / "a")
    assert first == digest(tmp_path / "b")
    assert {"side.cihx", "side.mraw", "experiment.yaml", "truth/truth.csv", "truth/top.csv"} <= set(first)
    render_drop(scene.model_copy(update={"seed": 6}), tmp_path / "c")
    assert digest(tmp_path / "c")["side.mraw"] != first["side.mraw"]


@pytest.mark.parametrize(
    "keys",
    [
        {"side": SIDE, "top": TOP},
        {"kind": "surface_impact", "side": {**SIDE, "surface_y_px": 180.0}},
        {"kind": "free_flight", "impact_speed_m_s": 1.0, "side": SIDE},
        {"side": {**SIDE, "format": "mraw", "bits": 12, "empty_frames": 3}, "switches": {"wet_scale": 1.05}},
        {"side": None, "top": TOP},
    ],
)
def test_experiment_obeys_the_contract(keys):
    scene = make_scene(**keys)
    text = yaml.safe_dump(describe_experiment(scene, {"side": "side", "top": "top"}))
    experiment = Experiment.model_validate(yaml.safe_load(text))
    assert experiment.kind == scene.kind
    assert "scale_px_per_m: 500" not in text


def test_edge_of_the_rendered_sphere_is_where_the_truth_has_it():
    scene = make_scene(side={"width": 200, "height": 320, "scale_px_per_m": 2000.0, "surface_y_px": 250.3,
                             "exposure_s": 0.0, "lamp": {"dark": 0.0}})  # fmt: skip
    picture = film(scene)
    t = -0.012
    hidden = 1.0 - picture.transmission(t).astype(float)[:230]
    now, view = see_instant(picture.course, t), place_side(scene)
    rows, columns = np.mgrid[: hidden.shape[0], : hidden.shape[1]]
    radius = 0.0255 * 2000.0
    assert np.sqrt(hidden.sum() / np.pi) == pytest.approx(radius, abs=1e-3)
    assert (hidden * rows).sum() / hidden.sum() == pytest.approx(view.surface_y_px - 2000.0 * now.y_c_m, abs=3e-3)
    assert (hidden * columns).sum() / hidden.sum() == pytest.approx(99.5, abs=3e-3)


def test_only_what_changes_is_drawn_anew():
    picture = film(make_scene(switches={"second_object": True, "surface_band_px": 10.0}))
    frame = picture.transmission(0.03)
    changed = frame != picture.background
    assert not changed[:, :20].any()
    assert changed[100:160, 60:140].any()


def test_cavity_has_dark_walls_and_a_bright_core():
    picture = film(make_scene(side={"width": 360, "height": 640, "scale_px_per_m": 1400.0, "surface_y_px": 130.0}))
    frame = picture.transmission(0.07)
    now = see_instant(picture.course, 0.07)
    k = int(np.argmin(np.abs(now.depth - 0.06)))
    row = round(130.0 + 1400.0 * 0.06)
    width = 1400.0 * now.wall[k]
    assert frame[row, 180] > 0.6
    assert frame[row, round(179.5 + 0.9 * width)] < 0.1
    assert frame[row, round(179.5 + width + 6)] == pytest.approx(1.0, abs=1e-3)


def test_refraction_makes_the_sphere_larger_below_the_surface():
    side = {"width": 360, "height": 640, "scale_px_per_m": 1400.0, "surface_y_px": 130.0}
    dry, wet = (film(make_scene(side=side, switches={"wet_scale": s})).transmission(0.06) for s in (1.0, 1.06))
    below = slice(300, None)
    assert (1.0 - wet[below]).sum() > (1.0 - dry[below]).sum() * 1.05


def test_dropped_and_duplicated_frames(tmp_path):
    scene = make_scene(
        kind="free_flight", impact_speed_m_s=1.0, clip={"longest_s": 0.01}, side={**SIDE, "fps": 1000.0},
        switches={"dropped_frames": [3], "duplicated_frames": [5]},
    )  # fmt: skip
    render_drop(scene, tmp_path)
    names = [f"side_{FIRST_NUMBER + k:06d}.png" for k in range(11) if k != 3]
    assert sorted(p.name for p in (tmp_path / "side").iterdir()) == names
    pair = [(tmp_path / "side" / f"side_{FIRST_NUMBER + k:06d}.png").read_bytes() for k in (4, 5, 6)]
    assert pair[0] == pair[1] != pair[2]


def test_campaign_in_two_processes_writes_the_same(tmp_path):
    flight = {"kind": "free_flight", "impact_speed_m_s": 1.0, "clip": {"longest_s": 0.01}, "side": SIDE}
    drops = [{"name": n} for n in ("a", "b")]
    scenes = {"materials": {"soft": SOFT}, "defaults": {"sphere": {"diameter_m": 0.02}, **flight}, "drops": drops}
    (tmp_path / "scenes.yaml").write_text(yaml.safe_dump(scenes))
    done: list[tuple[int, int]] = []
    folders = render_campaign(tmp_path / "scenes.yaml", tmp_path / "one", progress=lambda a, b: done.append((a, b)))
    render_campaign(tmp_path / "scenes.yaml", tmp_path / "two", jobs=2)
    assert [f.name for f in folders] == ["a", "b"]
    assert render_campaign(tmp_path / "scenes.yaml", tmp_path / "three", only=("b",)) == [tmp_path / "three" / "b"]
    with pytest.raises(InputError, match="has no drop c; its drops are a, b"):
        render_campaign(tmp_path / "scenes.yaml", tmp_path / "three", only=("c",))
    assert done == [(1, 2), (2, 2)]
    assert digest(tmp_path / "one") == digest(tmp_path / "two")


def test_the_sample_drop_is_what_its_scene_draws(tmp_path):
    sample = Path(__file__).parents[2] / "sample_frames"
    (folder,) = render_campaign(sample / "scene.yaml", tmp_path)
    kept, drawn = digest(sample / folder.name), digest(folder)
    assert kept.keys() == drawn.keys()
    for name in ("experiment.yaml", "truth/truth.yaml"):
        assert (folder / name).read_text() == (sample / folder.name / name).read_text()
    for path in sorted((sample / folder.name / "truth").glob("*.csv")):
        ours, theirs = pd.read_csv(folder / "truth" / path.name), pd.read_csv(path)
        # nine digits are kept, of which another library of mathematics may round the last differently
        pd.testing.assert_frame_equal(ours, theirs, rtol=1e-7, atol=1e-8)
    for view in ("side", "top"):
        for path in sorted((folder / view).iterdir())[::20]:
            ours = cv2.imread(str(path), cv2.IMREAD_UNCHANGED).astype(int)
            theirs = cv2.imread(str(sample / folder.name / view / path.name), cv2.IMREAD_UNCHANGED)
            # another processor may round one grey level differently
            assert np.abs(ours - theirs).max() <= 1
    assert sum(p.stat().st_size for p in sample.rglob("*") if p.is_file()) <= 3_000_000


def test_empty_frames_come_first_and_the_clock_counts_them(tmp_path):
    scene = make_scene(
        side={**SIDE, "empty_frames": 4, "surface_y_px": 150.3}, top=TOP, clip={"longest_s": 0.03, "before_s": 0.012}
    )
    render_drop(scene, tmp_path)
    truth = yaml.safe_load((tmp_path / "truth" / "truth.yaml").read_text())
    with (tmp_path / "truth" / "truth.csv").open() as file:
        rows = list(csv.DictReader(file))
    experiment = yaml.safe_load((tmp_path / "experiment.yaml").read_text())
    assert [r["measurable"] for r in rows[3:5]] == ["0", "1"]
    assert float(rows[4]["t_s"]) + truth["impact_time_s"] == pytest.approx(4 / 500.0)
    assert experiment["views"]["side"]["background"] == [0, 3]
    assert experiment["views"]["top"]["offset_s"] == pytest.approx(4 / 500.0)
    frames = sorted((tmp_path / "side").iterdir())
    assert len(frames) == len(rows)
    dark = [int((cv2.imread(str(p), cv2.IMREAD_UNCHANGED)[:140] < 60).sum()) for p in frames[:5]]
    assert dark[:4] == [0, 0, 0, 0]
    assert dark[4] > 400


def test_top_view_alone_and_a_saturated_ground(tmp_path):
    scene = make_scene(side=None, top={**TOP, "lamp": {"level": 1.4}}, clip={"longest_s": 0.03})
    render_drop(scene, tmp_path)
    frames = sorted((tmp_path / "top").iterdir())
    with (tmp_path / "truth" / "truth.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(frames) == len(rows)
    assert rows[0]["measurable"] == "1"
    first = cv2.imread(str(frames[0]), cv2.IMREAD_UNCHANGED)
    assert (first == 255).mean() > 0.5
    assert first[48, 48] < 60


@pytest.mark.parametrize(("kind", "surface"), [("water_entry", 80.4), ("water_entry", 80.7), ("surface_impact", 250.4)])
def test_the_surface_is_drawn_at_the_row_of_the_truth(kind, surface):
    scene = make_scene(kind=kind, side={"width": 200, "height": 320, "scale_px_per_m": 800.0, "surface_y_px": surface})
    picture = film(scene)
    for frame in (picture.background, picture.transmission(-0.002)):
        hidden = 1.0 - frame[:, 3].astype(float)
        if kind == "water_entry":
            row = float((hidden * np.arange(320)).sum() / hidden.sum())
        else:
            row = 319.5 - float(hidden.sum()) / 0.88
        assert row == pytest.approx(surface, abs=1e-4)


FLIGHT = {"kind": "free_flight", "impact_speed_m_s": 1.0}


def test_a_shorter_rendering_leaves_nothing_of_the_longer_one(tmp_path):
    long, short = (
        make_scene(side=SIDE, top=t, clip={"longest_s": s}, **FLIGHT) for t, s in ((TOP, 0.02), (None, 0.01))
    )
    render_drop(long, tmp_path / "a")
    (tmp_path / "a" / "notes.txt").write_text("mine")
    (tmp_path / "a" / "side" / "side_by_side.png").write_text("mine")
    render_drop(short, tmp_path / "a")
    render_drop(short, tmp_path / "b")
    kept, drawn = digest(tmp_path / "a"), digest(tmp_path / "b")
    assert {"notes.txt", "side/side_by_side.png"} == set(kept) - set(drawn)
    assert {name: kept[name] for name in drawn} == drawn
    assert not (tmp_path / "a" / "top").exists()


def test_what_no_rendering_wrote_is_left_alone(tmp_path):
    lab = tmp_path / "lab" / "side" / "side_000001.png"
    lab.parent.mkdir(parents=True)
    lab.write_bytes(b"a frame")
    (tmp_path / "lab" / "experiment.yaml").write_text("kind: free_flight")
    before = digest(tmp_path)
    with pytest.raises(InputError, match="not rendered by wentry"):
        render_drop(make_scene(side=SIDE, **FLIGHT), tmp_path / "lab")
    with pytest.raises(InputError, match="is a file"):
        render_drop(make_scene(side=SIDE, **FLIGHT), tmp_path / "lab" / "experiment.yaml")
    assert digest(tmp_path) == before


def test_an_interrupted_rendering_is_not_taken_for_a_drop_and_can_be_done_again(tmp_path):
    scene = make_scene(side=SIDE, clip={"longest_s": 0.02}, **FLIGHT)
    render_drop(scene, tmp_path / "a")

    def stop(done: int, total: int) -> None:
        if done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        render_drop(scene, tmp_path / "a", progress=stop)
    assert not (tmp_path / "a" / "experiment.yaml").exists()
    render_drop(scene, tmp_path / "a")
    render_drop(scene, tmp_path / "b")
    assert digest(tmp_path / "a") == digest(tmp_path / "b")


def test_a_top_view_lit_from_the_front_has_highlights_and_a_shadow(tmp_path):
    view = {"width": 200, "height": 200, "scale_px_per_m": 2400.0, "polarity": "bright"}
    pictures = []
    for switches in ({}, {"wet_highlights": 8, "crown_shadow": True}):
        course, _ = plan_scene(make_scene(top=view, switches=switches))
        pictures.append(Film(course, course.scene.top, draw_top_instant, [], 3).transmission(0.012))
    plain, lit = pictures
    assert plain[100, 100] > 0.9
    assert (lit - plain).max() > 0.2
    assert (lit - plain)[100, 40:60].min() < -0.3
    outside = np.hypot(*(np.mgrid[:200, :200] - 99.5)) > 2400.0 * 0.0255 * 1.7
    np.testing.assert_allclose(lit[outside], plain[outside], atol=1e-4)
