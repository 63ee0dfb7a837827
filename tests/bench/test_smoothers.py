from __future__ import annotations

import re

import pytest

from wentry_cli.bench.row import BenchRow
from wentry_cli.bench.smoother_cases import CASES
from wentry_cli.bench.smoother_peers import ORACLE, PEERS
from wentry_cli.bench.smoothers import MODES, OURS, run


@pytest.fixture(scope="module")
def quick() -> list[BenchRow]:
    return run(True, 0)


def test_ours_has_the_least_error_of_all(quick: list[BenchRow]) -> None:
    plain = [row for row in quick if not row.case.startswith("hard")]
    assert len(plain) == 4 * (len(MODES) + len(PEERS))
    assert all(row.failures == 0.0 and row.time_us > 0 for row in plain)
    for case in ("inside", "at impact"):
        for quantity in ("velocity", "acceleration"):
            reached = {r.method: r.rmse for r in plain if r.case.endswith(case) and r.quantity == quantity}
            ours = reached.pop(OURS)
            assert ours < min(reached.values())


def test_hard_cases_are_all_there_and_none_fails(quick: list[BenchRow]) -> None:
    hard = [row for row in quick if row.case.startswith("hard")]
    assert len(hard) == 2 * (len(CASES) + 1)
    assert all(row.failures == 0.0 for row in hard)
    v = {row.case: row.rmse for row in hard if row.quantity == "velocity"}
    assert v["hard: free fall, no process noise, inside"] < v["hard: 0.1 px, white, inside"]
    assert v["hard: noise 1e-6 px, inside"] < v["hard: 0.1 px, white, inside"]


def test_the_same_seed_gives_the_same_errors(quick: list[BenchRow]) -> None:
    assert [row.rmse for row in run(True, 0)] == [row.rmse for row in quick]


@pytest.mark.slow
def test_targets_on_drops_that_nobody_tuned_on() -> None:
    """Velocity within 1.6 and acceleration within 2.2 of the oracle inside; bands at impact hold 90 % and more."""
    rows = [row for row in run(False, 31) if row.method in (OURS, ORACLE)]
    for pixels in ("0.02 px", "0.1 px", "0.5 px"):
        for quantity, most in (("velocity", 1.6), ("acceleration", 2.2)):
            pair = {r.method: r for r in rows if r.case == f"{pixels}, inside" and r.quantity == quantity}
            assert pair[OURS].rmse < most * pair[ORACLE].rmse
            strike = next(
                r for r in rows if r.case == f"{pixels}, at impact" and r.quantity == quantity and r.method == OURS
            )
            assert _share(pair[OURS]) > 0.91
            assert _share(strike) > 0.90


def _share(row: BenchRow) -> float:
    found = re.search(r"holds ([\d.]+)%", row.note)
    assert found
    return float(found[1]) / 100.0
