"""Calibration into materials.csv: from tables of drops on a plate, and from a compression test."""

import dataclasses

import numpy as np
import pytest

from tests.promises import broken_promises
from wentry_cli.config.campaign import Drop
from wentry_cli.config.materials import find_material, packaged_config
from wentry_cli.config.models import Experiment
from wentry_cli.errors import ConfigurationError, InputError, TooFewMeasurementsError
from wentry_cli.mechanics.calibration import REFERENCE_HARDENING
from wentry_cli.mechanics.compression import compression_force
from wentry_cli.mechanics.solver import find_period, solve_oscillation
from wentry_cli.provenance import digest_of
from wentry_cli.records import STAGES, write_json
from wentry_cli.stages.calibrate import calibrate_impact, why_unused
from wentry_cli.stages.calibrate.compression import calibrate_compression, doubt_of, read_compression
from wentry_cli.stages.model import sphere_material
from wentry_cli.stages.report import table_1
from wentry_cli.tables import new_table, read_table, write_table

KEY = "dragonskin_6p70_large"


def make_drop(name, kind="surface_impact", sphere_id="S5"):
    sphere = {"diameter_m": 0.0974, "density_kg_m3": 1070.0, "material": KEY, "id": sphere_id}
    experiment = Experiment.model_validate({"kind": kind, "sphere": sphere, "views": {"side": {"source": "side"}}})
    return Drop(
        name,
        packaged_config("materials.yaml").parent,
        experiment,
        find_material(KEY, packaged_config("materials.yaml")),
    )


def write_ringing(results, drop, peak, rng, *, last=300):
    """A drop filmed at 2000 fps that reaches its first peak 9 ms after contact."""
    material = sphere_material(drop)
    t = (np.arange(last) - 10) / 2000.0
    values = solve_oscillation(material, peak, np.maximum(t - 0.009, 0.0)).stretch
    noisy = np.where(t < 0.009, 1.0, values) + 0.004 * rng.standard_normal(last)
    columns = {"frame": np.arange(last), "t_s": t, "stretch": noisy, "stretch_unc": np.full(last, 0.004)}
    write_table(results / drop.name, "stretch", new_table("stretch", columns))
    row = {"period": [1], "t_peak_s": [0.009 + 2e-5], "stretch_peak": [peak], "status": ["ok"]}
    write_table(results / drop.name, "periods", new_table("periods", row))
    return find_period(material, peak)


def test_three_heights_recover_the_flow(tmp_path):
    rng = np.random.default_rng(1)
    drops = [make_drop(f"h{k}") for k in range(3)]
    for drop, peak in zip(drops, (1.25, 1.5, 1.75), strict=True):
        write_ringing(tmp_path, drop, peak, rng)
    assert calibrate_impact(tmp_path, drops) == []
    row = read_table(tmp_path, "materials").iloc[0]
    truth = drops[0].material
    assert row["status"] == "ok"
    assert broken_promises(tmp_path, "materials") == []
    assert row["source"] == "impact"
    assert row["sphere_id"] == "S5"
    assert abs(row["n"] - truth.n) < 4 * row["n_unc"]
    assert abs(row["eps0_dot_1_s"] - truth.eps0_dot_1_s) < 4 * row["eps0_dot_1_s_unc"]
    assert row["g_inf_pa"] == truth.g_inf_pa
    assert 0.98 < row["correlation"] < 1.0
    write_json(
        tmp_path / "h0" / STAGES, {"model": {"fingerprint": {"material": digest_of(truth.model_dump(mode="json"))}}}
    )
    waiting = table_1(tmp_path, [drop.with_calibration(tmp_path) for drop in drops])
    assert waiting["source"].tolist() == ["materials.csv (impact), not yet fitted with", truth.source]
    by_hand = drops[0].with_calibration(tmp_path).material
    write_json(
        tmp_path / "h0" / STAGES, {"model": {"fingerprint": {"material": digest_of(by_hand.model_dump(mode="json"))}}}
    )
    used = table_1(tmp_path, [drop.with_calibration(tmp_path) for drop in drops])
    assert used["source"].tolist() == ["materials.csv (impact)", truth.source]
    assert used["n"].tolist() == pytest.approx([row["n"], truth.n])
    again = drops[0].with_calibration(tmp_path).material
    assert again.n == pytest.approx(row["n"])
    curve = read_table(tmp_path, "calibration")
    for drop in drops:
        seen, fitted = read_table(tmp_path / drop.name, "stretch"), curve[curve["drop"] == drop.name]
        after = seen[seen["t_s"] >= fitted["t_s"].iloc[0]]
        misfit = after["stretch"] - np.interp(after["t_s"], fitted["t_s"], fitted["stretch"])
        assert np.sqrt(np.mean(misfit**2)) == pytest.approx(0.004, rel=0.1)


