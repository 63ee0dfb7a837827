from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from drop_fixtures import FPS, SCALE, D, R, make_drop, motion, write_events, write_views

from wentry_cli.stages import kinematics, stretch, summary
from wentry_cli.tables import new_table, read_table, write_table


def test_a_soft_sphere(tmp_path: Path) -> None:
    known = motion()
    write_views(tmp_path, known)
    write_events(tmp_path)
    drop = make_drop()
    stretch.run(tmp_path, drop)
    kinematics.run(tmp_path, drop)
    table = read_table(tmp_path, "kinematics")
    assert len(table) == known.t.size
    late = known.t > 0.004
    assert np.sqrt(np.mean((table["v_c_m_s"] - known.v_c)[late] ** 2)) < 0.008
    assert np.mean((np.abs(table["v_c_m_s"] - known.v_c) < 1.96 * table["v_c_m_s_unc"])[late]) > 0.85
    early = (known.t >= 0) & (known.t < R / np.sqrt(6900 / 1070))
    assert set(table["status"][early]) == {"early_shape"}
    assert set(table["status"][~early]) == {"ok"}


def test_every_measured_row_is_full_and_the_others_say_why(tmp_path: Path) -> None:
    known = motion()
    write_views(tmp_path, known)
    side = read_table(tmp_path, "side")
    side.loc[100:104, ["stretch", "stretch_unc"]] = np.nan
    side.loc[120:122, ["y_b_m", "y_b_m_unc", "stretch", "stretch_unc", "center_x_px", "center_y_px"]] = np.nan
    side.loc[120:122, "status"] = "no_edge"
    side.loc[150, "status"] = "manual"
    side.loc[160, ["y_b_m", "y_b_m_unc", "stretch", "stretch_unc"]] = np.nan
    side.loc[160, "status"] = "manual"  # left out by hand
    side.loc[170, "y_b_m"] += 0.004
    write_table(tmp_path, "side", side)
    drop = make_drop()
    stretch.run(tmp_path, drop)
    kinematics.run(tmp_path, drop)
    table = read_table(tmp_path, "kinematics")
    numbers = table.drop(columns=["frame", "status"])
    assert numbers[table["status"] == "ok"].notna().all().all()
    assert set(table["status"][100:105]) == {"occluded"}
    assert table["y_c_m"][100:105].isna().all()
    assert table["v_b_m_s"][100:105].notna().all()
    assert set(table["status"][120:123]) == {"no_edge"}
    assert table["y_b_m"][120:123].isna().all()
    assert list(table["status"][[150, 160]]) == ["manual", "manual"]
    assert table["status"][170] == "poor_fit"


def test_a_rigid_sphere_needs_no_stretch(tmp_path: Path) -> None:
    known = motion(amplitude=0.0)
    write_views(tmp_path, known, rigid=True)
    kinematics.run(tmp_path, make_drop(material="rigid"))
    table = read_table(tmp_path, "kinematics")
    assert np.allclose(table["y_c_m"] - table["y_b_m"], R)
    assert np.sqrt(np.mean((table["v_c_m_s"] - known.v_c)[known.t > 0.004] ** 2)) < 0.003
    assert set(table["status"]) == {"ok"}


def test_without_a_material_the_period_tells_how_long_the_shape_is_a_wave(tmp_path: Path) -> None:
    known = motion()
    write_views(tmp_path, known)
    drop = make_drop(sphere={"diameter_m": D}, material="rigid")
    assert drop.material is None
    stretch.run(tmp_path, drop)
    kinematics.run(tmp_path, drop)
    words = read_table(tmp_path, "kinematics")["status"]
    assert (words == "early_shape").sum() == pytest.approx(known.period / 2.8 * FPS, abs=1.5)


def test_too_few_frames_to_smooth(tmp_path: Path) -> None:
    known = motion()
    write_views(tmp_path, known)
    side = read_table(tmp_path, "side")
    side.loc[5:, ["y_b_m", "y_b_m_unc", "stretch", "stretch_unc"]] = np.nan
    side.loc[5:, "status"] = "no_object"
    write_table(tmp_path, "side", side)
    drop = make_drop()
    stretch.run(tmp_path, drop)
    kinematics.run(tmp_path, drop)
    table = read_table(tmp_path, "kinematics")
    assert set(table["status"][5:]) == {"no_object"}
    assert set(table["status"][:5]) == {"too_few"}
    assert table["v_c_m_s"].isna().all()


