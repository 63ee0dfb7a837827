"""How much to smooth: maximum likelihood, generalised cross validation, or the elbow of roughness against error."""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from wentry_cli.kinematics import likelihood
from wentry_cli.kinematics.state_pass import Record, StatePass, smooth

Array = NDArray[np.float64]
LONG_RECORD = 4000
ABOUT_EVENT = 500
USUAL_SHARE, SHARE_SPREAD = 0.1, 1.0  # a lasting bandwidth of a tenth of the record, within a factor e
USUAL_SLAM, SLAM_SPREAD = 0.2, 0.5  # logarithm of frames: what a slam leaves to chance is gone after two or three
USUAL_STRIKE, STRIKE_SPREAD = 1.0, 1.0  # logarithm of the jump at an event over the accelerations of longer times


def fit_pass(record: Record, *, budget: int = 160) -> StatePass:
    """Smooth ``record`` with the hyperparameters of greatest likelihood; one (a bandwidth) where it has no event."""
    grid, model = _grid(record), likelihood_model(record)
    start = likelihood.best_start(grid, *model)
    theta, _ = likelihood.minimise(start, *model, budget)
    return smooth(record, theta)


def likelihood_model(record: Record) -> tuple[Array, Array, Array, Array, Array]:
    """What the functions of ``likelihood`` want to know of a record, after the hyperparameters."""
    nodes = _thinned(record)
    return nodes, record.events, record.start_mean, record.start_covariance, _prior(record, nodes)


def _prior(record: Record, nodes: Array) -> Array:
    """Limits, usual value and spread of each hyperparameter (see ``likelihood.costs``).

    Where the noise hides the slam, the likelihood is the same for all jumps below what it shows, and the greatest may
    lie at none at all: an impact that leaves the acceleration as it was, with an error bar that says so.
    """
    prior = np.column_stack([likelihood.SEARCH_LIMITS, np.zeros(6), np.full(6, np.inf)])
    if record.events.size:
        prior[0, 2:] = np.log(USUAL_SHARE * nodes[-1, 0]), SHARE_SPREAD
        prior[4, 2:] = USUAL_SLAM, SLAM_SPREAD
    if np.any(nodes[:, 3] >= 0):  # the record shows an event, and does not begin after the last
        prior[3, 2:] = USUAL_STRIKE + np.log(_acceleration_scale(record)), STRIKE_SPREAD
    return prior


def _thinned(record: Record) -> Array:
    """The nodes that the likelihood is taken of: all about the events, every k-th elsewhere in a long record."""
    nodes = record.nodes
    stride = nodes.shape[0] // LONG_RECORD
    if stride < 2:
        return nodes
    keep = np.arange(nodes.shape[0]) % stride == 0
    for at in np.flatnonzero(nodes[:, 3] >= 0):
        keep[max(at - ABOUT_EVENT, 0) : at + ABOUT_EVENT] = True
    return np.ascontiguousarray(nodes[keep])


def _grid(record: Record) -> Array:
    length = float(record.nodes[-1, 0] - max(record.events[0] if record.events.size else 0.0, 0.0))
    lasting = np.log(length * np.array([0.03, 0.1, 0.3]))
    if not record.events.size:
        return np.log(length * np.geomspace(0.003, 1.0, 12))[:, None]
    brief = np.log(length * np.array([0.01, 0.03]))
    decay = np.log(length * np.array([0.02, 0.1]))
    strike = np.log(_acceleration_scale(record) * np.array([0.5, 5.0]))
    slam = np.log(np.array([1.5, 5.0]))
    later = (np.log(0.3),) if record.events.size > 1 else ()
    return np.array([(*row, *later) for row in product(lasting, brief, decay, strike, slam)])


def _acceleration_scale(record: Record) -> float:
    """Greatest acceleration over a tenth of the record, in noise per frame²."""
    values = record.nodes[record.nodes[:, 3] < 0]
    stride = max(values.shape[0] // 20, 1)
    coarse = values[::stride]
    if coarse.shape[0] < 3:
        return 1.0
    slope = np.diff(coarse[:, 1]) / np.diff(coarse[:, 0])
    change = np.abs(np.diff(slope)) / (0.5 * (coarse[2:, 0] - coarse[:-2, 0]))
    return float(max(np.max(change), 1e-3))


def fit_plain(record: Record, criterion: str) -> StatePass:
    """Smooth without events, the bandwidth chosen by ``gcv`` (Craven & Wahba 1979) or ``epps`` (elbow)."""
    length = float(record.nodes[-1, 0])
    bandwidths = np.log(np.geomspace(0.5, max(length, 2.0), 60))
    if criterion == "epps":
        return smooth(record, np.array([_elbow(record, bandwidths)]))
    scores = np.array([_gcv(record, np.array([b])) for b in bandwidths])
    best = int(np.argmin(scores))
    fine = np.linspace(bandwidths[max(best - 1, 0)], bandwidths[min(best + 1, 59)], 13)
    scores = np.array([_gcv(record, np.array([b])) for b in fine])
    return smooth(record, np.array([fine[int(np.argmin(scores))]]))


def _residuals(record: Record, theta: Array) -> tuple[Array, Array, Array]:
    """Return weighted residuals, leverages and fitted deviations of the measured frames."""
    result = smooth(record, theta)
    rows = record.nodes[record.nodes[:, 3] < 0]
    times = record.origin_s + rows[:, 0] * record.interval_s
    states, covariance = result.evaluate(times)
    fitted = states[:, 0] / record.noise_m - record.polynomial(rows[:, 0])[:, 0]
    leverage = np.minimum(result.leverage(covariance, rows[:, 2] * record.noise_m**2), 1.0 - 1e-9)
    return (rows[:, 1] - fitted) / np.sqrt(rows[:, 2]), leverage, fitted


def _gcv(record: Record, theta: Array) -> float:
    residual, leverage, _ = _residuals(record, theta)
    free = residual.size - float(np.sum(leverage))
    return float(np.sum(residual**2) * residual.size / max(free, 1e-9) ** 2)


def _elbow(record: Record, bandwidths: Array) -> float:
    """Log bandwidth where roughness against error (both logarithmic) bends most.

    The roughness ∫ y‴² dt of a smoothing spline f with penalty p is fᵀ W (y − f)/p, by its normal equations.
    """
    error = np.empty(bandwidths.size)
    rough = np.empty(bandwidths.size)
    for i, bandwidth in enumerate(bandwidths):
        residual, _, fitted = _residuals(record, np.array([bandwidth]))
        error[i] = np.log(np.sum(residual**2) + 1e-300)
        rough[i] = np.log(max(float(fitted @ residual), 1e-300)) - 6.0 * bandwidth
    slope = np.gradient(rough, error)
    bend = np.gradient(slope, error)
    return float(bandwidths[1 + int(np.argmax(bend[1:-1]))])
