"""One smoothing of one record with one order of the state: from metres and seconds to states and back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wentry_cli.kinematics import likelihood, side_by_side, two_filters

Array = NDArray[np.float64]
DIFFUSE = 1e3  # prior widths in standard errors of the polynomial that the record is centred on


@dataclass(frozen=True)
class Ballistic:
    """What is known before and at the first event.

    ``acceleration`` before it and its ``uncertainty``, m/s²; NaN leaves it free. ``position_jump`` is the standard
    deviation, m, of a step of the measured position at the event (a scale that changes at the waterline);
    ``velocity_jump``, m/s, of a step of the velocity (the bottom of a soft sphere is stopped, its centre is not).
    """

    acceleration: float = float("nan")
    uncertainty: float = 0.0
    position_jump: float = 0.0
    velocity_jump: float = 0.0


@dataclass(frozen=True)
class Places:
    """Times (n,) as a record counts them, in frames, the last node at or before each, and the centring polynomial."""

    frames: Array
    anchors: NDArray[np.int64]
    polynomial: Array


@dataclass(frozen=True)
class Record:
    """A record in dimensionless form: frames and noise as units, centred on a polynomial.

    ``nodes`` as in ``state_space``; ``centre`` are the derivatives (order m) of the polynomial at ``origin_s``.
    """

    order: int
    origin_s: float
    interval_s: float
    noise_m: float
    centre: Array
    nodes: Array
    events: Array
    start_mean: Array
    start_covariance: Array

    def frames(self, times_s: Array) -> Array:
        """Return times in frame intervals after the first frame."""
        return (np.asarray(times_s, dtype=float) - self.origin_s) / self.interval_s

    def places(self, times_s: Array, *, before: bool = False) -> Places:
        """Return where these times lie in the record; the instant of an event lies after it, or ``before`` it."""
        frames = self.frames(times_s)
        # rounding must not push an event's own instant to its wrong side
        nudged = frames - 1e-9 if before else frames + 1e-9
        anchors = np.searchsorted(self.nodes[:, 0], nudged, side="right") - 1
        return Places(frames, anchors.astype(np.int64), self.polynomial(frames))

    def polynomial(self, frames: Array) -> Array:
        """Return the centring polynomial's first three derivatives, (n, 3), per frame and noise."""
        step = np.asarray(frames, dtype=float)
        out = np.zeros((step.size, 3))
        for i in range(3):
            term = np.ones_like(step)
            for j in range(i, self.order):
                out[:, i] += self.centre[j] * term
                term = term * step / (j - i + 1)
        return out


def prepare(
    times_s: Array, position: Array, variance: Array, *, events_s: Array, order: int, ballistic: Ballistic
) -> Record:
    """Bring the measured frames (finite, sorted by time) and events into the form of the state-space model."""
    interval = float(np.median(np.diff(times_s)))
    noise = float(np.sqrt(np.median(variance)))
    frames = (times_s - times_s[0]) / interval
    values = position / noise
    weights = noise**2 / variance
    events = np.sort((np.asarray(events_s, dtype=float) - times_s[0]) / interval)
    events = events[events < frames[-1]]
    before = int(np.sum(frames < events[0])) if events.size else 0
    known = ballistic.acceleration * interval**2 / noise if before else np.nan
    centre, covariance = _centre(frames, values, weights, (order, before, known))
    if before and np.isfinite(known):
        covariance[2, 2] = (ballistic.uncertainty * interval**2 / noise) ** 2
    record = Record(
        order,
        float(times_s[0]),
        interval,
        noise,
        centre,
        np.empty((0, 4)),
        events,
        np.zeros(order),
        covariance,
    )
    jumps = ((ballistic.velocity_jump * interval / noise) ** 2, (ballistic.position_jump / noise) ** 2)
    return _with_nodes(record, frames, values, 1.0 / weights, jumps)


def _centre(frames: Array, values: Array, weights: Array, case: tuple[int, int, float]) -> tuple[Array, Array]:
    """Fit the polynomial of the ballistic part (else of the first frames); return it and the wide prior about it."""
    order, before, known = case
    free = order if before == 0 else (2 if np.isfinite(known) else 3)
    count = max(before, free + 1) if before else 2 * order
    t, y, w = frames[:count], values[:count].copy(), np.sqrt(weights[:count])
    free = min(free, t.size)
    if np.isfinite(known):
        y -= 0.5 * known * t**2
    design = np.stack([t**i / (2.0 if i == 2 else 6.0 if i == 3 else 1.0) for i in range(free)], axis=1)
    solution = np.linalg.lstsq(design * w[:, None], y * w, rcond=None)[0]
    inverse = np.linalg.pinv((design * w[:, None]).T @ (design * w[:, None]))
    centre = np.zeros(order)
    centre[:free] = solution
    covariance = np.zeros((order, order))
    # the noise of the fit alone would be too sharp where an event cuts the ballistic part short
    np.fill_diagonal(covariance[:free, :free], DIFFUSE**2 * np.maximum(np.diag(inverse), 1e-12))
    if np.isfinite(known):
        centre[2] = known
    return centre, covariance