@pytest.mark.parametrize("smoother", ["gcv", "epps"])
def test_the_other_smoothers(tmp_path: Path, smoother: str) -> None:
    known = motion(amplitude=0.0)
    write_views(tmp_path, known, rigid=True)
    kinematics.run(tmp_path, make_drop(material="rigid", analysis={"smoother": smoother}))
    table = read_table(tmp_path, "kinematics")
    error = (table["v_c_m_s"] - known.v_c)[known.t > 0.01]
    assert 0.002 < np.sqrt(np.mean(error**2)) < 0.05


def free_flight(folder: Path, noise_px: float = 0.01) -> None:
    n = 15
    t = np.arange(n) / 30000
    random = np.random.default_rng(0)
    y = 100 + SCALE * (1.57 * t + 0.5 * 9.81 * t**2) + noise_px * random.normal(size=n)
    side = {
        "frame": np.arange(n),
        "t_s": t,
        "center_x_px": 50 + 0.01 * np.arange(n),
        "center_y_px": y,
        "radius_px": 60 + noise_px / np.sqrt(2) * random.normal(size=n),
        "radius_px_unc": np.full(n, noise_px),
        "stretch": np.ones(n),
        "bottom_y_px_unc": np.full(n, noise_px),
        "status": ["ok"] * n,
    }
    write_table(folder, "side", new_table("side", side))
    write_table(folder, "geometry", new_table("geometry", {"view": ["side"], "fps": [3e4], "scale_px_per_m": [SCALE]}))


def test_a_free_flight_has_one_acceleration_without_a_prior(tmp_path: Path) -> None:
    free_flight(tmp_path)
    drop = make_drop(kind="free_flight", sphere={"diameter_m": 0.03}, material="rigid")
    kinematics.run(tmp_path, drop)
    table = read_table(tmp_path, "kinematics")
    assert table["y_c_m"][0] == 0.0
    assert table["x_c_m"][14] == pytest.approx(0.14 / SCALE)
    assert table["a_c_m_s2"].nunique() == 1
    unc = table["a_c_m_s2_unc"][0]
    assert abs(table["a_c_m_s2"][0] + 9.81) < 3 * unc
    # σ_a = σ √(720/n)/T²: no narrower than the data allow
    least = 0.01 / SCALE * np.sqrt(720 / 15) / (14 / 30000) ** 2
    assert 0.6 * least < unc < 2.0 * least
    assert set(table["status"]) == {"ok"}


def test_the_lowest_point_of_a_free_flight_is_that_of_its_view(tmp_path: Path) -> None:
    free_flight(tmp_path)
    drop = make_drop(kind="free_flight", sphere={"diameter_m": 0.03}, material="rigid")
    side = read_table(tmp_path, "side")
    side["y_b_m"] = (100.0 - side["center_y_px"] - 60.2) / SCALE
    side["y_b_m_unc"] = 3e-6
    side.loc[4, "y_b_m"] = np.nan
    write_table(tmp_path, "side", side)
    kinematics.run(tmp_path, drop)
    table = read_table(tmp_path, "kinematics")
    known = np.arange(15) != 4
    assert np.allclose(table["y_b_m"][known], read_table(tmp_path, "side")["y_b_m"][known], rtol=0, atol=1e-12)
    assert set(table["y_b_m_unc"][known]) == {3e-6}
    assert table["y_b_m"][4] == pytest.approx(table["y_c_m"][4] - 0.015)


