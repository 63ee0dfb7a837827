from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from tests.stages.drop_fixtures import make_drop
from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.contours.fitting import assemble_fit
from wentry_cli.stages.track.below import warn_where_lost_below
from wentry_cli.stages.track.out_of_view import warn_where_out_of_view
from wentry_cli.tracking.sighting import Sighting

SPEED, SURFACE, DRY, COUNT = 4.0, 100.0, 20, 80
QUALITY = {"blur": 1.0, "arc": 0.5, "gated": 0.0, "residual": 0.01}


def sightings(seen_below: int) -> list[Sighting]:
    """A sphere that reaches the surface in frame 20 and is measured in the first so many frames after that."""
    found = []
    for k in range(COUNT):
        fit = assemble_fit(EllipseShape(50.0, 20.0 + (SPEED * (k - DRY) + 60.0), 20.0), np.eye(5), QUALITY, "ok")
        wet = k >= DRY
        lost = wet and k >= DRY + seen_below
        found.append(Sighting(k, "no_edge", wet=True) if lost else Sighting(k, "ok", fit, wet=wet))
    return found


@pytest.mark.parametrize(
    ("seen_below", "rows", "count", "told"),
    [
        (0, 400, COUNT, "in 0 of the 60"),
        (5, 400, COUNT, "in 5 of the 60"),
        (0, 300, COUNT, "in 0 of the 50"),
        (6, 400, COUNT, ""),
        (0, 148, COUNT, ""),
        (0, 400, DRY + 12, ""),
    ],
)
def test_a_sphere_that_is_seen_in_air_only_is_told(
    seen_below: int, rows: int, count: int, told: str, caplog: pytest.LogCaptureFixture
) -> None:
    clip = SimpleNamespace(count=count, shape=(rows, 200))
    warn_where_lost_below(make_drop(), clip, sightings(seen_below)[:count], SURFACE)
    assert ("below the surface" in caplog.text) is bool(told)
    assert told in caplog.text


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["ok"] * 4 + ["out_of_frame"] * 3, "in 3 frames, from frame 4 on, 2.0 ms after impact"),
        (["ok"] * 4 + ["poor_fit"] + ["out_of_frame"], "in a frame, from frame 5 on, 2.5 ms after impact"),
        (["out_of_frame"] * 2 + ["ok"] * 4 + ["occluded"], ""),
        (["ok", "out_of_frame", "ok"], ""),
        (["out_of_frame"] * 3, ""),
    ],
)
def test_a_sphere_that_leaves_the_picture_is_told_once(
    words: list[str], told: str, caplog: pytest.LogCaptureFixture
) -> None:
    warn_where_out_of_view(make_drop(), "side", {"status": words, "t_s": 5e-4 * np.arange(len(words))})
    assert len(caplog.messages) == bool(told)
    assert told in caplog.text
