"""Hard sequences: rows of two, what is hidden is not measured, and what is wrong is found."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from wentry_cli.bench import sequences
from wentry_cli.bench.kept import Chapter
from wentry_cli.bench.page import write_page
from wentry_cli.bench.row import BenchRow
from wentry_cli.bench.sequence_scenes import SEQUENCES


@pytest.fixture(scope="module")
def rows() -> list[BenchRow]:
    return sequences.run(quick=True, seed=3)


def test_rows_of_two_sequences(rows: list[BenchRow]) -> None:
    assert [row.case for row in rows] == [item.name for item in SEQUENCES[:2] for _ in range(3)]
    assert [row.quantity for row in rows] == 2 * ["y_b", "bottom_y", "stretch"]
    for row in rows:
        assert row.items <= row.in_view
        assert row.measured > 0.9
        assert row.false_ok == 0.0
        assert row.time_us > 0.0
        assert row.rmse < (0.05 if row.unit == "px" else 1e-3)
    assert "3 gap" in rows[3].note
    assert "impact ok, off by" in rows[3].note
    assert rows[4].note == ""


def test_the_page_has_a_line_a_sequence(rows: list[BenchRow], tmp_path: Path) -> None:
    page = write_page([Chapter("sequences", rows)], tmp_path, ["sequences"]).read_text(encoding="utf-8")
    assert "## Hard sequences" in page
    assert sum(line.startswith("| frames missing, numbers tell |") for line in page.splitlines()) == 1


def _measured(name: str, folder: Path) -> pd.DataFrame:
    sequence = next(item for item in SEQUENCES if item.name == name)
    return sequences.measure(sequence, 3, folder).found


def test_a_sphere_behind_spray_is_not_measured_and_found_again(tmp_path: Path) -> None:
    side = _measured("lost behind a splash", tmp_path / "clip").set_index("frame")
    assert (side.status.loc[40:51] != "ok").all()
    assert (side.status.loc[52:] == "ok").all()


@pytest.mark.parametrize("seed", [412, 20170524])
def test_bubbles_that_cling_to_a_sphere_are_not_taken_for_it(seed: int, tmp_path: Path) -> None:
    sequence = next(item for item in SEQUENCES if item.name == "jets and bubbles after closure")
    drop = sequences.measure(sequence, seed, tmp_path / "clip")
    stretch = next(item for item in drop.quantities if item.name == "stretch")
    said = sequences._compare(drop.found, drop.can, stretch)
    assert said["false_ok"] == 0.0
    assert said["measured"] > 0.7
    assert "out_of_frame" not in set(drop.found["status"])  # it stays in view


def test_a_faint_sphere_beside_black_glare_is_followed_to_its_pinch_off(tmp_path: Path) -> None:
    sequence = next(item for item in SEQUENCES if item.name == "sphere and cavity of 20 % contrast")
    drop = sequences.measure(sequence, 3, tmp_path / "clip")
    assert not drop.refusal
    assert (drop.found["status"] == "ok").mean() > 0.9
    assert drop.events["pinch_off"].said == "ok, deep_seal (truth: deep_seal)"
    assert drop.events["pinch_off"].sigmas < 3.0


def test_frames_numbered_anew_leave_the_files_without_a_gap(tmp_path: Path) -> None:
    side = _measured("frames missing, numbered anew", tmp_path / "clip")
    files = sorted(path.name for path in (tmp_path / "clip" / "side").iterdir())
    assert files == [f"side_{number:06d}.png" for number in range(1, len(files) + 1)]
    assert len(side) == len(files) == len(pd.read_csv(tmp_path / "clip" / "truth" / "truth.csv")) - 2


def test_what_is_called_ok_and_wrong_is_counted() -> None:
    truth = np.arange(10.0)
    can = np.arange(10) < 8
    found = pd.DataFrame({"frame": range(10), "bottom_y_px": truth, "bottom_y_px_unc": 0.01, "status": "ok"})
    found.loc[3, "bottom_y_px"] += 0.2
    found.loc[4, "bottom_y_px"] += 0.08  # far beyond its uncertainty, and too little to matter
    found.loc[[5, 9], "status"] = "occluded"
    quantity = sequences.Quantity("bottom_y", "px", "bottom_y_px", truth, 1.0, 1.0)
    said = sequences._compare(found, can, quantity)
    assert said["false_ok"] == pytest.approx(1 / 8)
    assert said["worst"] == pytest.approx(20.0)
    assert said["measured"] == pytest.approx(7 / 8)
    assert said["unmeasurable_ok"] == 0.5
    assert said["items"] == 8


def test_a_drop_that_was_refused_has_failed() -> None:
    quantity = sequences.Quantity("bottom_y", "px", "bottom_y_px", np.arange(4.0), 1.0, 1.0)
    said = sequences._compare(pd.DataFrame({"frame": range(4)}), np.full(4, True), quantity)
    assert said["failures"] == 1.0
    assert math.isnan(said["rmse"])


def test_drops_of_a_sequence_are_counted_together(tmp_path: Path) -> None:
    drops = [sequences.measure(SEQUENCES[1], seed, tmp_path / str(seed)) for seed in (3, 4)]
    one, both = sequences.list_rows("one", drops[:1])[0], sequences.list_rows("both", drops)[0]
    assert both.items == sum(drop.can.sum() for drop in drops)
    assert both.in_view == sum(drop.in_view for drop in drops) > one.in_view
    assert "6 gap" in both.note
    assert one.note.count("+") + one.note.count("-") == 1
    assert both.note.count("+") + both.note.count("-") == 2
