"""The bounds that the page counts in, against the renderer differentiated pixel by pixel."""

import math

import numpy as np
import pytest

from wentry_cli.bench.outline_cases import find_case
from wentry_cli.bench.outline_frames import bounds_of
from wentry_cli.contours.bounds import visible_top
from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.synthetic.camera_noise import Sensor
from wentry_cli.synthetic.still import StillBody, StillLight, draw_still

ROWS, COLUMNS = 200, 258
X, Y, REACH_PX = 128.3, 95.6, 12.0
STEPS = {"x": 0.05, "y": 0.05, "stretch": 1e-3, "psf": 0.02}


def transmission(case, **step):
    body = StillBody(X + step.get("x", 0.0), Y + step.get("y", 0.0), case.radius, case.stretch + step.get("stretch", 0))
    light = StillLight(dark=case.dark, psf_px=case.psf + step.get("psf", 0.0))
    return np.asarray(draw_still(body, light, (ROWS, COLUMNS), np.random.default_rng(0)).transmission, np.float64)


def near(case):
    """Which pixels lie within REACH_PX of the outline that is seen."""
    row, column = np.mgrid[:ROWS, :COLUMNS]
    angle = np.linspace(0.0, 2.0 * np.pi, 600)
    across, along = case.radius * case.stretch * np.cos(angle), case.radius / case.stretch**2 * np.sin(angle)
    away = np.min([np.hypot(column - X - u, row - Y - v) for u, v in zip(across, along, strict=True)], axis=0)
    return (away < REACH_PX) & (row >= visible_top(EllipseShape(X, Y, case.radius, case.stretch), case.visible))


@pytest.mark.parametrize(("name", "y_ratio"), [("noise 1 %", 1.014), ("λ 0.85", 1.005), ("λ 1.8", 1.046)])
def test_bounds_are_those_of_the_renderer_to_two_per_cent_but_for_y_of_the_flattest(name, y_ratio):
    case = find_case(name)
    plain = transmission(case)
    light = (plain - case.dark) / (1.0 - case.dark)
    row, column = np.mgrid[:ROWS, :COLUMNS]
    told = [
        (transmission(case, **{key: step}) - transmission(case, **{key: -step})) / (2.0 * step)
        for key, step in STEPS.items()
    ]
    told += [1.0 - light, light, light * (column - X) / case.radius, light * (row - Y) / case.radius]
    ground = case.level * (2**case.bits - 1)
    shot = Sensor().shot_share
    variance = (case.noise**2 + 1.0 / (12.0 * ground**2)) * (1.0 - shot + shot * plain)
    seen = near(case)
    slopes = np.array(told)[:, seen]
    covariance = np.linalg.inv((slopes / variance[seen]) @ slopes.T)[:3, :3]
    lowest = np.array([0.0, 1.0, -2.0 * case.radius / case.stretch**3])
    found = [*np.sqrt(np.diag(covariance)), math.sqrt(lowest @ covariance @ lowest)] / bounds_of(case)[:4]
    assert found[[0, 2, 3]] == pytest.approx(1.0, abs=0.025)
    assert found[1] == pytest.approx(y_ratio, abs=0.01)
