"""Faults of recordings and configurations: what is an error, what is a status, and what is left behind."""

from __future__ import annotations

import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.cli.conftest import Command
from wentry_cli.tables import read_table


def _frames(video: Path) -> list[Path]:
    return sorted((video / "side").iterdir())


def _lines(video: Path) -> list[str]:
    return (video / "experiment.yaml").read_text().splitlines()


def _edit(video: Path, old: str, new: str) -> None:
    path = video / "experiment.yaml"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def _repaint(paths: list[Path], source: Path) -> None:
    for path in paths:
        if path != source:
            shutil.copyfile(source, path)


def test_the_small_drop_is_sound(wentry: Command, video: Path, tmp_path: Path) -> None:
    done = wentry("run", video, "-o", tmp_path / "r")
    assert done.code == 0, done.err
    summary = read_table(tmp_path / "r", "summary").iloc[0]
    assert summary["impact_speed_m_s"] == pytest.approx(3.0, abs=0.02)
    assert summary["seal_type"] == "deep_seal"


def test_empty_source_folder(wentry: Command, video: Path, tmp_path: Path) -> None:
    for path in _frames(video):
        path.unlink()
    done = wentry("process", video, "-o", tmp_path / "r")
    assert done.code == 4
    assert str(video / "side") in done.err
    assert not list((tmp_path / "r").rglob("*.csv"))


def test_frames_of_different_sizes(wentry: Command, video: Path, tmp_path: Path) -> None:
    odd = _frames(video)[5]
    cv2.imwrite(str(odd), np.zeros((10, 12), np.uint8))
    done = wentry("process", video, "-o", tmp_path / "r")
    assert done.code == 4
    assert odd.name in done.err
    assert not list((tmp_path / "r").rglob("*.csv"))


def test_results_among_the_frames_are_refused(wentry: Command, video: Path) -> None:
    before = sorted((video / "side").iterdir())
    done = wentry("process", video, "-o", video / "side" / "results")
    assert done.code == 4
    assert "lies among the frames" in done.err
    assert [path for path in sorted((video / "side").iterdir()) if path.suffix == ".png"] == before


@pytest.mark.parametrize(
    ("source", "results", "told"),
    [
        ("side", "side", "lies among the frames of"),
        (".", ".", "the results of video would lie beside its experiment.yaml"),
        (".", "results", ""),
        ('"side_*.png"', ".", "the results of video would lie beside its experiment.yaml"),
        ('"side_*.png"', "results", ""),
        ('"side_*.png"', "..", "the tables of video would lie beside its experiment.yaml"),
        ("side", "..", "the tables of video would lie beside its experiment.yaml"),
        ("side", ".", "the results of video would lie beside its experiment.yaml"),
        ("side", "results", ""),
        ("side", "../results", ""),
    ],
)
def test_nothing_is_written_among_frames(wentry: Command, video: Path, source: str, results: str, told: str) -> None:
    """Nor beside experiment.yaml; a folder of its own in that of the drop does no harm where frames have theirs."""
    drop = video.rename(video.parent / "video") if video.name != "video" else video
    if source != "side":
        for path in (drop / "side").iterdir():
            path.rename(drop / path.name)
        (drop / "side").rmdir()
    experiment = drop / "experiment.yaml"
    experiment.write_text(experiment.read_text().replace("source: side", f"source: {source}"))
    before = sorted(drop.parent.rglob("*"))
    done = wentry("process", drop, "-o", drop / results, "--until", "ingest")
    assert done.code == (4 if told else 0), done.err
    assert told in done.err
    if told:
        assert done.err.endswith("choose another folder with -o\n")
        assert sorted(drop.parent.rglob("*")) == before


def test_a_gap_is_a_row(wentry: Command, video: Path, tmp_path: Path) -> None:
    _frames(video)[40].unlink()
    done = wentry("process", video, "-o", tmp_path / "r")
    assert done.code == 0, done.err
    for name in ("frames", "side"):
        table = read_table(tmp_path / "r" / "small", name)
        assert table.loc[40, "status"] == "gap"
        assert (table["frame"] == np.arange(len(table))).all()
    assert np.isnan(read_table(tmp_path / "r" / "small", "side").loc[40, "y_b_m"])


