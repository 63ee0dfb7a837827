"""The free oscillation λ(t) of a Bergström–Boyce sphere released at rest from a stretch, with its extrema."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wentry_cli.errors import ConfigurationError
from wentry_cli.mechanics import stepping
from wentry_cli.mechanics.bergstrom_boyce import FloatArray, Groups, Material, find_groups, flow_hardening
from wentry_cli.mechanics.dense_output import SAMPLED
from wentry_cli.mechanics.events import PEAK, VALLEY
from wentry_cli.mechanics.stepping import MOST_EVENTS, SMALL_PERIOD

PARAMETERS = ("stretch_0", "eps0_dot_1_s", "n", "g_inf_pa", "g_t_pa", "viscous_0")
MOST_STEPS = 200_000
STRETCH_RANGE = (0.05, 20.0)
NOT_RISING = "times_s must be a rising, finite, non-empty array of one dimension"


@dataclass(frozen=True)
class Trajectory:
    """One oscillation. Times in s from the release; arrays are sampled at ``t_s``.

    ``states`` has a row each for λ, dλ/dt*, λ_p² − 1 and, where asked for, the sensitivities of λ to the groups.
    ``events`` has a row (t*, kind, λ, dλ/dt*, λ_p² − 1) for each extremum and crossing of λ = 1 in the order in which
    they happen; the release itself is not among them.
    ``energy_error`` is the largest violation of the energy balance over the initial energy.
    """

    groups: Groups
    stretch_0: float
    t_s: FloatArray
    states: FloatArray
    events: FloatArray
    energy_error: float
    steps: int
    rejected_steps: int

    @property
    def stretch(self) -> FloatArray:
        """λ at ``t_s``; NaN beyond the end of an integration that stopped after the peaks wanted."""
        return np.asarray(self.states[0])

    @property
    def rate_1_s(self) -> FloatArray:
        """dλ/dt in 1/s."""
        return np.asarray(self.states[1] / self.groups.time_scale_s)

    @property
    def stretch_viscous(self) -> FloatArray:
        """λ_p, the part of the stretch that has flowed."""
        return np.asarray(np.sqrt(1.0 + self.states[2]))

    @property
    def sensitivities(self) -> FloatArray:
        """A row per time and a column per name in ``PARAMETERS``, or no column.

        dλ/dλ₀, dλ/d ln ε̇₀, dλ/dn, dλ/d ln G∞, dλ/d ln G_T, dλ/d ln λ_p(0), by the chain rule from the groups.
        """
        if len(self.states) == SAMPLED:
            return np.empty((self.t_s.size, 0))
        to_start, to_flow, to_n, to_ratio, to_viscous = self.states[SAMPLED:]
        ratio, scaled = self.groups.stiffness_ratio, self.t_s / self.groups.time_scale_s
        to_log_inf = 0.5 * scaled * self.states[1] - ratio * to_ratio - 0.5 * to_flow
        to_log_t = ratio * to_ratio + self.groups.m * to_flow
        return np.column_stack([to_start, to_flow, to_n, to_log_inf, to_log_t, to_viscous])

    @property
    def event_t_s(self) -> FloatArray:
        """Times of the events in s."""
        return self.events[:, 0] * self.groups.time_scale_s

    @property
    def event_kind(self) -> NDArray[np.int64]:
        """``events.PEAK``, ``VALLEY``, ``UPWARD`` or ``DOWNWARD`` of each event."""
        return self.events[:, 1].astype(np.int64)

    @property
    def event_stretch(self) -> FloatArray:
        """λ at the events."""
        return self.events[:, 2]

    def times_of(self, kind: int) -> FloatArray:
        """Times in s of all events of one kind."""
        times: FloatArray = self.event_t_s[self.event_kind == kind]
        return times

    def stretches_of(self, kind: int) -> FloatArray:
        """Stretches at all events of one kind."""
        stretches: FloatArray = self.event_stretch[self.event_kind == kind]
        return stretches

    @property
    def period_s(self) -> float:
        """Time from the release to the next extremum of the same sense; NaN where none was reached."""
        same = self.times_of(PEAK if self.stretch_0 > 1.0 else VALLEY)
        return float(same[0]) if same.size else math.nan


def solve_oscillation(
    material: Material,
    stretch_0: float,
    times_s: FloatArray,
    *,
    tolerance: float = 1e-10,
    sensitivities: bool = False,
    peaks_wanted: int = 0,
    most_steps: int = MOST_STEPS,
    viscous_0: float = 1.0,
) -> Trajectory:
    """Integrate λ(t) from λ(0) = ``stretch_0`` at rest, λ_p(0) = ``viscous_0``; sample it at the rising ``times_s``.

    ``tolerance`` bounds the local error of every step relative to 1 + |state|; the global error is of its size. A small
    oscillation is integrated more accurately in proportion to |λ₀ − 1|.
    With ``peaks_wanted`` the integration ends after so many peaks, and later samples are NaN. Compiled DOP853.

    Raises ``ConfigurationError`` with one sentence where the parameters are singular, too stiff for an explicit
    method, or not physical.
    """
    groups = find_groups(material)
    low, high = STRETCH_RANGE
    for value in (stretch_0, viscous_0):
        if not low <= value <= high:
            raise ConfigurationError(f"an initial stretch of {value:g} is outside {low:g} to {high:g}")
    times = np.ascontiguousarray(times_s, dtype=np.float64)
    if times.ndim != 1:
        raise ValueError(NOT_RISING)
    if sensitivities and (material.m < 1.0 or material.xi == 0.0):
        raise ConfigurationError("sensitivities need m of at least 1 and xi > 0; the flow rule is not smooth otherwise")
    settings = (groups.time_scale_s, float(tolerance), most_steps, peaks_wanted)
    status, done, energy_error, sampled, found, accepted, rejected = stepping.integrate_release(
        groups.values, (float(stretch_0), float(viscous_0)), times, settings, sensitivities
    )
    if status == stepping.NOT_RISING:
        raise ValueError(NOT_RISING)
    if status != stepping.DONE:
        raise ConfigurationError(_refusal(status, groups, stretch_0, done))
    return Trajectory(groups, stretch_0, times, sampled, found, energy_error, accepted, rejected)


def find_period(material: Material, stretch_0: float, *, tolerance: float = 1e-10) -> float:
    """Free period in s, from the release at ``stretch_0`` to the next extremum of the same sense.

    NaN where the sphere creeps back without passing another extremum within 40 small-amplitude periods.
    """
    duration = 40.0 * SMALL_PERIOD * find_groups(material).time_scale_s
    peaks = 1 if stretch_0 > 1.0 else 2  # the valley that ends a release below 1 lies between two peaks
    return solve_oscillation(
        material, stretch_0, np.array([duration]), tolerance=tolerance, peaks_wanted=peaks
    ).period_s


def _refusal(status: int, groups: Groups, stretch_0: float, fraction: float) -> str:
    hardening = flow_hardening(stretch_0**2 - 1.0, groups.xi)
    powers = [groups.flow * c**groups.n for c in (groups.xi, hardening) if c > 0.0]
    fastest = max(powers, default=math.nan)
    reason = {
        stepping.TOO_MANY_STEPS: "needs too many steps",
        stepping.STEP_TOO_SMALL: "needs steps below the rounding of time",
        stepping.TOO_MANY_EVENTS: f"has more than {MOST_EVENTS} extrema and crossings",
    }[status]
    return (
        f"the oscillation {reason} ({100.0 * fraction:.0f} % done; dimensionless flow rate A* c^n up to "
        f"{fastest:.3g}, G_T/G_inf {groups.stiffness_ratio:.3g}): the parameters are too stiff; check eps0_dot_1_s, n, "
        "xi and that tau0_pa is in Pa"
    )
