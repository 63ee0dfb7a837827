from __future__ import annotations

from pathlib import Path

import pytest

from wentry_cli.bench.delta_u import CASES, CHOICES, draw, run
from wentry_cli.bench.row import BenchRow


@pytest.fixture(scope="module")
def rows() -> list[BenchRow]:
    return run(False, 51)


@pytest.mark.slow
def test_measured_stretch_gives_the_velocity_loss_to_two_millimetres_per_second(rows: list[BenchRow]) -> None:
    assert len(rows) == len(CASES) * len(CHOICES)
    found = {(row.case, row.method): row for row in rows}
    for case in CASES:
        measured, model = found[f"ΔU, {case}", "λ measured"], found[f"ΔU, {case}", "λ model"]
        assert measured.failures == 0.0
        assert measured.rmse**2 - measured.bias**2 < 2.0**2
        assert measured.rmse < 3.8  # the scale's share; measured 2.5
        assert measured.rmse < 0.1 * model.rmse
        assert found[f"ΔU, {case}", "λ measured, gap left empty"].failures == 1.0


@pytest.mark.slow
def test_the_figure_has_a_bar_for_each_choice(rows: list[BenchRow], tmp_path: Path) -> None:
    draw(rows, tmp_path / "figure.svg")
    text = (tmp_path / "figure.svg").read_text(encoding="utf-8")
    assert all(row.method in text for row in rows if row.rmse == row.rmse)
