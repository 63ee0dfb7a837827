"""Uncertainty of least squares parameters where points come in groups that err together.

The variance is the bias-reduced sandwich over groups (Bell and McCaffrey 2002, "CR2"); the degrees of freedom of its
Student's t follow from the design (Satterthwaite), so that few or unequal groups widen the interval as they should.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

Array = NDArray[np.float64]
CONFIDENCE = 0.95
FLAT = 1e-9  # share of a direction that the other groups leave open; below it they say nothing about it


@dataclass(frozen=True)
class Parameter:
    """A fitted number, its standard uncertainty and its 95 % interval, both from one variance with ``dof``.

    All but ``value`` are NaN where the groups are too few to tell them.
    """

    value: float
    unc: float
    low: float
    high: float
    dof: float


def fit_parameters(design: Array, y: Array, groups: NDArray[np.int64]) -> list[Parameter]:
    """Least squares of ``y`` on the columns of ``design`` (of full rank), with ``groups`` naming the group of a row."""
    q, r = np.linalg.qr(design)
    inverse = np.linalg.inv(r)
    fitted = inverse @ (q.T @ y)
    members = [np.flatnonzero(groups == label) for label in np.unique(groups)]
    if len(members) <= design.shape[1]:
        return [_unknown(float(value)) for value in fitted]
    left = np.eye(y.size) - q @ q.T
    inflated = [_inflation(left[np.ix_(rows, rows)]) @ q[rows] for rows in members]
    parameters = []
    for value, weights in zip(fitted, inverse, strict=True):
        # the variance is the sum of (share · y)² over groups; a share tells how a group's residual moves the parameter
        shares = np.array([left[:, rows] @ (part @ weights) for rows, part in zip(members, inflated, strict=True)])
        parameters.append(_parameter(float(value), shares, y, float(weights @ weights)))
    return parameters


def _inflation(left: Array) -> Array:
    """The inverse square root of what a fit leaves of a group's scatter; nothing along what it leaves nothing of."""
    open_share, directions = np.linalg.eigh(left)
    scale = np.where(open_share > FLAT, 1.0 / np.sqrt(np.maximum(open_share, FLAT)), 0.0)
    return np.asarray(directions * scale @ directions.T, dtype=float)


def _parameter(value: float, shares: Array, y: Array, true: float) -> Parameter:
    """From the groups' shares; ``true`` is the variance for independent errors of unit variance.

    What the sandwich expects for such errors is ``true`` too, but where one group alone carries the parameter.
    """
    products = shares @ shares.T
    expected = float(np.trace(products))
    if expected < FLAT * true:
        return _unknown(value)
    unc = float(np.sqrt(true / expected) * np.linalg.norm(shares @ y))
    dof = expected**2 / float(np.sum(products**2))
    reach = unc * float(stdtrit(dof, 0.5 * (1.0 + CONFIDENCE)))
    return Parameter(value, unc, value - reach, value + reach, dof)


def _unknown(value: float) -> Parameter:
    return Parameter(value, np.nan, np.nan, np.nan, np.nan)
