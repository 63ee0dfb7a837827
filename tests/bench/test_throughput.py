"""Rows of whole recordings: every method on the same frames, the process with its stages."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from wentry_cli.bench.row import BenchRow
from wentry_cli.bench.speed_clips import write_copy
from wentry_cli.bench.speed_page import UNPACKING_US, speed_tables
from wentry_cli.bench.speed_targets import ACCURATE, FAST, list_speed
from wentry_cli.bench.throughput import (
    CAMPAIGN,
    CASES,
    DECODING,
    FIRST_FRAMES,
    PROCESSING,
    QUICK,
    RECIPE,
    UNPACKING,
    YARDSTICK,
    bench_scene,
    run,
)  # fmt: skip
from wentry_cli.frames.formats import open_recording
from wentry_cli.synthetic.campaign import render_drop
from wentry_cli.synthetic.scene import Clip

NAN = math.nan
NAMES = ("raw", "copy")
TIMES_US = {DECODING: 250.0, ACCURATE: 400.0, FAST: 100.0, PROCESSING: 800.0, RECIPE: 1000.0}


def made_up(times_us: dict[str, float] = TIMES_US) -> list[BenchRow]:
    """The same times in every case; the first frames lie on a line of 50 ms and 300 µs a frame, two processes halve."""
    row = BenchRow("throughput", "", "", "y_b", "mm", 0.0, 0.002, NAN, 0.0, NAN, items=500)
    rows = [
        replace(row, case=case.name, method=method, time_us=time) for case in CASES for method, time in times_us.items()
    ]
    for count in (100, 250):
        case = f"{CASES[0].name}{FIRST_FRAMES}{count} frames"
        rows.append(replace(row, case=case, method=ACCURATE, time_us=5e4 / count + 300.0, items=count))
    campaign = replace(row, case=f"2{CAMPAIGN}", note="500 frames/s: wall time, 2 cores")
    return [*rows, *(replace(campaign, method=f"{PROCESSING} -j {n}", time_us=2000.0 / n) for n in (1, 2))]


def test_rates_stand_beside_decoding_and_the_recipe() -> None:
    page = speed_tables(made_up())
    (line,) = (line for line in page if line.startswith(f"| {CASES[0].name} | 500"))
    cells = [cell.strip() for cell in line.strip("|").split("|")]
    assert cells[2:] == ["**4000** (–, 4)", "**2500** (0.62, 2.5)", "**10000** (2.5, 10)", "1250 (0.31, 1.2)",
                         "1000 (0.25, –)"]  # fmt: skip
    assert "| wentry process -j 2 | 1000 | 0.50 | 2 |" in page


def test_time_against_the_number_of_frames_is_a_line() -> None:
    page = "\n".join(speed_tables(made_up()))
    assert "| 100 | 0.080 |\n| 250 | 0.125 |\n| 500 | 0.200 |" in page
    assert f"{ACCURATE}: 50 ms and 0.300 ms a frame, at most 0% off that line." in page


def test_the_machine_is_compared_with_that_of_the_targets() -> None:
    unpacking = replace(made_up()[0], case=YARDSTICK, method=UNPACKING, time_us=2.0 * UNPACKING_US)
    page = "\n".join(speed_tables([*made_up(), unpacking]))
    assert f"in memory, in {2.0 * UNPACKING_US:.0f} µs" in page
    (target,) = (item for item in list_speed([*made_up(), unpacking]) if item.what.endswith("track, accurate, R 60"))
    assert "; 5000 if all else scales" in target.measured
    assert not target.met  # what counts is what was measured
    assert "in memory, in" not in "\n".join(speed_tables(made_up()))


def test_targets_of_speed_are_those_of_the_slowest_case() -> None:
    met = {target.what.rpartition(": ")[2]: target.met for target in list_speed(made_up())}
    assert met == {
        "track, accurate, R 60": False,  # 2500 of 3000
        "track, accurate, R 125": True,
        "track, fast": True,
        "all of process": True,  # 1250 of 1200
        ACCURATE: False,  # of a PNG: 62 % of decoding alone
        PROCESSING: False,
    }
    slow = [
        replace(row, time_us=900.0) if (row.case, row.method) == (CASES[4].name, PROCESSING) else row
        for row in made_up()
    ]
    (target,) = (target for target in list_speed(slow) if "all of process" in target.what)
    assert not target.met
    assert target.measured == f"1111 ({CASES[4].name}), 0.28 × decoding, 1.11 × {RECIPE}"


def test_a_quick_run_has_no_targets() -> None:
    names = {case.name for case in QUICK}
    assert list_speed([row for row in made_up() if row.case in names]) == []


@pytest.mark.parametrize("kind", ["png", "tiff", "avi"])
def test_a_copy_holds_the_frames_of_the_raw_clip(kind: str, tmp_path: Path) -> None:
    bits = 16 if kind == "tiff" else 8
    scene = bench_scene("mraw", bits, 3, quick=True)
    render_drop(scene.model_copy(update={"clip": Clip(longest_s=0.002, before_s=0.001)}), tmp_path / "raw")
    write_copy(tmp_path / "raw", tmp_path / "copy", kind)
    views = [yaml.safe_load((tmp_path / name / "experiment.yaml").read_text("utf-8"))["views"] for name in NAMES]
    raw, copy = (open_recording(tmp_path / n / v["side"]["source"]) for n, v in zip(NAMES, views, strict=True))
    assert raw.info.frame_count == copy.info.frame_count == 5
    for index in range(5):
        off = np.abs(raw.read(index).astype(float) - copy.read(index).astype(float))
        assert off.max() == 0 if kind != "avi" else off.mean() < 2.0  # motion JPEG loses some of the noise
    truths = {(tmp_path / name / "truth" / "truth.csv").read_bytes() for name in NAMES}
    assert len(truths) == 1
    assert views[1]["side"]["fps"] == raw.info.fps == 2000.0


@pytest.mark.slow
def test_rows_of_short_recordings() -> None:
    rows = run(quick=True, seed=7)
    found = {(row.case, row.method): row for row in rows}
    for case in QUICK:
        assert (case.name, RECIPE) in found
        for method in (ACCURATE, FAST, PROCESSING):
            assert found[case.name, method].failures < 0.02
            assert found[case.name, method].rmse < 0.02  # mm: a twentieth of a pixel
        times = [found[case.name, method].time_us for method in (PROCESSING, ACCURATE, DECODING)]
        assert times == sorted(times, reverse=True)
        assert math.isnan(found[case.name, DECODING].rmse)
        stages = ("ingest", "track", "cavity", "stretch", "kinematics")
        assert all(stage in found[case.name, PROCESSING].note for stage in stages)
    assert sum(FIRST_FRAMES in row.case for row in rows) == 4
    alone, beside = (found[f"2{CAMPAIGN}", f"{PROCESSING} -j {jobs}"] for jobs in (1, 2))
    assert alone.items == beside.items == 2 * found[QUICK[0].name, DECODING].items
