from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from drop_fixtures import Known, make_drop, motion, write_events, write_views

from wentry_cli.stages import stretch
from wentry_cli.tables import new_table, read_table, write_table


def write_top(folder: Path, known: Known, *, late: float = 0.0, until: float = 0.03) -> None:
    n = known.t.size
    random = np.random.default_rng(9)
    seen = np.interp(known.t + late, known.t, known.stretch) + 0.002 * random.normal(size=n)
    seen[known.t > until] = np.nan
    top = {
        "frame": np.arange(n),
        "t_s": known.t,
        "stretch": seen,
        "stretch_unc": np.where(np.isfinite(seen), 0.002, np.nan),
        "status": np.where(np.isfinite(seen), "ok", "occluded"),
    }
    write_table(folder, "top", new_table("top", top))


def test_both_views_become_one(tmp_path: Path) -> None:
    known = motion()
    write_views(tmp_path, known)
    write_top(tmp_path, known)
    write_events(tmp_path)
    stretch.run(tmp_path, make_drop())
    table = read_table(tmp_path, "stretch")
    early = table["t_s"] < 0.03
    assert set(table.loc[early, "source"]) == {"both"}
    assert set(table.loc[~early, "source"]) == {"side"}
    error = table["stretch"].to_numpy(float) - known.stretch
    assert np.sqrt(np.mean(error[early.to_numpy(bool)] ** 2)) < 0.0012
    assert table["stretch_top"].isna().sum() == (~early).sum()
    periods = read_table(tmp_path, "periods")
    assert list(periods["period"]) == list(range(1, len(periods) + 1))
    assert periods["t_end_s"][0] == pytest.approx(known.period, abs=4e-4)
    assert periods["peak_to_peak_s"][0] == pytest.approx(known.period, abs=2e-4)
    assert periods["status"].iloc[0] == "ok"
    assert periods["status"].iloc[-1] == "clip_ended"
    assert np.isnan(periods["t_end_s"].iloc[-1])


def test_views_that_contradict_each_other_are_not_merged(tmp_path: Path) -> None:
    known = motion()
    write_views(tmp_path, known)
    write_events(tmp_path)
    stretch.run(tmp_path, make_drop())
    alone = read_table(tmp_path, "periods")
    write_top(tmp_path, known, late=0.25 * known.period)
    stretch.run(tmp_path, make_drop())
    table, periods = read_table(tmp_path, "stretch"), read_table(tmp_path, "periods")
    assert set(table["source"].dropna()) == {"side"}
    assert table["stretch_top"].notna().sum() > 20, "what the top view saw is still shown"
    assert periods.equals(alone)


def test_views_that_contradict_each_other_are_doubted_where_the_side_view_shows_no_oscillation(tmp_path: Path) -> None:
    known = motion()
    write_views(tmp_path, known)
    side = read_table(tmp_path, "side")
    side.loc[(side["t_s"] < 0.0) | (side["t_s"] > 0.008), ["stretch", "stretch_unc"]] = np.nan
    write_table(tmp_path, "side", side)
    write_top(tmp_path, known, late=0.25 * known.period, until=1.0)
    stretch.run(tmp_path, make_drop())
    table, periods = read_table(tmp_path, "stretch"), read_table(tmp_path, "periods")
    common = table[table["source"] == "both"]
    assert len(common) >= 5
    apart = float((common["stretch_top"] - common["stretch_side"]).abs().median())
    assert apart > 0.02
    assert table["stretch_unc"].min() >= apart
    assert periods["stretch_peak_unc"].min() >= apart


def test_a_period_is_ok_only_where_all_of_it_is_known(tmp_path: Path) -> None:
    for frames in (300, 170, 163, 155, 140):
        write_views(tmp_path, motion(n=frames))
        stretch.run(tmp_path, make_drop())
        periods = read_table(tmp_path, "periods")
        whole = periods.drop(columns=["status"]).notna().all(axis=1)
        assert list(periods["status"] == "ok") == list(whole)
        assert periods["status"].iloc[-1] == "clip_ended"


def test_a_swing_that_dies_below_the_noise_is_not_a_clip_that_ended(tmp_path: Path) -> None:
    write_views(tmp_path, motion(amplitude=0.05, period=0.012, damping=90.0))
    stretch.run(tmp_path, make_drop())
    periods = read_table(tmp_path, "periods")
    assert 1 <= len(periods) < 6
    assert periods["status"].iloc[-1] == "not_identified"


def test_the_clocks_are_brought_together(tmp_path: Path) -> None:
    known = motion()
    write_views(tmp_path, known)
    write_top(tmp_path, known, late=6e-4)
    write_events(tmp_path)
    stretch.run(tmp_path, make_drop())
    table = read_table(tmp_path, "stretch")
    together = (table["source"] == "both").to_numpy(bool)
    apart = (table["stretch_top"] - table["stretch_side"]).to_numpy(float)[together]
    assert together.sum() > 90
    assert np.sqrt(np.mean(apart**2)) < 0.004


def test_gaps_and_bad_fits_stay_empty(tmp_path: Path) -> None:
    known = motion()
    write_views(tmp_path, known)
    side = read_table(tmp_path, "side")
    side.loc[100:105, ["stretch", "stretch_unc"]] = np.nan
    side.loc[110:112, "status"] = "poor_fit"
    write_table(tmp_path, "side", side)
    stretch.run(tmp_path, make_drop())
    table = read_table(tmp_path, "stretch")
    assert table["stretch"].isna().sum() == 9
    assert table["source"].isna().sum() == 9
    assert len(table) == known.t.size


def test_the_top_view_alone(tmp_path: Path) -> None:
    known = motion()
    write_top(tmp_path, known, until=1.0)
    stretch.run(tmp_path, make_drop(views={"top": {"source": "top", "fps": 2000.0}}))
    assert set(read_table(tmp_path, "stretch")["source"]) == {"top"}
    assert len(read_table(tmp_path, "periods")) >= 4


def test_nothing_that_rings(tmp_path: Path) -> None:
    write_views(tmp_path, motion(amplitude=0.0))
    stretch.run(tmp_path, make_drop())
    periods = read_table(tmp_path, "periods")
    assert list(periods["status"]) == ["too_few"]
    assert periods["stretch_peak"].isna().all()


def test_nothing_that_was_tracked(tmp_path: Path) -> None:
    stretch.run(tmp_path, make_drop())
    assert not list(tmp_path.iterdir())
