"""Position, velocity and acceleration with standard errors from a noisy track that is struck at known instants.

``impact_aware``: no process noise before the first event (ballistic), a Gaussian jump of the acceleration at each
event, process noise q∞ + q₀ exp(−(t − t₀)/τ) after it, a state of order 4, averaged over the hyperparameters that the
data allow (``averaging``). Within four frames of an event a quarter is a state of order 3: no smoothness that holds
elsewhere can be taken for granted in a slam that lasts two or three frames. ``gcv`` and ``epps`` are plain quintic
smoothing splines
whose parameter is chosen by generalised cross validation, or at the elbow of roughness against error (Epps, Truscott &
Techet 2010, the paper's route); they are the same model without events, so they carry standard errors too.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from wentry_cli.kinematics import roughness
from wentry_cli.kinematics.averaging import members
from wentry_cli.kinematics.hyperparameters import fit_pass, fit_plain
from wentry_cli.kinematics.outliers import correlation_widening, first_suspects, late_suspects, scatter_ratio
from wentry_cli.kinematics.state_pass import Ballistic, Places, StatePass, prepare, smooth

Array = NDArray[np.float64]
Mode = Literal["impact_aware", "gcv", "epps"]
Mixture = tuple[tuple[float, StatePass], ...]
MINIMUM_FRAMES = 6
ROUNDS = 4
FEW_CHANGED = 0.001  # fewer frames than this share do not move the hyperparameters
LEAST_SCATTER = 1e-6  # below it there is no noise to measure
NEAR_EVENT_FRAMES = 4.0  # 2 ms at the paper's 2000 fps; the share of order 3 is gone at twice that
NEAR_EVENT_SHARE = 0.25


@dataclass(frozen=True)
class TrackState:
    """States at given times: m, m/s, m/s²; ``covariance`` is (n, 3, 3) in that order."""

    times_s: Array
    position: Array
    velocity: Array
    acceleration: Array
    covariance: Array

    def widened(self, factor: Array | float) -> TrackState:
        """Return these states with all standard uncertainties times ``factor``, or each (n, 3) by its own."""
        factors = np.broadcast_to(factor, (self.times_s.size, 3))
        return replace(self, covariance=factors[:, :, None] * factors[:, None, :] * self.covariance)

    @property
    def position_unc(self) -> Array:
        """Standard uncertainty of the position, m."""
        return np.sqrt(self.covariance[:, 0, 0])

    @property
    def velocity_unc(self) -> Array:
        """Standard uncertainty of the velocity, m/s."""
        return np.sqrt(self.covariance[:, 1, 1])

    @property
    def acceleration_unc(self) -> Array:
        """Standard uncertainty of the acceleration, m/s²."""
        return np.sqrt(self.covariance[:, 2, 2])


@dataclass(frozen=True)
class SmoothTrack:
    """A smoothed track. ``frames`` are the states at the input times (missing ones are interpolated).

    ``used`` is False where a frame was missing or deleted as an outlier; ``residual`` is measured − smoothed (NaN
    where missing); ``noise_scale`` multiplies the stated uncertainties to match the scatter found; ``mixture`` holds
    the smoothings and their shares; ``status`` is ok or too_few; ``widening`` is the factor on all standard
    uncertainties for noise that is correlated from frame to frame (``outliers.correlation_widening``), ``rough`` the
    share that the record shows of the roughness expected (``roughness.shown``).
    """

    frames: TrackState
    used: NDArray[np.bool_]
    residual: Array
    noise_scale: float
    events_s: Array
    mixture: Mixture
    status: str
    widening: float = 1.0
    rough: float = 1.0

    def evaluate(self, times_s: Array | float, *, before: bool = False) -> TrackState:
        """Return the states at any times; at the instant of an event those after it, or those ``before`` it.

        Just after it the velocity is short by what the acceleration takes to rise (``state_space.LAG``).
        """
        times = np.atleast_1d(np.asarray(times_s, dtype=float))
        if not self.mixture:
            return _empty(times)
        return _blend(self.mixture, times, self.events_s, before, self.rough).widened(self.widening)

    def means(self, times_s: Array) -> Array:
        """Return position, velocity and acceleration, (n, 3), as ``evaluate`` does; of what has been smoothed."""
        return _mean(self.mixture, times_s, self.events_s)


def smooth_track(
    times_s: Array,
    position_m: Array,
    position_unc_m: Array | float = 1.0,
    *,
    events_s: tuple[float, ...] = (),
    mode: Mode = "impact_aware",
    ballistic: Ballistic = Ballistic(),  # noqa: B008  (frozen)
) -> SmoothTrack:
    """Smooth ``position_m`` (n; NaN = missing) seen at the increasing ``times_s``, uncertainties (n, or one for all).

    ``events_s``: the impact and any later jolts, sub-frame. ``ballistic``: what is known of the acceleration before
    the first of them. Only ratios of the uncertainties matter: their scale is estimated (``noise_scale``).
    Fewer than six measured frames give NaN throughout and status ``too_few``. ValueError for times that do not
    increase.
    """
    times = np.ascontiguousarray(times_s, dtype=float)
    if times.size > 1 and not np.all(np.diff(times) > 0):
        raise ValueError("times must increase")
    position = np.asarray(position_m, dtype=float)
    variance = np.broadcast_to(np.asarray(position_unc_m, dtype=float) ** 2, times.shape)
    measured = np.isfinite(position) & np.isfinite(variance) & (variance > 0)
    if measured.sum() < MINIMUM_FRAMES:
        return _too_few(times, position)
    events = np.asarray(sorted(events_s) if mode == "impact_aware" else (), dtype=float)
    scatter = scatter_ratio(times, position, np.sqrt(variance))
    # in units of what scatters, bandwidths mean the same whatever was stated
    unit = scatter if scatter > LEAST_SCATTER else 1.0
    record = (times[measured], position[measured], unit**2 * variance[measured])
    used = ~first_suspects(*record, events)
    passes = _fit(record, used, events, (mode, ballistic))
    for _ in range(ROUNDS):
        suspects = late_suspects(passes, *record, used)
        if np.array_equal(suspects, ~used) or (~suspects).sum() < MINIMUM_FRAMES:
            break
        changed = np.mean(suspects == used)
        used = ~suspects
        known = passes if changed < FEW_CHANGED else ()
        passes = _fit(record, used, events, (mode, ballistic), known)
    good = measured.copy()
    good[measured] = used
    mixture = tuple(members(passes[0])) if mode == "impact_aware" else ((1.0, passes[0]),)
    mixture += tuple((0.0, other) for other in passes[1:])
    rough = roughness.shown(passes[0], events, NEAR_EVENT_FRAMES) if mode == "impact_aware" else 1.0
    frames = _blend(mixture, times, events, False, rough)
    residual = position - frames.position
    widening = correlation_widening(np.where(good, residual / np.sqrt(variance), np.nan))
    scale = unit * passes[0].noise_scale
    return SmoothTrack(frames.widened(widening), good, residual, scale, events, mixture, "ok", widening, rough)


def _fit(
    measured: tuple[Array, Array, Array],
    used: NDArray[np.bool_],
    events: Array,
    how: tuple[Mode, Ballistic],
    known: tuple[StatePass, ...] = (),
) -> tuple[StatePass, ...]:
    """Smooth the used frames; with the hyperparameters of ``known`` passes where these are given."""
    times, position, variance = (part[used] for part in measured)
    mode, ballistic = how
    if mode != "impact_aware":
        record = prepare(times, position, variance, events_s=events, order=3, ballistic=ballistic)
        return (fit_plain(record, mode),)
    orders = (4, 3) if events.size else (4,)
    records = [
        prepare(times, position, variance, events_s=events, order=order, ballistic=ballistic) for order in orders
    ]
    if known:
        return tuple(smooth(record, old.theta) for record, old in zip(records, known, strict=True))
    return tuple(fit_pass(record) for record in records)


def _blend(mixture: Mixture, times: Array, events: Array, before: bool, rough: float) -> TrackState:
    """Mix the smoothings by their shares. The error bars hold as much roughness as the record shows."""
    states, squares = np.zeros((times.size, 3)), np.zeros((times.size, 3, 3))
    first = np.zeros((times.size, 3))
    for member, (smoothing, part, weight, places) in enumerate(_weighted(mixture, times, events, before)):
        own, spread = smoothing.at(places)
        if member == 0:
            first = own
        off = own - first[part]
        states[part] += weight[:, None] * off
        squares[part] += weight[:, None, None] * (spread + off[:, :, None] * off[:, None, :])
    covariance = squares - states[:, :, None] * states[:, None, :]
    states += first
    blended = TrackState(times, states[:, 0], states[:, 1], states[:, 2], covariance)
    return blended.widened(roughness.bar_factors(mixture[0][1], times, events, NEAR_EVENT_FRAMES, rough))


def _mean(mixture: Mixture, times: Array, events: Array) -> Array:
    """The states (n, 3) that ``_blend`` gives, without their covariances, which cost more."""
    states, first = np.zeros((times.size, 3)), np.zeros((times.size, 3))
    for member, (smoothing, part, weight, places) in enumerate(_weighted(mixture, times, events, False)):
        own = smoothing.means_at(places)
        if member == 0:
            first = own
        states[part] += weight[:, None] * (own - first[part])
    return states + first


def _weighted(
    mixture: Mixture, times: Array, events: Array, before: bool
) -> Iterator[tuple[StatePass, NDArray[np.intp] | slice, Array, Places]]:
    """Each smoothing with those of the times at which it counts, its weight there, and where these lie in its record.

    One of share 0 counts near events only, where it takes from the others.
    """
    near = np.zeros(times.shape)
    if events.size and any(share == 0.0 for share, _ in mixture):
        distance = np.min(np.abs(times[:, None] - events[None, :]), axis=1) / mixture[0][1].record.interval_s
        near = NEAR_EVENT_SHARE * np.clip(2.0 - distance / NEAR_EVENT_FRAMES, 0.0, 1.0)
    record = mixture[0][1].record
    everywhere, somewhere = record.places(times, before=before), np.flatnonzero(near)
    for share, smoothing in mixture:
        if share > 0.0:
            own = smoothing.record is record
            places = everywhere if own else smoothing.record.places(times, before=before)
            yield smoothing, slice(None), share * (1.0 - near), places
        elif somewhere.size:
            yield smoothing, somewhere, near[somewhere], smoothing.record.places(times[somewhere], before=before)


def _empty(times: Array) -> TrackState:
    nothing = np.full(times.shape, np.nan)
    return TrackState(times, nothing, nothing, nothing, np.full((times.size, 3, 3), np.nan))


def _too_few(times: Array, position: Array) -> SmoothTrack:
    unused = np.zeros(times.shape, dtype=bool)
    return SmoothTrack(_empty(times), unused, np.full(position.shape, np.nan), np.nan, np.empty(0), (), "too_few")
