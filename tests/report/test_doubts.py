"""Drops whose measurements contradict what was told: they stay in tables, regressions and figures, and are marked."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest
from fixture_campaign import CAMPAIGN, write_campaign
from matplotlib.figure import Figure

from wentry_cli.report.campaign import Campaign, read_campaign
from wentry_cli.report.drawing import draw_panel, styled
from wentry_cli.report.legends import plain_decades
from wentry_cli.report.page import Content, write_page
from wentry_cli.report.panel import Panel
from wentry_cli.report.panels import campaign_panels
from wentry_cli.report.print_text import number_lines
from wentry_cli.report.regressions import regression_table
from wentry_cli.report.tabulation import check_table, drop_table
from wentry_cli.tables import new_table

DOUBTED, WHAT = "g74_d51_h053", "fall before impact; row of the surface"
SHOWN_IN = {"4b", "4c", "6a", "6b", "7d"}


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Campaign:
    folder: Path = tmp_path_factory.mktemp("doubts")
    return read_campaign(folder, write_campaign(folder, CAMPAIGN))


@pytest.fixture(scope="module")
def doubted(campaign: Campaign) -> Campaign:
    told = {"doubts": WHAT, "speed_from_height_m_s": 3.22, "speed_taken_by_air_m_s": 0.0161,
            "fall_acceleration_m_s2": 9.4, "fall_acceleration_m_s2_unc": 0.05}  # fmt: skip
    drops = [replace(d, summary={**d.summary, **told}) if d.name == DOUBTED else d for d in campaign.drops]
    return replace(campaign, drops=tuple(drops))


def crosses(figure: Figure) -> int:
    return sum(line.get_marker() == "x" and len(line.get_xdata()) for ax in figure.axes for line in ax.lines)


def test_figures_cross_the_points_of_a_drop_in_doubt(campaign: Campaign, doubted: Campaign) -> None:
    for made, expected in ((campaign, False), (doubted, True)):
        panels = {panel.key: panel for panel in campaign_panels(made) if isinstance(panel, Panel)}
        for key in SHOWN_IN:
            with styled():
                assert bool(crosses(draw_panel(panels[key]))) is expected, key
            named = f"Crossed, in doubt: {DOUBTED} ({WHAT})." in panels[key].caption
            assert named is expected, key
        told = [key for key, panel in panels.items() if f"In doubt: {DOUBTED}" in panel.caption]
        assert told == (["7a", "8"] if expected else [])


def test_tables_name_the_drops_in_doubt(campaign: Campaign, doubted: Campaign) -> None:
    assert check_table(campaign).rows == ()
    table = check_table(doubted)
    rows = {row[0]: dict(zip(table.header, row, strict=True)) for row in table.rows}
    assert rows[DOUBTED] == {
        "drop": DOUBTED,
        "U₀ (m/s)": "3.100 ± 0.010",
        "by the drop (m/s)": "3.22",
        "U₀ off it": "−3.7 %",
        "a in air (m/s²)": "9.400 ± 0.050",
        "in doubt": WHAT,
    }
    status = {row[0]: row[-1] for row in drop_table(doubted).rows}
    assert status[DOUBTED] == "ok, in doubt"
    assert status["g74_d100_h153"] == "ok"
    content = Content(doubted, (), (), ())
    page = re.sub(r"</?su[bp]>", "", write_page(content))
    assert "By the drop: √(2gh) of the height that was given, of which the air takes 0.5 % at most" in page
    printed = " ".join(text for line in number_lines(content) for _, text in line.cells)
    assert "0.5 % at most" in printed
    assert "What was told of the drops" not in write_page(Content(campaign, (), (), ()))


def test_a_regression_counts_and_names_its_drops_in_doubt(campaign: Campaign) -> None:
    columns = {"relation": ["period_exp"], "x": ["elastic_time_s"], "y": ["period_s"], "slope": [1.2], "n": [5]}
    bare = regression_table(replace(campaign, scaling=new_table("scaling", columns)))
    assert "in doubt" not in bare.header
    doubts = {"doubtful": [f"{DOUBTED}: fall before impact; other: row of the surface and optical axis"]}
    table = regression_table(replace(campaign, scaling=new_table("scaling", columns | doubts)))
    assert table.header[-1] == "in doubt"
    assert table.rows[0][-1] == f"2 of 5: {DOUBTED}: fall before impact; other: row of the surface and optical axis"


@pytest.mark.parametrize(
    ("limits", "labels"),
    [
        ((0.02, 40.0), ["0.1", "1", "10"]),
        ((0.02, 0.9), ["0.02", "0.05", "0.1", "0.2", "0.5"]),
        ((0.2, 0.54), ["0.2", "0.3", "0.5"]),
        ((0.29, 1.1), ["0.3", "0.5", "1"]),
        ((0.197, 0.31), ["0.2", "0.25", "0.3"]),
        ((1.47, 1.93), ["1.5", "1.6", "1.7", "1.8", "1.9"]),
    ],
)
def test_a_logarithmic_axis_has_labels_enough(limits: tuple[float, float], labels: list[str]) -> None:
    figure = Figure()
    ax = figure.subplots()
    ax.set(xscale="log", xlim=limits)
    plain_decades(ax.xaxis)
    figure.draw_without_rendering()
    low, high = limits
    shown = [t.get_text() for t in ax.get_xticklabels() if low <= t.get_position()[0] <= high and t.get_text()]
    assert shown == labels


def test_every_doubt_is_explained() -> None:
    package = Path(__file__).parents[2] / "wentry_cli"
    sources = {path: path.read_text(encoding="utf-8") for path in package.rglob("*.py")}
    named = {what for text in sources.values() for what in re.findall(r'puts_in_doubt\("([^"]+)"\)', text)}
    named |= set(
        re.findall(r'^ +\("([a-z ]+)", ', sources[package / "stages" / "summary" / "__init__.py"], re.MULTILINE)
    )
    assert len(named) > 12
    listed = (package.parent / "docs" / "conventions.md").read_text(encoding="utf-8")
    listed = listed[listed.index("## Doubts") : listed.index("## Status words")]
    assert named == set(re.findall(r"`([a-z ]+)`", listed)) - {"doubts"}
