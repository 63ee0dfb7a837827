"""A recording that lost a frame and was numbered anew: told, and the speed is of frames whose time is known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.stages.rendered import measure, render, truth
from wentry_cli.stages import kinematics
from wentry_cli.stages.summary.speeds import measured_speeds
from wentry_cli.tables import read_table


def _lose(source: Path, lost: int) -> None:
    """Remove a frame and number those behind it anew."""
    images = sorted(item for item in source.iterdir() if item.is_file())
    for before, after in zip(images[lost:], images[lost + 1 :], strict=False):
        after.replace(before)


def test_a_frame_lost_before_impact_is_told(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    folder = render(tmp_path / "drop", sphere={"diameter_m": 0.051}, clip={"before_s": 0.012, "longest_s": 0.03})
    _lose(folder / "side", 7)
    out = tmp_path / "out"
    drop, _ = measure(folder, out)
    assert "between frames 6 and 7 the sphere moves as far as in 2 frames elsewhere: a frame is missing" in caplog.text
    side, said = read_table(out, "side"), truth(folder)[1]
    assert (side["status"][:7] != "ok").all()
    assert (side["status"][7:12] == "ok").all()
    geometry = read_table(out, "geometry").iloc[0]
    lost_s = 1.0 / float(geometry["fps"])
    late = float(geometry["impact_time_s"]) - (said["impact_time_s"] - lost_s)
    assert abs(late) < 4.0 * float(geometry["impact_time_s_unc"])
    kinematics.run(out, drop)
    speeds = measured_speeds(out, drop)
    assert abs(speeds.impact - said["u0_m_s"]) < 4.0 * speeds.impact_unc
    assert np.isfinite(speeds.impact)


def test_a_gap_of_numbers_that_misses_no_frame_is_told_and_costs_the_frames_before_it(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    folder = render(tmp_path / "drop", sphere={"diameter_m": 0.051}, clip={"before_s": 0.012, "longest_s": 0.03})
    images = sorted(item for item in (folder / "side").iterdir() if item.is_file())
    for image in reversed(images[5:]):
        digits = image.stem[len(image.stem.rstrip("0123456789")) :]
        image.rename(image.with_stem(f"{image.stem.removesuffix(digits)}{int(digits) + 10:0{len(digits)}d}"))
    out = tmp_path / "out"
    drop, _ = measure(folder, out)
    assert "between frames 4 and 15 the clock tells 11 intervals and the sphere moves as far as in one" in caplog.text
    side, said = read_table(out, "side"), truth(folder)[1]
    assert (side["status"][:15] != "ok").all()
    assert (side["status"][15:20] == "ok").all()
    kinematics.run(out, drop)
    speeds = measured_speeds(out, drop)
    assert abs(speeds.impact - said["u0_m_s"]) < 4.0 * speeds.impact_unc
    geometry = read_table(out, "geometry").iloc[0]
    late = float(geometry["impact_time_s"]) - (said["impact_time_s"] + 10.0 / float(geometry["fps"]))
    assert abs(late) < 4.0 * float(geometry["impact_time_s_unc"])