def test_the_scale_is_in_the_uncertainty_of_a_free_fall(tmp_path: Path) -> None:
    free_flight(tmp_path)
    drop = make_drop(kind="free_flight", sphere={"diameter_m": 0.03}, material="rigid")
    kinematics.run(tmp_path, drop)
    found = []
    for relative in (0.0, 5.0):
        geometry = read_table(tmp_path, "geometry")
        geometry["scale_px_per_m_unc"] = relative * SCALE
        write_table(tmp_path, "geometry", geometry)
        summary.run(tmp_path, drop)
        found.append(read_table(tmp_path, "summary").iloc[0])
    random, both = (row["acceleration_m_s2_unc"] for row in found)
    assert random == pytest.approx(read_table(tmp_path, "kinematics")["a_c_m_s2_unc"][0])
    assert both == pytest.approx(np.hypot(random, 5.0 * found[0]["acceleration_m_s2"]))


def test_nothing_that_was_tracked(tmp_path: Path) -> None:
    kinematics.run(tmp_path, make_drop())
    kinematics.run(tmp_path, make_drop(kind="free_flight", sphere={"diameter_m": 0.03}, material="rigid"))
    assert not list(tmp_path.iterdir())


def test_a_fall_that_is_not_that_of_gravity_is_told(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Half the frame rate given: times twice as long, and a quarter of the acceleration."""
    known = motion()
    write_views(tmp_path, known)
    kinematics.run(tmp_path, make_drop())
    assert "falls with" not in caplog.text
    side = read_table(tmp_path, "side")
    side["t_s"] *= 2.0
    write_table(tmp_path, "side", side)
    kinematics.run(tmp_path, make_drop())
    assert "before impact the sphere falls with 2.5 ±" in caplog.text
    assert "check fps" in caplog.text
    table = read_table(tmp_path, "kinematics")
    air = table[table["t_s"] < 0]
    # what is measured, not what is assumed
    assert np.all(np.abs(air["a_c_m_s2"] + 9.81 / 4.0) < 3.0 * air["a_c_m_s2_unc"])


@pytest.mark.parametrize(("wrong", "told"), [(0.9, True), (1.1, True), (0.99, False), (1.01, False)])
def test_a_rate_that_is_off_by_a_tenth_is_told(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, wrong: float, told: bool
) -> None:
    write_views(tmp_path, motion())
    side = read_table(tmp_path, "side")
    side["t_s"] *= wrong
    side["center_y_px"] += 0.02 * np.random.default_rng(6).normal(size=len(side))
    write_table(tmp_path, "side", side)
    kinematics.run(tmp_path, make_drop())
    assert ("falls with" in caplog.text) == told


def test_a_surface_that_was_given_too_low_is_no_fault_of_the_camera(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """What counts as the fall then ends in the water."""
    write_views(tmp_path, motion())
    side = read_table(tmp_path, "side")
    side["t_s"] -= 15.0 / FPS
    write_table(tmp_path, "side", side)
    kinematics.run(tmp_path, make_drop(views={"side": {"source": "side", "fps": FPS, "surface_y_px": 340}}))
    assert "check views.side.surface_y_px, which says when it ends" in caplog.text
    assert "fps" not in caplog.text


def test_a_sphere_that_is_held_at_first_falls_with_gravity_all_the_same(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    known = motion(u0=0.5, amplitude=0.0, n=200)
    write_views(tmp_path, known, rigid=True)
    side = read_table(tmp_path, "side")
    released = -8.25 / FPS
    since = np.maximum(side["t_s"] - released, 0.0)
    before = side["t_s"] < 0
    # a strong pull instead of gravity, which gains a speed in the few frames there are
    side.loc[before, "y_b_m"] = (0.5 * 500.0 * (released**2 - since**2))[before]
    side.loc[before, "bottom_y_px"] = 300.0 - SCALE * side["y_b_m"][before]
    side.loc[before, "center_y_px"] = side["bottom_y_px"][before] - SCALE * R
    write_table(tmp_path, "side", side)
    geometry = read_table(tmp_path, "geometry")
    geometry["impact_time_s"], geometry["release_time_s"] = 0.25, 0.25 + released
    write_table(tmp_path, "geometry", geometry)
    drop = make_drop(material="rigid", gravity_m_s2=500.0)
    kinematics.run(tmp_path, drop)
    assert "falls with" not in caplog.text
    table = read_table(tmp_path, "kinematics")
    hanging = side["t_s"] < released
    assert np.all(np.abs(table["v_b_m_s"][hanging]) < 0.01)
    assert set(table["status"][before]) == {"ok"}
