"""The stage ``model`` on tables made by hand: a sphere that rings at a known ratio of the model's period."""

import dataclasses

import numpy as np
import pytest

from wentry_cli.config.campaign import Drop
from wentry_cli.config.materials import find_material, packaged_config, read_materials
from wentry_cli.config.models import Experiment
from wentry_cli.errors import ConfigurationError
from wentry_cli.mechanics.bergstrom_boyce import Material
from wentry_cli.mechanics.solver import find_period, solve_oscillation
from wentry_cli.schemas import STATUS_WORDS
from wentry_cli.stages import model
from wentry_cli.tables import has_table, new_table, read_table, write_table

KEY = "dragonskin_6p70_small"
SPHERE = Material(0.0255, 1070.0, 6900.0, 6900.0, 0.0866, 1.0, 1.0, -0.1902, 0.021)
PEAK, PEAK_TIME, RATIO = 1.5, 0.011, 1.25


def make_drop(folder, kind="water_entry", **sphere):
    given = {"diameter_m": 0.051, "density_kg_m3": 1070.0, "material": KEY} | sphere
    experiment = Experiment.model_validate({"kind": kind, "sphere": given, "views": {"side": {"source": "side"}}})
    material = find_material(given["material"], packaged_config("materials.yaml"))
    return Drop("drop", folder, experiment, material)


def write_inputs(folder, *, noise=0.0, last=240, shallow=1.0):
    """A drop at 2000 fps with impact in frame 20, λ rising to its peak and then as the model slowed by RATIO."""
    rng = np.random.default_rng(5)
    t = (np.arange(last) - 20) / 2000.0
    rise = 1.0 + (PEAK - 1.0) * np.sin(0.5 * np.pi * np.clip(t, 0.0, PEAK_TIME) / PEAK_TIME)
    ring = solve_oscillation(SPHERE, PEAK, np.maximum(t - PEAK_TIME, 0.0) / RATIO).stretch
    stretch = np.where(t < PEAK_TIME, rise, np.where(ring < 1.0, 1.0 - shallow * (1.0 - ring), ring))
    fall = np.where(t < 0.0, -3.0 * t - 4.905 * t**2, -3.0 * t + 20.0 * t**2)
    centre = 0.0255 + fall
    bottom = centre - 0.0255 / stretch**2 + 2e-5 * rng.standard_normal(last)
    measured = stretch + noise * rng.standard_normal(last)
    unc = np.full(last, max(noise, 1e-4))
    frames = np.arange(last)
    write_table(
        folder,
        "stretch",
        new_table("stretch", {"frame": frames, "t_s": t, "stretch": measured, "stretch_unc": unc, "source": "side"}),
    )
    period = RATIO * find_period(SPHERE, PEAK)
    row = {"period": [1], "t_peak_s": [PEAK_TIME], "stretch_peak": [PEAK], "stretch_peak_unc": [max(noise, 1e-4)]}
    if t[-1] > PEAK_TIME + period:
        row |= {"peak_to_peak_s": [period], "peak_to_peak_s_unc": [0.005 * period]}
    write_table(folder, "periods", new_table("periods", row | {"status": ["ok"]}))
    columns = {"frame": frames, "t_s": t, "y_b_m": bottom, "y_b_m_unc": np.full(last, 2e-5), "status": ["ok"] * last}
    write_table(folder, "side", new_table("side", columns))
    write_table(folder, "kinematics", new_table("kinematics", columns | {"x_c_m": np.zeros(last)}))
    scales = {"scale_px_per_m": [4000.0], "scale_water_px_per_m": [4000.0]}
    write_table(folder, "geometry", new_table("geometry", {"view": ["side"]} | scales))
    return t, stretch, centre


