"""How far measured values lie from the truth, and whether their uncertainties tell it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class ErrorStatistics:
    """Errors of ``measured`` values out of ``measurable`` ones.

    ``beyond_3`` is the share whose error exceeds three stated uncertainties, ``pull`` the standard deviation of error
    over uncertainty; both NaN where no uncertainty is stated.
    """

    measurable: int
    measured: int
    bias: float
    rmse: float
    largest: float
    pull: float
    beyond_3: float


def error_statistics(
    measured: FloatArray, truth: FloatArray, uncertainty: FloatArray | None = None, ok: NDArray[np.bool_] | None = None
) -> ErrorStatistics:
    """Statistics of ``measured − truth`` over the entries where ``truth`` is finite.

    All arrays have one shape; ``ok`` marks the entries that the measurement vouches for (default: finite ones). An
    entry that is not vouched for counts as measurable but not as measured.
    """
    measurable = np.isfinite(truth)
    vouched = measurable & np.isfinite(measured) & (np.isfinite(measured) if ok is None else ok)
    error = (measured - truth)[vouched]
    if error.size == 0:
        nan = float("nan")
        return ErrorStatistics(int(measurable.sum()), 0, nan, nan, nan, nan, nan)
    pull = beyond = float("nan")
    if uncertainty is not None:
        stated = uncertainty[vouched]
        usable = np.isfinite(stated) & (stated > 0)
        if usable.any():
            ratio = error[usable] / stated[usable]
            pull, beyond = float(np.sqrt(np.mean(ratio**2))), float(np.mean(np.abs(ratio) > 3))
    return ErrorStatistics(
        int(measurable.sum()),
        int(vouched.sum()),
        float(error.mean()),
        float(np.sqrt(np.mean(error**2))),
        float(np.abs(error).max()),
        pull,
        beyond,
    )
