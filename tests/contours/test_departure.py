from __future__ import annotations

import numpy as np
import pytest

from tests.contours.scenes import draw, nudged
from wentry_cli.contours.departure import NONE, Shape, Waves, extremes, measure_departure, pool_departures
from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.contours.silhouette import fit_silhouette
from wentry_cli.synthetic.outline import draw_sphere_outline, measure_outline

MISFIT = (0.003, 0.004)
KNOWN = (0.003, 0.0, 0.004, 0.0, 0.0, 0.0, 0.0, 0.0)


def measured(seed: int, misfit: tuple[float, float]) -> Waves:
    scene = draw(seed, radius=46.0, stretch=1.0, visible=1.0, body={"misfit": misfit})
    fit = fit_silhouette(scene.patch, nudged(scene.shape), free="x y R stretch")
    return measure_departure(scene.patch, fit)


def test_waves_of_a_whole_outline_are_found() -> None:
    found = pool_departures([measured(seed, MISFIT) for seed in range(8)], 46.0).waves
    assert found == pytest.approx(KNOWN, abs=2e-4)


def test_an_ellipse_has_no_departure() -> None:
    assert pool_departures([measured(seed, (0.0, 0.0)) for seed in range(8)], 46.0).waves == NONE


def test_the_error_of_one_outline_is_what_others_scatter_by() -> None:
    rows = [measured(seed, MISFIT) for seed in range(16)]
    scatter = np.std([row.waves for row in rows], axis=0)
    assert np.median([row.error for row in rows]) == pytest.approx(float(np.sqrt(np.mean(scatter**2))), rel=0.3)


def test_two_frames_tell_clear_waves() -> None:
    for first in range(0, 8, 2):
        found = pool_departures([measured(seed, MISFIT) for seed in (first, first + 1)], 46.0).waves
        assert found == pytest.approx(KNOWN, abs=4e-4)
        assert pool_departures([measured(seed, (0.0, 0.0)) for seed in (first, first + 1)], 46.0).waves == NONE


def test_one_frame_tells_nothing() -> None:
    assert pool_departures([Waves(KNOWN, 1e-5), Waves()], 46.0) == Shape()


def test_what_may_be_there_is_doubt() -> None:
    """A wave of four standard errors is not clear, but likely; without one there is no doubt."""
    rng = np.random.default_rng(5)
    scatter = 1e-3 * np.sqrt(16.0) / 1.25
    wave = np.array([4e-3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])

    def doubt(true: np.ndarray) -> float:
        shapes = [
            pool_departures([Waves(tuple(true + scatter * rng.normal(size=8)), 1e-3) for _ in range(16)], 46.0)
            for _ in range(50)
        ]
        return float(np.median([shape.doubt for shape in shapes if not shape.waves]))

    assert doubt(wave) == pytest.approx(4e-3, rel=0.15)
    assert doubt(np.zeros(8)) == 0.0


def test_a_hidden_outline_tells_nothing() -> None:
    scene = draw(3, radius=46.0, stretch=1.0, visible=1.0)
    fit = fit_silhouette(scene.patch, nudged(scene.shape), free="x y R stretch")
    scene.patch.values[: scene.patch.values.shape[0] // 2] = 0.0
    assert measure_departure(scene.patch, fit).waves == NONE


@pytest.mark.parametrize("stretch", [0.9, 1.0, 1.4])
def test_extremes_are_those_of_the_drawn_outline(stretch: float) -> None:
    half_width, bottom = measure_outline(draw_sphere_outline(46.0, stretch, misfit=MISFIT))
    width, lowest = extremes(EllipseShape(10.0, 20.0, 46.0, stretch), KNOWN)
    assert width == pytest.approx(half_width / 46.0, abs=1e-5)
    assert lowest == pytest.approx(20.0 + bottom, abs=1e-3)


@pytest.mark.parametrize("level", ["accurate", "fast"])
def test_a_known_departure_unbiases_the_size_of_half_an_outline(level: str) -> None:
    errors = {}
    for departure in (NONE, KNOWN):
        fits = []
        for seed in range(8):
            scene = draw(seed, radius=46.0, stretch=1.02, visible=0.55, body={"misfit": MISFIT})
            fits.append(
                fit_silhouette(
                    scene.patch,
                    nudged(scene.shape),
                    free="x y R stretch",
                    top_y_px=scene.top_y,
                    level=level,
                    departure=departure,
                )
            )
        assert all(fit.status == "ok" for fit in fits)
        errors[departure] = abs(float(np.mean([fit.radius_px for fit in fits])) / 46.0 - 1.0)
    assert errors[NONE] > 0.01
    assert errors[KNOWN] < 0.0025
