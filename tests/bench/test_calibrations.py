"""The chapter of calibrations: ours has no failures and the least error, and its targets are listed."""

from __future__ import annotations

import pytest

from wentry_cli.bench.calibrations import ADDED_MASS, COMPRESSION, FLOW, RATIO, run
from wentry_cli.bench.mechanics_targets import list_mechanics
from wentry_cli.bench.row import BenchRow


@pytest.fixture(scope="module")
def rows() -> list[BenchRow]:
    return run(True, 1)


@pytest.mark.parametrize(("case", "quantity"), [(FLOW, "ln flow"), (RATIO, "ratio"), (COMPRESSION, "G∞")])
def test_ours_is_the_best(rows: list[BenchRow], case: str, quantity: str) -> None:
    ours, *others = (row for row in rows if row.case == case and row.quantity == quantity)
    assert ours.failures == 0.0
    assert others
    assert all(2.0 * ours.rmse < other.rmse for other in others)


def test_added_mass_has_all_its_digits(rows: list[BenchRow]) -> None:
    assert next(row for row in rows if row.case == ADDED_MASS).rmse < 1e-14


def test_what_was_asked_stands_beside_what_was_reached(rows: list[BenchRow]) -> None:
    found = {target.what: target for target in list_mechanics(rows)}
    assert found["joint fits solved from no start"].met
    assert found["C_m, relative"].met
    missed = [row if row.case != ADDED_MASS else _replaced(row) for row in rows]
    assert not {target.what: target for target in list_mechanics(missed)}["C_m, relative"].met


def _replaced(row: BenchRow) -> BenchRow:
    return BenchRow(**{**row.__dict__, "rmse": 1e-9})
