from __future__ import annotations

import pytest

from tests.synthetic.drops import VERY_SOFT, make_scene
from wentry_cli.synthetic.campaign import plan_scene
from wentry_cli.synthetic.course import Course


@pytest.fixture(scope="session")
def soft_course() -> Course:
    return plan_scene(make_scene())[0]


@pytest.fixture(scope="session")
def rigid_course() -> Course:
    return plan_scene(make_scene(sphere={"diameter_m": 0.051}))[0]


@pytest.fixture(scope="session")
def sealed_course() -> Course:
    return plan_scene(
        make_scene(
            sphere={"diameter_m": 0.1, "law": VERY_SOFT, "material": "very_soft"},
            height_m=2.27,
            physics={"loading_rate": 0.3, "drag": 1.2},
        )
    )[0]
