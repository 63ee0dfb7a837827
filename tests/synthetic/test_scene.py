from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from wentry_cli.errors import ConfigurationError, InputError
from wentry_cli.synthetic.campaign import plan_scene
from wentry_cli.synthetic.scene import load_scenes

CONFIGS = Path(__file__).parents[2] / "configs"
VIEW = {"width": 64, "height": 64, "scale_px_per_m": 200}
DROP = {"name": "a", "sphere": {"diameter_m": 0.05}, "height_m": 1.0, "side": VIEW}


def write(path: Path, document: object) -> Path:
    path.write_text(yaml.safe_dump(document), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("document", "word"),
    [
        ({"drops": [{**DROP, "heigth_m": 1.0}]}, "heigth_m"),
        ({"drops": [{**DROP, "physics": {"drag": -1.0}}]}, "physics.drag"),
        ({"drops": [{**DROP, "impact_speed_m_s": 3.0}]}, "impact_speed_m_s"),
        ({"drops": [{k: v for k, v in DROP.items() if k != "side"}]}, "at least one view"),
        ({"drops": [DROP, DROP]}, "share a name"),
        ({"drops": [{**DROP, "sphere": {"diameter_m": 0.05, "material": "cheese"}}]}, "cheese"),
        ({"scenes": [DROP]}, "drops"),
        ({"drops": [DROP], "colour": 1}, "colour"),
        ([DROP], "mapping"),
    ],
)
def test_a_wrong_scenes_file_says_what_is_wrong(tmp_path, document, word):
    with pytest.raises(ConfigurationError, match=word):
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
