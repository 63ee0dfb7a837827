"""What a person corrects by hand: refused where it is wrong, has no effect or lies outside of the clip."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from tests.runner.conftest import EXPERIMENT
from wentry_cli.config.campaign import Drop, read_drop
from wentry_cli.config.corrections import FrameCorrection
from wentry_cli.errors import ConfigurationError
from wentry_cli.pipeline import STAGES
from wentry_cli.runner.corrections import apply_corrections, correct_frames
from wentry_cli.runner.in_clip import check_before, check_heights, check_times
from wentry_cli.tables import new_table, read_table, write_table

STAGE = {stage.name: stage for stage in STAGES}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("frames:\n- {view: side, frames: [1, 1]}\n", "give either `exclude: true` or values"),
        ("events:\n- {event: pinch_off}\n", "t_s is needed for pinch_off"),
        ("events:\n- {event: pinch_off, t_s: 0.1, time_s: 0.1}\n", "time_s has no meaning for pinch_off; remove it"),
        ("events:\n- {event: impact, time_s: 0.1, y_m: 0.0}\n", "y_m has no meaning for impact; remove it"),
        ("events:\n- {event: dome_over, t_s: 0.1, value: deep_seal}\n", "value has no meaning for dome_over"),
        ("frames:\n- {view: top, frames: [1, 1], y_b_m: 0.1}\n", "y_b_m is not measured in the top view"),
        (
            "frames:\n- {view: top, frames: [1, 2], exclude: true}\n",
            "2:4: error: frames.0.view: the top view",
        ),
        (
            "frames:\n- {view: side, frames: [20, 20], y_b_m: 1e300}\n",
            "2:34: error: frames.0.y_b_m: must be at m",
        ),
        (
            "frames:\n- {view: side, frames: [2, 2], y_b_m: 0.1, y_b_m_unc: 1e-300}\n",
            "must be at least 1e-08",
        ),
        ("frames:\n- {view: side, frames: [2, 2], stretch: 9}\n", "frames.0.stretch: must be at most 5, not 9"),
        (
            "frames:\n- {view: side, frames: [2, 9], y_b_m: 0.1}\n- {view: side, frames: [9, 12], exclude: true}\n",
            "3:3: error: frames.1: corrects frames that line 2 corrects too; keep one of the two",
        ),
        (
            "events:\n- {event: pinch_off, t_s: 0.09, y_m: -0.1}\n- {event: pinch_off, t_s: 0.02}\n",
            "3:3: error: events.1: pinch_off 1 stands twice; keep one",
        ),
        ("events:\n- {event: impact, time_s: 0}\n- {event: impact, time_s: 0}\n", "events.1: impact stands twice"),
        ("events:\n- {event: impact, time_s: 0, index: 2}\n", "index has no meaning for impact"),
        ("events:\n- {event: pinch_off, t_s: -3}\n", "2:22: error: events.0.t_s: must be at least 0 s, not -3"),
        ("events:\n- {event: pinch_off, t_s: 0.1, y_m: 0.1, value: deep_seal}\n", "y_m is negative, not 0.1"),
        ("events:\n- {event: pinch_off, t_s: 0.1, y_m_unc: 0.001}\n", "y_m_unc has no meaning without y_m"),
        ("event: []\n", "unknown key; did you mean events?"),
    ],
)
def test_wrong_corrections_are_told(drop: Drop, text: str, expected: str) -> None:
    (drop.folder / "corrections.yaml").write_text(text)
    with pytest.raises(ConfigurationError, match=r"corrections\.yaml:\d+:\d+: error") as caught:
        read_drop("video", drop.folder)
    assert expected in str(caught.value)


def _corrected(drop: Drop, text: str) -> Drop:
    (drop.folder / "corrections.yaml").write_text(text)
    return read_drop("video", drop.folder)


@pytest.mark.parametrize("change", [("water_entry", "free_flight"), ("water_entry", "surface_impact"), ("side", "top")])
def test_an_event_that_nothing_reads_is_refused(drop: Drop, change: tuple[str, str]) -> None:
    (drop.folder / "experiment.yaml").write_text(EXPERIMENT.replace(*change))
    with pytest.raises(ConfigurationError, match=r":2:4: error: events\.0\.event: pinch_off has no effect"):
        _corrected(drop, "events:\n- {event: pinch_off, t_s: 0.1}\n")


def test_a_height_by_hand_has_no_effect_on_a_free_flight(drop: Drop) -> None:
    (drop.folder / "experiment.yaml").write_text(EXPERIMENT.replace("water_entry", "free_flight"))
    assert _corrected(drop, "frames:\n- {view: side, frames: [5, 6], exclude: true}\n").corrections.frames
    with pytest.raises(ConfigurationError, match=r":2:3: error: frames\.0: has no effect on a free flight"):
        _corrected(drop, "frames:\n- {view: side, frames: [5, 6], y_b_m: 0.01}\n")


def test_a_misspelt_key_of_a_correction_is_told_the_right_one(drop: Drop) -> None:
    with pytest.raises(ConfigurationError, match=r"frames\.1\.exlude: unknown key; did you mean exclude\?"):
        _corrected(
            drop,
            "frames:\n- {view: side, frames: [5, 6], exclude: true}\n- {view: side, frames: [8, 9], exlude: true}\n",
        )


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            "frames:\n- {view: side, frames: [50, 100], exclude: true}\n",
            "2:16: error: frames.0.frames: [50, 100]",
        ),
        ("events:\n- {event: impact, time_s: 500}\n", "2:19: error: events.0.time_s: 500 s is not in the clip"),
        ("events:\n- {event: impact, time_s: -500}\n", "2:19: error: events.0.time_s: -500 s is not in the clip"),
        ("events:\n- {event: impact, time_s: 0.0996}\n", "which lasts from 0 to 0.0995 s"),
    ],
)
def test_what_lies_outside_of_the_clip_is_refused(drop: Drop, tmp_path: Path, text: str, expected: str) -> None:
    """100 frames at 1000 / s, by the times themselves and by the table of the stage before."""
    times = [index * 0.001005 for index in range(100)]
    corrected = _corrected(drop, text)
    with pytest.raises(ConfigurationError) as caught:
        check_times(corrected, {"side": times})
    assert expected in str(caught.value)
    assert str(drop.folder / "corrections.yaml") in str(caught.value)
    write_table(tmp_path, "frames", new_table("frames", {"view": ["side"] * 100, "frame": range(100), "time_s": times}))
    with pytest.raises(ConfigurationError) as again:
        check_before(tmp_path, STAGE["track"], corrected)
    assert str(again.value) == str(caught.value)


def test_the_clip_may_begin_after_the_impact(drop: Drop) -> None:
    check_times(_corrected(drop, "events:\n- {event: impact, time_s: -0.09}\n"), {"side": [0.0, 0.1]})
    check_times(_corrected(drop, "frames:\n- {view: side, frames: [0, 1], exclude: true}\n"), {"side": [0.0, 0.1]})


@pytest.fixture
def tables(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A clip of 0.1 s with the impact at 0.02 s, 400 rows at 1000 px/m in air and 1050 px/m through water."""
    write_table(tmp_path, "frames", new_table("frames", {"view": ["side"] * 2, "frame": [0, 1], "time_s": [0.0, 0.1]}))
    geometry = {"view": ["side"], "impact_time_s": [0.02], "scale_px_per_m": [1000.0], "scale_water_px_per_m": [1050.0]}
    write_table(tmp_path, "geometry", new_table("geometry", geometry))
    monkeypatch.setattr("wentry_cli.runner.in_clip._picture_rows", lambda drop: 400)
    return tmp_path


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            "{event: pinch_off, t_s: 0.081}",
            "2:22: error: events.0.t_s: 0.081 s lies behind the end of",
        ),
        (
            "{event: pinch_off, t_s: 0.07, y_m: -0.41}",
            "events.0.y_m: -0.41 m is not in the picture, which is 0.4 m",
        ),
        ("{event: pinch_off, t_s: 0.08, y_m: -0.39}", ""),
    ],
)
def test_an_event_against_clip_and_picture(drop: Drop, tables: Path, text: str, expected: str) -> None:
    corrected = _corrected(drop, f"events:\n- {text}\n")
    if not expected:
        check_before(tables, STAGE["cavity"], corrected)
        return
    with pytest.raises(ConfigurationError) as caught:
        check_before(tables, STAGE["cavity"], corrected)
    assert expected in str(caught.value)