def _with_nodes(record: Record, frames: Array, values: Array, variance: Array, jumps: tuple[float, float]) -> Record:
    """Interleave frames and events by time, an event before the frame of the same instant."""
    inside = [(i, t) for i, t in enumerate(record.events) if t > frames[0]]
    rows = np.zeros((frames.size + len(inside), 4))
    rows[: frames.size, 0] = frames
    rows[: frames.size, 1] = values - record.polynomial(frames)[:, 0]
    rows[: frames.size, 2] = variance
    rows[: frames.size, 3] = -1.0
    for row, (i, t) in enumerate(inside, start=frames.size):
        rows[row] = (t, *(jumps if i == 0 else (0.0, 0.0)), i)
    rows = rows[np.lexsort((-rows[:, 3], rows[:, 0]))]
    return Record(**{**record.__dict__, "nodes": np.ascontiguousarray(rows)})


@dataclass(frozen=True)
class StatePass:
    """A smoothed record: evaluates position, velocity and acceleration anywhere."""

    record: Record
    theta: Array
    law: Array
    strengths: Array
    noise_scale: float
    cost: float
    filtered: tuple[Array, Array]
    ahead: tuple[Array, Array]

    def evaluate(self, times_s: Array, *, before: bool = False) -> tuple[Array, Array]:
        """Return states (n, 3) and covariances (n, 3, 3) in m, m/s, m/s²; at an event: after it, or ``before``."""
        return self.at(self.record.places(times_s, before=before))

    def at(self, places: Places) -> tuple[Array, Array]:
        """As ``evaluate``, at places of its record."""
        states, spread = self._joined(places)
        unit = self._unit
        return states * unit, spread[:, :3, :3] * np.outer(unit, unit) * self.noise_scale**2

    def means_at(self, places: Places) -> Array:
        """Return the states (n, 3) alone, at places of its record."""
        return self._joined(places)[0] * self._unit

    @property
    def _unit(self) -> Array:
        return np.asarray(self.record.noise_m / self.record.interval_s ** np.arange(3))

    def _joined(self, places: Places) -> tuple[Array, Array]:
        """States (n, 3) and covariances in frames and standard deviations of the noise."""
        record = self.record
        deviation, spread = two_filters.evaluate(
            places.frames,
            places.anchors,
            record.nodes,
            self.law,
            record.events,
            self.strengths,
            record.order,
            self.filtered,
            self.ahead,
        )
        return deviation[:, :3] + places.polynomial, spread

    def leverage(self, covariance: Array, variance: Array) -> Array:
        """Return V/r: of a frame that was used, the share of its own measurement in its smoothed position (< 1).

        ``covariance`` is the one that ``evaluate`` gives at the frame.
        """
        return np.asarray(np.maximum(covariance[:, 0, 0] / self.noise_scale**2, 0.0) / variance)


def smooth(record: Record, theta: Array) -> StatePass:
    """Smooth ``record`` with given hyperparameters (see ``likelihood.law_of``)."""
    law = likelihood.law_of(theta, record.order)
    strengths = likelihood.strengths_of(theta, record.events)
    model = (record.nodes, law, record.events, strengths, record.start_mean, record.start_covariance)
    logs, squares = _likelihood(record, law, strengths)
    count = max(int(np.sum(record.nodes[:, 3] < 0)) - record.order, 1)
    filtered = two_filters.filter_forward(*model)
    ahead = two_filters.filter_backward(*model[:4], record.order)
    scale = float(np.sqrt(squares / count))
    value = 0.5 * (count * np.log(squares / count + 1e-300) + logs)
    return StatePass(record, theta, law, strengths, scale, float(value), filtered, ahead)


def _likelihood(record: Record, law: Array, strengths: Array) -> tuple[float, float]:
    """Σ log F and Σ v²/F of the innovations of ``record``."""
    laws, all_strengths = np.tile(law, (side_by_side.SETS, 1)), np.tile(strengths, (side_by_side.SETS, 1))
    logs, squares = side_by_side.log_likelihoods(
        record.nodes, laws, record.events, all_strengths, record.start_mean, record.start_covariance
    )
    return float(logs[0]), float(squares[0])