def test_modulus_of_a_compression_test_is_used(tmp_path):
    rng = np.random.default_rng(3)
    drops = [make_drop(f"h{k}") for k in range(2)]
    for drop, peak in zip(drops, (1.3, 1.7), strict=True):
        write_ringing(tmp_path, drop, peak, rng)
    write_test(tmp_path / "test.csv", "displacement_m,force_N", modulus=7000.0)
    calibrate_compression(read_compression(tmp_path / "test.csv"), 0.0974, tmp_path, material=KEY)
    calibrate_impact(tmp_path, drops)
    rows = read_table(tmp_path, "materials").set_index("source")
    assert rows.loc["impact", "g_inf_pa"] == pytest.approx(7000.0, rel=1e-4)
    assert rows.loc["impact", "g_inf_pa_unc"] > 0.0


FITTED = ["n", "n_unc", "eps0_dot_1_s", "eps0_dot_1_s_unc"]


@pytest.mark.parametrize(("peak", "last", "known"), [(1.2, 80, False), (1.6, 300, True)])
def test_one_height_is_reported_as_not_identified(tmp_path, peak, last, known):
    drop = make_drop("only")
    write_ringing(tmp_path, drop, peak, np.random.default_rng(2), last=last)
    (warning,) = calibrate_impact(tmp_path, [drop])
    assert "S5: one drop" in warning
    row = read_table(tmp_path, "materials").iloc[0]
    assert row["status"] == "not_identified"
    assert row[FITTED].isna().all()
    true = drop.material.eps0_dot_1_s * REFERENCE_HARDENING**drop.material.n
    assert np.isfinite(row["flow_1_s"]) == known
    assert not known or abs(row["flow_1_s"] - true) < 4 * row["flow_1_s_unc"] < true
    assert drop.with_calibration(tmp_path).material == drop.material


def test_one_height_leaves_the_row_of_three(tmp_path):
    rng = np.random.default_rng(1)
    drops = [make_drop(f"h{k}") for k in range(3)]
    for drop, peak in zip(drops, (1.25, 1.5, 1.75), strict=True):
        write_ringing(tmp_path, drop, peak, rng)
    calibrate_impact(tmp_path, drops)
    before, curves = ((tmp_path / f"{name}.csv").read_bytes() for name in ("materials", "calibration"))
    one, kept = calibrate_impact(tmp_path, drops[:1])
    assert "one drop" in one
    assert "the good row of an earlier calibration stays" in kept
    assert (tmp_path / "materials.csv").read_bytes() == before
    with pytest.raises(TooFewMeasurementsError, match="the good row of an earlier calibration stays"):
        calibrate_impact(tmp_path, [make_drop("missing")])
    assert (tmp_path / "materials.csv").read_bytes() == before
    assert (tmp_path / "calibration.csv").read_bytes() == curves


def test_a_drop_that_ends_at_its_peak_is_left_out_and_told(tmp_path):
    rng = np.random.default_rng(1)
    drops = [make_drop(f"h{k}") for k in range(4)]
    for drop, peak in zip(drops[:3], (1.25, 1.5, 1.75), strict=True):
        write_ringing(tmp_path, drop, peak, rng)
    assert calibrate_impact(tmp_path, drops[:3]) == []
    alone = (tmp_path / "materials.csv").read_bytes()
    write_ringing(tmp_path, drops[3], 1.4, rng, last=33)
    assert why_unused(tmp_path, drops[3]) == "fewer than 8 frames were measured after its first peak"
    assert calibrate_impact(tmp_path, drops) == [
        "S5: h3 is left out: fewer than 8 frames were measured after its first peak"
    ]
    assert (tmp_path / "materials.csv").read_bytes() == alone


