"""The O(n) recursions against the same Gaussian model written out as dense matrices."""

from __future__ import annotations

from dataclasses import replace
from math import factorial

import numpy as np
import pytest

from wentry_cli.kinematics import state_space
from wentry_cli.kinematics.likelihood import law_of, strengths_of
from wentry_cli.kinematics.side_by_side import SETS, densities, log_likelihoods
from wentry_cli.kinematics.state_pass import Ballistic, Record, prepare, smooth


def transition(m: int, step: float) -> np.ndarray:
    return np.array([[step ** (j - i) / factorial(j - i) if j >= i else 0.0 for j in range(m)] for i in range(m)])


def noise(m: int, step: float) -> np.ndarray:
    nodes, weights = np.polynomial.legendre.leggauss(8)
    total = np.zeros((m, m))
    for node, weight in zip(nodes, weights, strict=True):
        column = transition(m, 0.5 * step * (1 + node))[:, -1]
        total += 0.5 * step * weight * np.outer(column, column)
    return total


@pytest.mark.parametrize("m", [3, 4])
@pytest.mark.parametrize("step", [0.3, 1.0, 2.5])
def test_one_step(m: int, step: float) -> None:
    random = np.random.default_rng(m)
    x, root = random.normal(size=m), random.normal(size=(m, m))
    P = root @ root.T
    expected = transition(m, step) @ P @ transition(m, step).T + 0.7 * noise(m, step)
    mean = transition(m, step) @ x
    state_space.predict(x, P, step, 0.7)
    assert np.allclose(x, mean)
    assert np.allclose(P, expected)


@pytest.mark.parametrize("m", [3, 4])
def test_smoothed_states_are_the_conditional_expectation(m: int) -> None:
    random = np.random.default_rng(0)
    t = np.cumsum(random.uniform(0.5, 1.5, 24)) * 1e-3
    event = 0.5 * (t[7] + t[8])
    y = random.normal(size=24) + 5.0 * np.maximum(t - event, 0) * 1e3
    variance = random.uniform(0.5, 2.0, 24)
    record = prepare(t, y, variance, events_s=np.array([event]), order=m, ballistic=Ballistic(-1000.0, 100.0))
    # a prior of moderate width, or the dense side would lose its digits
    record = replace(record, start_covariance=np.diag([4.0, 2.0, 1.0, 0.5][:m]))
    theta = np.log([8.0, 3.0, 5.0, 2.0, 1.5])
    result = smooth(record, theta)
    nodes, law = record.nodes, law_of(theta, m)
    # all states as one Gaussian vector: start, then transitions and jumps
    n = nodes.shape[0]
    maps, covariance = np.zeros((n * m, n * m)), np.zeros((n * m, n * m))
    cumulative = np.eye(m)
    blocks = [record.start_covariance]
    steps = [np.eye(m)]
    for k in range(1, n):
        start, stop = nodes[k - 1, 0], nodes[k, 0]
        q = state_space.density(law, record.events, strengths_of(theta, record.events), start, stop)
        block = q * noise(m, stop - start)
        if nodes[k, 3] >= 0:
            block += np.diag([nodes[k, 2], nodes[k, 1], law[3] ** 2, law[4] ** 2][:m])
            behind = np.array([0.0, -state_space.LAG * law[6], 1.0])  # a velocity behind its acceleration, in part
            block[:3, :3] += law[3] ** 2 * (np.outer(behind, behind) - np.diag([0.0, 0.0, 1.0]))
            block[1, 1] += (state_space.LAG_SPREAD * law[6] * law[3]) ** 2
        blocks.append(block)
        steps.append(transition(m, stop - start))
    for k in range(n):
        cumulative = np.eye(m)
        for i in range(k, -1, -1):
            maps[k * m : (k + 1) * m, i * m : (i + 1) * m] = cumulative
            cumulative = cumulative @ steps[i]
    for i, block in enumerate(blocks):
        covariance[i * m : (i + 1) * m, i * m : (i + 1) * m] = block
    joint = maps @ covariance @ maps.T
    seen = [k for k in range(n) if nodes[k, 3] < 0]
    rows = [k * m for k in seen]
    total = joint[np.ix_(rows, rows)] + np.diag(nodes[seen, 2])
    gain = joint[:, rows] @ np.linalg.inv(total)
    mean = (gain @ nodes[seen, 1]).reshape(n, m)
    posterior = joint - gain @ joint[rows]
    states, spreads = result.evaluate(t)
    unit = record.noise_m / record.interval_s ** np.arange(3)
    ours = states / unit - record.polynomial(record.frames(t))
    assert np.allclose(ours, mean[seen, :3], atol=1e-5)
    for k, spread in zip(seen, spreads, strict=True):
        dense = posterior[k * m : k * m + 3, k * m : k * m + 3] * np.outer(unit, unit) * result.noise_scale**2
        assert np.allclose(spread, dense, rtol=1e-3, atol=1e-6 * np.abs(dense).max())
    z = nodes[seen, 1]
    expected = np.linalg.slogdet(total)[1] + z @ np.linalg.solve(total, z)
    assert _twice_minus_log(record, [law] * SETS)[0] == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("m", [3, 4])