def test_a_truncated_image_is_a_row(wentry: Command, video: Path, tmp_path: Path) -> None:
    broken = _frames(video)[40]
    broken.write_bytes(broken.read_bytes()[:300])
    done = wentry("process", video, "-o", tmp_path / "r")
    assert done.code == 0, done.err
    assert read_table(tmp_path / "r" / "small", "frames").loc[40, "status"] == "bad_frame"
    assert read_table(tmp_path / "r" / "small", "side").loc[40, "status"] == "bad_frame"


def test_an_empty_file_is_told_by_its_header_alone(wentry: Command, video: Path) -> None:
    (first, *_) = _frames(video)
    first.write_bytes(b"")
    done = wentry("check", video)
    assert done.code == 0, done.err
    assert f"(1 cannot be read: {first.name})" in done.out


@pytest.mark.parametrize(("height", "told"), [(1.5, False), (4.5, True)])
def test_a_height_that_few_rooms_have_is_asked_after(
    wentry: Command, video: Path, caplog: pytest.LogCaptureFixture, height: float, told: bool
) -> None:
    done = wentry("check", video, "--set", f"drop.height_m={height}")
    assert done.code == 0, done.err
    asked = "--set drop.height_m: warning: drop.height_m: 4.5 m is higher than most rooms and gives 9.4 m/s at impact"
    assert (asked in caplog.text) is told


def test_a_sphere_that_is_larger_than_the_picture_is_a_mistake_of_the_scale(wentry: Command, video: Path) -> None:
    _edit(video, "source: side", "source: side\n    scale_px_per_m: 20000")
    line = next(number for number, text in enumerate(_lines(video), 1) if "scale_px_per_m: 20000" in text)
    height, width = cv2.imread(str(_frames(video)[0]), 0).shape
    for command in ("check", "process"):
        done = wentry(command, video)
        assert done.code == 3
        assert f"{video / 'experiment.yaml'}:{line}:5: error: views.side.scale_px_per_m: 20000 makes" in done.err
        assert f"the picture is {width} x {height} px; correct the scale or sphere.diameter_m" in done.err


def test_a_video_without_a_sphere(wentry: Command, video: Path, tmp_path: Path) -> None:
    paths = _frames(video)
    rng = np.random.default_rng(3)
    empty = np.full(cv2.imread(str(paths[0]), 0).shape, 180.0)
    for path in paths:
        cv2.imwrite(str(path), np.clip(empty + rng.normal(0, 2, empty.shape), 0, 255).astype(np.uint8))
    done = wentry("process", video, "-o", tmp_path / "r")
    assert done.code == 5
    side = read_table(tmp_path / "r" / "small", "side")
    assert len(side) == len(paths)
    assert set(side["status"]) == {"no_object"}
    assert side["y_b_m"].isna().all()


def test_a_sphere_that_never_reaches_the_water(wentry: Command, video: Path, tmp_path: Path) -> None:
    paths = _frames(video)
    for path in paths[14:]:
        path.unlink()
    done = wentry("process", video, "-o", tmp_path / "r")
    assert done.code == 5, done.err
    assert "small" in done.err
    side = read_table(tmp_path / "r" / "small", "side")
    assert len(side) == 14
    assert read_table(tmp_path / "r" / "small", "geometry").iloc[0].isna()["impact_time_s"]


def test_a_sphere_that_leaves_the_frame(wentry: Command, video: Path, tmp_path: Path) -> None:
    _edit(video, "    source: side\n", "    source: side\n    roi_px: [0, 0, 240, 230]\n")
    done = wentry("run", video, "-o", tmp_path / "r")
    assert done.code == 0, done.err
    side = read_table(tmp_path / "r" / "small", "side")
    assert side["status"].iloc[-1] in ("out_of_frame", "no_object")
    assert side.loc[side["status"] == "out_of_frame", "y_b_m"].isna().all()
    assert (side["status"] == "ok").sum() > 20


