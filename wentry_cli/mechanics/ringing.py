"""One drop on a rigid surface as its calibration sees it: λ(t) after the first peak."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from wentry_cli.mechanics.bergstrom_boyce import FloatArray


@dataclass(frozen=True)
class Ringing:
    """One drop after its first peak: times in s from the peak, λ and its standard uncertainty (equal lengths).

    ``common`` is the relative standard uncertainty of λ that all frames of the drop share (scale, edge, outline).
    """

    times_s: FloatArray
    stretch: FloatArray
    stretch_unc: FloatArray
    common: float = 0.0

    def clean(self) -> Ringing:
        """The frames that were measured, none of them surer than the median one: few frames must not lead the fit."""
        unc = np.broadcast_to(np.asarray(self.stretch_unc, dtype=float), np.shape(self.times_s))
        with np.errstate(invalid="ignore"):
            good = np.isfinite(self.times_s) & np.isfinite(self.stretch) & (unc > 0.0) & (self.times_s >= 0.0)
        floor = float(np.median(unc[good])) if good.any() else 1.0
        return Ringing(self.times_s[good], self.stretch[good], np.maximum(unc[good], floor), self.common)
