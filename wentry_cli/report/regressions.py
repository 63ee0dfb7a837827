"""The table of the regressions as rows of text."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from wentry_cli.report.campaign import Campaign, as_number, as_text
from wentry_cli.report.fits import why_nothing
from wentry_cli.report.numbers import DASH, fixed, or_reason, with_uncertainty
from wentry_cli.report.tabulation import TextTable

HEADER = (
    "relation", "y on x", "slope", "95 % interval", "dof", "intercept", "exponent", "R²", "scatter",
    "drops / conditions / spheres", "paper", "left out", "in doubt",
)  # fmt: skip
RELATIONS = {
    "period_exp": "period, measured",
    "period_model": "period, model",
    "pinch_off_d": "pinch-off, D",
    "pinch_off_deff": "pinch-off, D_eff",
    "pinch_off_deff_froude": "pinch-off, D_eff on Fr",
    "delta_u": "loss of velocity",
}
QUANTITIES = {
    "elastic_time_s": "D/√(G∞/ρ_s)",
    "period_s": "T",
    "period_model_s": "T",
    "froude": "Fr",
    "froude_eff": "U₀/√(g D_eff)",
    "tp_u0_over_d": "t_p U₀/D",
    "tp_u0_over_deff": "t_p U₀/D_eff",
    "stiffness_ratio": "G∞/(ρ_w U₀²)",
    "delta_u_over_u0": "ΔU/U₀",
}


def regression_table(campaign: Campaign) -> TextTable:
    """Every relation that any drop bears on: slope or exponent with its interval, the paper's value, who is left out.

    One without enough drops for a slope, or enough groups for an interval, says so.
    """
    rows = []
    for row in campaign.scaling.to_dict("records"):
        known = math.isfinite(as_number(row["slope"])) or as_number(row["n"]) > 0
        if known or as_text(row["left_out"]):
            rows.append(_cells({str(name): value for name, value in row.items()}))
    doubts = any(row[-1] != DASH for row in rows)  # a column of its own only where it is needed
    shown = len(HEADER) if doubts else len(HEADER) - 1
    return TextTable(HEADER[:shown], tuple(row[:shown] for row in rows))


def _cells(row: Mapping[str, Any]) -> tuple[str, ...]:
    number = {name: as_number(value) for name, value in row.items()}
    axes = [as_text(row[name]) for name in ("y", "x")]
    factor, unit = (1e3, " ms") if axes[0].endswith("_s") else (1.0, "")
    power = "exponent" if math.isfinite(number["exponent"]) else "slope"
    slope = with_uncertainty(number["slope"], number["slope_unc"])
    scatter = with_uncertainty(factor * number["residual_scatter"], digits=2)
    intercept = with_uncertainty(factor * number["intercept"], factor * number["intercept_unc"])
    counts = [with_uncertainty(number[name]) for name in ("n", "n_conditions", "n_spheres")]
    return (
        _relation_name(as_text(row["relation"])),
        " on ".join(QUANTITIES.get(key, key) for key in axes),
        or_reason(slope, why_nothing(row)),
        _interval(number, power) if slope == DASH else or_reason(_interval(number, power), why_nothing(row)),
        with_uncertainty(number["dof"], digits=2),
        intercept if intercept == DASH else intercept + unit,
        with_uncertainty(number["exponent"], number["exponent_unc"]),
        with_uncertainty(number["r_squared"]),
        scatter if scatter == DASH else scatter + (" of ln y" if power == "exponent" else unit),
        " / ".join(counts),
        with_uncertainty(number["paper_value"]),
        as_text(row["left_out"]) or DASH,
        _in_doubt(row),
    )


def _in_doubt(row: Mapping[str, Any]) -> str:
    """``2 of 5: a (scale), b (fall before impact)``: the drops that take part though their numbers are in doubt."""
    named = [one for one in as_text(row.get("doubtful")).split("; ") if one]
    return f"{len(named)} of {as_number(row['n']):.0f}: {'; '.join(named)}" if named else DASH


def _interval(number: Mapping[str, float], name: str) -> str:
    low, high = number[f"{name}_low"], number[f"{name}_high"]
    return f"{fixed(low, 3)} to {fixed(high, 3)}" if math.isfinite(low) and math.isfinite(high) else DASH


def _relation_name(key: str) -> str:
    name = key.removesuffix("_intercept")
    return RELATIONS.get(name, name) + (", intercept free" if name != key else "")
