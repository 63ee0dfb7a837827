"""The demo campaign against its truth: every number that the README and the report stand on. Run by `make accuracy`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from wentry_cli.cli.main import run
from wentry_cli.comparison.campaign import Comparison, compare
from wentry_cli.config.places import read_document
from wentry_cli.tables import read_table

pytestmark = pytest.mark.slow

DEMO = Path(__file__).resolve().parents[2] / "configs" / "demo.yaml"
SPOILT = "g6p70_d51_h053_spoilt"


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("demo")
    assert run(["render", str(DEMO), "-o", str(folder / "videos"), "-j", "2", "-q"]) == 0
    assert run(["process", str(folder / "videos"), "-o", str(folder / "results"), "-j", "2", "-q"]) == 0
    assert run(["fit", str(folder / "results"), "-q"]) == 0
    return folder / "results", folder / "videos"


@pytest.fixture(scope="module")
def errors(campaign: tuple[Path, Path]) -> list[Comparison]:
    return compare(*campaign)


def _scale(results: Path, drop: str) -> float:
    return float(read_table(results / drop, "geometry")["scale_px_per_m"].iloc[0])


def _of(errors: list[Comparison], table: str, quantity: str) -> dict[str, Comparison]:
    return {line.drop: line for line in errors if (line.table, line.quantity) == (table, quantity)}


def test_the_demo_is_small(campaign: tuple[Path, Path]) -> None:
    frames = sum(len(read_table(folder.parent, "frames")) for folder in campaign[0].glob("*/frames.csv"))
    assert frames <= 3000


def test_clean_drops_are_measured_to_a_twentieth_of_a_pixel(
    campaign: tuple[Path, Path], errors: list[Comparison]
) -> None:
    for drop, line in _of(errors, "side", "y_b_m").items():
        if drop != SPOILT:
            assert line.errors.rmse * _scale(campaign[0], drop) < 0.05, drop
            assert line.errors.measured >= 0.98 * line.errors.measurable, drop
    for drop, line in _of(errors, "side", "stretch").items():
        if drop != SPOILT and not drop.startswith("rigid"):
            assert line.errors.rmse < 5e-4, drop
            assert line.errors.measured >= 0.98 * line.errors.measurable, drop


def test_the_spoilt_drop_knows_its_errors(errors: list[Comparison]) -> None:
    for quantity in ("stretch", "y_b_m"):
        line = _of(errors, "side", quantity)[SPOILT]
        assert line.errors.beyond_3 <= 0.02, quantity
        assert line.errors.measured >= 0.9 * line.errors.measurable


def test_every_number_of_a_drop_lies_within_three_uncertainties(errors: list[Comparison]) -> None:
    for quantity in ("impact_speed_m_s", "t_p_s", "delta_u_over_u0"):
        for drop, line in _of(errors, "summary", quantity).items():
            assert line.errors.pull <= 3 or not np.isfinite(line.errors.pull), (drop, quantity, line.errors)


def test_seals_and_cavities_are_recognised(errors: list[Comparison]) -> None:
    seals = _of(errors, "summary", "seal_type")
    for drop, line in seals.items():
        assert line.errors.largest == 0, (drop, line.note)
    for drop, line in _of(errors, "summary", "pinch_off_cavity").items():
        # where the contact line hovers at the depth of the seal nobody sees in which period it passed: then no number
        silent = "sphere_seal" in seals[drop].note and line.note.startswith("–")
        assert silent or line.errors.largest == 0, (drop, line.note)


def _true_slopes(campaign: tuple[Path, Path]) -> dict[str, float]:
    """Slopes through the origin from the truth alone, with the definitions of the contract."""
    results, videos = campaign
    summary = read_table(results, "summary").set_index("drop")
    rows = []
    for drop, row in summary.iterrows():
        truth = read_document(videos / str(drop) / "truth" / "truth.yaml").data
        peaks = truth.get("peaks") or []
        number = truth.get("pinch_off_cavity")
        wide = 1.0 if row["rigid"] == "true" else peaks[number - 1] if number else np.nan
        deep = truth.get("seal_type") == "deep_seal"
        elastic = row["diameter_m"] / np.sqrt(row["g_inf_pa"] / row["density_kg_m3"])
        rows.append(
            {
                "elastic": elastic,
                "period": truth.get("free_period_s") or np.nan,
                "froude": truth["u0_m_s"] / np.sqrt(9.81 * row["diameter_m"]),
                "froude_eff": truth["u0_m_s"] / np.sqrt(9.81 * row["diameter_m"] * wide),
                "d": truth["t_p_s"] * truth["u0_m_s"] / row["diameter_m"] if deep else np.nan,
                "deff": truth["t_p_s"] * truth["u0_m_s"] / (row["diameter_m"] * wide) if deep else np.nan,
            }
        )
    table = pd.DataFrame(rows).astype(float)

    def slope(x: str, y: str) -> float:
        both = table[[x, y]].dropna()
        return float((both[x] * both[y]).sum() / (both[x] ** 2).sum())

    return {
        "period_exp": slope("elastic", "period"),
        "pinch_off_d": slope("froude", "d"),
        "pinch_off_deff": slope("froude_eff", "deff"),
    }


def test_slopes_agree_with_those_of_the_truth(campaign: tuple[Path, Path]) -> None:
    found = read_table(campaign[0], "scaling").set_index("relation")
    for relation, slope in _true_slopes(campaign).items():
        assert found.loc[relation, "status"] == "ok"
        assert found.loc[relation, "slope"] == pytest.approx(slope, rel=0.02), relation