@pytest.mark.parametrize("noise", [0.0005, 0.005])
def test_ratio_and_centre_are_recovered(tmp_path, noise):
    t, stretch, centre = write_inputs(tmp_path, noise=noise)
    model.run(tmp_path, make_drop(tmp_path))
    fit = read_table(tmp_path, "model_fit").iloc[0]
    assert fit["status"] == "ok"
    assert fit["time_ratio"] == pytest.approx(RATIO, abs=max(4 * fit["time_ratio_unc"], 1e-3))
    assert fit["time_ratio_unc"] < 0.01
    assert fit["period_exp_s"] / fit["period_model_s"] == pytest.approx(fit["time_ratio"], rel=1e-6)
    assert fit["stretch_0"] == PEAK
    curve = read_table(tmp_path, "model")
    assert curve["t_s"][0] == 0.0
    assert curve["t_scaled_s"][0] == pytest.approx(PEAK_TIME)
    late = t > PEAK_TIME
    assert np.interp(t[late], curve["t_scaled_s"], curve["stretch"]) == pytest.approx(stretch[late], abs=0.02)
    motion = read_table(tmp_path, "kinematics_model")
    assert motion["y_c_m"].to_numpy() == pytest.approx(centre, abs=6e-4 + 5 * noise * 0.0255)
    assert set(motion["status"]) <= set(STATUS_WORDS)
    assert (motion["status"] == "ok").mean() > 0.85
    assert set(motion["stretch_source"][motion["t_s"] < PEAK_TIME]) == {"measured"}
    assert set(motion["stretch_source"][motion["t_s"] > PEAK_TIME]) == {"model"}


def test_shallow_valleys_do_not_move_the_ratio(tmp_path):
    write_inputs(tmp_path, noise=0.002, shallow=0.7)
    model.run(tmp_path, make_drop(tmp_path))
    fit = read_table(tmp_path, "model_fit").iloc[0]
    assert fit["time_ratio"] == pytest.approx(RATIO, rel=4e-3)
    assert fit["residual_rms"] > 0.01


def test_uncertainties_hold_the_misfit_of_the_model(tmp_path):
    _, _, centre = write_inputs(tmp_path, noise=0.0005, shallow=0.7)
    model.run(tmp_path, make_drop(tmp_path))
    motion = read_table(tmp_path, "kinematics_model")
    t = motion["t_s"].to_numpy()
    late = (t > 0.02) & (t < 0.08)
    speed = np.gradient(centre, t)
    for name, truth in (("y_c_m", centre), ("v_c_m_s", speed)):
        score = (motion[name].to_numpy() - truth)[late] / motion[f"{name}_unc"].to_numpy()[late]
        assert 0.2 < np.sqrt(np.mean(score**2)) < 2.0, name


def test_gap_in_the_stretch_is_bridged_by_the_model_and_one_before_the_peak_stays_empty(tmp_path):
    write_inputs(tmp_path)
    table = read_table(tmp_path, "stretch")
    table.loc[[30, 31, 100, 101], ["stretch", "stretch_unc"]] = np.nan
    write_table(tmp_path, "stretch", table)
    model.run(tmp_path, make_drop(tmp_path))
    motion = read_table(tmp_path, "kinematics_model")
    assert motion["stretch_source"][100] == "bridge"
    assert motion["status"][100] == "ok"
    assert motion["y_c_m"].isna()[[30, 31]].all()
    assert motion["v_c_m_s"].isna()[[30, 31]].all()
    assert motion["status"][30] == "no_edge"


def test_clip_that_ends_before_the_second_peak_says_so(tmp_path):
    write_inputs(tmp_path, noise=0.001, last=20 + 22 + 30)
    model.run(tmp_path, make_drop(tmp_path))
    fit = read_table(tmp_path, "model_fit").iloc[0]
    assert fit["status"] == "clip_ended"
    assert fit["time_ratio"] == pytest.approx(RATIO, rel=0.1)


