"""The stage cavity on rendered drops; the sphere's path is written from the truth, as a perfect tracker would."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml

from wentry_cli.config.campaign import Drop, read_drop
from wentry_cli.schemas import STATUS_WORDS
from wentry_cli.stages import cavity, ingest
from wentry_cli.synthetic.campaign import render_drop
from wentry_cli.synthetic.scene import Scene
from wentry_cli.tables import new_table, read_table, write_table

SOFT = {"g_inf_pa": 6900.0, "g_t_pa": 6900.0, "n": -0.1902, "eps0_dot_1_s": 0.021}
VERY_SOFT = {"g_inf_pa": 1235.0, "g_t_pa": 1235.0, "n": -0.5, "eps0_dot_1_s": 0.0066}
SIDE = {"width": 280, "height": 400, "scale_px_per_m": 1200.0, "surface_y_px": 80.3, "fps": 1000.0}
TOP = {"width": 160, "height": 160, "scale_px_per_m": 1200.0, "fps": 1000.0}


def scene(**keys: Any) -> Scene:
    said = {
        "name": "drop",
        "seed": 5,
        "sphere": {"diameter_m": 0.051, "law": SOFT, "material": "dragonskin_6p70_small"},
        "height_m": 1.53,
        "side": SIDE,
        "clip": {"before_s": 0.003, "after_pinch_off_s": 0.006},
    }
    return Scene.model_validate(said | keys)


def write_track(folder: Path, drop: Path, width: int) -> None:
    """side.csv, top.csv and geometry.csv as a tracker with 0.05 px of noise would have them."""
    truth = yaml.safe_load((drop / "truth" / "truth.yaml").read_text())
    said = yaml.safe_load((drop / "experiment.yaml").read_text())
    rows = pd.read_csv(drop / "truth" / "truth.csv")
    frames = read_table(folder, "frames")
    rows = rows.head(int((frames["view"] == "side").sum()))
    scale, surface = truth["scale_px_per_m"], truth["surface_y_px"]
    radius, count, random = 0.5 * said["sphere"]["diameter_m"], len(rows), np.random.default_rng(0)
    good = rows["measurable"] == 1
    rigid = said["sphere"]["material"] == "rigid"
    stretch = rows["stretch"] + random.normal(0.0, 5e-4, count)
    side = {
        "frame": rows["frame"],
        "t_s": rows["t_s"],
        "center_x_px": 0.5 * (width - 1) + random.normal(0.0, 0.05, count),
        "center_y_px": surface - scale * rows["y_c_m"] + random.normal(0.0, 0.05, count),
        "stretch": np.full(count, np.nan) if rigid else stretch,
        "stretch_unc": np.full(count, 5e-4),
        "separation_y_px": surface - scale * rows["separation_y_m"],
        "separation_y_m": rows["separation_y_m"],
        "status": np.where(good, "ok", "short_arc"),
        "y_b_source": ["ellipse"] * count,
    }
    for name, values in side.items():
        if name not in {"frame", "t_s", "status", "y_b_source"}:
            side[name] = np.where(good, values, np.nan)
    write_table(folder, "side", new_table("side", side))
    views = [name for name in ("side", "top") if name in said["views"]]
    geometry = {"view": views, "fps": 1000.0, "exposure_s": 1e-4, "scale_px_per_m": scale, "surface_y_px": surface}
    geometry |= {"optical_axis_y_px": 200.0, "optical_axis_y_px_unc": 50.0}
    geometry |= {"scale_water_px_per_m": scale, "scale_water_px_per_m_unc": 0.2, "radius_px": scale * radius}
    geometry |= {"impact_time_s": truth["impact_time_s"], "impact_time_s_unc": 3e-6}
    write_table(folder, "geometry", new_table("geometry", geometry))
    if "top" in views:
        above = pd.read_csv(drop / "truth" / "top.csv")
        seen = above["measurable"] == 1
        middle = np.where(seen, 0.5 * (TOP["width"] - 1), np.nan)
        columns = {"frame": above["frame"], "t_s": above["t_s"], "center_x_px": middle, "center_y_px": middle}
        columns |= {"radius_px": np.where(seen, above["radius_px"], np.nan)}
        columns |= {"status": np.where(seen, "ok", "occluded")}
        write_table(folder, "top", new_table("top", columns))


def measure(source: Path, results: Path) -> tuple[Drop, dict[str, Any], pd.DataFrame]:
    """Run ingest and cavity; returns the drop, its truth and events.csv by event."""
    results.mkdir()
    drop = read_drop("drop", source)
    ingest.run(results, drop)
    opened = ingest.open_view(drop, "side")
    opened.recording.close()
    write_track(results, source, opened.info.width)
    cavity.run(results, drop)
    events = read_table(results, "events")
    assert set(events["status"]) <= set(STATUS_WORDS)
    return drop, yaml.safe_load((source / "truth" / "truth.yaml").read_text()), events


def event(events: pd.DataFrame, name: str, index: int = 1) -> pd.Series:
    return events[(events["event"] == name) & (events["index"] == index)].iloc[0]


@pytest.fixture(scope="module")
def soft(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, dict[str, Any], pd.DataFrame]:
    folder = tmp_path_factory.mktemp("soft")
    render_drop(scene(top=TOP), folder / "drop")
    _, truth, events = measure(folder / "drop", folder / "results")
    return folder / "drop", folder / "results", truth, events


def test_pinch_off_of_a_nested_cavity(soft: tuple[Path, Path, dict[str, Any], pd.DataFrame]) -> None:
    *_, truth, events = soft
    row = event(events, "pinch_off")
    assert (row["value"], row["status"]) == ("deep_seal", "ok")
    assert row["t_s"] == pytest.approx(truth["t_p_s"], abs=1.5e-4)
    assert abs(row["t_s"] - truth["t_p_s"]) < 3.0 * row["t_s_unc"]
    assert row["y_m"] == pytest.approx(truth["y_p_m"], abs=1.5 / 1200.0)


def test_events_before_the_pinch_off(soft: tuple[Path, Path, dict[str, Any], pd.DataFrame]) -> None:
    *_, truth, events = soft
    assert event(events, "impact")["t_s"] == 0.0
    assert event(events, "second_cavity")["t_s"] == pytest.approx(truth["periods"][1]["start_s"], abs=3e-4)
    dome = event(events, "dome_over")
    assert dome["status"] == "ok"
    assert dome["t_s"] == pytest.approx(truth["dome_over_s"], abs=1.5e-3)


def test_necks_agree_with_the_rendered_ones(soft: tuple[Path, Path, dict[str, Any], pd.DataFrame]) -> None:
    source, results, _, _ = soft
    truth = pd.read_csv(source / "truth" / "necks.csv")
    both = truth.merge(read_table(results, "neck"), on="frame", suffixes=("_true", ""))
    both = both[(both["y_m_true"] - both["y_m"]).abs() < 0.005]
    error = (both["radius_m"] - both["radius_m_true"]) * 1200.0
    assert len(both) > 0.6 * len(truth)
    assert abs(error.mean()) < 0.1
    assert error.std() < 0.15
    closing = both[both["neck_true"] == truth["neck"].iloc[-1]]
    assert (closing["y_m"] - closing["y_m_true"]).abs().median() * 1200.0 < 1.0


def test_the_profile_is_the_wall_in_metres(soft: tuple[Path, Path, dict[str, Any], pd.DataFrame]) -> None:
    _, results, truth, _ = soft
    rows = read_table(results, "cavity")
    assert set(rows["wall"]) >= {1, 2}
    assert (rows["left_m"] < 0.0).all()
    assert (rows["right_m"] > 0.0).all()
    assert rows["y_m"].between(-0.25, 0.0).all()
    early = rows[rows["t_s"] < truth["periods"][1]["start_s"]]
    assert set(early["wall"]) == {1}
    assert abs((rows["left_m"] + rows["right_m"]).median()) * 1200.0 < 0.2


def test_a_second_run_gives_the_same_bytes(
    soft: tuple[Path, Path, dict[str, Any], pd.DataFrame], tmp_path: Path
) -> None:
    source, results, _, _ = soft
    again = tmp_path / "again"
    shutil.copytree(results, again)
    cavity.run(again, read_drop("drop", source))
    for name in ("cavity.csv", "neck.csv", "events.csv"):
        assert (again / name).read_bytes() == (results / name).read_bytes()


def test_a_clip_that_ends_before_the_pinch_off(
    soft: tuple[Path, Path, dict[str, Any], pd.DataFrame], tmp_path: Path
) -> None:
    source, _, truth, _ = soft
    short = tmp_path / "drop"
    shutil.copytree(source, short)
    said = yaml.safe_load((short / "experiment.yaml").read_text())
    last = int((truth["t_p_s"] + truth["impact_time_s"]) * 1000.0) - 6
    said["views"]["side"]["frames"] = [0, last]
    said["views"].pop("top")
    (short / "experiment.yaml").write_text(yaml.safe_dump(said))
    *_, events = measure(short, tmp_path / "results")
    row = event(events, "pinch_off")
    assert row["status"] == "clip_ended"
    assert row[["t_s", "t_s_unc", "y_m"]].isna().all()
    assert len(read_table(tmp_path / "results", "neck")) > 20


LOST = {"t_s", "center_x_px", "center_y_px", "impact_time_s", "impact_time_s_unc", "surface_y_px"}


def test_a_drop_whose_sphere_was_not_found_has_tables_that_say_so(
    soft: tuple[Path, Path, dict[str, Any], pd.DataFrame], tmp_path: Path
) -> None:
    source, results, _, _ = soft
    lost = tmp_path / "results"
    shutil.copytree(results, lost)
    for name in ("side", "geometry"):
        table = read_table(lost, name)
        for column in set(table.columns) & LOST:
            table[column] = np.nan
        write_table(lost, name, table)
    cavity.run(lost, read_drop("drop", source))
    assert len(read_table(lost, "cavity")) == len(read_table(lost, "neck")) == 0
    assert event(read_table(lost, "events"), "impact")["status"] == "no_object"
    row = event(read_table(lost, "events"), "pinch_off")
    assert row["status"] == "no_edge"
    assert np.isnan(row["t_s"])


def test_where_nothing_stands_out_below_the_surface_it_is_told(
    soft: tuple[Path, Path, dict[str, Any], pd.DataFrame], tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    folder, results = tmp_path / "drop", tmp_path / "results"
    shutil.copytree(soft[0], folder)
    shutil.copytree(soft[1], results)
    pictures = sorted((folder / "side").glob("*.png"))
    empty = pictures[0].read_bytes()  # the sphere is in air there
    for picture in pictures:
        picture.write_bytes(empty)
    cavity.run(results, read_drop("drop", folder))
    assert event(read_table(results, "events"), "pinch_off")["status"] == "no_edge"
    assert "neither cavity nor sphere stands out from the ground" in caplog.text


def test_a_rigid_sphere_filmed_from_the_side(tmp_path: Path) -> None:
    rigid = scene(
        sphere={"diameter_m": 0.051, "material": "rigid"},
        side=SIDE | {"height": 480, "width": 280},
        switches={"jets": True, "droplets": 20, "surface_band_px": 8, "surface_band_uneven": 0.4},
    )
    render_drop(rigid, tmp_path / "drop")
    _, truth, events = measure(tmp_path / "drop", tmp_path / "results")
    row = event(events, "pinch_off")
    assert (row["value"], row["status"]) == ("deep_seal", "ok")
    assert row["t_s"] == pytest.approx(truth["t_p_s"], abs=1.5e-4)
    assert list(events["event"]) == ["impact", "dome_over", "pinch_off"]
    assert set(read_table(tmp_path / "results", "cavity")["wall"]) == {1}


@pytest.mark.slow
def test_a_cavity_that_closes_on_the_sphere(tmp_path: Path) -> None:
    very_soft = scene(
        sphere={"diameter_m": 0.1, "material": "dragonskin_1p12_large", "law": VERY_SOFT},
        height_m=2.27,
        physics={"loading_rate": 0.3, "drag": 1.2},
        side=SIDE | {"width": 416, "height": 336, "scale_px_per_m": 900, "surface_y_px": 170.4},
        clip={"before_s": 0.004, "after_pinch_off_s": 0.012},
    )
    render_drop(very_soft, tmp_path / "drop")
    _, truth, events = measure(tmp_path / "drop", tmp_path / "results")
    row = event(events, "pinch_off")
    assert truth["seal_type"] == row["value"] == "sphere_seal"
    assert abs(row["t_s"] - truth["t_p_s"]) < 3.0 * row["t_s_unc"]
    assert row["t_s"] == pytest.approx(truth["t_p_s"], abs=1e-3)
