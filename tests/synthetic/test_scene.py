from __future__ import annotations

import json
from pathlib import Path

import pytest
import yaml

from wentry_cli.errors import ConfigurationError, InputError
from wentry_cli.synthetic.campaign import plan_scene
from wentry_cli.synthetic.scenes_file import load_scenes

CONFIGS = Path(__file__).parents[2] / "configs"
VIEW = {"width": 64, "height": 64, "scale_px_per_m": 200}
DROP = {"name": "a", "sphere": {"diameter_m": 0.05}, "height_m": 1.0, "side": VIEW}


def write(path: Path, document: object) -> Path:
    path.write_text(yaml.safe_dump(json.loads(json.dumps(document))), encoding="utf-8")  # without aliases
    return path


@pytest.mark.parametrize(
    ("document", "word"),
    [
        (
            {"drops": [{**DROP, "heigth_m": 1.0}]},
            r"scenes.yaml:\d+:3: error: heigth_m: unknown key; did you mean height_m",
        ),
        ({"drops": [{**DROP, "physics": {"drag": -1.0}}]}, "physics.drag"),
        ({"drops": [{**DROP, "impact_speed_m_s": 3.0}]}, "impact_speed_m_s"),
        ({"drops": [{k: v for k, v in DROP.items() if k != "side"}]}, "at least one view"),
        ({"drops": [DROP, DROP]}, r"scenes.yaml:\d+:3: error: drops.1.name: two drops share the name a"),
        (
            {"drops": [{**DROP, "sphere": {"diameter_m": 0.05, "material": "cheese"}}]},
            "'cheese' is not .* give `materials",
        ),
        ({"scenes": [DROP]}, "drops"),
        ({"drops": [DROP], "colour": 1}, "colour"),
        ([DROP], "key: value"),
        ({"drops": [DROP], "seed": "x"}, "seed"),
        ({"drops": [{**DROP, "physics": {"drag": float("nan")}}]}, "physics.drag: must be a finite number"),
        ({"drops": [DROP, 3]}, "drops.1"),
        (
            {
                "drops": [{**DROP, "sphere": {"diameter_m": 0.05, "material": "soft"}}],
                "materials": {"soft": {"xi": -1}},
            },
            "sphere.law.g_inf_pa",
        ),
        ({"materials": "none.yaml", "drops": [DROP]}, "none.yaml"),
        ({"drops": [{**DROP, "name": "../a"}]}, r"name: is that of a folder: letters, digits and _.* not '../a'"),
    ],
)
def test_a_wrong_scenes_file_says_what_is_wrong(tmp_path, document, word):
    with pytest.raises((ConfigurationError, InputError), match=word):
        load_scenes(write(tmp_path / "scenes.yaml", document))


def test_a_missing_or_broken_file_is_named(tmp_path):
    with pytest.raises(InputError, match="nowhere"):
        load_scenes(tmp_path / "nowhere.yaml")
    (tmp_path / "broken.yaml").write_text("drops: [", encoding="utf-8")
    with pytest.raises(ConfigurationError, match="not valid YAML"):
        load_scenes(tmp_path / "broken.yaml")


def test_defaults_are_merged_and_null_drops_a_view(tmp_path):
    document = {
        "seed": 3,
        "defaults": {"side": {**VIEW, "fps": 1000.0}, "top": VIEW},
        "drops": [{"name": "a", "sphere": {"diameter_m": 0.05}, "height_m": 1.0, "top": None, "side": {"bits": 12}}],
    }
    (scene,) = load_scenes(write(tmp_path / "scenes.yaml", document))
    assert scene.top is None
    assert (scene.side.fps, scene.side.bits, scene.seed) == (1000.0, 12, 3000)


def test_the_demo_holds_what_the_regressions_need():
    scenes = load_scenes(CONFIGS / "demo.yaml")
    assert len(scenes) == 6
    images, seals, slow = 0, [], 0
    for scene in scenes:
        course, times = plan_scene(scene)
        images += sum(t.size for t in times.values())
        seals.append((scene.sphere.law is None, course.cavity.seal_type))
        assert course.end_s > course.cavity.t_p_s
        slow += bool(scene.physics.shallow_valleys or scene.physics.period_growth)
        if scene.sphere.law is not None:
            assert len(course.cavity.starts) >= 1
    assert images <= 3000
    assert sorted(seals) == [(False, "deep_seal")] * 4 + [(False, "sphere_seal"), (True, "deep_seal")]
    assert slow == 3
    assert {s.side.format for s in scenes} == {"png", "tiff", "mraw"}


def test_the_paper_has_its_twenty_four_drops():
    scenes = load_scenes(CONFIGS / "paper.yaml")
    assert len(scenes) == 24
    assert len({s.sphere.id for s in scenes}) == 8
    soft = [s for s in scenes if s.sphere.law is not None]
    off_model = [s for s in soft if s.physics.shallow_valleys or s.physics.period_growth]
    assert len(off_model) == len(soft) // 2


def test_the_calibration_has_the_six_spheres_of_table_1_at_three_heights():
    scenes = load_scenes(CONFIGS / "calibration.yaml")
    assert {s.kind for s in scenes} == {"surface_impact"}
    pairs = {(s.sphere.id, s.height_m) for s in scenes}
    assert pairs == {(f"S{k}", height) for k in range(1, 7) for height in (0.53, 1.53, 2.27)}


def test_numbers_as_everybody_writes_them_and_no_anchors(tmp_path):
    text = "drops:\n- {name: a, height_m: 1, sphere: {diameter_m: 5e-2}, side: &v "
    text += "{width: 64, height: 64, scale_px_per_m: 2e2}"
    (tmp_path / "scenes.yaml").write_text(text.replace("&v ", "") + "}\n")
    (scene,) = load_scenes(tmp_path / "scenes.yaml")
    assert (scene.sphere.diameter_m, scene.side.scale_px_per_m) == (0.05, 200.0)
    (tmp_path / "scenes.yaml").write_text(text + ", top: *v}\n")
    with pytest.raises(ConfigurationError, match=r"2:60: error: anchors \(&v\)"):
        load_scenes(tmp_path / "scenes.yaml")


def test_all_mistakes_come_at_once_and_each_once(tmp_path):
    wrong = {
        "defaults": {"side": {**VIEW, "fsp": 1.0}},
        "drops": [{**DROP, "name": n, "clip": {"befor_s": 1}} for n in "ab"],
    }
    with pytest.raises(ConfigurationError) as caught:
        load_scenes(write(tmp_path / "scenes.yaml", wrong))
    lines = str(caught.value).splitlines()
    assert [("fsp" in line, "befor_s" in line) for line in lines] == [(True, False), (False, True), (False, True)]
    assert "did you mean fps" in lines[0]
