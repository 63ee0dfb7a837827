from __future__ import annotations

import numpy as np
import pytest

from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.imaging.patch import Patch
from wentry_cli.synthetic.still import StillBody, StillLight, draw_still
from wentry_cli.tracking.held_radius import radius_slope, with_radius
from wentry_cli.tracking.scale import PooledRadius
from wentry_cli.tracking.sighting import FURTHER_PX, Look, Sighting, examine
from wentry_cli.tracking.wet_radius import constrain, pool_sightings

BODY = StillBody(80.3, 90.7, 40.0, stretch=1.15, separation_y_px=86.0)
BOX = (0.0, 0.0, 159.0, 199.0)


@pytest.fixture(scope="module")
def patch() -> Patch:
    still = draw_still(BODY, StillLight(), (200, 160), np.random.default_rng(4))
    return Patch(still.flat)


def look(free: str) -> Look:
    return Look(BOX, free, top_y_px=90.0)


def test_a_free_radius_that_is_then_held_gives_what_a_held_radius_gives(patch: Patch) -> None:
    guess = EllipseShape(80.0, 91.0, 40.0, 1.14)
    free = examine(patch, 0, guess, look("x y R stretch"))
    held = examine(patch, 0, guess, look("x y stretch"))
    assert free.fit is not None
    assert held.fit is not None
    moved = with_radius([free.fit], 40.0, radius_slope(free.fit)[None])[0]
    assert moved.stretch == pytest.approx(held.fit.stretch, abs=0.35 * held.fit.stretch_unc)
    assert moved.bottom_y_px == pytest.approx(held.fit.bottom_y_px, abs=0.35 * held.fit.bottom_y_unc_px)
    assert moved.stretch_unc == pytest.approx(held.fit.stretch_unc, rel=0.2)


def test_the_uncertainty_of_the_pooled_radius_is_carried_on(patch: Patch) -> None:
    free = examine(patch, 0, EllipseShape(80.0, 91.0, 40.0, 1.14), look("x y R stretch"))
    assert free.fit is not None
    slope = radius_slope(free.fit)
    moved = with_radius([free.fit], 40.0, slope[None], radius_unc=0.5)[0]
    assert moved.stretch_unc == pytest.approx(abs(slope[3]) * 0.5, rel=0.1)


def test_pooling_and_constraining_leave_the_other_medium_alone(patch: Patch) -> None:
    seen = examine(patch, 3, EllipseShape(80.0, 91.0, 40.0, 1.14), look("x y R stretch"))
    failed = Sighting(4, "no_edge")
    assert pool_sightings([seen, failed], wet=False).value == pytest.approx(40.0, abs=0.3)
    assert not pool_sightings([seen, failed], wet=True).known
    assert constrain([seen, failed], PooledRadius(40.0, 0.01, 5, 0.02), wet=True) == [seen, failed]


def test_an_outline_that_changes_further_from_the_band_is_doubted_by_it(patch: Patch) -> None:
    """A trace of the surface band lies on the first rows below the line."""
    trace = 0.6 * np.exp(-0.15 * np.maximum(np.arange(200.0)[:, None] - 106.0, 0.0) ** 2)
    bent = Patch((patch.values + (0.25 - patch.values) * trace).astype(np.float32))
    beside = look("x y stretch")._replace(top_y_px=107.0, beside_band=True)
    guess = EllipseShape(80.0, 91.0, 40.0, 1.14)
    doubted = examine(bent, 0, guess, beside).fit
    plain = examine(bent, 0, guess, beside._replace(beside_band=False)).fit
    assert doubted is not None
    assert plain is not None
    lower = beside._replace(beside_band=False, top_y_px=107.0 + FURTHER_PX[0])
    further = examine(bent, 0, plain.shape, lower).fit
    assert further is not None
    change = further.stretch - plain.stretch
    assert abs(change) > 1e-4
    assert doubted.stretch_unc == pytest.approx(np.hypot(plain.stretch_unc, change), rel=0.1)


def test_where_few_frames_tell_the_radius_well_half_hidden_ones_help(patch: Patch) -> None:
    seen = examine(patch, 3, EllipseShape(80.0, 91.0, 40.0, 1.14), look("x y R stretch"))
    assert seen.free_fit is not None
    hidden = seen._replace(free_fit=seen.free_fit._replace(gated_fraction=0.45))
    assert pool_sightings([seen] * 4 + [hidden] * 4, wet=False).count == 4
    assert pool_sightings([seen] + [hidden] * 4, wet=False).count == 5


def test_a_second_fit_leaves_radius_and_tilt_free(patch: Patch) -> None:
    both = Look(BOX, "x y stretch", top_y_px=90.0, also_free=True)
    seen = examine(patch, 0, EllipseShape(80.0, 91.0, 40.0, 1.14), both)
    assert seen.free_fit is not None
    assert abs(seen.free_fit.tilt_deg) < 4 * seen.free_fit.tilt_unc_deg


@pytest.mark.parametrize(("stretch", "leans"), [(1.0, False), (0.97, False), (1.09, True)])
def test_a_second_fit_of_a_round_sphere_holds_the_tilt(stretch: float, leans: bool) -> None:
    """It has none to tell; left free it would take what belongs to the radius, and the stretch with it."""
    body = StillBody(80.3, 90.7, 40.0, stretch=stretch, separation_y_px=86.0)
    patch = Patch(draw_still(body, StillLight(), (200, 160), np.random.default_rng(4)).flat)
    both = Look(BOX, "x y stretch", top_y_px=90.0, also_free=True)
    seen = examine(patch, 0, EllipseShape(80.0, 91.0, 40.0, stretch + 0.004), both)
    assert seen.free_fit is not None
    assert bool(seen.free_fit.covariance[4, 4] > 0.0) is leans
    assert seen.free_fit.covariance[2, 2] > 0.0


def test_an_empty_patch_is_a_status() -> None:
    empty = noisy(np.ones((120, 120), np.float32))
    seen = examine(empty, 0, EllipseShape(60.0, 60.0, 30.0), Look((0, 0, 119, 119)))
    assert not seen.ok
    assert seen.status in {"no_edge", "short_arc", "poor_fit", "occluded"}


def noisy(values: np.ndarray) -> Patch:
    rng = np.random.default_rng(5)
    return Patch((values + 0.01 * rng.normal(size=values.shape)).astype(np.float32))
