"""A sphere that is not round in air: the picture is drawn out in one direction, or the sphere is no sphere."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from wentry_cli.doubts import puts_in_doubt
from wentry_cli.stages.track.scales import Scales
from wentry_cli.tracking.sighting import Sighting

if TYPE_CHECKING:
    from wentry_cli.config.campaign import Drop

logger = logging.getLogger(__name__)
FEWEST, LEAST_ARC = 4, 0.9
# how far a stretch must be from 1 (a moulded sphere may be out of round by a hundredth of its diameter), that in
# standard uncertainties, and by which share of it it may change
LEAST, CLEARLY, STEADY = 0.006, 5.0, 0.3


def oblateness(sightings: Sequence[Sighting]) -> float:
    """λ − 1 of a sphere in air where it is clearly not 0 and the same in all frames that show it whole; else 0.

    A sphere that rings from its release has a stretch that changes.
    """
    whole = [
        (item.fit.stretch - 1.0, item.fit.stretch_unc)
        for item in sightings
        if item.ok and not item.wet and item.fit is not None and item.fit.arc_fraction > LEAST_ARC
    ]
    if len(whole) < FEWEST:
        return 0.0
    off, unc = np.array(whole).T
    usual = float(np.median(off))
    clear = abs(usual) > max(LEAST, CLEARLY * float(np.median(unc)))
    return usual if clear and np.ptp(off) < STEADY * abs(usual) + CLEARLY * float(np.median(unc)) else 0.0


def with_doubted_pixels(drop: Drop, scales: Scales, off: float) -> Scales:
    """The scales, doubted by how far one along the height differs from the mean one; it is told where that is so."""
    if not off:
        return scales
    wider = (1.0 + off) ** 3 - 1.0
    logger.warning(
        f"{drop.name}: in air the sphere is {abs(wider):.1%} {'wider than high' if wider > 0 else 'higher than wide'} "
        "in all frames, as in a picture whose pixels are not square or that was scaled in one direction; export the "
        "recording as it was taken, or heights and speeds may be wrong by as much",
        extra=puts_in_doubt("shape of the pixels"),
    )
    doubt = abs((1.0 + off) ** 2 - 1.0)
    return replace(
        scales,
        air_unc=float(np.hypot(scales.air_unc, doubt * scales.air)),
        water_unc=float(np.hypot(scales.water_unc, doubt * scales.water)),
    )
