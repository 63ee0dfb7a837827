"""The optical axis of the side view: what a wrong one does to the path at the waterline is noticed."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np
import pytest

from wentry_cli.config.campaign import read_drop
from wentry_cli.stages.track.axis import OpticalAxis, assumed_axis, checked_axis
from wentry_cli.stages.track.scales import Scales, height_unc

SCALES = Scales(4400.0, 0.1, 4620.0, 0.1, "")
AXIS = OpticalAxis(512.0, 50.0)
TIMES = (np.arange(60) - 20.3) / 2000.0
UPPER, LOWER = 4400.0, 4620.0


def drop_in(folder: Path, more: str = ""):
    (folder / "experiment.yaml").write_text(
        "kind: water_entry\nsphere: {diameter_m: 0.051, density_kg_m3: 1070}\n"
        f"views: {{side: {{source: frames, fps: 2000{more}}}}}\n"
    )
    return read_drop("soft", folder)


def path(axis_off_px: float, *, drag_m_s2: float = 60.0) -> np.ndarray:
    """A fall at 3 m/s that water slows down, as a picture with its axis ``axis_off_px`` above the assumed one shows."""
    wet = np.maximum(TIMES, 0.0)
    height = 0.0255 - 3.0 * TIMES - 0.5 * 9.81 * TIMES**2 + 0.5 * drag_m_s2 * wet**2
    return height + np.where(TIMES > 0.0, -axis_off_px * (1.0 / UPPER - 1.0 / LOWER), 0.0)


@pytest.mark.parametrize("off", [-20.0, 0.0, 60.0])
def test_an_axis_within_what_is_assumed_says_nothing(tmp_path, caplog, off):
    assert checked_axis(drop_in(tmp_path), AXIS, SCALES, TIMES, path(off)) == AXIS
    assert not caplog.records


@pytest.mark.parametrize("off", [-400.0, 300.0])
def test_a_jump_at_the_waterline_is_told_and_widens_the_heights(tmp_path, caplog, off):
    with caplog.at_level(logging.WARNING):
        checked = checked_axis(drop_in(tmp_path), AXIS, SCALES, TIMES, path(off))
    assert checked.y_px == AXIS.y_px
    assert 0.7 * abs(off) < checked.unc_px < 1.3 * abs(off)
    assert "views.side.optical_axis_y_px" in caplog.text
    rows = np.array([150.0, 600.0])
    unc = height_unc((rows, np.zeros(2)), SCALES, (200.0, 0.0), (checked.y_px, checked.unc_px))
    shift = abs(off) * (1.0 / UPPER - 1.0 / LOWER)
    assert unc[0] < 0.02 * shift
    assert unc[1] == pytest.approx(shift, rel=0.3)


def test_too_few_frames_on_one_side_say_nothing(tmp_path, caplog):
    centre = np.where(TIMES < 0.0, np.nan, path(400.0))
    assert checked_axis(drop_in(tmp_path), AXIS, SCALES, TIMES, centre) == AXIS
    assert not caplog.records


def test_a_given_axis_is_trusted_more(tmp_path):
    assert assumed_axis(drop_in(tmp_path), (512.0, 512.0)) == AXIS
    given = assumed_axis(drop_in(tmp_path, ", optical_axis_y_px: 300"), (512.0, 512.0))
    assert given.y_px == 300.0
    assert given.unc_px < AXIS.unc_px


def test_without_a_wall_the_axis_does_not_matter():
    same = Scales(4400.0, 0.0, 4400.0, 0.0, "")
    assert height_unc((np.array([600.0]), np.zeros(1)), same, (200.0, 0.0), (512.0, 50.0))[0] == 0.0
