"""Clips that begin while the sphere still hangs, or end before it meets the surface."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from drop_fixtures import SCALE, make_drop

from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.contours.fitting import assemble_fit
from wentry_cli.imaging.free_surface import SurfaceRow
from wentry_cli.stages.track.impact import entry_impact
from wentry_cli.stages.track.side_result import why_no_impact
from wentry_cli.tracking.held import let_go
from wentry_cli.tracking.sighting import Sighting

FPS, G, SURFACE, NOISE = 1000.0, 9.81, 400.0, 0.02


def sightings(count: int, released_s: float, fall_s: float) -> list[Sighting]:
    quality = {"blur": 1.0, "arc": 1.0, "gated": 0.0, "residual": 0.01}
    random = np.random.default_rng(7)
    found = []
    for frame in range(count):
        since = max(frame / FPS - released_s, 0.0)
        row = SURFACE + 0.5 * G * SCALE * (since**2 - fall_s**2) + NOISE * random.normal()
        if since < fall_s:
            shape = EllipseShape(0.0, row - 50.0, 50.0, 1.0)
            fit = assemble_fit(shape, np.eye(5) * NOISE**2, quality, "ok")
            found.append(Sighting(frame, "ok", fit._replace(bottom_y_unc_px=NOISE)))
    return found


@pytest.mark.parametrize(("released_s", "fall_s"), [(0.0702, 0.05), (0.0503, 0.03), (0.0107, 0.1)])
def test_impact_and_speed_are_those_of_the_fall(released_s: float, fall_s: float) -> None:
    seen = sightings(200, released_s, fall_s)
    clip = SimpleNamespace(time_s=np.arange(200) / FPS)
    impact = entry_impact(
        make_drop(), clip, seen, (SurfaceRow(SURFACE, 0.05, 3.0, 0.5, "ok"), SCALE), let_go(seen, clip.time_s)
    )
    assert impact.status == "ok"
    assert abs(impact.time_s - released_s - fall_s) < 3.0 * impact.time_unc_s < 1e-3
    assert impact.speed_px_s == pytest.approx(G * fall_s * SCALE, rel=2e-3)


@pytest.mark.parametrize(
    ("count", "status"), [(150, "ok"), (121, "clip_ended"), (118, "clip_ended"), (90, "no_object")]
)
def test_a_clip_that_ends_in_air_says_by_how_much(count: int, status: str) -> None:
    """Contact is in frame 120.2; of what is seen for a shorter time than it is away, nothing is said."""
    seen = sightings(count, 0.0702, 0.05)
    clip = SimpleNamespace(time_s=np.arange(count) / FPS)
    drop = make_drop()
    impact = entry_impact(
        drop, clip, seen, (SurfaceRow(SURFACE, 0.05, 3.0, 0.5, "ok"), SCALE), let_go(seen, clip.time_s)
    )
    assert impact.status == status
    told = why_no_impact(impact, "surface", drop, clip)
    if status == "clip_ended":
        assert np.isfinite(impact.time_s) == (count == 121)
        assert impact.beyond_s == pytest.approx(0.1202 - (count - 1) / FPS, abs=5e-5)
        assert told.startswith(f"the clip ends {121.2 - count:.1f} frames before the sphere meets the surface, in air")
    else:
        assert np.isfinite(impact.time_s) == (status == "ok")
        assert told.startswith("the sphere never reaches the surface" if status == "no_object" else "")
        assert bool(told) == (status != "ok")