def test_curves_of_other_spheres_stay(tmp_path):
    rng = np.random.default_rng(1)
    drops = [make_drop(f"{sphere_id}{k}", sphere_id=sphere_id) for sphere_id in ("A", "B") for k in range(2)]
    for drop, peak in zip(drops, (1.3, 1.7, 1.3, 1.7), strict=True):
        write_ringing(tmp_path, drop, peak, rng)
    calibrate_impact(tmp_path, drops)
    whole = (tmp_path / "calibration.csv").read_bytes()
    calibrate_impact(tmp_path, drops[2:])
    assert (tmp_path / "calibration.csv").read_bytes() == whole


def test_drops_without_a_peak_are_too_few_and_the_table_is_written(tmp_path):
    with pytest.raises(
        TooFewMeasurementsError, match=r"no sphere could be calibrated; .* --dry-run` says of each drop"
    ):
        calibrate_impact(tmp_path, [make_drop("missing")])
    assert read_table(tmp_path, "materials")["status"].tolist() == ["too_few"]


def test_columns_of_the_stretch_in_place_of_each_other(tmp_path):
    drop = make_drop("turned")
    write_ringing(tmp_path, drop, 1.5, np.random.default_rng(1))
    table = read_table(tmp_path / drop.name, "stretch")
    turned = table.assign(t_s=table["stretch"], stretch=table["t_s"])
    write_table(tmp_path / drop.name, "stretch", turned)
    with pytest.raises(InputError, match=r"stretch\.csv: t_s does not rise; run the stage stretch again"):
        calibrate_impact(tmp_path, [drop])
    assert not (tmp_path / "materials.csv").exists()


def test_no_drop_on_a_plate(tmp_path):
    with pytest.raises(InputError, match="surface_impact"):
        calibrate_impact(tmp_path, [make_drop("wet", kind="water_entry")])


def test_unknown_material(tmp_path):
    bare = dataclasses.replace(make_drop("bare"), material=None)
    with pytest.raises(ConfigurationError, match=r"sphere\.material is missing"):
        calibrate_impact(tmp_path, [bare])


def write_test(path, header, factor=1.0, modulus=6900.0, zero=4e-4):
    d = np.linspace(0.0, 0.025, 80)
    force = modulus * 0.0974**2 * compression_force((d - zero) / 0.0974)
    lines = [header, *(f"{a * factor:.9g},{b:.9g}" for a, b in zip(d, force, strict=True))]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


@pytest.mark.parametrize(("unit", "factor"), [("displacement_m", 1.0), ("displacement_mm", 1e3)])
def test_compression_gives_the_modulus_in_either_unit(tmp_path, unit, factor):
    write_test(tmp_path / "test.csv", f"{unit},force_N", factor)
    calibrate_compression(read_compression(tmp_path / "test.csv"), 0.0974, tmp_path, material=KEY)
    row = read_table(tmp_path, "materials").iloc[0]
    assert row["g_inf_pa"] == pytest.approx(6900.0, rel=1e-4)
    assert (row["material"], row["source"], row["status"]) == (KEY, "compression", "ok")
    assert broken_promises(tmp_path, "materials") == []
    assert np.isnan(row["n"])


