"""The table of solvers: rows are there, errors follow the tolerance, ours is the fastest at its error."""

import pytest

from wentry_cli.bench.solvers import OURS, run


@pytest.mark.slow
def test_quick_table():
    rows = run(quick=True, seed=1)
    ours = {row.method: row for row in rows if row.method.startswith("wentry, all events")}
    assert len(ours) == len(OURS)
    assert all(row.failures == 0.0 for row in rows)
    assert all(row.chapter == "solvers" for row in rows)
    tight = ours["wentry, all events, 1e-08"]
    assert tight.rmse < 1e-7
    assert ours["wentry, all events, 1e-10"].rmse < tight.rmse < ours["wentry, all events, 2e-04"].rmse < 1e-3
    equal = [row for row in rows if not row.method.startswith("wentry") and row.rmse < 1e-6]
    assert equal
    assert all(row.time_us > 3.0 * tight.time_us for row in equal)
