from __future__ import annotations

import numpy as np
import pytest

from wentry_cli.contours.ellipse import EllipseShape, SilhouetteFit
from wentry_cli.contours.fitting import assemble_fit
from wentry_cli.tracking.confirmed import without_unconfirmed
from wentry_cli.tracking.sighting import Sighting


def fit(gated: float) -> SilhouetteFit:
    quality = {"blur": 1.0, "arc": 0.5, "gated": gated, "residual": 0.05}
    return assemble_fit(EllipseShape(50.0, 60.0, 20.0), np.eye(5), quality, "ok")


def track(good: list[int], gated: float) -> list[Sighting]:
    """Thirty wet frames, of which some were measured and the others lost."""
    return [
        Sighting(k, "ok", fit(gated), wet=True) if k in good else Sighting(k, "no_edge", wet=True) for k in range(30)
    ]


@pytest.mark.parametrize(
    ("good", "gated", "believed"),
    [
        ([10, 17], 0.5, 0),
        ([10, 11, 17, 18], 0.5, 0),
        ([10, 17], 0.2, 2),
        ([10, 12, 15], 0.5, 3),
        (list(range(30)), 0.5, 30),
        ([0, 1, 2, 3, 9], 0.5, 4),
    ],
)
def test_what_is_seen_alone_needs_an_outline_that_agrees(good: list[int], gated: float, believed: int) -> None:
    kept = without_unconfirmed(track(good, gated))
    assert sum(item.ok for item in kept) == believed
    assert all(kept[k].status == ("ok" if kept[k].ok else "poor_fit") for k in good)
    assert all(item.status == "no_edge" for item in kept if item.frame not in good)
