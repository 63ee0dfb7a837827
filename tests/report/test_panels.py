"""Panels: the numbers drawn are the numbers in the table behind, and the lines are what they say."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from fixture_campaign import CAMPAIGN, Made, write_campaign
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from wentry_cli.mechanics.compression import compression_force
from wentry_cli.report.campaign import Campaign, example_drop, read_campaign
from wentry_cli.report.curves import conditions, mean_and_spread, mean_curve
from wentry_cli.report.drawing import draw_panel, styled
from wentry_cli.report.drop_sheets import drop_sheets
from wentry_cli.report.flight_motion import flight_velocity
from wentry_cli.report.force_panels import force_coefficients
from wentry_cli.report.legends import stiffness_handles
from wentry_cli.report.moments import telling_moments
from wentry_cli.report.names import file_stem
from wentry_cli.report.numbers import fixed, or_reason, with_uncertainty
from wentry_cli.report.page import page_title
from wentry_cli.report.panel import NotDrawn, Panel, merged
from wentry_cli.report.panels import campaign_panels, drop_panels
from wentry_cli.report.pinch_off_panels import _numbers
from wentry_cli.report.strip_frames import _chosen_rows
from wentry_cli.report.style import GREEN, VERMILION, plain, stiffness_shade
from wentry_cli.report.tabulation import drop_table, entry_table, flight_table
from wentry_cli.report.theory import added_mass_prefactor, published_pinch_off_band, ring_model_pinch_off
from wentry_cli.report.velocity_panels import speed_groups, velocity_change, with_gaps
from wentry_cli.report.words import MEANINGS
from wentry_cli.schemas import STATUS_WORDS
from wentry_cli.tables import new_table


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Campaign:
    results = tmp_path_factory.mktemp("panels")
    return read_campaign(results, write_campaign(results))


@pytest.fixture(scope="module")
def panels(campaign: Campaign) -> list[Panel]:
    return [panel for panel in campaign_panels(campaign) + drop_panels(campaign) if isinstance(panel, Panel)]


@pytest.fixture(scope="module")
def figures(panels: list[Panel]) -> list[tuple[Panel, Figure]]:
    with styled():
        return [(panel, draw_panel(panel)) for panel in panels]


def _drawn_points(figure: Figure) -> np.ndarray:
    points = []
    for ax in figure.axes:
        for line in (artist for artist in ax.get_children() if isinstance(artist, Line2D)):
            if line.get_transform().contains_branch(ax.transData) and len(line.get_xdata()):
                points.append(
                    np.column_stack([np.asarray(line.get_xdata(), float), np.asarray(line.get_ydata(), float)])
                )
    return np.vstack(points)


def test_drawn_numbers_stand_in_the_table_behind(figures: list[tuple[Panel, Figure]]) -> None:
    assert len(figures) > 20
    for panel, figure in figures:
        drawn = _drawn_points(figure)
        known = panel.data.select_dtypes("number").to_numpy(float).ravel()
        known = np.unique(np.append(known[np.isfinite(known)], [0.0, 1.0, 0.2]))
        values = drawn[np.isfinite(drawn)]
        nearest = known[np.clip(np.searchsorted(known, values), 1, known.size - 1)]
        nearest = np.where(abs(nearest - values) < abs(known[np.searchsorted(known, nearest) - 1] - values),
                           nearest, known[np.searchsorted(known, nearest) - 1])  # fmt: skip
        spare = {"sheet"}  # the time of pinch-off is marked there, from the summary
        wrong = abs(nearest - values) > 1e-9 * np.maximum(abs(values), 1e-12)
        assert wrong.mean() <= (0.01 if panel.key in spare else 0.0), panel.stem


def test_no_text_overlaps_another_in_a_panel(figures: list[tuple[Panel, Figure]]) -> None:
    for panel, figure in figures:
        with styled():
            for ax in figure.axes:
                for axis in (ax.xaxis, ax.yaxis):
                    boxes = [label.get_window_extent() for label in axis.get_ticklabels() if label.get_visible()]
                    inside = [box for box in boxes if box.width > 0]
                    pairs = [(a, b) for i, a in enumerate(inside) for b in inside[i + 1 :]]
                    assert not any(a.overlaps(b) and a.bounds != b.bounds for a, b in pairs), panel.stem


@pytest.mark.parametrize("places", [range(len(CAMPAIGN)), (5,)], ids=["campaign", "one drop"])
def test_legends_hide_nothing(tmp_path: Path, places: Iterable[int]) -> None:
    """A legend stands above its axes and within the picture."""
    results = read_campaign(tmp_path, write_campaign(tmp_path, tuple(CAMPAIGN[place] for place in places)))
    seen = 0
    for panel in [*campaign_panels(results), *drop_panels(results)]:
        figure = _drawn(panel) if isinstance(panel, Panel) else Figure()
        for ax in figure.axes:
            legend = ax.get_legend()
            if legend is not None:
                box = legend.get_window_extent()
                assert box.y0 >= ax.get_window_extent().y1 - 1.0, panel
                assert box.x0 >= -1.0, panel
                assert box.y1 <= figure.bbox.height + 1.0, panel
                seen += 1
    assert seen >= 9


def test_a_line_of_the_models_peaks_joins_drops_of_one_sphere_only(panels: list[Panel]) -> None:
    panel = next(panel for panel in panels if panel.key == "4c")
    ax = _drawn(panel).axes[0]
    model = panel.data[panel.data["series"] == "model"]
    for line in ax.get_lines():
        drawn = model[model["stretch_peak"].isin(np.asarray(line.get_ydata(), float))]
        if line.get_color() in {VERMILION, GREEN} and len(drawn) > 0:
            assert len(drawn[["g_inf_pa", "diameter_m"]].drop_duplicates()) == 1


def test_every_symbol_of_a_seal_is_in_the_legend(panels: list[Panel]) -> None:
    for key in ("4b", "6a", "7d"):
        panel = next(panel for panel in panels if panel.key == key)
        texts = [text.get_text() for text in _drawn(panel).axes[0].get_legend().get_texts()]
        assert "sphere seal" in texts, key


def test_bottom_position_is_in_diameters_and_pinch_off_times(campaign: Campaign, panels: list[Panel]) -> None:
    panel = next(panel for panel in panels if panel.key == "3c")
    drop = next(drop for drop in campaign.drops if drop.name == panel.drop)
    side = drop.table("side").dropna(subset=["y_b_m"])
    shown = panel.data[panel.data["series"] == "measured"]
    t_p, diameter = drop.number("t_p_s"), drop.number("diameter_m")
    side = side[side["t_s"] <= 1.15 * t_p]
    np.testing.assert_allclose(shown["t_over_tp"], side["t_s"].to_numpy() / t_p)
    np.testing.assert_allclose(shown["y_b_over_d"], side["y_b_m"].to_numpy() / diameter)
    np.testing.assert_allclose(shown["y_b_over_d_unc"], 2e-5 / diameter)


def test_example_drop_is_the_one_nearest_to_the_papers(panels: list[Panel]) -> None:
    assert {panel.drop for panel in panels if panel.key in {"3c", "3d", "4d"}} == {"g6p9_d51_h153"}


def test_the_only_drop_of_a_panel_is_named_alone(campaign: Campaign, panels: list[Panel]) -> None:
    singles = {"3c", "3d", "4d"}
    assert all("nearest to the paper's case" in panel.caption for panel in panels if panel.key in singles)
    for choice in ({"g6p9_d51_h153"}, {drop.name for drop in campaign.drops if drop.rigid}):
        few = replace(campaign, drops=tuple(drop for drop in campaign.drops if drop.name in choice)[:1])
        shown = [p for p in campaign_panels(few) if isinstance(p, Panel) and p.key in singles]
        assert shown
        assert not any("those with" in panel.caption or "first with" in panel.caption for panel in shown)


def test_compression_test_is_drawn_with_its_curve(campaign: Campaign) -> None:
    d = np.linspace(0.0, 0.01, 30)
    points = {
        "material": ["soft"] * 30,
        "sphere_id": [None] * 30,
        "displacement_m": d,
        "force_n": d,
        "force_model_n": 2 * d,
    }
    tested = replace(campaign, compression=new_table("compression", points))
    panel = next(panel for panel in campaign_panels(tested) if panel.key == "11")
    assert isinstance(panel, Panel)
    figure = Figure()
    panel.draw(figure)
    measured, line = figure.axes[0].get_lines()
    assert measured.get_ydata() == pytest.approx(d)
    assert line.get_ydata() == pytest.approx(2 * d)
    assert line.get_xdata() == pytest.approx(1e3 * d)


def test_compression_is_drawn_over_the_diameter_with_its_modulus(campaign: Campaign) -> None:
    d = np.linspace(0.0, 0.01, 30)
    points = {"material": ["soft"] * 30, "diameter_m": 0.05, "displacement_m": d, "force_n": d, "force_model_n": 2 * d}
    fitted = new_table("materials", {"material": ["soft"], "g_inf_pa": 5507.0, "g_inf_pa_unc": 32.0, "status": "ok"})
    tested = replace(campaign, compression=new_table("compression", points), materials=fitted)
    panel = next(panel for panel in campaign_panels(tested) if panel.key == "11")
    assert isinstance(panel, Panel)
    ax = _drawn(panel).axes[0]
    assert ax.get_lines()[1].get_xdata() == pytest.approx(d / 0.05)
    assert "5.507 ± 0.032 kPa" in ax.get_legend().get_texts()[1].get_text()


def test_the_curve_of_a_compression_test_has_no_corners(campaign: Campaign) -> None:
    """Of six points the curve between them is drawn too: the same as of many."""
    zero, size, g_inf = -0.0005, 0.05, 6000.0
    curves = []
    for count in (6, 60):
        d = np.linspace(0.0, 0.01, count)
        force = g_inf * size**2 * compression_force((d - zero) / size)
        points = {"material": ["soft"] * count, "diameter_m": size, "zero_m": zero, "displacement_m": d,
                  "force_n": force, "force_model_n": force}  # fmt: skip
        fitted = new_table("materials", {"material": ["soft"], "g_inf_pa": g_inf, "status": "ok"})
        tested = replace(campaign, compression=new_table("compression", points), materials=fitted)
        panel = next(panel for panel in campaign_panels(tested) if panel.key == "11")
        assert isinstance(panel, Panel)
        curves.append(np.asarray(_drawn(panel).axes[0].get_lines()[1].get_xydata()))
    assert len(curves[0]) > 100
    np.testing.assert_allclose(*curves, rtol=1e-6)


def test_a_sheet_names_only_what_it_shows(campaign: Campaign) -> None:
    for drop, sheet in zip((d for d in campaign.drops if d.kind != "free_flight"), drop_sheets(campaign), strict=True):
        assert isinstance(sheet, Panel)
        for name in ("separation line", "centre of mass"):
            drawn = name in set(sheet.data.loc[sheet.data["part"] == "position", "series"])
            assert drawn == (name in sheet.caption.split(";")[0]), drop.name
        assert ("λ_p = 1" in sheet.caption) == (drop.kind == "surface_impact")


def test_the_line_of_a_calibrated_drop_is_its_fit(campaign: Campaign) -> None:
    impact = campaign.of("surface_impact")[0]
    columns = {"drop": [impact.name] * 3, "t_s": [0.0, 0.01, 0.02], "stretch": [1.3, 0.9, 1.1]}
    fitted = replace(campaign, calibration=new_table("calibration", columns))
    drawn = [panel for panel in campaign_panels(fitted) if isinstance(panel, Panel) and panel.key == "12b"]
    data = next(panel.data for panel in drawn if impact.name in set(panel.data["drop"]))
    line = data[(data["drop"] == impact.name) & (data["series"] == "model, calibrated")]
    assert line["t_ms"].tolist() == pytest.approx([0.0, 10.0, 20.0])
    assert line["stretch"].tolist() == [1.3, 0.9, 1.1]
    assert "joint fit" in drawn[0].caption


def _drawn(panel: Panel) -> Figure:
    with styled():
        return draw_panel(panel)


def test_the_legend_of_the_plate_names_each_drop_and_the_line(tmp_path: Path) -> None:
    """Drops of one speed are told apart by their names."""
    plate = Made("plate_a", kind="surface_impact", sphere="S2")
    drops = (plate, replace(plate, name="plate_b"), replace(plate, name="plate_c", speed=3.2))
    (panel,) = (p for p in campaign_panels(read_campaign(tmp_path, write_campaign(tmp_path, drops))) if p.key == "12b")
    assert isinstance(panel, Panel)
    texts = [text.get_text() for text in _drawn(panel).axes[0].get_legend().get_texts()]
    assert sorted(texts) == [
        "$U_0$ = 3.20 m/s", "$U_0$ = 5.30 m/s, plate_a", "$U_0$ = 5.30 m/s, plate_b", "model, time scaled",
    ]  # fmt: skip


@pytest.mark.parametrize("key", ["3c", "3d", "4d", "12b", "sheet"])
def test_limits_follow_the_curve_not_the_uncertainty_at_impact(campaign: Campaign, key: str) -> None:
    def doubted(name: str, column: str, table: pd.DataFrame) -> pd.DataFrame:
        changed = table.copy()
        if column in changed.columns and name in {"side", "stretch"}:
            changed.loc[changed.index[len(changed) // 9], column] = 50.0
        return changed

    columns = {"side": "y_b_m_unc", "stretch": "stretch_unc"}
    drops = [
        replace(drop, tables={name: doubted(name, columns.get(name, ""), t) for name, t in drop.tables.items()})
        for drop in campaign.drops
    ]
    spoilt = replace(campaign, drops=tuple(drops))
    sound, doubtful = (
        next(p for p in [*campaign_panels(one), *drop_panels(one)] if p.key == key and _is_soft(p))
        for one in (campaign, spoilt)
    )
    assert isinstance(sound, Panel)
    assert isinstance(doubtful, Panel)
    unc = doubtful.data.filter(like="_unc").to_numpy(float)
    assert np.nanmax(unc) >= 50.0
    for before, after in zip(_drawn(sound).axes, _drawn(doubtful).axes, strict=True):
        assert after.get_ylim() == pytest.approx(before.get_ylim())


def _is_soft(panel: Panel | NotDrawn) -> bool:
    return not isinstance(panel, Panel) or "rigid" not in panel.drop


def test_a_curve_is_broken_where_its_uncertainty_exceeds_the_axis() -> None:
    curve = pd.DataFrame({"t": [0.0, 1.0, 2.0, 3.0], "v": [1.0, 2.0, 3.0, 4.0], "u": [0.1, 9.0, math.nan, 0.1]})
    assert with_gaps(curve, known_to=5.0)["v"].tolist() == pytest.approx([1.0, math.nan, 3.0, 4.0], nan_ok=True)
    assert with_gaps(curve)["v"].tolist() == [1.0, 2.0, 3.0, 4.0]


def test_the_axes_of_the_force_coefficient_end_where_its_values_do(campaign: Campaign) -> None:
    """Neither an error bar longer than the rest nor a period after what is shown widens them."""
    soft = campaign.drops[1]
    forces = soft.table("forces").copy()
    forces.loc[2, "force_coefficient_unc"] = 80.0
    late = forces.tail(1).assign(t_mid_over_tp=3.0, force_coefficient=-40.0)
    wild = replace(soft, tables={**soft.tables, "forces": pd.concat([forces, late], ignore_index=True)})
    panel = force_coefficients(replace(campaign, drops=(campaign.drops[0], wild)))
    assert isinstance(panel, Panel)
    ax = _drawn(panel).axes[0]
    last = float(panel.data["t_mid_over_tp"].max())
    assert last <= 1.5
    assert ax.get_xlim() == (0.0, pytest.approx(last, rel=0.05))
    low, high = ax.get_ylim()
    assert -0.6 < low < 0.0
    assert 1.1 < high < 1.6


def test_what_the_axis_of_the_force_coefficient_cuts_is_said(campaign: Campaign) -> None:
    rigid = campaign.drops[0]
    forces = rigid.table("forces").copy()
    for spike in (0.0, 40.0):
        forces.loc[3, "force_coefficient"] += spike
        panel = force_coefficients(
            replace(campaign, drops=(replace(rigid, tables={**rigid.tables, "forces": forces}),))
        )
        assert isinstance(panel, Panel)
        top = _drawn(panel).axes[0].get_ylim()[1]
        cut = float(panel.data["force_coefficient"].max())
        assert (cut > top) == (f"reach up to C_F = {with_uncertainty(cut, digits=3)}" in panel.caption)
    assert cut > top


def test_fit_line_of_the_period_is_the_table_s_slope(panels: list[Panel]) -> None:
    data = next(panel for panel in panels if panel.key == "4b").data
    fit = data[data["series"] == "fit experiment"].iloc[-1]
    assert fit["period_ms"] == pytest.approx(1.45 * fit["scale_ms"])
    assert fit["period_ms_low"] == pytest.approx(1.41 * fit["scale_ms"])
    point = data[(data["series"] == "experiment") & (data["g_inf_pa"] == 74690.0)].iloc[0]
    assert point["period_ms"] == pytest.approx(1.45 * point["scale_ms"])


def test_a_ratio_of_periods_that_is_not_known_is_said_and_the_model_drawn(tmp_path: Path) -> None:
    names = write_campaign(tmp_path, (CAMPAIGN[1],))
    campaign = read_campaign(tmp_path, names)
    (drop,) = campaign.drops
    unknown = {"time_ratio": math.nan, "time_ratio_unc": math.nan, "status": "not_identified"}
    tables = {**drop.tables, "model_fit": drop.table("model_fit").assign(**unknown),
              "model": drop.table("model").assign(t_scaled_s=math.nan)}  # fmt: skip
    panels = campaign_panels(replace(campaign, drops=(replace(drop, tables=tables),)))
    panel = next(panel for panel in panels if panel.key == "4d")
    assert isinstance(panel, Panel)
    assert "is not known" in panel.caption
    model = panel.data[panel.data["series"] == "model"]
    assert model["t_ms"].iloc[0] == pytest.approx(1e3 * drop.table("periods")["t_peak_s"].iloc[0])
    assert "model, time scaled" not in set(panel.data["series"])
    assert all("nan" not in p.caption for p in panels if isinstance(p, Panel))


def test_a_sheet_without_a_ratio_of_periods_has_no_time_scaled_model(tmp_path: Path) -> None:
    campaign = read_campaign(tmp_path, write_campaign(tmp_path, (CAMPAIGN[1],)))
    (drop,) = campaign.drops
    tables = {**drop.tables, "model_fit": drop.table("model_fit").assign(time_ratio=math.nan),
              "model": drop.table("model").assign(t_scaled_s=math.nan)}  # fmt: skip
    known, unknown = (drop_sheets(replace(campaign, drops=(one,)))[0] for one in (drop, replace(drop, tables=tables)))
    assert isinstance(known, Panel)
    assert isinstance(unknown, Panel)
    assert "time-scaled model" in known.caption
    assert "time-scaled model" not in unknown.caption
    assert "T_exp/T_model is not known" in unknown.caption
    assert set(known.data["series"]) - set(unknown.data["series"]) == {"model, time scaled", "model stretch"}


def test_intercept_in_seconds_is_drawn_in_milliseconds(tmp_path: Path) -> None:
    from wentry_cli.report.fits import fit_rows

    line = fit_rows("fit", {"slope": 2.0, "intercept": 0.003}, np.array([0.0, 10.0]), "x", "y", 1e3)
    np.testing.assert_allclose(line["y"], [3.0, 23.0])


def test_repeated_drops_are_one_point_with_their_spread(panels: list[Panel]) -> None:
    data = next(panel for panel in panels if panel.key == "6a").data
    twice = data[data["repeats"] == 2]
    assert len(twice) == 1
    row = twice.iloc[0]
    assert row["drop"] == "g6p9_d51_h153 + g6p9_d51_h153_again"
    assert row["froude_unc"] == pytest.approx(0.04 / math.sqrt(2) / math.sqrt(9.81 * 0.051), rel=1e-6)


def test_spread_is_never_less_than_the_uncertainty_of_the_mean() -> None:
    mean, spread = mean_and_spread(np.array([1.0, 1.0, math.nan]), np.array([0.4, 0.4, 9.0]))
    assert mean == 1.0
    assert spread == pytest.approx(0.4 / math.sqrt(2))
    assert all(math.isnan(value) for value in mean_and_spread(np.array([math.nan]), np.array([1.0])))


def test_mean_curve_of_two_lines() -> None:
    t = np.linspace(0.0, 1.0, 21)
    x, mean, spread = mean_curve([(t, t, 0 * t), (t + 0.005, 3 * (t + 0.005), 0 * t)])
    np.testing.assert_allclose(mean, 2 * x)
    np.testing.assert_allclose(spread, math.sqrt(2) * x)


def test_conditions_do_not_join_drops_without_one(campaign: Campaign) -> None:
    groups = conditions(campaign.drops)
    assert sorted(map(len, groups)) == [1] * 7 + [2]


def test_repeats_of_another_material_or_in_doubt_are_not_averaged(campaign: Campaign) -> None:
    one, other = next(group for group in conditions(campaign.drops) if len(group) == 2)

    def apart(**changed: object) -> list[int]:
        return sorted(map(len, conditions([one, replace(other, summary=other.summary | changed)])))

    assert apart() == [2]
    assert apart(g_inf_pa=1.0) == [1, 1]
    assert apart(doubts="fall before impact") == [1, 1]


def test_velocities_are_grouped_by_speed(campaign: Campaign) -> None:
    entries = campaign.of("water_entry")
    assert [[drop.number("impact_speed_m_s") for drop in group] for group in speed_groups(entries)] == [
        [3.1], [5.3, 5.3, 5.34, 5.4], [6.5],
    ]  # fmt: skip


def test_no_line_where_nothing_was_fitted(tmp_path: Path) -> None:
    names = write_campaign(tmp_path)
    (tmp_path / "scaling.csv").unlink()
    panels = {panel.key: panel for panel in campaign_panels(read_campaign(tmp_path, names))}
    for key, series in (("4b", "fit experiment"), ("6b", "fit"), ("7d", "fit")):
        panel = panels[key]
        assert isinstance(panel, Panel)
        assert series not in set(panel.data["series"])
        assert "not fitted" in panel.caption


def test_sphere_seal_has_no_effective_diameter(panels: list[Panel]) -> None:
    keys = {panel.key: panel.data for panel in panels}
    assert "sphere_seal" in set(keys["6a"]["seal_type"].dropna())
    assert "sphere_seal" not in set(keys["6b"]["seal_type"].dropna())


def test_the_uncertainty_of_the_effective_diameter_is_in_its_bars(campaign: Campaign) -> None:
    drop = next(d for d in campaign.drops if d.deformable_entry and math.isfinite(d.number("tp_u0_over_deff")))
    numbers = []
    for relative in (0.0, 0.05):
        doubtful = {**drop.summary, "diameter_eff_m_unc": relative * drop.number("diameter_eff_m")}
        numbers.append(_numbers("froude_eff", "tp_u0_over_deff")(replace(drop, summary=doubtful)))
    sure, doubt = numbers
    for name, power in (("froude_eff", 0.5), ("tp_u0_over_deff", 1.0)):
        added = power * 0.05 * sure[name]
        assert doubt[f"{name}_unc"] == pytest.approx(math.hypot(sure[f"{name}_unc"], added))


def test_the_speed_of_a_free_flight_names_the_scale(campaign: Campaign, panels: list[Panel]) -> None:
    (ball,) = campaign.of("free_flight")
    speed = flight_velocity(ball)
    assert speed.scale == pytest.approx(0.005 * abs(speed.value))
    assert speed.unc == pytest.approx(math.hypot(0.01, speed.scale))
    (panel,) = (p for p in panels if p.key == "free flight")
    assert f"{with_uncertainty(speed.value, speed.unc)} m/s (random 0.01, scale 0.0079)" in panel.caption
    table = flight_table(campaign)
    (row,) = table.rows
    assert row[0] == "ball"
    assert row[table.header.index("v, mid-clip (m/s)")] == "−1.620 ± 0.013"


@pytest.mark.parametrize(
    ("places", "title"),
    [
        ((8,), "Free flight"),
        ((0,), "Water entry of rigid spheres"),
        ((0, 1), "Water entry of deformable spheres"),
        ((1, 6, 8), "Water entry of deformable spheres, impact on a rigid surface and free flight"),
    ],
)
def test_the_title_names_what_was_filmed(tmp_path: Path, places: tuple[int, ...], title: str) -> None:
    drops = tuple(CAMPAIGN[i] for i in places)
    assert page_title(read_campaign(tmp_path, write_campaign(tmp_path, drops))) == title


def test_ring_model_tends_to_its_closed_form() -> None:
    # For large Fr: t_p U0/D = 2 sqrt(alpha) Fr + 1/2, closed form of the least z/U + 2 r0 alpha U/(g z).
    froude = np.array([40.0, 80.0])
    slope = np.diff(ring_model_pinch_off(froude, alpha=0.5)) / np.diff(froude)
    assert slope[0] == pytest.approx(2 * math.sqrt(0.5), rel=2e-3)


def test_published_band_has_the_slopes_of_its_prefactors() -> None:
    low, high = published_pinch_off_band(np.array([2.0]))
    assert low[0] / 2 == pytest.approx(1.202, abs=1e-3)
    assert high[0] / 2 == pytest.approx(1.626, abs=1e-3)


def test_added_mass_band_is_the_papers() -> None:
    assert added_mass_prefactor(0.74) == pytest.approx(0.8628, abs=1e-4)
    assert added_mass_prefactor(1.5) == pytest.approx(0.3357, abs=1e-4)


def test_softer_is_lighter_and_rigid_is_blue() -> None:
    shades = [int(stiffness_shade(g, False)[1:3], 16) for g in (1235.0, 6900.0, 74690.0)]
    assert shades == sorted(shades, reverse=True)
    assert stiffness_shade(math.nan, True) == "#0072B2"


@pytest.mark.parametrize(
    ("value", "unc", "text"),
    [
        (5.3123, 0.0112, "5.312 ± 0.011"),
        (103.7, 0.2, "103.70 ± 0.20"),
        (1234.5, 56.0, "1234 ± 56"),
        (123456.0, 789.0, "123460 ± 790"),
        (0.95, 0.0996, "0.95 ± 0.10"),
        (2.0, math.nan, "2"),
        (math.nan, 1.0, "–"),
        (-0.5, 0.0, "−0.5"),
        (-2.3e-5, math.nan, "−2.3e−05"),
        (74690.0, math.nan, "74690"),
        (1.1854, 257.2, "1 ± 257"),
        (0.0005267, 0.0012, "0.0005 ± 0.0012"),
        (0.1268, 2.5, "0.1 ± 2.5"),
    ],
)
def test_numbers_are_written_as_far_as_they_are_known(value: float, unc: float, text: str) -> None:
    assert with_uncertainty(value, unc) == text


def test_a_number_with_fixed_decimals_has_a_true_minus_unless_it_rounds_to_zero() -> None:
    assert [fixed(value, 1) for value in (-0.4, -0.04, 0.04, 12.25)] == ["−0.4", "0.0", "0.0", "12.2"]


def test_a_number_that_only_the_side_view_tells_says_that_there_is_none(campaign: Campaign) -> None:
    soft = campaign.drops[1]
    numbers = {name: value for name, value in soft.summary.items() if name not in {"impact_speed_m_s", "t_p_s"}}
    tables = {name: table for name, table in soft.tables.items() if name != "side"}
    table = drop_table(replace(campaign, drops=(replace(soft, summary=numbers, tables=tables), *campaign.drops[2:])))
    row = dict(zip(table.header, table.rows[0], strict=True))
    assert row["U₀ (m/s)"] == "– (not filmed from the side)"
    other = dict(zip(table.header, table.rows[1], strict=True))
    assert other["U₀ (m/s)"] == "5.340 ± 0.010"


def test_the_reason_of_a_missing_number_is_its_own(campaign: Campaign) -> None:
    """A sphere without a material whose cavity shows no neck: the status tells of the pinch-off."""
    soft = campaign.drops[1]
    gone = {"g_inf_pa", "stiffness_ratio", "t_p_s", "period_s", "impact_speed_m_s"}
    numbers = {name: value for name, value in soft.summary.items() if name not in gone} | {"status": "no_neck"}
    periods = soft.table("periods").assign(status="clip_ended")
    events = soft.table("events").assign(status="no_neck")
    drop = replace(soft, summary=numbers, tables={**soft.tables, "periods": periods, "events": events})
    row: dict[str, str] = {}
    for table in (drop_table, entry_table):
        found = table(replace(campaign, drops=(drop, *campaign.drops[2:])))
        row |= dict(zip(found.header, found.rows[0], strict=True))
    assert row["G∞ (kPa)"] == row["G∞/(ρ_w U₀²)"] == "– (no material)"
    assert row["T (ms)"] == "– (clip ended)"
    assert row["t_p (ms)"] == "– (no neck)"
    assert row["U₀ (m/s)"] == "– (no object)"


def test_a_loss_of_velocity_without_a_stiffness_is_not_called_missing(tmp_path: Path) -> None:
    campaign = read_campaign(tmp_path, write_campaign(tmp_path, (Made("a"),)))
    (drop,) = campaign.drops
    drop = replace(drop, summary={**drop.summary, "g_inf_pa": math.nan, "stiffness_ratio": math.nan})
    panel = velocity_change(replace(campaign, drops=(drop,)))
    assert isinstance(panel, NotDrawn)
    assert "stiffness" in panel.reason


def test_the_colour_of_an_unknown_stiffness_is_in_the_legend() -> None:
    data = pd.DataFrame({"rigid": [False, False, True], "g_inf_pa": [6900.0, math.nan, math.nan]})
    entries = {handle.get_label(): handle.get_color() for handle in stiffness_handles(data)}
    assert entries["$G_\\infty$ not known"] == stiffness_shade(math.nan, False)
    assert len(entries) == 3
    assert len(stiffness_handles(data[data["g_inf_pa"].notna()])) == 1


def test_of_drops_alike_the_example_has_the_most_measured_frames(campaign: Campaign) -> None:
    first, second = campaign.drops[1:3]
    for most in (first, second):
        drops = [
            replace(drop, summary={**drop.summary, "frames_measured": 280 if drop is most else 120})
            for drop in (first, second)
        ]
        chosen = example_drop(drops, "side")
        assert chosen is not None
        assert chosen.name == most.name


def test_a_dash_says_why() -> None:
    assert or_reason("–", "clip_ended") == "– (clip ended)"
    assert or_reason("–", "ok") == "–"
    assert or_reason("3", "clip_ended") == "3"


def test_every_status_word_is_explained() -> None:
    assert set(MEANINGS) == set(STATUS_WORDS)


def test_file_names_stay_apart_and_tame() -> None:
    names = ["a/b", "a b", "a_b", "../..", "", "ä", "x" * 300, "\udcff"]
    stems = [file_stem(name) for name in names]
    assert len(set(stems)) == len(names)
    assert all(0 < len(stem) < 100 and not stem.startswith(".") for stem in stems)


def test_text_from_outside_is_no_mathematics() -> None:
    assert plain("$a$\x00") == r"\$a\$?"


def test_where_nothing_enters_water_its_panels_have_one_reason(tmp_path: Path) -> None:
    ball = next(made for made in CAMPAIGN if made.kind == "free_flight")
    flights = read_campaign(tmp_path, write_campaign(tmp_path, (ball,)))
    missing = [panel for panel in campaign_panels(flights) if isinstance(panel, NotDrawn)]
    assert [panel.key for panel in missing if panel.key[0] in "345678"] == ["3–8"]


def test_same_reasons_are_said_once() -> None:
    gone = [NotDrawn("film strip", name, "gone") for name in ("a", "b", "a")]
    assert merged([*gone, NotDrawn("11", "c", "none")]) == [
        NotDrawn("film strip", "a; b", "gone"), NotDrawn("11", "c", "none"),
    ]  # fmt: skip


def test_moments_are_frames_of_the_leading_view_and_all_have_a_label(campaign: Campaign) -> None:
    for drop in campaign.drops:
        side = drop.table("side")
        measured = side.loc[side["status"] == "ok", "t_s"].astype(float)
        moments = telling_moments(drop)
        assert len(moments) == 7
        times = [moment.t_s for moment in moments]
        assert times == sorted(times)
        assert set(times) <= set(side["t_s"].astype(float))
        assert measured.min() <= times[0]
        assert times[-1] <= measured.max()
        assert all(moment.label for moment in moments)
    labels = {moment.label for moment in telling_moments(campaign.drops[1])}
    assert {"impact", "pinch-off", "widest, N = 1", "longest, N = 1"} <= labels


@pytest.mark.parametrize("status", ["ok", "occluded"])
def test_both_strips_show_the_frame_nearest_to_an_event_whatever_was_measured_in_it(
    campaign: Campaign, status: str
) -> None:
    """The top view, which was hidden at the peak, shows the same frame as the side view."""
    drop = campaign.drops[1]
    peak = drop.table("periods")["t_peak_s"].iloc[0]
    side, top = drop.table("side").copy(), drop.table("top").copy()
    at_peak = (side["t_s"] - peak).abs().idxmin()
    side.loc[at_peak, "status"] = status
    top.loc[at_peak - 2 : at_peak + 2, "status"] = "occluded"
    spoilt = replace(drop, tables={**drop.tables, "side": side, "top": top})
    for view in ("side", "top"):
        chosen = _chosen_rows(spoilt.table(view), telling_moments(spoilt))
        (row,) = [row for moment, row in chosen if moment.label == "widest, N = 1"]
        assert row["frame"] == side.loc[at_peak, "frame"]


def test_a_frame_that_cannot_be_shown_is_not_chosen(campaign: Campaign) -> None:
    drop = campaign.drops[1]
    side = drop.table("side").copy()
    contact = side["t_s"].abs().idxmin()
    side.loc[contact, "status"] = "bad_frame"
    (impact,) = [
        moment for moment in telling_moments(replace(drop, tables={**drop.tables, "side": side}))
        if moment.label == "impact"
    ]  # fmt: skip
    assert abs(side["t_s"] - impact.t_s).idxmin() in (contact - 1, contact + 1)


def test_a_pinch_off_after_the_sphere_has_left_the_image_is_in_the_strip(campaign: Campaign) -> None:
    drop = campaign.drops[1]
    side = drop.table("side").copy()
    side.loc[side["t_s"] > 0.6 * drop.number("t_p_s"), "status"] = "out_of_frame"
    moments = telling_moments(replace(drop, tables={**drop.tables, "side": side}))
    assert moments[-1].label == "pinch-off"
    assert moments[-1].t_s == pytest.approx(drop.number("t_p_s"), abs=2.6e-4)
    assert len(moments) == 7


def test_a_view_shows_no_frame_of_another_time(campaign: Campaign) -> None:
    """A top view that ended before pinch-off has no picture of it."""
    drop = campaign.drops[1]
    top = drop.table("top")
    top = top[top["t_s"] < 0.8 * drop.number("t_p_s")]
    assert "pinch-off" not in {moment.label for moment, _ in _chosen_rows(top, telling_moments(drop))}


def test_vertical_lines_are_the_frames_of_the_strip(campaign: Campaign, panels: list[Panel]) -> None:
    (panel,) = [panel for panel in panels if panel.key == "3d"]
    (drop,) = [drop for drop in campaign.drops if drop.name == panel.drop]
    lines = panel.data.loc[panel.data["series"] == "moment", "t_ms"]
    shown = [1e3 * row["t_s"] for _, row in _chosen_rows(drop.table("side"), telling_moments(drop))]
    assert list(lines) == pytest.approx(shown)


def test_a_drop_that_stands_still_has_no_moments() -> None:
    from wentry_cli.report.campaign import DropResults

    assert telling_moments(DropResults("x", {}, {})) == []
    assert Made("x").ratio > 0
    assert CAMPAIGN[0].rigid