def test_a_height_against_the_picture(drop: Drop, tables: Path) -> None:
    check_heights(tables, _corrected(drop, "frames:\n- {view: side, frames: [1, 1], y_b_m: -0.39}\n"))
    with pytest.raises(ConfigurationError, match=r":2:32: error: frames\.0\.y_b_m: -3 m is not in the picture"):
        check_heights(tables, _corrected(drop, "frames:\n- {view: side, frames: [1, 1], y_b_m: -3}\n"))


def test_a_value_by_hand_without_uncertainty_is_good_to_a_pixel(tmp_path: Path) -> None:
    side = {"frame": [0, 1, 2], "stretch": 1.0, "stretch_unc": 1e-4, "y_b_m": 0.1, "y_b_m_unc": 1e-5, "status": "ok"}
    write_table(tmp_path, "side", new_table("side", side))
    geometry = {"view": ["side"], "scale_px_per_m": [2000.0], "radius_px": [50.0]}
    write_table(tmp_path, "geometry", new_table("geometry", geometry))
    for frame, values in ((1, {"stretch": 1.2, "y_b_m": 0.2, "y_b_m_unc": 1e-3}), (2, {"y_b_m": 0.3})):
        correct_frames(tmp_path, FrameCorrection(view="side", frames=(frame, frame), **values))
    table = read_table(tmp_path, "side")
    assert table["stretch_unc"].tolist() == pytest.approx([1e-4, 1.0 / 50.0, 1e-4])
    assert table["y_b_m_unc"].tolist() == pytest.approx([1e-5, 1e-3, 1.0 / 2000.0])
    assert table["y_b_m_unc_random"].tolist() == pytest.approx([math.nan, 1e-3, 1.0 / 2000.0], nan_ok=True)
    assert table["stretch_unc_random"].tolist() == pytest.approx([math.nan, 1.0 / 50.0, math.nan], nan_ok=True)


