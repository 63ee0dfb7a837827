from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.stages.rendered import SIDE, change, render
from wentry_cli.config.campaign import read_drop
from wentry_cli.errors import ConfigurationError, InputError
from wentry_cli.frames.reader import RecordingInfo
from wentry_cli.stages import ingest
from wentry_cli.stages.inputs.agreement import check_view
from wentry_cli.tables import read_table

CLIP = {"before_s": 0.002, "longest_s": 0.006}


@pytest.fixture
def drop(tmp_path: Path) -> Path:
    return render(tmp_path / "drop", clip=CLIP)


def test_a_row_per_frame_with_times_and_levels(drop: Path, tmp_path: Path) -> None:
    ingest.run(tmp_path / "out", read_drop("drop", drop))
    frames = read_table(tmp_path / "out", "frames")
    count = len(list((drop / "side").iterdir()))
    assert list(frames.frame) == list(range(count))
    assert frames.time_s.to_numpy() == pytest.approx(np.arange(count) / 2000)
    assert frames.mean_level.between(100, 220).all()
    assert (frames.saturated_fraction == 0).all()
    assert set(frames.status) == {"ok"}


def test_a_gap_and_a_truncated_image_are_rows_and_told(
    drop: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    images = sorted((drop / "side").iterdir())
    images[3].unlink()
    images[5].write_bytes(images[5].read_bytes()[:400])
    ingest.run(tmp_path / "out", read_drop("drop", drop))
    frames = read_table(tmp_path / "out", "frames")
    assert list(frames.status[2:7]) == ["ok", "gap", "ok", "bad_frame", "ok"]
    assert f"frames of the side view cannot be read: 5 ({images[5].name}); they are left out" in caplog.text
    assert "frames of the side view are missing: 3 (number 4); they are left out" in caplog.text
    assert frames.mean_level.isna().sum() == 2
    assert frames.time_s.notna().all()


def test_damage_is_told_by_file_and_by_the_cameras_number(
    drop: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """The names of a camera seldom begin at 0: the file that has the frame's index is a healthy one."""
    for number, image in reversed(list(enumerate(sorted((drop / "side").iterdir())))):
        image.rename(image.with_name(f"shot_{number + 10:04d}.png"))
    (drop / "side" / "shot_0013.png").unlink()
    (drop / "side" / "shot_0015.png").write_bytes((drop / "side" / "shot_0015.png").read_bytes()[:400])
    (drop / "side" / "shot_0017.png").write_bytes((drop / "side" / "shot_0016.png").read_bytes())
    ingest.run(tmp_path / "out", read_drop("drop", drop))
    assert "cannot be read: 5 (shot_0015.png); they are left out" in caplog.text
    assert "are missing: 3 (number 13); they are left out" in caplog.text
    assert "bit by bit, first frame 7 (number 17), which" in caplog.text


def test_both_views_share_the_clock(tmp_path: Path) -> None:
    top = {"width": 160, "height": 160, "scale_px_per_m": 900.0}
    folder = render(tmp_path / "drop", clip=CLIP, top=top)
    text = (folder / "experiment.yaml").read_text(encoding="utf-8")
    (folder / "experiment.yaml").write_text(text.replace("source: top", "source: top\n    offset_s: 0.0125"))
    ingest.run(tmp_path / "out", read_drop("drop", folder))
    frames = read_table(tmp_path / "out", "frames")
    assert frames[frames.view == "side"].time_s.iloc[0] == 0.0
    assert frames[frames.view == "top"].time_s.iloc[0] == pytest.approx(0.0125)


@pytest.mark.parametrize("offset", [0.02, -0.1])
def test_views_that_are_far_apart_in_time_are_refused(tmp_path: Path, offset: float) -> None:
    folder = render(tmp_path / "drop", clip=CLIP, top={"width": 160, "height": 160, "scale_px_per_m": 900.0})
    change(folder, "top", offset_s=offset)
    with pytest.raises(
        ConfigurationError, match=rf"experiment\.yaml:\d+:\d+: error: views\.top\.offset_s: {offset} s puts"
    ):
        ingest.run(tmp_path / "out", read_drop("drop", folder))
    assert not (tmp_path / "out" / "frames.csv").exists()


@pytest.mark.parametrize(("row", "refused"), [(199.0, False), (201.0, True), (-150.0, False), (-201.0, True)])
def test_a_surface_far_from_the_picture_is_refused(drop: Path, tmp_path: Path, row: float, refused: bool) -> None:
    """The view has 200 rows; a clip under water shows no surface, which then lies above the picture."""
    change(drop, surface_y_px=row, roi_px=[0, 0, 150, 200])
    if refused:
        with pytest.raises(ConfigurationError, match=r"views\.side\.surface_y_px: .* rows are 0 to 199"):
            ingest.run(tmp_path / "out", read_drop("drop", drop))
    else:
        ingest.run(tmp_path / "out", read_drop("drop", drop))


def test_an_exposure_against_the_rate_of_the_header(tmp_path: Path) -> None:
    folder = render(tmp_path / "drop", clip=CLIP, side=SIDE | {"format": "mraw", "bits": 12})
    change(folder, fps="from_header", exposure_s=0.001)
    with pytest.raises(ConfigurationError, match=r"views\.side\.exposure_s: 0\.001 s is longer than a frame at 2000"):
        ingest.run(tmp_path / "out", read_drop("drop", folder))


def test_raw_recordings_are_sampled_by_strips(tmp_path: Path) -> None:
    folder = render(tmp_path / "drop", clip=CLIP, side=SIDE | {"format": "mraw", "bits": 12})
    ingest.run(tmp_path / "out", read_drop("drop", folder))
    frames = read_table(tmp_path / "out", "frames")
    assert set(frames.status) == {"ok"}
    assert frames.mean_level.between(1500, 3600).all()


def test_a_missing_rate_says_what_to_set(drop: Path, tmp_path: Path) -> None:
    change(drop, fps="from_header")
    with pytest.raises(ConfigurationError, match=r"views\.side\.fps"):
        ingest.run(tmp_path / "out", read_drop("drop", drop))
    assert not (tmp_path / "out" / "frames.csv").exists()


def test_frames_and_region_are_those_of_the_configuration(drop: Path, tmp_path: Path) -> None:
    change(drop, frames=[2, 8], roi_px=[10, 0, 150, 200])
    ingest.run(tmp_path / "out", read_drop("drop", drop))
    frames = read_table(tmp_path / "out", "frames")
    assert list(frames.frame) == list(range(7))
    assert frames.camera_frame.iloc[0] == 3
    assert frames.time_s.iloc[0] == 0.0


def test_doubled_frames_are_said(drop: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    ingest.run(tmp_path / "out", read_drop("drop", drop))
    assert not caplog.records
    images = sorted((drop / "side").iterdir())
    for first, second in zip(images[:6:2], images[1:7:2], strict=True):
        second.write_bytes(first.read_bytes())
    ingest.run(tmp_path / "again", read_drop("drop", drop))
    assert f"drop: 3 of {len(images)} frames of the side view equal the frame before" in caplog.text
    status = read_table(tmp_path / "again", "frames").status
    assert list(status[:7]) == ["ok", "bad_frame"] * 3 + ["ok"]


def test_a_raw_frame_that_repeats_the_one_before_is_told_by_all_of_it(tmp_path: Path) -> None:
    """Strips stand for a raw frame; where they agree the whole frame decides."""
    folder = render(tmp_path / "drop", clip=CLIP, side=SIDE | {"format": "mraw", "bits": 16})
    raw = folder / "side.mraw"
    pixels = np.fromfile(raw, "<u2").reshape(-1, SIDE["height"], SIDE["width"])
    pixels[3] = pixels[2]
    pixels[5] = pixels[4]
    pixels[5, 0, 0] += 1
    pixels.tofile(raw)
    ingest.run(tmp_path / "out", read_drop("drop", folder))
    status = read_table(tmp_path / "out", "frames").status
    assert status[3] == "bad_frame"
    assert set(status.drop(3)) == {"ok"}


def test_what_a_recording_has_to_tell_is_told(drop: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    images = sorted((drop / "side").iterdir())
    images[3].with_name("side_3.png").write_bytes(images[3].read_bytes())
    ingest.run(tmp_path / "out", read_drop("drop", drop))
    assert "drop: views.side.source: 'side_3.png' has the number of" in caplog.text


@pytest.mark.parametrize(
    ("background", "told"),
    [("nothing.png", "no such file"), ("small.png", "is 10 x 10 pixels"), ("side", "is a folder, not an image")],
)
def test_a_background_that_does_not_fit_leaves_no_table(tmp_path: Path, background: str, told: str) -> None:
    folder = render(tmp_path / "drop", clip=CLIP)
    cv2.imwrite(str(folder / "small.png"), np.full((10, 10), 200, np.uint8))
    change(folder, "side", background=background)
    drop = read_drop("drop", folder)
    with pytest.raises(InputError, match=rf"views.side.background.*{told}"):
        ingest.run(tmp_path / "out", drop)
    assert not (tmp_path / "out" / "frames.csv").exists()


def test_an_exposure_of_the_header_that_outlasts_a_frame_is_refused(tmp_path: Path) -> None:
    folder = render(tmp_path / "drop", clip=CLIP)
    change(folder, "side", fps="from_header", exposure_s=None)
    drop = read_drop("drop", folder)
    opened = RecordingInfo(
        path=Path("a.cihx"), format="Photron", frame_count=9, width=64, height=64, bit_depth=8,
        fps=1000.0, fps_source="header", exposure_s=0.5,
    )  # fmt: skip
    with pytest.raises(InputError, match=r"claims an exposure of 0.5 s, longer than a frame at 1000"):
        check_view(drop, "side", opened)


@pytest.mark.parametrize(
    ("kind", "told"), [("JPEG images, 8 bit", True), ("video MJPG", True), ("video FFV1", False), ("TIFF", False)]
)
def test_levels_that_are_made_for_the_eye_are_told(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, kind: str, told: bool
) -> None:
    drop = read_drop("drop", render(tmp_path / "drop", clip=CLIP))
    info = RecordingInfo(
        path=Path("a"), format=kind, frame_count=9, width=64, height=64, bit_depth=8,
        fps=1000.0, fps_source="given", exposure_s=None,
    )  # fmt: skip
    ingest.tell_notes(drop, "side", info)
    assert ("usually not linear in the light" in caplog.text) is told