def test_rows_of_others_stay_and_own_rows_are_replaced(tmp_path):
    write_test(tmp_path / "a.csv", "Displacement_m,force_n")  # any case, as in compression.csv
    write_test(tmp_path / "b.csv", "displacement_m,force_N", modulus=1235.0)
    calibrate_compression(read_compression(tmp_path / "a.csv"), 0.0974, tmp_path, material="a")
    calibrate_compression(read_compression(tmp_path / "a.csv"), 0.0974, tmp_path, material="b")
    calibrate_compression(read_compression(tmp_path / "b.csv"), 0.0974, tmp_path, material="b")
    rows = read_table(tmp_path, "materials")
    assert rows["material"].tolist() == ["a", "b"]
    assert rows["g_inf_pa"].tolist() == pytest.approx([6900.0, 1235.0], rel=1e-4)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        ("", "header needs force_N"),
        ("displacement,force\n1,2\n", "rename the columns"),
        ("displacement_m,force_N\n0.1,abc\n", "test.csv:2"),
        ("displacement_m;force_N\n0.1;2\n", "separated by semicolons; write commas"),
        ("displacement_m\tforce_N\n0.1\t2\n", "separated by tabs"),
        ("displacement_m,force_N\n0.1;2\n", "test.csv:2: the columns are separated by semicolons"),
        ("displacement_m,force_N\n0.1,2\n0,2,3,1\n", "test.csv:3: 4 columns, and the header has 2, as decimal commas"),
        ('displacement_m,force_N\n"0,1","2,5"\n', "decimal commas"),
        ("displacement_m,displacement_mm,force_N\n0.1,100,2\n", "has displacement_m and displacement_mm; keep one"),
        ("displacement_m,force_N,force_N\n0.1,2,2\n", "force_N twice"),
        ("displacement_m,force_N\n0.1,2\n0.2,1e300\n", "test.csv:3: 0.2 and 1e300 are beyond any test"),
        ("\0" * 900, "it holds zero bytes"),
        ("x" * 900 + ",y\n", "and is x{120}…; rename"),
    ],
)
def test_wrong_files_are_one_sentence(tmp_path, content, sentence):
    (tmp_path / "test.csv").write_text(content, encoding="utf-8")
    with pytest.raises(InputError, match=sentence):
        calibrate_compression(read_compression(tmp_path / "test.csv"), 0.05, tmp_path)
    assert not (tmp_path / "materials.csv").exists()


def test_missing_file(tmp_path):
    with pytest.raises(InputError, match=r"none\.csv: no such file; give the CSV file of the compression test"):
        read_compression(tmp_path / "none.csv")


@pytest.mark.parametrize("diameter", [-0.05, 0.0, float("nan"), float("inf"), 51.0])
def test_wrong_diameter(tmp_path, diameter):
    write_test(tmp_path / "test.csv", "displacement_m,force_N")
    with pytest.raises(ConfigurationError, match="positive, finite and at most 1"):
        calibrate_compression(read_compression(tmp_path / "test.csv"), diameter, tmp_path)
    assert not (tmp_path / "materials.csv").exists()


def test_rows_without_numbers_are_left_out_and_told(tmp_path):
    write_test(tmp_path / "test.csv", "displacement_m,force_N")
    whole = read_compression(tmp_path / "test.csv")
    assert whole.warnings == ()
    lines = (tmp_path / "test.csv").read_text(encoding="utf-8").splitlines()
    lines[5:5] = ["nan,1.0", "0.01,", "", "0.01,inf"]
    (tmp_path / "holes.csv").write_text("\n".join(lines), encoding="utf-8")
    holes = read_compression(tmp_path / "holes.csv")
    (warning,) = holes.warnings
    assert warning.endswith("holes.csv: left out for want of two finite numbers: lines 6, 7, 9")
    assert holes.force_n == pytest.approx(whole.force_n, abs=0.0)


def test_a_file_that_is_no_text(tmp_path):
    (tmp_path / "test.csv").write_bytes("displacement_m,force_N\n0,0\n".encode("utf-16"))
    with pytest.raises(InputError, match=r"test\.csv: is no text in UTF-8; save"):
        read_compression(tmp_path / "test.csv")


def test_what_follows_the_turn_of_the_plates_is_left_out(tmp_path):
    write_test(tmp_path / "test.csv", "displacement_m,force_N")
    loading = read_compression(tmp_path / "test.csv")
    lines = (tmp_path / "test.csv").read_text(encoding="utf-8").splitlines()
    back = [f"{d:.9g},{0.8 * f:.9g}" for d, f in zip(loading.displacement_m, loading.force_n, strict=True)][::-1]
    (tmp_path / "both.csv").write_text("\n".join(lines + back), encoding="utf-8")
    both = read_compression(tmp_path / "both.csv")
    assert [warning.rpartition(": ")[2] for warning in both.warnings] == ["the last 80 points"]
    assert both.force_n == pytest.approx(loading.force_n, abs=0.0)
    (tmp_path / "reversed.csv").write_text("\n".join(lines[:1] + lines[:0:-1]), encoding="utf-8")
    assert read_compression(tmp_path / "reversed.csv").force_n.size == loading.force_n.size