def test_sets_side_by_side_are_those_alone(m: int) -> None:
    random = np.random.default_rng(2)
    frames = np.delete(np.arange(80.0), [11, 40, 41, 42])
    t = (frames + random.uniform(-1e-5, 1e-5, frames.size)) * 1e-3
    y = random.normal(size=frames.size) + np.maximum(frames - 30.4, 0.0) ** 2
    events = np.array([0.0304, 0.0577])
    record = prepare(t, y, np.ones(frames.size), events_s=events, order=m, ballistic=Ballistic(-1.0, 100.0))
    thetas = [np.log([8.0, 3.0, 5.0, 2.0, 1.5, 0.4]) + random.uniform(-1.0, 1.0, 6) for _ in range(SETS)]
    together = _twice_minus_log(record, [law_of(theta, m) for theta in thetas])
    alone = [_twice_minus_log(record, [law_of(theta, m)] * SETS)[0] for theta in thetas]
    assert np.ptp(together) > 1.0
    assert np.allclose(together, alone, rtol=1e-12)
    for theta in thetas:
        law = law_of(theta, m)
        found = densities(record.nodes, np.array([law] * SETS), record.events, np.ones((SETS, 2)))[1:]
        between = zip(record.nodes[:-1, 0], record.nodes[1:, 0], strict=True)
        expected = [state_space.density(law, record.events, np.ones(2), *ends) for ends in between]
        assert np.allclose(found, np.array(expected)[:, None], rtol=1e-10)


def _twice_minus_log(record: Record, laws: list[np.ndarray]) -> np.ndarray:
    strengths = np.ones((SETS, record.events.size))
    logs, squares = log_likelihoods(
        record.nodes, np.array(laws), record.events, strengths, record.start_mean, record.start_covariance
    )
    return logs + squares


def test_between_nodes_a_missing_frame_says_the_same() -> None:
    random = np.random.default_rng(1)
    t = np.arange(30) * 1e-3
    y = np.cumsum(np.cumsum(random.normal(size=30)))
    y[12] = np.nan
    good = np.isfinite(y)
    record = prepare(
        t[good], y[good], np.ones(29), events_s=np.array([0.00450]), order=3, ballistic=Ballistic(0.0, 1.0)
    )
    result = smooth(record, np.log([5.0, 3.0, 5.0, 2.0, 1.5]))
    around = result.evaluate(np.array([0.0119999999, 0.012, 0.0120000001]))[0]
    assert np.allclose(around[0], around[1], rtol=1e-4)
    assert np.allclose(around[2], around[1], rtol=1e-4)
    widths = result.evaluate(np.array([0.017, 0.012]))[1][:, 0, 0]
    assert widths[1] > widths[0] > 0


def test_covariances_stay_positive_in_long_gaps() -> None:
    t = np.arange(200) * 5e-4
    y = np.sin(60 * t)
    keep = (t < 0.03) | (t > 0.05)
    record = prepare(
        t[keep], y[keep], np.full(keep.sum(), 1e-6), events_s=np.array([0.0]), order=4, ballistic=Ballistic()
    )
    result = smooth(record, np.log([10.0, 2.0, 40.0, 5.0, 1.5]))
    spread = result.evaluate(np.linspace(0.0, 0.0995, 900))[1]
    assert np.all(np.diagonal(spread, axis1=1, axis2=2) > 0)


@pytest.mark.parametrize("pixels", [1e-6, 1e-3, 1.0])
def test_variances_stay_positive_however_small_the_noise(pixels: float) -> None:
    """Noise and path sixteen decades apart in their squares, a jump in between, no process noise before it."""
    t = (np.arange(300) - 40.3) / 2000
    noise = pixels / 4000
    after = np.maximum(t, 0.0)
    y = -5.0 * t - 4.9 * t**2 + 100.0 * after**2 * np.exp(-after / 0.01)
    seen = y + noise * np.random.default_rng(0).normal(size=t.size)
    record = prepare(t, seen, np.full(t.size, noise**2), events_s=np.zeros(1), order=4, ballistic=Ballistic(-9.8, 0.0))
    result = smooth(record, np.log([10.0, 2.0, 40.0, 50.0, 1.5]))
    spread = result.evaluate(t)[1] / result.noise_scale**2
    assert np.linalg.eigvalsh(spread[t >= 0.0]).min() > 0.0
    assert np.all(spread[:, 0, 0] > 0.0)
    assert np.all(spread[:, 0, 0] < 1.001 * noise**2)
