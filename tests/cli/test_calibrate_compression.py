"""``wentry calibrate compression``: a mistake is a sentence and leaves nothing behind."""

import re

import numpy as np
import pytest

from wentry_cli.mechanics.compression import compression_force
from wentry_cli.stages.calibrate.rows import fitted_numbers
from wentry_cli.tables import read_table


def write_test(path, header="displacement_m,force_N"):
    d = np.linspace(0.0, 0.012, 40)
    force = 6900.0 * 0.051**2 * compression_force(d / 0.051)
    lines = [header, *(f"{a:.9g},{b:.9g}" for a, b in zip(d, force, strict=True)), "0.013,nan"]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize("diameter", ["-0.05", "0", "nan", "inf", "51"])
def test_wrong_diameters_are_usage(tmp_path, wentry, diameter):
    test = write_test(tmp_path / "test.csv")
    done = wentry("calibrate", "compression", test, "--diameter-m", diameter, "-o", tmp_path / "r")
    assert done.code == 2
    assert f"{diameter} is no diameter in metres: it must be positive, finite and at most 1." in done.err
    assert not (tmp_path / "r").exists()


@pytest.mark.parametrize("material", ["=cmd()", "a\nb", " "])
def test_a_material_that_spoils_the_table_is_usage(tmp_path, wentry, material):
    words = ("--diameter-m", "0.05", "--material", material, "-o", tmp_path / "r")
    done = wentry("calibrate", "compression", write_test(tmp_path / "test.csv"), *words)
    assert done.code == 2
    assert f"{material!r} is no key: it must be one line of text that does not begin with = + - @." in done.err
    assert not (tmp_path / "r").exists()


def test_an_unreadable_test_makes_no_folder(tmp_path, wentry):
    (tmp_path / "test.csv").write_text("displacement_m;force_N\n0,1;2,5\n", encoding="utf-8")
    done = wentry("calibrate", "compression", tmp_path / "test.csv", "--diameter-m", "0.051", "-o", tmp_path / "r")
    assert done.code == 4
    assert "semicolons" in done.err
    assert not (tmp_path / "r").exists()


def test_a_failed_test_keeps_the_good_row(tmp_path, wentry):
    words = ("--diameter-m", "0.051", "--material", "soft", "-o", tmp_path / "r")
    done = wentry("calibrate", "compression", write_test(tmp_path / "good.csv"), *words)
    assert done.code == 0
    assert "left out for want of two finite numbers: line 42" in done.err
    told = re.match(r"soft g_inf_pa (\S+) ± \S+ \(95 %: \S+ to \S+\), zero_m \S+ ± \S+ \(ok\)$", done.out)
    assert told
    assert float(told.group(1)) == pytest.approx(6900.0)
    before = (tmp_path / "r" / "materials.csv").read_bytes()
    curve = read_table(tmp_path / "r", "compression")
    assert len(curve) == 40
    assert curve["force_model_n"].to_numpy() == pytest.approx(curve["force_n"].to_numpy(), abs=1e-4)
    (tmp_path / "short.csv").write_text("displacement_m,force_N\n0,0\n0.001,1\n0.002,2\n", encoding="utf-8")
    done = wentry("calibrate", "compression", tmp_path / "short.csv", *words)
    assert done.code == 5
    assert "G_inf is not determined, it has 2 of the 6 points with a load that are needed; check the units" in done.err
    assert "the good row of an earlier calibration stays" in done.err
    assert (tmp_path / "r" / "materials.csv").read_bytes() == before
    assert len(read_table(tmp_path / "r", "compression")) == 40


@pytest.mark.parametrize("drops", [False, True])
def test_what_comes_next_begins_with_the_fit_of_the_drops_that_are_there(tmp_path, wentry, drops):
    results = tmp_path / "r"
    if drops:
        (results / "a").mkdir(parents=True)
        (results / "a" / "drop.json").write_text("{}", encoding="utf-8")
    done = wentry(
        "calibrate", "compression", write_test(tmp_path / "test.csv"), "--diameter-m", "0.051", "-o", results
    )  # fmt: skip
    assert (f"next: wentry fit {results}, then wentry report {results} draws the test" in done.err) == drops


def test_a_test_alone_has_a_report_which_a_new_test_renews(tmp_path, wentry):
    results = tmp_path / "r"
    words = ("--diameter-m", "0.051", "-o", results)
    done = wentry("calibrate", "compression", write_test(tmp_path / "test.csv"), *words)
    assert f"wentry report {results} draws the test" in done.err
    assert wentry("report", results).code == 0
    assert (results / "figures" / "fig_11_compression.svg").is_file()
    page = (results / "report.html").read_text(encoding="utf-8")
    assert "Compression of spheres" in page
    assert 'id="drops"' not in page
    assert "show today's results already" in wentry("report", results).err
    assert wentry("calibrate", "compression", tmp_path / "test.csv", "--material", "b", *words).code == 0
    assert "report done" in wentry("report", results).err
    done = wentry("report", results, "--drop", "a")
    assert done.code == 4
    assert "holds no processed drop" in done.err
    (results / "compression.csv").unlink()
    assert wentry("report", results).code == 4


def test_the_curve_of_a_sphere_replaces_its_earlier_one(tmp_path, wentry):
    for material in ("soft", "hard", "soft"):
        words = ("--diameter-m", "0.051", "--material", material, "-o", tmp_path / "r")
        assert wentry("calibrate", "compression", write_test(tmp_path / "test.csv"), *words).code == 0
    assert read_table(tmp_path / "r", "compression")["material"].tolist() == ["hard"] * 40 + ["soft"] * 40


def test_numbers_are_told_to_the_digits_of_their_uncertainty():
    row = {"g_inf_pa": 59365.3, "g_inf_pa_unc": 741.2, "g_inf_low_pa": 57861.2, "g_inf_high_pa": 60869.4}
    row |= {"n": -0.1934, "n_unc": 0.0123, "n_low": None, "n_high": None, "zero_m": None}
    assert fitted_numbers(row) == "g_inf_pa 59370 ± 740 (95 %: 57860 to 60870), n −0.193 ± 0.012"


def test_no_summary_of_a_command_is_cut(wentry):
    assert "..." not in wentry("calibrate", "--help").out.partition("Commands:")[2]
