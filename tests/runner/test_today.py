"""What fit, report and status make of an experiment.yaml or a materials.yaml that was edited after process."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from tests.cli.conftest import SMALL, Command, call_wentry, wentry
from wentry_cli.config.campaign import read_drop
from wentry_cli.config.materials import packaged_config
from wentry_cli.pipeline import STAGES
from wentry_cli.runner import plan
from wentry_cli.runner.plan import fingerprint
from wentry_cli.runner.status import campaign_status
from wentry_cli.synthetic.campaign import render_drop
from wentry_cli.synthetic.scene import Scene
from wentry_cli.tables import read_table

__all__ = ["wentry"]
CHANGED = "configuration condition changed since; what was there before is shown"
SET = "liquid.surface_tension_n_m=0.07"


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("today")
    render_drop(Scene.model_validate(SMALL), folder / "small")
    assert call_wentry("run", folder / "small", "-o", folder / "results", "-q", "--set", SET) == 0
    return folder


@pytest.fixture
def experiment(made: Path) -> object:
    """The file, which a test may edit; as it was afterwards, and the results too."""
    path = made / "small" / "experiment.yaml"
    text, results = path.read_text(), made / "results"
    kept = shutil.copytree(results, made / "kept")
    yield path
    path.write_text(text)
    shutil.rmtree(results)
    kept.rename(results)


def _edit(path: Path, before: str, after: str) -> None:
    assert before in path.read_text()
    path.write_text(path.read_text().replace(before, after))


def test_what_was_set_in_the_last_run_is_no_edit(made: Path, wentry: Command) -> None:
    states = campaign_status(made / "results")
    assert {state for state, _ in states["small"].values()} == {"fresh", "not needed"}
    assert " run " not in wentry("fit", made / "results", "-n").out


def test_fit_uses_what_its_own_stages_read_as_it_is_now(made: Path, experiment: Path, wentry: Command) -> None:
    results = made / "results"
    _edit(experiment, "kind:", "gravity_m_s2_unc: 0.02\ncondition: edited\nkind:")
    assert "condition changed" in wentry("fit", results, "-n").out
    told = wentry("report", results)
    assert told.code == 0
    assert "small: configuration condition changed since summary was done; the report shows what was" in told.err
    assert f"run `wentry fit {results}`" in told.err
    assert "report done" in told.err
    assert CHANGED in (results / "report.html").read_text(encoding="utf-8")
    assert wentry("fit", results).code == 0
    assert read_table(results / "small", "summary")["condition"].tolist() == ["edited"]
    assert {state for state, _ in campaign_status(results)["small"].values()} == {"fresh", "not needed"}
    assert wentry("report", results).err.startswith("report done")
    assert CHANGED not in (results / "report.html").read_text(encoding="utf-8")


def test_fit_refuses_what_was_measured_otherwise(made: Path, experiment: Path, wentry: Command) -> None:
    results = made / "results"
    before = (results / "summary.csv").read_bytes()
    _edit(experiment, "diameter_m: 0.051", "diameter_m: 0.0509")
    for words in (("-n",), ()):
        told = wentry("fit", results, *words)
        assert told.code == 4
        assert told.err == (
            "small: configuration sphere.diameter_m changed since track was done; run "
            f"`wentry process {made / 'small'} -o {results} with --set as before` first\n"
        )
        assert told.out == ""
    assert (results / "summary.csv").read_bytes() == before
    assert "changed since track was done" in wentry("report", results).err
    side = results / "small" / "side.csv"
    text = side.read_text()
    side.write_text(text.replace("ok", "poor_fit", 1))
    told = wentry("fit", results)
    assert told.code == 4, "an edited table does not hide the edited key"
    assert "configuration sphere.diameter_m changed since track was done" in told.err
    assert (results / "summary.csv").read_bytes() == before
    assert "changed since track was done" in wentry("report", results).err
    side.write_text(text)
    _edit(experiment, "diameter_m: 0.0509", "diameter_m: 0.051")
    assert wentry("fit", results).code == 0, "a refusal does not stick"


def test_a_file_that_is_wrong_now_is_told(made: Path, experiment: Path, wentry: Command) -> None:
    _edit(experiment, "kind:", "kinds:")
    told = wentry("fit", made / "results")
    assert told.code == 3
    assert "did you mean kind?" in told.err
    states = campaign_status(made / "results")["small"]
    assert states["summary"] == ("stale", "see input")
    state, reason = states["input"]
    assert state == "wrong"
    assert "did you mean kind?" in reason


def test_a_material_reaches_only_what_uses_it(made: Path, tmp_path: Path) -> None:
    folder, stages = tmp_path / "soft", {stage.name: stage for stage in STAGES}
    folder.mkdir()
    text = (made / "small" / "experiment.yaml").read_text()
    (folder / "side").symlink_to(made / "small" / "side")

    def marks(material: str) -> dict[str, object]:
        (folder / "experiment.yaml").write_text(text.replace("rigid", material))
        drop = read_drop("soft", folder)
        return {name: fingerprint(folder, drop, stage) for name, stage in stages.items()}

    small, large = marks("dragonskin_6p70_small"), marks("dragonskin_1p12_small")
    assert {name for name in stages if small[name] != large[name]} == {"kinematics", "model", "summary"}
    assert marks("rigid")["track"] != small["track"]
    given = packaged_config("materials.yaml").read_text(encoding="utf-8")
    (folder / "materials.yaml").write_text(given.replace("xi: 0.0866", "xi: 0.08"), encoding="utf-8")
    other = marks("dragonskin_6p70_small")
    assert {name for name in stages if small[name] != other[name]} == {"model", "summary"}


def test_a_touched_recording_is_the_same_one_and_a_changed_one_is_not(made: Path) -> None:
    frame = sorted((made / "small" / "side").iterdir())[5]
    stat, content = frame.stat(), frame.read_bytes()

    def states() -> set[str]:
        plan.identity.cache_clear()
        return {state for state, _ in campaign_status(made / "results")["small"].values()}

    try:
        os.utime(frame, ns=(1, 1))
        assert states() == {"fresh", "not needed"}
        frame.write_bytes(content[:-9] + bytes([content[-9] ^ 1]) + content[-8:])
        os.utime(frame, ns=(1, 1))
        assert states() == {"stale", "not needed"}
    finally:
        frame.write_bytes(content)
        os.utime(frame, ns=(stat.st_atime_ns, stat.st_mtime_ns))
        plan.identity.cache_clear()