def test_without_a_first_peak_nothing_is_claimed(tmp_path):
    write_inputs(tmp_path)
    write_table(tmp_path, "periods", new_table("periods", {}))
    model.run(tmp_path, make_drop(tmp_path))
    fit = read_table(tmp_path, "model_fit").iloc[0]
    assert fit["status"] == "too_few"
    assert np.isnan(fit["time_ratio"])
    assert len(read_table(tmp_path, "model")) == 0
    motion = read_table(tmp_path, "kinematics_model")
    assert len(motion) == 240
    assert set(motion["stretch_source"][:20]) == {"measured"}
    assert motion["stretch_source"][20:].isna().all()
    assert motion["y_c_m"][20:].isna().all()
    assert set(motion["status"][20:]) == {"too_few"}


def test_drop_on_a_plate_has_no_motion_table(tmp_path):
    write_inputs(tmp_path)
    model.run(tmp_path, make_drop(tmp_path, kind="surface_impact"))
    assert has_table(tmp_path, "model_fit")
    assert not has_table(tmp_path, "kinematics_model")


def test_unknown_material_writes_nothing(tmp_path):
    model.run(tmp_path, make_drop(tmp_path, material="rigid"))
    assert list(tmp_path.iterdir()) == []


def test_missing_density_is_a_sentence(tmp_path):
    drop = make_drop(tmp_path, density_kg_m3=None)
    bare = dataclasses.replace(drop, material=drop.material.model_copy(update={"density_kg_m3": None}))
    write_inputs(tmp_path)
    with pytest.raises(ConfigurationError, match="density_kg_m3 is missing"):
        model.run(tmp_path, bare)


@pytest.mark.parametrize(
    ("tau0_pa", "told"), [(1.0, ""), (1e3, "so slowly that it hardly damps"), (1e-3, "at once, as if only g_inf_pa")]
)
def test_a_flow_in_the_wrong_unit_is_told(tmp_path, caplog, tau0_pa, told):
    write_inputs(tmp_path)
    drop = make_drop(tmp_path)
    model.run(tmp_path, dataclasses.replace(drop, material=drop.material.model_copy(update={"tau0_pa": tau0_pa})))
    assert [told in text and "check eps0_dot_1_s and that tau0_pa is in Pa" in text for text in caplog.messages] == (
        [True] if told else []
    )


@pytest.mark.parametrize(
    ("stiffer", "kind", "told"),
    [
        (1.0, "water_entry", ""),
        (8.6, "water_entry", "T_exp/T_model is 3.67, outside 0.7 to 2.5, where about 1.14 to 1.5 is expected"),
        (
            8.6,
            "surface_impact",
            "where about 1 is expected: G∞ goes as its inverse square, so that 0.074 times the g_inf_pa",
        ),
        (15.0, "water_entry", "no T_exp/T_model: λ does not tell it between 0.4 and 4"),
    ],
)
def test_a_modulus_that_no_period_agrees_with_is_told(tmp_path, caplog, stiffer, kind, told):
    """Both networks are stiffer, and flow as before: the model rings faster by the root of it."""
    write_inputs(tmp_path)
    drop = make_drop(tmp_path, kind=kind)
    scaled = {key: stiffer * getattr(drop.material, key) for key in ("g_inf_pa", "g_t_pa", "tau0_pa")}
    scaled["eps0_dot_1_s"] = stiffer**0.5 * drop.material.eps0_dot_1_s
    model.run(tmp_path, dataclasses.replace(drop, material=drop.material.model_copy(update=scaled)))
    assert [told in text and "check g_inf_pa (Pa)" in text for text in caplog.messages] == ([True] if told else [])


def test_packaged_materials_are_table_1():
    known = read_materials(packaged_config("materials.yaml"))
    assert len(known) == 6
    assert sorted({m.g_inf_pa for m in known.values()}) == [1235.0, 6900.0, 74690.0]
    assert sorted({m.g_inf_text_pa for m in known.values()}) == [1120.0, 6700.0, 70200.0]
    assert all(m.g_t_pa == m.g_inf_pa and m.tau0_pa == 1.0 for m in known.values())
