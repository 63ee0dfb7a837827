from __future__ import annotations

import re

import numpy as np
import pytest

from wentry_cli.bench.falls import FPS, PX_PER_M, SPHERES, make_truth, slam_of
from wentry_cli.bench.row import BenchRow
from wentry_cli.bench.smoother_bounds import FALLS_KNOWN, find_bound
from wentry_cli.bench.smoother_cases import CASES
from wentry_cli.bench.smoother_page import explain
from wentry_cli.bench.smoother_peers import ORACLE, ORACLE_AT_IMPACT, PEERS
from wentry_cli.bench.smoothers import MODES, OURS, PLACES, run


@pytest.fixture(scope="module")
def quick() -> list[BenchRow]:
    return run(True, 0)


def test_ours_has_the_least_error_of_all(quick: list[BenchRow]) -> None:
    plain = [row for row in quick if not row.case.startswith("hard")]
    assert len(plain) == 2 * len(PLACES) * (len(MODES) + len(PEERS))
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


def test_a_quick_look_explains_nothing(quick: list[BenchRow]) -> None:
    assert explain(quick) == ""


def test_who_knows_what_falls_are_like_sees_the_slam_through_the_noise() -> None:
    bound, noise = find_bound(5), 0.1 / PX_PER_M
    off = []
    for sphere in SPHERES:
        truth = make_truth(sphere, 77)
        v, a = bound(truth.t, truth.y + noise * np.random.default_rng(1).normal(size=truth.t.size), noise)
        assert np.array_equal(np.isfinite(v), truth.at_impact)
        off.append(np.stack([v - truth.v, a - truth.a], axis=1)[truth.at_impact])
    v_off, a_off = np.sqrt(np.mean(np.concatenate(off) ** 2, axis=0))
    assert 0.0 < v_off < 13e-3
    assert 0.0 < a_off < 23.0


@pytest.mark.parametrize("sphere", SPHERES)
def test_a_slam_is_as_high_and_as_long_as_its_frames_show(sphere: str) -> None:
    peak, width = slam_of(sphere, 3)
    truth = make_truth(sphere, 3)
    above = truth.t[truth.at_impact & (truth.a > 0.5 * peak)]
    assert truth.a[truth.at_impact].max() <= peak * 1.001
    assert 0.0 <= width - (above[-1] - above[0]) < 2.0 / FPS


@pytest.mark.slow
def test_targets_on_drops_that_nobody_tuned_on() -> None:
    """Velocity within 1.6 and acceleration within 2.2 of the oracle inside; bands at impact hold 90 % and more."""
    rows = [row for row in run(False, 31) if row.method in (OURS, ORACLE, ORACLE_AT_IMPACT, FALLS_KNOWN)]
    for pixels in ("0.02 px", "0.1 px", "0.5 px"):
        for quantity, most in (("velocity", 1.6), ("acceleration", 2.2)):
            pair = {r.method: r for r in rows if r.case == f"{pixels}, inside" and r.quantity == quantity}
            assert pair[OURS].rmse < most * pair[ORACLE].rmse
            strike = next(
                r for r in rows if r.case == f"{pixels}, at impact" and r.quantity == quantity and r.method == OURS
            )
            assert 0.91 < _share(pair[OURS]) < 0.98
            assert _share(strike) > 0.90
    text = explain(rows)
    known = next(r for r in rows if r.method == FALLS_KNOWN and r.case == "0.1 px, at impact" and r.unit == "m/s²")
    assert f"{known.rmse:.3g} m/s²" in text
    assert known.note in text


def _share(row: BenchRow) -> float:
    found = re.search(r"holds ([\d.]+)%", row.note)
    assert found
    return float(found[1]) / 100.0
