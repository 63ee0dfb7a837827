"""The table of hard cases: errors follow the tolerance, and what cannot be integrated is said."""

import re
from dataclasses import replace

import numpy as np
import pytest

from wentry_cli.bench import extended_precision, extremes
from wentry_cli.bench.kept import Chapter
from wentry_cli.bench.page import write_page
from wentry_cli.mechanics.bergstrom_boyce import find_groups


def test_quick_rows():
    rows = {row.case: row for row in extremes.run(quick=True, seed=1)}
    assert set(rows) == set(extremes.QUICK)
    refused = [row for row in rows.values() if row.failures == 1.0]
    assert len(refused) == 2
    assert all(row.note.startswith("refused: the material") for row in refused)
    assert rows["released at .4"].rmse < 1e-9
    assert rows["m = .5"].rmse < 1e-9


def test_the_page_says_what_the_program_says(tmp_path):
    rows = extremes.run(quick=True, seed=1)
    rows.append(replace(rows[0], case="odd", note=f"{rows[0].note}; warning: flows at once"))
    page = write_page([Chapter("extremes", rows)], tmp_path, ()).read_text(encoding="utf-8")
    assert re.search(r"\| released at \.4 \| 1e-10 \| \S+ \| \S+ \| \S+ \| \d+ \+ \d+ \| \S+ \| nothing \|", page)
    assert re.search(r"\| odd \|.*\| warning: flows at once \|", page)
    assert re.search(
        r"\| ξ = 0, n = −\.2 \| 1e-10 \| – \| – \| – \| – \| – \| refused: the material .* xi > 0 \|", page
    )
    assert not list(tmp_path.glob("*.svg"))


@pytest.mark.slow
def test_every_case_is_exact_or_refused():
    rows = extremes.run(quick=False, seed=1)
    assert sum(row.failures for row in rows) == 4
    solved = {row.case: row.rmse for row in rows if row.failures == 0.0}
    long = {case: rmse for case, rmse in solved.items() if case.startswith("1000 periods")}
    assert len(long) == 2
    assert max(long.values()) < 1.8e-8  # the phase of a thousand periods, at the tolerance 1e-12
    assert max(rmse for case, rmse in solved.items() if case not in long) < 1.4e-10


def test_the_reference_keeps_the_period_of_the_elastic_sphere():
    """T/(D √(ρ_s/G∞)) = 1.044997246 at λ₀ = 1.5, by quadrature; D √(ρ_s/G∞) = 2 t_c."""
    groups = find_groups(next(case.material for case in extremes.CASES if case.name == "G_T = 0"))
    period = 2.0 * 1.044997246
    found = extended_precision.solve(groups, 1.5, 1.0, np.array([0.5 * period, period]))
    assert found == pytest.approx([0.723440917421, 1.5], abs=1e-11)
