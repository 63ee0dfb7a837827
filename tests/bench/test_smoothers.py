from __future__ import annotations

import pytest

from wentry_cli.bench.smoothers import METHODS, run


@pytest.mark.slow
def test_ours_has_the_least_error_of_all() -> None:
    rows = run(True, 0)
    assert len(rows) == 4 * len(METHODS)
    assert all(row.failures == 0.0 and row.time_us > 0 for row in rows)
    for case in ("inside", "at impact"):
        for quantity in ("velocity", "acceleration"):
            reached = {r.method: r.rmse for r in rows if r.case.endswith(case) and r.quantity == quantity}
            ours = reached.pop("wentry, impact_aware")
            assert ours < min(reached.values())


def test_the_same_seed_gives_the_same_errors() -> None:
    first, second = ([row.rmse for row in run(True, 3)] for _ in range(2))
    assert first == second
