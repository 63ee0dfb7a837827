from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest
from fixture_campaign import CAMPAIGN, write_campaign

from wentry_cli.report.campaign import Campaign, read_campaign
from wentry_cli.report.fits import exponent_text, slope_text
from wentry_cli.report.page import Content, write_page
from wentry_cli.report.regressions import regression_table
from wentry_cli.tables import new_table

PERIOD = {"relation": "period_exp_intercept", "x": "elastic_time_s", "y": "period_s", "slope": 1.09, "slope_unc": 0.013,
          "slope_low": 0.92, "slope_high": 1.26, "intercept": 0.00423, "intercept_unc": 0.0007, "dof": 1.06,
          "residual_scatter": 0.00075, "n": 5, "n_conditions": 5, "n_spheres": 4, "status": "ok"}  # fmt: skip
LAW = {"relation": "delta_u", "x": "stiffness_ratio", "y": "delta_u_over_u0", "slope": 0.4, "slope_low": 0.3,
       "slope_high": 0.5, "exponent": -0.5, "exponent_unc": 0.03, "exponent_low": -0.6, "exponent_high": -0.4,
       "residual_scatter": 0.04, "n": 6, "n_conditions": 1, "n_spheres": 1, "status": "ok"}  # fmt: skip
NO_SLOPE = {"relation": "delta_u", "x": "stiffness_ratio", "y": "delta_u_over_u0", "n": 2, "n_conditions": 2,
            "n_spheres": 1, "paper_value": -0.5, "left_out": "a: sphere_seal", "status": "too_few"}  # fmt: skip
NO_INTERVAL = {"relation": "pinch_off_d", "x": "froude", "y": "tp_u0_over_d", "slope": 1.3, "n": 6, "n_conditions": 1,
               "n_spheres": 1, "status": "too_few"}  # fmt: skip
ALIKE = {"relation": "delta_u", "x": "stiffness_ratio", "y": "delta_u_over_u0", "n": 6, "n_conditions": 6,
         "n_spheres": 1, "status": "too_few"}  # fmt: skip
NOBODY = {"relation": "period_exp", "x": "elastic_time_s", "y": "period_s", "n": 0, "status": "too_few"}


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Campaign:
    folder: Path = tmp_path_factory.mktemp("regressions")
    return read_campaign(folder, write_campaign(folder, CAMPAIGN[:1]))


def shown(campaign: Campaign, *rows: dict[str, object]) -> list[dict[str, str]]:
    names = list(dict.fromkeys(name for row in rows for name in row))
    table = new_table("scaling", {name: [row.get(name) for row in rows] for name in names})
    found = regression_table(replace(campaign, scaling=table))
    return [dict(zip(found.header, row, strict=True)) for row in found.rows]


def test_what_has_seconds_is_shown_in_milliseconds(campaign: Campaign) -> None:
    (row,) = shown(campaign, PERIOD)
    assert row["intercept"] == "4.23 ± 0.70 ms"
    assert row["scatter"] == "0.75 ms"
    assert row["slope"] == "1.090 ± 0.013"
    assert row["drops / conditions / spheres"] == "5 / 5 / 4"


def test_a_power_law_has_the_interval_of_its_exponent(campaign: Campaign) -> None:
    (row,) = shown(campaign, LAW)
    assert row["95 % interval"] == "−0.600 to −0.400"
    assert row["scatter"] == "0.04 of ln y"
    assert exponent_text(LAW) == "exponent −0.500, 95 % interval −0.600 to −0.400, 6 drops in 1 condition, 1 sphere"


def test_a_row_without_a_number_says_why(campaign: Campaign) -> None:
    none, bare, alike = shown(campaign, NO_SLOPE, NO_INTERVAL, ALIKE, NOBODY)  # nothing bears on the last
    assert alike["slope"] == "– (drops hardly apart in x)"
    assert none["slope"] == "– (too few: 5 drops needed)"
    assert (none["95 % interval"], none["paper"], none["left out"]) == ("–", "−0.5", "a: sphere_seal")
    assert bare["slope"] == "1.3"
    assert bare["95 % interval"] == "– (too few groups)"


def test_a_caption_counts_drops_conditions_and_spheres() -> None:
    assert slope_text(PERIOD) == "slope 1.090, 95 % interval 0.920 to 1.260, 5 drops in 5 conditions, 4 spheres"
    assert slope_text(NO_INTERVAL) == (
        "slope 1.300, 95 % interval not known (too few groups: 6 drops in 1 condition, 1 sphere)"
    )
    assert exponent_text(ALIKE) == "no exponent, drops hardly apart in x: 6 drops in 6 conditions, 1 sphere"
    assert slope_text({}) == "no slope, relation not fitted"


def test_the_table_wraps_where_the_page_is_narrow(campaign: Campaign) -> None:
    table = new_table("scaling", {name: [value] for name, value in NO_SLOPE.items()})
    page = write_page(Content(replace(campaign, scaling=table), (), (), ()))
    regressions = page.partition('<section id="regressions">')[2].partition("</section>")[0]
    assert '<table class="dense wraps">' in regressions
    assert '<td class="long">a: sphere_seal</td>' in regressions
    assert re.search(r"table\.wraps td \{ white-space: normal; \}", page)