@pytest.mark.parametrize(("said", "expected"), [({}, 1.0 / 2000.0), ({"separation_y_m_unc": 5e-4}, 5e-4)])
def test_a_separation_line_by_hand_has_an_uncertainty(tmp_path: Path, said: dict[str, float], expected: float) -> None:
    """Also in a frame in which none was measured."""
    side = {"frame": [0, 1], "separation_y_m": [math.nan, -0.2], "separation_y_m_unc": [math.nan, 1e-5], "status": "ok"}
    write_table(tmp_path, "side", new_table("side", side))
    geometry = {"view": ["side"], "scale_px_per_m": [2000.0], "radius_px": [50.0]}
    write_table(tmp_path, "geometry", new_table("geometry", geometry))
    correct_frames(tmp_path, FrameCorrection(view="side", frames=(0, 0), separation_y_m=-0.1, **said))
    table = read_table(tmp_path, "side")
    assert table["separation_y_m"].tolist() == [-0.1, -0.2]
    assert table["separation_y_m_unc"].tolist() == pytest.approx([expected, 1e-5])


@pytest.mark.parametrize(
    ("said", "time_unc", "height_unc"),
    [("", 0.25e-3, 1.0 / 2000.0), (", t_s_unc: 1e-5, y_m_unc: 0.002", 1e-5, 0.002)],
)
def test_an_event_by_hand_without_uncertainty_is_good_to_half_a_frame_and_a_pixel(
    drop: Drop, tmp_path: Path, said: str, time_unc: float, height_unc: float
) -> None:
    geometry = {"view": ["side"], "fps": [2000.0], "scale_px_per_m": [2000.0], "radius_px": [50.0]}
    write_table(tmp_path, "geometry", new_table("geometry", geometry))
    measured = {"event": ["impact", "pinch_off"], "index": [1, 1], "t_s": [0.0, 0.08], "t_s_unc": 1e-5}
    write_table(tmp_path, "events", new_table("events", measured | {"y_m": [0.0, -0.1], "status": "ok"}))
    corrected = _corrected(drop, f"events:\n- {{event: pinch_off, t_s: 0.09, y_m: -0.12{said}}}\n")
    apply_corrections(tmp_path, STAGE["cavity"], corrected)
    row = read_table(tmp_path, "events").set_index("event").loc["pinch_off"]
    assert row[["t_s", "y_m", "status"]].tolist() == [0.09, -0.12, "manual"]
    assert row[["t_s_unc", "y_m_unc"]].tolist() == pytest.approx([time_unc, height_unc])


@pytest.mark.parametrize(("said", "expected"), [("", 0.25e-3), (", t_s_unc: 2e-5", 2e-5)])
def test_an_impact_by_hand_is_good_to_half_a_frame(drop: Drop, tmp_path: Path, said: str, expected: float) -> None:
    geometry = {"view": ["side"], "fps": [2000.0], "impact_time_s": [0.02], "impact_time_s_unc": [1e-6]}
    write_table(tmp_path, "geometry", new_table("geometry", geometry))
    corrected = _corrected(drop, f"events:\n- {{event: impact, time_s: 0.021{said}}}\n")
    apply_corrections(tmp_path, STAGE["track"], corrected)
    assert read_table(tmp_path, "geometry")["impact_time_s_unc"].tolist() == pytest.approx([expected])