def test_a_clip_that_ends_before_pinch_off(wentry: Command, video: Path, tmp_path: Path) -> None:
    for path in _frames(video)[60:]:
        path.unlink()
    done = wentry("run", video, "-o", tmp_path / "r")
    assert done.code == 0, done.err
    events = read_table(tmp_path / "r" / "small", "events").set_index("event")
    assert events.loc["pinch_off", "status"] == "clip_ended"
    assert np.isnan(events.loc["pinch_off", "t_s"])
    assert np.isnan(read_table(tmp_path / "r", "summary").iloc[0]["t_p_s"])


def test_colour_frames_are_measured_as_grey(wentry: Command, video: Path, tmp_path: Path) -> None:
    plain = wentry("process", video, "-o", tmp_path / "grey", "--until", "track")
    for path in _frames(video):
        cv2.imwrite(str(path), cv2.cvtColor(cv2.imread(str(path), 0), cv2.COLOR_GRAY2BGR))
    colour = wentry("process", video, "-o", tmp_path / "colour", "--until", "track")
    assert (plain.code, colour.code) == (0, 0)
    grey, other = (read_table(tmp_path / name / "small", "side")["y_b_m"] for name in ("grey", "colour"))
    np.testing.assert_allclose(other, grey, atol=2e-5)


def test_no_frame_rate(wentry: Command, video: Path, tmp_path: Path) -> None:
    _edit(video, "fps: 1000.0", "fps: from_header")
    done = wentry("process", video, "-o", tmp_path / "r")
    assert done.code == 3
    assert "views.side.fps" in done.err
    assert not list((tmp_path / "r").rglob("*.csv"))


def test_a_missing_frame_rate_of_each_view_has_its_place_and_its_drop(wentry: Command, video: Path) -> None:
    shutil.copytree(video / "side", video / "top")
    _edit(video, "fps: 1000.0", "fps: from_header")
    _edit(video, "views:", "views:\n  top: {source: top}")
    lines = [line for line in wentry("check", video).err.splitlines() if "fps" in line]
    assert [line.split(" ")[:2] for line in lines] == [
        ["small:", f"{video / 'experiment.yaml'}:{place}:"] for place in ("15:5", "12:3")
    ]


def test_corrections_that_the_clip_cannot_have(wentry: Command, video: Path, tmp_path: Path) -> None:
    """`check` tells what `process` would; what was excluded is missing, and too much of it is exit 5."""
    corrections = video / "corrections.yaml"
    corrections.write_text("events:\n- {event: impact, time_s: 500}\n")
    for done in (wentry("check", video), wentry("process", video, "-o", tmp_path / "r")):
        assert done.code == 3
        assert f"{corrections}:2:19: error: events.0.time_s: 500 s is not in the clip" in done.err
    assert not (tmp_path / "r" / "small" / "side.csv").exists()
    corrections.write_text(f"frames:\n- {{view: side, frames: [0, {len(_frames(video)) - 1}], exclude: true}}\n")
    done = wentry("process", video, "-o", tmp_path / "r")
    assert done.code == 5
    assert "leaves only 0 frames of small, 12 are needed; exclude fewer" in done.err
    assert set(read_table(tmp_path / "r" / "small", "side")["status"]) == {"manual"}
    corrections.write_text("events:\n- {event: pinch_off, t_s: 0.02, y_m: -0.9}\n")
    done = wentry("process", video, "-o", tmp_path / "r")
    assert done.code == 3
    assert f"{corrections}:2:33: error: events.0.y_m: -0.9 m is not in the picture, which is 0.4" in done.err
    corrections.unlink()
    assert wentry("process", video, "-o", tmp_path / "r").code == 0


