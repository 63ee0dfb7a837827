from __future__ import annotations

import shutil
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import pytest

from tests.stages.rendered import SIDE, change, errors_px, measure, render, truth
from wentry_cli.comparison.campaign import compare
from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.errors import InputError, TooFewMeasurementsError
from wentry_cli.stages import kinematics, stretch, summary
from wentry_cli.stages.track import side as side_view
from wentry_cli.stages.track.side_result import _without_impossible
from wentry_cli.tables import has_table, read_table
from wentry_cli.tracking.prediction import Path as Prediction

CLEAN_Y_B_PX = 0.05
CLEAN_STRETCH = 6e-4
NUMBERS = ["center_x_px", "center_y_px", "radius_px", "bottom_y_px", "bottom_y_px_unc", "y_b_m", "y_b_m_unc"]


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


@pytest.fixture(scope="module")
def soft(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    base = tmp_path_factory.mktemp("soft")
    top = {"width": 176, "height": 176, "scale_px_per_m": 1000.0, "camera_distance_m": 1.5}
    folder = render(base / "drop", top=top)
    _, error = measure(folder, base / "out")
    assert error is None
    return folder, base / "out"


def test_a_clean_drop_is_measured_to_a_twentieth_of_a_pixel(soft: tuple[Path, Path]) -> None:
    found = errors_px(*soft)
    assert np.count_nonzero(~found["ok"]) <= 2  # of 58: the first two below the surface, in the blur of its band
    assert rms(found["y_b"][found["ok"]]) < CLEAN_Y_B_PX
    late = found["ok"] & (np.arange(found["ok"].size) > 17)  # short arcs just after impact are known less well
    assert rms(found["stretch"][late]) < CLEAN_STRETCH


def test_scale_surface_and_impact(soft: tuple[Path, Path]) -> None:
    _, said = truth(soft[0])
    side = read_table(soft[1], "geometry").set_index("view").loc["side"]
    assert side.scale_px_per_m == pytest.approx(said["scale_px_per_m"], rel=1e-3)
    assert side.scale_water_px_per_m == side.scale_px_per_m
    assert abs(side.surface_y_px - said["surface_y_px"]) < 3 * side.surface_y_px_unc
    assert abs(side.impact_time_s - said["impact_time_s"]) < 3 * side.impact_time_s_unc + 1e-5
    assert side.radius_px == pytest.approx(0.0255 * said["scale_px_per_m"], rel=1e-3)


def test_a_row_is_ok_only_where_its_values_are_filled(soft: tuple[Path, Path]) -> None:
    side = read_table(soft[1], "side")
    good = side[side.status == "ok"]
    assert good[[*NUMBERS, "stretch", "stretch_unc"]].notna().all(axis=None)
    assert side[side.status != "ok"][[*NUMBERS, "stretch"]].isna().all(axis=None)
    assert set(good.y_b_source) <= {"local", "ellipse"}
    assert good.separation_y_px.notna().sum() > 5
    assert good[good.t_s < 0].separation_y_px.isna().all()


def test_the_separation_line_says_how_well_it_is_known(soft: tuple[Path, Path]) -> None:
    """In metres at least as badly as in pixels, and ``wentry compare`` states its pull."""
    side = read_table(soft[1], "side")
    line = side.dropna(subset=["separation_y_m"])
    scale = read_table(soft[1], "geometry").set_index("view").loc["side"].scale_water_px_per_m
    assert line.separation_y_m_unc.notna().all()
    assert side[side.separation_y_m.isna()].separation_y_m_unc.isna().all()
    assert (line.separation_y_m_unc >= line.separation_y_px_unc / scale).all()
    assert (line.separation_y_m_unc < 2.0 * line.separation_y_px_unc / scale + 1e-4).all()
    (soft[1] / "drop.json").write_text("{}")
    (found,) = [item for item in compare(soft[1].parent, soft[0]) if item.quantity == "separation_y_m"]
    assert 0.2 < found.errors.pull < 2.0


def test_the_top_view_shares_the_impact(soft: tuple[Path, Path]) -> None:
    known, _ = truth(soft[0])
    top = read_table(soft[1], "top")
    good = (top.status == "ok").to_numpy()
    assert good.sum() >= 12
    error = (top.stretch - known.stretch.iloc[: len(top)]).to_numpy(float)[good]
    assert rms(error) < 1e-3
    assert top.t_s.to_numpy() == pytest.approx(read_table(soft[1], "side").t_s.to_numpy()[: len(top)])


def test_the_same_input_gives_the_same_bytes(soft: tuple[Path, Path], tmp_path: Path) -> None:
    measure(soft[0], tmp_path)
    for name in ("frames", "geometry", "side", "top"):
        assert (tmp_path / f"{name}.csv").read_bytes() == (soft[1] / f"{name}.csv").read_bytes()


def test_a_rigid_sphere_has_no_stretch(tmp_path: Path) -> None:
    folder = render(tmp_path / "drop", sphere={"diameter_m": 0.051})
    _, error = measure(folder, tmp_path / "out")
    assert error is None
    assert read_table(tmp_path / "out", "side").stretch.isna().all()
    assert not has_table(tmp_path / "out", "top")
    found = errors_px(folder, tmp_path / "out")
    assert found["ok"].mean() >= 0.98
    assert rms(found["y_b"][found["ok"]]) < CLEAN_Y_B_PX


def test_a_wall_before_the_water_is_found(tmp_path: Path) -> None:
    folder = render(tmp_path / "drop", switches={"wet_scale": 1.05}, clip={"before_s": 0.006, "longest_s": 0.045})
    measure(folder, tmp_path / "out")
    side = read_table(tmp_path / "out", "geometry").iloc[0]
    assert abs(side.scale_water_px_per_m / (1.05 * 900) - 1) < 3 * side.scale_water_px_per_m_unc / (1.05 * 900)
    assert side.scale_water_px_per_m == pytest.approx(1.05 * 900, rel=2e-3)
    found = errors_px(folder, tmp_path / "out")
    assert found["ok"].mean() >= 0.9
    assert rms(found["y_b"][found["ok"]]) < 2 * CLEAN_Y_B_PX


def test_a_rigid_sphere_behind_a_wall_is_measured_with_the_scale_of_the_water(tmp_path: Path) -> None:
    sphere = {"diameter_m": 0.051, "material": "rigid"}
    side = {"width": 288, "height": 480, "scale_px_per_m": 2400.0, "surface_y_px": 150.25}  # 3.7 px of radius apart
    clip = {"before_s": 0.006, "longest_s": 0.035}
    folder = render(tmp_path / "drop", sphere=sphere, side=side, switches={"wet_scale": 1.06}, clip=clip)
    drop, error = measure(folder, tmp_path / "out")
    assert error is None
    assert not drop.experiment.deformable
    geometry = read_table(tmp_path / "out", "geometry").iloc[0]
    said = truth(folder)[1]
    assert geometry.scale_water_px_per_m == pytest.approx(said["scale_water_px_per_m"], rel=1e-3)
    found = errors_px(folder, tmp_path / "out")
    assert found["ok"].mean() > 0.95
    assert np.sqrt(np.nanmean(found["y_b"][found["ok"]] ** 2)) < 0.1


def test_a_drop_on_a_plate(tmp_path: Path) -> None:
    side = SIDE | {"surface_y_px": 200.375}
    folder = render(tmp_path / "drop", kind="surface_impact", side=side)
    _, error = measure(folder, tmp_path / "out")
    assert error is None
    found = errors_px(folder, tmp_path / "out")
    assert found["ok"].all()
    assert rms(found["stretch"]) < CLEAN_STRETCH
    assert rms(found["y_b"]) < 2 * CLEAN_Y_B_PX
    assert read_table(tmp_path / "out", "side").separation_y_px.isna().all()


def test_an_entry_that_is_called_a_drop_on_a_plate_is_refused(tmp_path: Path) -> None:
    folder = render(tmp_path / "drop", clip={"before_s": 0.02, "longest_s": 0.06})
    said = (folder / "experiment.yaml").read_text()
    (folder / "experiment.yaml").write_text(said.replace("kind: water_entry", "kind: surface_impact"))
    _, error = measure(folder, tmp_path / "out")
    assert isinstance(error, TooFewMeasurementsError)
    assert "check kind and views.side.surface_y_px" in str(error)


def _tilt_pulls(out: Path, tilt_deg: float) -> np.ndarray:
    side = read_table(out, "side")
    told = side[side.tilt_deg.notna()]
    assert (told.status == "ok").all()
    assert told.tilt_deg_unc.notna().all()
    assert side[abs(side.stretch - 1) < 0.003].tilt_deg.isna().all()
    return ((told.tilt_deg - tilt_deg) / told.tilt_deg_unc).to_numpy(float)


def test_a_tilted_sphere_tells_its_tilt_and_is_measured_all_the_same(tmp_path: Path) -> None:
    folder = render(tmp_path / "drop", switches={"tilt_deg": 5.0}, clip={"before_s": 0.006, "longest_s": 0.05})
    measure(folder, tmp_path / "out")
    pulls = _tilt_pulls(tmp_path / "out", 5.0)
    assert pulls.size > 30
    assert (np.abs(pulls) < 3).all()
    known, _ = truth(folder)
    side = read_table(tmp_path / "out", "side").iloc[: len(known)]
    good = (side.status == "ok").to_numpy()
    for name in ("stretch", "y_b_m"):
        off = ((side[name] - known[name]) / side[f"{name}_unc"]).to_numpy(float)[good]
        assert np.mean(np.abs(off) > 3) <= 0.02, name
    found = errors_px(folder, tmp_path / "out")
    assert rms(found["y_b"][found["ok"]]) < CLEAN_Y_B_PX


def test_a_tilted_sphere_on_a_plate(tmp_path: Path) -> None:
    side = SIDE | {"surface_y_px": 200.375}
    folder = render(tmp_path / "drop", kind="surface_impact", side=side, switches={"tilt_deg": 5.0})
    measure(folder, tmp_path / "out")
    found = errors_px(folder, tmp_path / "out")
    assert found["ok"].all()
    assert rms(found["stretch"]) < CLEAN_STRETCH
    assert (np.abs(_tilt_pulls(tmp_path / "out", 5.0)) < 3).all()


def test_a_free_flight_counts_from_its_first_frame(tmp_path: Path) -> None:
    folder = render(tmp_path / "drop", kind="free_flight", clip={"before_s": 0.0, "longest_s": 0.02})
    _, error = measure(folder, tmp_path / "out")
    assert error is None
    side = read_table(tmp_path / "out", "side")
    assert (side.status == "ok").all()
    assert side.t_s.iloc[0] == 0.0
    assert side.y_b_m.iloc[0] == pytest.approx(-0.0255, rel=2e-3)
    view = read_table(tmp_path / "out", "geometry").iloc[0]
    assert np.isnan(view.impact_time_s)
    assert np.isnan(view.scale_water_px_per_m)
    assert view.scale_source == "diameter"


def test_a_free_flight_may_be_filmed_as_the_top_view(tmp_path: Path) -> None:
    """The same recording under either name gives the same motion."""
    folder = render(tmp_path / "drop", kind="free_flight", clip={"before_s": 0.0, "longest_s": 0.02})
    measure(folder, tmp_path / "side")
    path = folder / "experiment.yaml"
    path.write_text(path.read_text().replace("side:", "top:"))
    drop, error = measure(folder, tmp_path / "top")
    assert error is None
    above = read_table(tmp_path / "top", "top")
    assert (above.status == "ok").all()
    assert above.t_s.iloc[0] == 0.0
    assert np.abs(above.stretch - 1.0).max() < 5e-3
    kinematics.run(tmp_path / "top", drop)
    motion = read_table(tmp_path / "top", "kinematics")
    assert motion.a_c_m_s2.iloc[0] == pytest.approx(-9.81, abs=3 * motion.a_c_m_s2_unc.iloc[0])


def test_light_that_the_sensor_clips_is_told(
    recordings: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    source = recordings / "photron" / "ball_12bit.cihx"
    (tmp_path / "experiment.yaml").write_text(
        f"kind: free_flight\nsphere: {{diameter_m: 0.0025}}\nviews: {{side: {{source: {source}}}}}\n"
    )
    measure(tmp_path, tmp_path / "out")
    assert "film with less light" in caplog.text


def test_the_top_view_alone_tells_the_impact(tmp_path: Path) -> None:
    top = {"width": 176, "height": 176, "scale_px_per_m": 1000.0}
    folder = render(tmp_path / "drop", side=None, top=top)
    measure(folder, tmp_path / "out")
    _, said = truth(folder)
    view = read_table(tmp_path / "out", "geometry").iloc[0]
    assert view["view"] == "top"
    assert abs(view.impact_time_s - said["impact_time_s"]) < 3 * view.impact_time_s_unc
    assert not has_table(tmp_path / "out", "side")


def test_a_scale_that_the_falling_sphere_contradicts_counts(tmp_path: Path) -> None:
    """Before impact λ is 1: a scale of the top view that is wrong by .4 % shows there, and is wrong later too."""
    top = {"width": 176, "height": 176, "scale_px_per_m": 1000.0, "camera_distance_m": 1.5}
    folder = render(tmp_path / "drop", top=top)
    change(folder, "top", scale_px_per_m=1004.0)
    measure(folder, tmp_path / "out")
    above, rows = read_table(tmp_path / "out", "top"), truth(folder)[0]
    seen = (above.status == "ok") & (above.t_s > 0.0)
    assert seen.sum() > 3
    error = (above.stretch - np.interp(above.t_s, rows["t_s"], rows["stretch"]))[seen]
    assert error.abs().median() > 2e-3
    assert (error.abs() < 3 * above.stretch_unc[seen]).all()


def test_an_uncertain_distance_of_the_camera_counts(tmp_path: Path) -> None:
    """λ is proportional to 1 − h/Z, so dλ/λ = h/Z dZ/Z; without a side view the time of contact is less sure too."""
    top = {"width": 176, "height": 176, "scale_px_per_m": 1000.0, "camera_distance_m": 1.5}
    folder = render(tmp_path / "drop", top=top)
    alone = render(tmp_path / "alone", side=None, top=top)
    for name, unc in (("sure", 0.0), ("unsure", 0.15)):
        for place in (folder, alone):
            change(place, "top", camera_distance_m_unc=unc)
            measure(place, tmp_path / name / place.name)
    times = [read_table(tmp_path / name / "alone", "geometry").impact_time_s_unc[0] for name in ("sure", "unsure")]
    assert times[1] > times[0]
    sure, unsure = (read_table(tmp_path / name / "drop", "top") for name in ("sure", "unsure"))
    added = np.sqrt(np.maximum(unsure.stretch_unc**2 - sure.stretch_unc**2, 0.0)) / sure.stretch
    deep = (sure.t_s > 0.02) & (sure.status == "ok")
    depth = 1.0 - 1.0 / pd.read_csv(folder / "truth" / "top.csv").magnification  # h/Z
    assert added[deep].max() == pytest.approx(0.1 * np.abs(depth[deep]).max(), rel=0.05)


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return render(tmp_path_factory.mktemp("short") / "drop", clip={"before_s": 0.006, "longest_s": 0.015})


def test_a_clip_that_ends_before_the_surface(short: Path, tmp_path: Path) -> None:
    change(short, frames=[0, 7])
    _, error = measure(short, tmp_path)
    change(short, frames=None)
    assert isinstance(error, TooFewMeasurementsError)
    side = read_table(tmp_path, "side")
    assert len(side) == 8
    assert side.center_y_px.notna().all()
    assert side.t_s.isna().all()
    assert (side.status == "not_identified").all()  # without the impact a row has no time


def test_a_video_without_a_sphere(tmp_path: Path) -> None:
    folder = render(tmp_path / "drop", clip={"before_s": 0.002, "longest_s": 0.01})
    for path in sorted((folder / "side").iterdir()):
        cv2.imwrite(str(path), np.full((260, 176), 180, np.uint8))
    _, error = measure(folder, tmp_path / "out")
    assert isinstance(error, TooFewMeasurementsError)
    assert "no sphere" in str(error)
    side = read_table(tmp_path / "out", "side")
    assert set(side.status) == {"no_object"}
    assert has_table(tmp_path / "out", "geometry")


def test_a_damaged_frame_is_a_row_and_the_path_goes_on(short: Path, tmp_path: Path) -> None:
    folder = tmp_path / "drop"
    folder.mkdir()
    (folder / "experiment.yaml").write_bytes((short / "experiment.yaml").read_bytes())
    (folder / "side").mkdir()
    for path in (short / "side").iterdir():
        (folder / "side" / path.name).write_bytes(path.read_bytes())
    images = sorted((folder / "side").iterdir())
    images[4].write_bytes(images[4].read_bytes()[:200])
    images[24].unlink()
    _, error = measure(folder, tmp_path / "out")
    assert error is None
    side = read_table(tmp_path / "out", "side")
    assert (side.status[4], side.status[24]) == ("bad_frame", "gap")
    assert (side.status[[3, 5, 23, 25]] == "ok").all()


def test_a_given_scale_and_surface_win(short: Path, tmp_path: Path) -> None:
    change(short, scale_px_per_m=905.0, surface_y_px=91.0)
    measure(short, tmp_path)
    change(short, scale_px_per_m="auto", surface_y_px="auto")
    side = read_table(tmp_path, "geometry").iloc[0]
    assert (side.scale_px_per_m, side.scale_water_px_per_m, side.surface_y_px) == (905.0, 905.0, 91.0)
    assert "given" in side.scale_source


def test_a_background_file_must_fit(short: Path, tmp_path: Path) -> None:
    cv2.imwrite(str(short / "empty.png"), np.full((10, 10), 180, np.uint8))
    change(short, background="empty.png")
    _, error = measure(short, tmp_path)
    change(short, background="auto")
    assert isinstance(error, InputError)
    assert "background" in str(error)


def test_a_table_of_frames_that_does_not_fit_the_recording(short: Path, tmp_path: Path) -> None:
    drop, _ = measure(short, tmp_path)
    frames = pd.read_csv(tmp_path / "frames.csv").iloc[:-1]
    frames.to_csv(tmp_path / "frames.csv", index=False)
    from wentry_cli.stages import track

    with pytest.raises(InputError, match="ingest"):
        track.run(tmp_path, drop)


def test_the_real_ball(recordings: Path, tmp_path: Path) -> None:
    source = recordings / "photron" / "ball_12bit.cihx"
    (tmp_path / "experiment.yaml").write_text(
        f"kind: free_flight\nsphere: {{diameter_m: 0.0025}}\nviews: {{side: {{source: {source}}}}}\n"
    )
    _, error = measure(tmp_path, tmp_path / "out")
    assert error is None
    side = read_table(tmp_path / "out", "side")
    assert (side.status == "ok").sum() == 15
    assert (2 * side.radius_px).between(125.5, 127.2).all()
    assert (side.stretch - 1).abs().max() < 0.005
    rows = np.polyfit(side.frame, side.center_y_px, 1)[0]
    assert rows == pytest.approx(2.647, abs=0.01)
    scale = read_table(tmp_path / "out", "geometry").scale_px_per_m.iloc[0]
    assert rows * 30000 / scale == pytest.approx(1.57, abs=0.02)


def test_a_stretch_that_no_sphere_can_have_is_never_ok(soft: tuple[Path, Path], tmp_path: Path) -> None:
    """A camera close above the water would see the falling sphere behind itself, and the sunken one tiny."""
    change(soft[0], "top", camera_distance_m=0.06)
    try:
        measure(soft[0], tmp_path / "out")
    finally:
        change(soft[0], "top", camera_distance_m=1.5)
    top = read_table(tmp_path / "out", "top")
    assert top.stretch.dropna().between(0.5, 3.0).all()
    assert top[top.status == "ok"].stretch.notna().all()
    assert set(top[top.radius_px.notna() & top.stretch.isna()].status) == {"not_identified"}
    side = {"frame": [0, 1, 2], "stretch": np.array([1.1, -9e7, 3.2]), "stretch_unc": np.full(3, 0.01)}
    found = _without_impossible(side | {"status": ["ok", "ok", "occluded"]})
    assert found["status"] == ["ok", "poor_fit", "occluded"]
    assert np.isnan(found["stretch"]).tolist() == np.isnan(found["stretch_unc"]).tolist() == [False, True, True]


def test_a_path_may_start_at_the_contact(
    soft: tuple[Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where the sampled frames show the sphere first as it touches the water, all before and after is followed too."""
    folder = soft[0]
    rows, said = truth(folder)
    touching = int(np.flatnonzero(rows["t_s"] > 0.0)[0])
    measure(folder, tmp_path / "usual")
    usual = read_table(tmp_path / "usual", "side")

    def at_contact(*_: object, **__: object) -> Prediction:
        path = Prediction(radius=said["scale_px_per_m"] * 0.0255)
        for frame in (touching, touching + 1):
            seen = usual.iloc[touching - 1]
            fallen = said["surface_y_px"] - said["scale_px_per_m"] * rows["y_c_m"][frame]
            path.add(frame, EllipseShape(seen["center_x_px"], fallen, path.radius))
        return path

    monkeypatch.setattr(side_view, "find_seed", at_contact)
    measure(folder, tmp_path / "late")
    late = read_table(tmp_path / "late", "side")
    assert list(late.status) == list(usual.status)
    np.testing.assert_allclose(late.stretch, usual.stretch, atol=1e-4)


def test_what_is_found_from_above_only_after_impact_is_doubted(
    soft: tuple[Path, Path], tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    folder, out = tmp_path / "drop", tmp_path / "out"
    shutil.copytree(soft[0], folder)
    measure(folder, out)
    assert "before impact, so what" not in caplog.text
    pictures = sorted((folder / "top").glob("*.png"))
    random = np.random.default_rng(1)
    for picture in pictures[:14]:  # in air
        cv2.imwrite(str(picture), random.normal(190.0, 2.0, (176, 176)).round().astype(np.uint8))
    measure(folder, out)
    assert (read_table(out, "top").status == "ok").any()
    assert "before impact, so what is found after it may be something else" in caplog.text


def test_a_faint_sphere_is_found_from_above(tmp_path: Path) -> None:
    top = {"width": 176, "height": 176, "scale_px_per_m": 1000.0, "camera_distance_m": 1.5, "lamp": {"dark": 0.65}}
    folder = render(tmp_path / "drop", top=top)
    _, error = measure(folder, tmp_path / "out")
    assert error is None
    table, (known, _) = read_table(tmp_path / "out", "top"), truth(folder)
    ok = (table.status == "ok").to_numpy()
    assert ok.mean() > 0.6
    off = (table.stretch - known.stretch[: len(table)])[ok]
    assert np.all(np.abs(off) < 5.0 * table.stretch_unc[ok])


@pytest.mark.parametrize(("angle_deg", "fall"), [(-4.0, "4.0 degrees to the right"), (3.0, "3.0 degrees to the left")])
def test_a_camera_that_is_not_level_is_told_and_corrected_for(
    soft: tuple[Path, Path], tmp_path: Path, caplog: pytest.LogCaptureFixture, angle_deg: float, fall: str
) -> None:
    """Heights, impact and speed are those above the surface, wherever in the picture the sphere is seen."""
    folder, out = tmp_path / "drop", tmp_path / "out"
    shutil.copytree(soft[0], folder)
    for path in (folder / "side").glob("*.png"):
        level = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        assert level is not None
        turn = cv2.getRotationMatrix2D((88.0, 90.25), angle_deg, 1.0)
        turned = cv2.warpAffine(level, turn, level.shape[::-1], flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
        cv2.imwrite(str(path), turned)
    drop, error = measure(folder, out)
    assert error is None
    assert f"the surface falls by {fall} of the side view: level the camera; heights are corrected" in caplog.text
    side, (known, said) = read_table(out, "side"), truth(folder)
    known = known[: len(side)]
    ok = (side.status == "ok").to_numpy()
    assert ok.sum() > 0.9 * (known.measurable == 1).sum()
    assert rms((side.stretch - known.stretch)[ok].to_numpy()) < 2.0 * CLEAN_STRETCH
    assert (np.abs(side.y_b_m - known.y_b_m)[ok] < 3.0 * side.y_b_m_unc[ok]).all()
    impact = read_table(out, "geometry").iloc[0]
    assert abs(impact.impact_time_s - said["impact_time_s"]) < 3.0 * impact.impact_time_s_unc
    assert impact.roll_deg == pytest.approx(-angle_deg, abs=0.05)
    stretch.run(out, drop)
    kinematics.run(out, drop)
    summary.run(out, drop)
    speed = read_table(out, "summary").iloc[0]
    assert abs(speed.impact_speed_m_s - said["u0_m_s"]) < 3.0 * speed.impact_speed_m_s_unc
