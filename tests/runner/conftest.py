"""A rigid drop on paper: its configuration and an empty folder for its frames."""

from __future__ import annotations

from pathlib import Path

import pytest

from wentry_cli.config.campaign import Drop, read_drop

EXPERIMENT = """\
kind: water_entry
sphere: {diameter_m: 0.051, density_kg_m3: 1070, material: rigid}
views:
  side: {source: side, fps: 2000}
"""


@pytest.fixture
def drop(tmp_path: Path) -> Drop:
    folder = tmp_path / "video"
    (folder / "side").mkdir(parents=True)
    (folder / "experiment.yaml").write_text(EXPERIMENT)
    return read_drop("video", folder)
