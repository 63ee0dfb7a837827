"""The tilt of the sphere: what single frames tell of it, and what they tell together, for the next one to hold."""

from __future__ import annotations

import math

from wentry_cli.contours.ellipse import SilhouetteFit
from wentry_cli.tracking.sighting import Sighting

# A frame tells the tilt where it is known to so many degrees: not that of a sphere that is nearly round.
WORST_UNC_DEG = 0.5
# A sphere that is out of round by this share of its radius looks tilted, the more so the less it is stretched.
OUT_OF_ROUND = 2e-4
# What is left of a step by its curvature.
CURVED = 0.02
# Before anything is seen of it; how far it may wander from one frame to the next; what is no longer believed.
ANY_TILT_DEG = 5.0
WANDER_DEG = 0.05
MOST_SIGMA = 3.0
# A tilt below this does neither stretch nor lowest point any harm.
HARMLESS_DEG = 0.3


def identified_tilt(fit: SilhouetteFit) -> tuple[float, float]:
    """Tilt in degrees and its standard uncertainty, as one outline tells it; NaN where it does not.

    Beside the noise the uncertainty holds what a sphere that is not quite round does to it.
    """
    step, oblate = fit.seen_tilt_deg - fit.tilt_deg, abs(fit.stretch - 1.0)
    if fit.status != "ok" or not math.isfinite(fit.seen_tilt_unc_deg) or oblate == 0.0:
        return math.nan, math.nan
    round_deg = math.degrees(OUT_OF_ROUND / (3.0 * oblate))
    unc = math.hypot(fit.seen_tilt_unc_deg, CURVED * step, round_deg)
    return (fit.seen_tilt_deg, unc) if unc < WORST_UNC_DEG else (math.nan, math.nan)


class Tilt:
    """The tilt in degrees as the frames so far tell it: it may wander slowly, and what stands out counts less."""

    def __init__(self) -> None:
        """Start upright, not knowing."""
        self.value, self.unc = 0.0, ANY_TILT_DEG
        self.frame: int | None = None
        self.known_from: int | None = None

    def hear(self, sighting: Sighting) -> None:
        """Take what another frame tells into account."""
        seen, unc = identified_tilt(sighting.fit) if sighting.fit is not None else (math.nan, math.nan)
        if not math.isfinite(seen):
            return
        frame = sighting.frame
        steps = 0 if self.frame is None else abs(frame - self.frame)
        self.frame = frame
        variance = min(self.unc**2 + steps * WANDER_DEG**2, ANY_TILT_DEG**2)
        off = abs(seen - self.value) / math.sqrt(variance + unc**2)
        noise = unc**2 * max(1.0, off / MOST_SIGMA) ** 2
        gain = variance / (variance + noise)
        self.value += gain * (seen - self.value)
        self.unc = math.sqrt((1.0 - gain) * variance)
        if self.known_from is None and self.unc < WORST_UNC_DEG:
            self.known_from = frame

    @property
    def harmful_before(self) -> int:
        """The frame before which others were looked at with a tilt that was not yet known and does harm; else -1."""
        return self.known_from if self.known_from is not None and abs(self.value) > HARMLESS_DEG else -1
