"""The same tables from a Dask cluster; a sentence where there is none."""

from __future__ import annotations

from pathlib import Path

import pytest

from wentry_cli.errors import InputError
from wentry_cli.pipeline import stages_of
from wentry_cli.runner.cluster import run_on_cluster, run_remotely
from wentry_cli.runner.drop import Event
from wentry_cli.runner.work import Work


def test_no_scheduler_is_a_sentence() -> None:
    pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
    with pytest.raises(InputError, match="no Dask scheduler answers there"):
        list(run_on_cluster("tcp://127.0.0.1:9", Work(Path(), []), [], lambda event: None))


def test_work_travels_as_plain_data(tmp_path: Path) -> None:
    from wentry_cli.config.campaign import read_drop

    (tmp_path / "experiment.yaml").write_text(
        "kind: free_flight\nsphere: {diameter_m: 0.05}\nviews: {side: {source: nowhere, fps: 1000}}\n"
    )
    record = read_drop("a", tmp_path).record()
    events, failure = run_remotely(Work(tmp_path / "results", stages_of("process")), record)
    assert failure is not None
    assert failure.exit_code == 4
    assert isinstance(events[-1], Event)
    assert "nowhere" in failure.sentence
