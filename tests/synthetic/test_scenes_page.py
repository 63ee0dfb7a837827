"""docs/scenes.md: made from the models as they are, with an example that can be drawn."""

from __future__ import annotations

import sys
from pathlib import Path

from wentry_cli.synthetic.campaign import plan_scene
from wentry_cli.synthetic.scenes_file import load_scenes

DOCS = Path(__file__).resolve().parents[2] / "docs"


def test_page_of_scenes_is_current() -> None:
    sys.path.insert(0, str(DOCS))
    try:
        import make_scenes
    finally:
        sys.path.pop(0)
    assert make_scenes.PAGE.read_text(encoding="utf-8") == make_scenes.page(), "run `make tables`"


def test_the_example_of_the_page_can_be_drawn(tmp_path: Path) -> None:
    _, example, _ = (DOCS / "scenes.md").read_text(encoding="utf-8").split("```")
    (tmp_path / "scenes.yaml").write_text(example.removeprefix("yaml"))
    first, second = load_scenes(tmp_path / "scenes.yaml")
    assert first.sphere.law is not None
    assert all(times.size > 20 for scene in (first, second) for times in plan_scene(scene)[1].values())
