"""How far the numbers measured by hand may be off: the experiment with one of them moved by its uncertainty."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from typing import Any

from pydantic import BaseModel

from wentry_cli.config.models import Experiment

BY_HAND = (
    "sphere.diameter_m",
    "sphere.density_kg_m3",
    "sphere.mass_kg",
    "liquid.density_kg_m3",
    "liquid.viscosity_pa_s",
    "liquid.surface_tension_n_m",
    "gravity_m_s2",
    "drop.height_m",
    "drop.impact_speed_m_s",
)


def with_uncertainty(experiment: Experiment, key: str) -> tuple[float | None, float]:
    """The number at ``key`` (dotted) and its standard uncertainty; ``None`` where it was not given."""
    part: Any = experiment
    *path, name = key.split(".")
    for step in path:
        part = getattr(part, step)
    return getattr(part, name), float(getattr(part, f"{name}_unc"))


def moved(experiment: Experiment, *, but: Collection[str] = ()) -> list[Experiment]:
    """``experiment`` once for each number that was given with an uncertainty, that number moved by it.

    The keys named in ``but`` stay where they are.
    """
    return [
        _with(experiment, key, value + unc)
        for key in BY_HAND
        if key not in but
        for value, unc in [with_uncertainty(experiment, key)]
        if value is not None and unc > 0.0
    ]


def uncertainty_by_hand(
    numbers: Callable[[Experiment], Mapping[str, float]], experiment: Experiment
) -> dict[str, float]:
    """Standard uncertainty of each of ``numbers`` from what was measured by hand; errors of one are independent."""
    nominal = numbers(experiment)
    changes = [numbers(other) for other in moved(experiment)]
    return {name: math.hypot(*(other[name] - value for other in changes)) for name, value in nominal.items()}


def _with(part: Any, key: str, value: float) -> Any:
    name, _, rest = key.partition(".")
    below: BaseModel | float = _with(getattr(part, name), rest, value) if rest else value
    return part.model_copy(update={name: below})