def test_columns_in_place_of_each_other_are_told(tmp_path):
    write_test(tmp_path / "test.csv", "force_N,displacement_m")
    with pytest.raises(TooFewMeasurementsError, match=r"the plates move by 14.9 m, more than the diameter 0\.0974 m"):
        calibrate_compression(read_compression(tmp_path / "test.csv"), 0.0974, tmp_path)


@pytest.mark.parametrize(
    ("modulus", "word"), [(1.0, "softer than any gel"), (1e9, "harder than any rubber"), (7e3, "")]
)
def test_a_modulus_that_no_sphere_has_is_told(tmp_path, modulus, word):
    write_test(tmp_path / "test.csv", "displacement_m,force_N", modulus=modulus)
    fit = calibrate_compression(read_compression(tmp_path / "test.csv"), 0.0974, tmp_path)
    assert bool(word) == (word in doubt_of(fit) != "")
    row = read_table(tmp_path, "materials").iloc[0]
    assert row["g_inf_low_pa"] <= row["g_inf_pa"] <= row["g_inf_high_pa"]
    assert read_table(tmp_path, "compression")["zero_m"].to_numpy() == pytest.approx(4e-4, abs=1e-7)


def test_tables_of_an_earlier_version_are_read(tmp_path):
    write_test(tmp_path / "test.csv", "displacement_m,force_N")
    calibrate_compression(read_compression(tmp_path / "test.csv"), 0.0974, tmp_path, material="a")
    for name, new in (("materials", ["flow_1_s", "flow_1_s_unc", "g_inf_low_pa"]), ("compression", ["zero_m_unc"])):
        old = read_table(tmp_path, name).drop(columns=new)
        old.to_csv(tmp_path / f"{name}.csv", index=False)
    calibrate_compression(read_compression(tmp_path / "test.csv"), 0.0974, tmp_path, material="b")
    assert read_table(tmp_path, "materials")["g_inf_low_pa"].isna().tolist() == [True, False]
    assert read_table(tmp_path, "compression")["zero_m_unc"].isna().sum() == 80


def test_a_test_without_load_is_too_few(tmp_path):
    (tmp_path / "test.csv").write_text("displacement_m,force_N\n0,0\n0.001,\n", encoding="utf-8")
    with pytest.raises(TooFewMeasurementsError, match="not determined") as caught:
        calibrate_compression(read_compression(tmp_path / "test.csv"), 0.05, tmp_path)
    assert "earlier" not in str(caught.value)
    assert read_table(tmp_path, "materials")["status"].tolist() == ["too_few"]


def test_a_failed_test_leaves_the_good_row(tmp_path):
    write_test(tmp_path / "good.csv", "displacement_m,force_N")
    calibrate_compression(read_compression(tmp_path / "good.csv"), 0.0974, tmp_path, material="a")
    before = (tmp_path / "materials.csv").read_bytes()
    (tmp_path / "short.csv").write_text("displacement_m,force_N\n0,0\n0.001,1\n0.002,2\n", encoding="utf-8")
    with pytest.raises(TooFewMeasurementsError, match="the good row of an earlier calibration stays"):
        calibrate_compression(read_compression(tmp_path / "short.csv"), 0.0974, tmp_path, material="a")
    assert (tmp_path / "materials.csv").read_bytes() == before


def test_a_force_of_the_wrong_sign_leaves_the_cells_empty(tmp_path):
    write_test(tmp_path / "test.csv", "displacement_m,force_N", modulus=-6900.0)
    with pytest.raises(TooFewMeasurementsError, match="the signs"):
        calibrate_compression(read_compression(tmp_path / "test.csv"), 0.0974, tmp_path)
    row = read_table(tmp_path, "materials").iloc[0]
    assert row["status"] == "not_identified"
    assert row[["g_inf_pa", "g_inf_pa_unc"]].isna().all()
