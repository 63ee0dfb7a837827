"""The level "fast" on short arcs of small spheres: it claims no more than it knows, or nothing."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import stdtrit

from tests.contours.scenes import draw, nudged
from wentry_cli.contours.ellipse import SilhouetteFit
from wentry_cli.contours.ray_scatter import few_rays
from wentry_cli.contours.silhouette import fit_silhouette


def fits(visible: float) -> list[tuple[SilhouetteFit, float]]:
    found = []
    for seed in range(40):
        scene = draw(seed, radius=26.0, visible=visible, noise=0.02)
        fit = fit_silhouette(
            scene.patch, nudged(scene.shape, seed=seed), free="x y stretch", top_y_px=scene.top_y, level="fast"
        )
        found.append((fit, scene.shape.stretch))
    return found


@pytest.mark.parametrize("independent", [8.5, 12.0, 30.0, 80.0])
def test_few_residuals_are_judged_by_students_t(independent: float) -> None:
    freedom = independent - 3
    student = float(stdtrit(freedom, 0.975)) / 1.959964
    assert few_rays(independent, 3) == pytest.approx(independent / freedom * student**2, rel=0.01)


def test_an_arc_with_hardly_more_rays_than_parameters_is_not_measured() -> None:
    pulls = [(fit.stretch - true) / fit.stretch_unc for fit, true in fits(0.13) if fit.status == "ok"]
    assert len(pulls) <= 2  # of 40: noise may make an arc a ray longer
    assert np.all(np.abs(pulls) < 3.0)


def test_a_quarter_of_the_outline_is_measured_as_well_as_it_says() -> None:
    pulls = [(fit.stretch - true) / fit.stretch_unc for fit, true in fits(0.25) if fit.status == "ok"]
    assert len(pulls) == 40
    assert float(np.sqrt(np.mean(np.square(pulls)))) < 1.3
