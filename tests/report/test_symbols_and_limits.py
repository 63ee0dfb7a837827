"""Nothing that a figure shows is hidden, cut or without a name."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from fixture_campaign import CAMPAIGN, write_campaign
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from wentry_cli.report.campaign import Campaign, read_campaign
from wentry_cli.report.drawing import draw_panel, styled
from wentry_cli.report.drop_sheets import drop_sheets
from wentry_cli.report.force_panels import force_coefficients
from wentry_cli.report.free_flight_panels import free_flights
from wentry_cli.report.legends import draw_points, uncover
from wentry_cli.report.oscillation_panels import PERIOD_LINES
from wentry_cli.report.panel import Panel
from wentry_cli.report.panels import campaign_panels
from wentry_cli.report.symbols import as_html


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Campaign:
    folder: Path = tmp_path_factory.mktemp("shown")
    return read_campaign(folder, write_campaign(folder, CAMPAIGN))


def drawn(panel: object) -> Figure:
    assert isinstance(panel, Panel)
    with styled():
        return draw_panel(panel)


def test_a_symbol_on_another_is_open_and_the_small_one_lies_on_top() -> None:
    ax = Figure().subplots()
    places = {"x": [1.0, 1.0, 1.0, 3.0], "y": [1.0, 1.01, 3.0, 3.0], "diameter_m": [0.051, 0.1, 0.051, 0.051]}
    draw_points(
        ax, pd.DataFrame(places).assign(rigid=False, g_inf_pa=[1e3, 7e3, 7e3, 7e3], seal_type="", doubts=""), "x", "y"
    )
    ax.set(xlim=(0, 4), ylim=(0, 4))
    uncover(ax)
    small, large, *others = [container.lines[0] for container in ax.containers]
    assert small.get_markerfacecolor() == "none"
    assert small.get_zorder() > large.get_zorder()
    assert all(mark.get_markerfacecolor() != "none" for mark in (large, *others))


def test_symbols_of_a_peak_have_the_colour_of_its_line(campaign: Campaign) -> None:
    panel = next(panel for panel in campaign_panels(campaign) if panel.key == "4c")
    legend = drawn(panel).axes[0].get_legend()
    assert legend is not None
    handles = dict(zip([text.get_text() for text in legend.get_texts()], legend.legend_handles, strict=True))
    for period in (2, 3):
        face = handles[f"$N$ = {period}"].get_markerfacecolor()  # type: ignore[union-attr]
        assert to_hex(face) == str(PERIOD_LINES[period]["color"]).lower()


def test_the_force_coefficient_is_defined_and_its_symbols_are_told_apart(campaign: Campaign) -> None:
    panel = force_coefficients(campaign)
    assert isinstance(panel, Panel)
    assert all(part in panel.caption for part in ("A = π (λ_pN D/2)²", "A = π D²/4", "Highest symbol: "))
    legend = drawn(panel).axes[0].get_legend()
    assert legend is not None
    assert any("G_" in text.get_text() for text in legend.get_texts())


def test_a_squared_velocity_has_its_index_lowered() -> None:
    assert as_html("ẏ_c² A, y_c2") == "ẏ<sub>c</sub>² A, y_c2"


def test_the_frame_of_a_free_flight_cuts_no_point_and_no_bar(campaign: Campaign) -> None:
    drop = campaign.of("free_flight")[0]
    table = pd.concat([drop.table("kinematics")] * 14, ignore_index=True)
    table["t_s"] = np.linspace(0.0, 0.1, len(table))
    many = replace(drop, tables={**drop.tables, "kinematics": table})
    (few_panel,), (panel,) = (free_flights(replace(campaign, drops=(one,))) for one in (drop, many))
    assert isinstance(panel, Panel)
    axes = drawn(panel).axes
    for ax, name in zip(axes[2:], "xy", strict=True):
        low, high = ax.get_ylim()
        bar = panel.data["y_unc_um"] if name == "y" else 0.0
        residual = panel.data[f"{name}_residual_um"]
        assert low < float((residual - bar).min())
        assert float((residual + bar).max()) < high
    sizes = [drawn(one).axes[1].lines[1].get_markersize() for one in (few_panel, panel)]
    assert sizes[1] < sizes[0]


def test_a_legend_of_a_sheet_stays_at_its_part(campaign: Campaign) -> None:
    for panel in drop_sheets(campaign):
        figure = drawn(panel)
        width = figure.bbox.width / (3 if len(figure.axes) == 3 else 2)
        for ax in figure.axes:
            legend = ax.get_legend()
            assert legend is None or legend.get_window_extent().width < width


def test_a_panel_of_one_drop_says_which_and_why(campaign: Campaign) -> None:
    panels = {panel.key: panel for panel in campaign_panels(campaign)}
    for key in ("3c", "3d", "4d"):
        panel = panels[key]
        assert isinstance(panel, Panel)
        assert f"drop {panel.drop} (of those with" in panel.caption
        assert "nearest to the paper's case" in panel.caption