def test_one_broken_drop_stops_no_other(wentry: Command, video: Path, tmp_path: Path) -> None:
    shutil.copytree(video, video.parent / "broken")
    shutil.copytree(video, video.parent / "misspelt")
    for path in _frames(video.parent / "broken"):
        path.write_bytes(b"")
    _edit(video.parent / "misspelt", "diameter_m", "diametre_m")
    done = wentry("run", video.parent, "-o", tmp_path / "r")
    assert done.code == 6
    assert "did you mean diameter_m?" in done.err
    assert "2 of 3 drops failed: misspelt, broken" in done.err
    assert read_table(tmp_path / "r", "summary")["drop"].tolist() == ["small"]
    assert (tmp_path / "r" / "report.html").is_file()
    # the report shows what there is, so it has done its work; it names what it lacks
    done = wentry("report", tmp_path / "r")
    assert done.code == 0
    told = done.err.splitlines()
    assert told[0].startswith(
        f"broken: not complete: ingest: {video.parent / 'broken' / 'side'}: not one of the images"
    )
    assert told[1].startswith(f"misspelt: not complete: configuration: {video.parent / 'misspelt'}")
    assert told[-1].startswith(f"{tmp_path / 'r' / 'report.html'} and ")
    assert "complete" not in wentry("report", tmp_path / "r", "--drop", "small").err
    assert wentry("report", tmp_path / "r", "-q").err == ""


def test_a_report_before_the_fit_says_what_it_lacks(wentry: Command, video: Path, tmp_path: Path) -> None:
    assert wentry("process", video, "-o", tmp_path / "r").code == 0
    done = wentry("report", tmp_path / "r")
    assert done.code == 0
    assert "small: not complete: summary: stage summary has not run; run `wentry fit` first\n" in done.err


def test_one_process_or_two_give_the_same_bytes(wentry: Command, video: Path, tmp_path: Path) -> None:
    shutil.copytree(video, video.parent / "second")
    assert wentry("process", video.parent, "-o", tmp_path / "one", "-j", "1").code == 0
    assert wentry("process", video.parent, "-o", tmp_path / "two", "-j", "2").code == 0
    tables = sorted(path.relative_to(tmp_path / "one") for path in (tmp_path / "one").rglob("*.csv"))
    assert len(tables) == 14
    for table in tables:
        assert (tmp_path / "one" / table).read_bytes() == (tmp_path / "two" / table).read_bytes(), table


def test_a_second_run_decodes_no_frame(
    wentry: Command, video: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert wentry("process", video, "-o", tmp_path / "r").code == 0

    def refuse(*_: object, **__: object) -> None:
        raise AssertionError("a frame was decoded")

    for name in ("imread", "imdecode"):
        monkeypatch.setattr(cv2, name, refuse)
    done = wentry("process", video, "-o", tmp_path / "r", "-v")
    assert done.code == 0, done.err
    assert done.err.count("fresh") == 4


def test_a_source_that_is_not_there_is_told_with_its_key_and_what_lies_there(wentry: Command, video: Path) -> None:
    (video / "overhead").mkdir()
    for words in (("check", video), ("process", video, "-o", video.parent.parent / "results")):
        done = wentry(*words, "--set", "views.side.source=sid2")
        assert done.code == 4
        told = "--set views.side.source: error: views.side.source: "
        assert f"{told}{video / 'sid2'}: no such file or folder; did you mean 'side'? in" in done.err
        assert "lie experiment.yaml, overhead, side" in done.err
    _edit(video, "source: side", "source: sid2")
    place = f"{video / 'experiment.yaml'}:{next(k for k, line in enumerate(_lines(video), 1) if 'source:' in line)}:5"
    assert wentry("check", video).err.startswith(
        f"{video.name}: {place}: error: views.side.source: {video / 'sid2'}: no such file"
    )


def test_a_region_outside_of_the_picture_is_a_mistake_of_the_configuration(wentry: Command, video: Path) -> None:
    done = wentry("check", video, "--set", "views.side.roi_px=[0, 0, 241, 400]")
    assert done.code == 3
    assert done.err.startswith(
        f"{video.name}: --set views.side.roi_px: error: views.side.roi_px: [0, 0, 241, 400] is not"
    )


def test_a_picture_that_is_turned_is_asked_after(wentry: Command, video: Path, tmp_path: Path) -> None:
    for number, (given, told) in enumerate(
        {
            "rotate=90": "rotate, flip",
            "polarity=bright": "polarity",
            "frames=[0, 13]": "views.side.frames [0, 13]",
        }.items()
    ):
        done = wentry("process", video, "-o", tmp_path / str(number), "--set", f"views.side.{given}")
        assert done.code == 5, (given, done.err)
        assert told in done.err
