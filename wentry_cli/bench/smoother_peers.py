"""Other ways to velocity and acceleration: SciPy's splines, csaps, Savitzky–Golay, PyNumDiff, differences, an oracle.

csaps and PyNumDiff come with the extra ``peers``; where they are not installed they are left out.
"""

from __future__ import annotations

import contextlib
import importlib.util
import io
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import UnivariateSpline, make_smoothing_spline
from scipy.optimize import minimize
from scipy.signal import savgol_filter

from wentry_cli.bench.falls import FPS, GRAVITY, Truth
from wentry_cli.kinematics.likelihood import SEARCH_LIMITS, clipped
from wentry_cli.kinematics.state_pass import Ballistic, Record, prepare, smooth

Array = NDArray[np.float64]
Method = Callable[[Array, Array, float], tuple[Array, Array]]
ORACLE = "oracle: state space of order 4, hyperparameters fitted to the truth"
ORACLE_AT_IMPACT = "oracle: the same, fitted to the first 4 ms"
ORACLE_DRAWS, ORACLE_CALLS = 4, 200
BAND_LIMIT_HZ = 40.0  # what PyNumDiff is told of the signal: the softest spheres ring at 20 Hz, the slam is far faster


def differences(t: Array, y: Array, noise: float) -> tuple[Array, Array]:
    """Central differences, twice."""
    del noise
    v = np.gradient(y, t)
    return v, np.gradient(v, t)


def cubic_gcv(t: Array, y: Array, noise: float) -> tuple[Array, Array]:
    """Cubic smoothing spline with the penalty by generalised cross validation."""
    del noise
    # in frames: in seconds the search for the penalty ends at its bound
    frames = (t - t[0]) * FPS
    spline = make_smoothing_spline(frames, y)
    return spline.derivative(1)(frames) * FPS, spline.derivative(2)(frames) * FPS**2


def quintic_known_noise(t: Array, y: Array, noise: float) -> tuple[Array, Array]:
    """Quintic spline whose residual is the true noise."""
    spline = UnivariateSpline(t, y / noise, k=5, s=t.size)
    return spline.derivative(1)(t) * noise, spline.derivative(2)(t) * noise


def savitzky_golay(t: Array, y: Array, noise: float) -> tuple[Array, Array]:
    """Window by generalised cross validation of the smoothed position, degree 4."""
    del noise
    windows = [w for w in range(7, 62, 4) if w < t.size]
    scores = []
    for w in windows:
        own = savgol_filter(np.eye(1, w, w // 2)[0], w, 4)[w // 2]
        scores.append(np.mean((y - savgol_filter(y, w, 4)) ** 2) / (1.0 - own) ** 2)
    best, step = windows[int(np.argmin(scores))], 1.0 / FPS
    return savgol_filter(y, best, 4, 1, step), savgol_filter(y, best, 4, 2, step)


def csaps_own(t: Array, y: Array, noise: float) -> tuple[Array, Array]:
    """Cubic smoothing spline of csaps with the smoothing that it chooses itself."""
    del noise
    from csaps import CubicSmoothingSpline

    frames = (t - t[0]) * FPS
    spline = CubicSmoothingSpline(frames, y).spline
    return spline(frames, nu=1) * FPS, spline(frames, nu=2) * FPS**2


def pynumdiff_optimised(name: str) -> Method:
    """A method of PyNumDiff with its own optimiser; the acceleration by the same method from the velocity."""

    def differentiate(t: Array, y: Array, noise: float) -> tuple[Array, Array]:
        del noise
        import pynumdiff
        from pynumdiff.optimize import optimize

        method, step = getattr(pynumdiff, name), float(t[1] - t[0])
        sink = io.StringIO()
        with contextlib.redirect_stderr(sink), contextlib.redirect_stdout(sink):
            best, _ = optimize(method, y, step, bandlimit=BAND_LIMIT_HZ, parallel=False)
            _, v = method(y, step, **best)
            again, _ = optimize(method, v, step, bandlimit=BAND_LIMIT_HZ, parallel=False)
            _, a = method(v, step, **again)
        return v, a

    return differentiate


def installed_peers() -> dict[str, Method]:
    """The methods of the optional packages that are installed, by the name that a table shows."""
    found: dict[str, Method] = {}
    if importlib.util.find_spec("csaps"):
        found["csaps, its own choice"] = csaps_own
    if importlib.util.find_spec("pynumdiff"):
        for name in ("rtsdiff", "savgoldiff", "splinediff"):
            found[f"pynumdiff {name}, its own optimiser"] = pynumdiff_optimised(name)
    return found


def find_oracle(truth: Truth, noise: float, random: np.random.Generator, where: NDArray[np.bool_]) -> Method:
    """Return the smoother whose hyperparameters make the errors of v and a ``where`` least on other draws of the noise.

    It knows the truth: no method that sees only a record of this model does better there.
    """
    draws = [_record(truth, truth.y + noise * random.normal(size=truth.t.size), noise) for _ in range(ORACLE_DRAWS)]

    def loss(theta: Array) -> float:
        off = []
        for record in draws:
            states, _ = smooth(record, clipped(theta, SEARCH_LIMITS)).evaluate(truth.t[where])
            off.append([np.mean((states[:, 1] - truth.v[where]) ** 2), np.mean((states[:, 2] - truth.a[where]) ** 2)])
        total = float(np.sum(np.log(np.mean(off, axis=0))))
        return total if np.isfinite(total) else 1e3

    start = np.log([30.0, 3.0, 30.0, 5.0, 1.5])
    limits = {"maxfev": ORACLE_CALLS, "xatol": 0.02, "fatol": 0.005}
    best = minimize(loss, start, method="Nelder-Mead", options=limits).x

    def differentiate(t: Array, y: Array, noise: float) -> tuple[Array, Array]:
        states, _ = smooth(_record(truth, y, noise), clipped(best, SEARCH_LIMITS)).evaluate(t)
        return states[:, 1], states[:, 2]

    return differentiate


def _record(truth: Truth, y: Array, noise: float) -> Record:
    variance = np.full(y.size, noise**2)
    return prepare(truth.t, y, variance, events_s=np.zeros(1), order=4, ballistic=Ballistic(-GRAVITY, 0.0))


PEERS: dict[str, Method] = {
    "scipy make_smoothing_spline, GCV": cubic_gcv,
    "scipy UnivariateSpline k=5, true noise": quintic_known_noise,
    "scipy savgol_filter, window by GCV": savitzky_golay,
    "central differences": differences,
}
