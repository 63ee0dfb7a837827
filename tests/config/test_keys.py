"""No key without effect: each one makes a stage stale, is read while a drop is worked on, or is refused."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import UnionType
from typing import Any, Union, get_args, get_origin

import numpy as np
import pytest
from pydantic import BaseModel

from tests.cli.test_scenes import SCENES, SMALL
from wentry_cli.config.campaign import Drop, read_drop
from wentry_cli.config.materials import Material
from wentry_cli.config.models import Experiment, Part
from wentry_cli.config.moved import BY_HAND, moved, uncertainty_by_hand
from wentry_cli.errors import ConfigurationError
from wentry_cli.pipeline import STAGES
from wentry_cli.runner.commands import overrides_document
from wentry_cli.runner.drop import run_drop
from wentry_cli.runner.plan import Choice, fingerprint
from wentry_cli.synthetic.campaign import render_drop
from wentry_cli.synthetic.scene import Scene

# what nobody reads while a drop is measured, and where it takes effect instead
ELSEWHERE = {
    "Liquid.temperature_c": "sets the three properties when the file is read",
    "Sphere.id": "is part of Sphere.group, which a given id replaces",
    "Material.n_unc": "shown in the report",
    "Material.eps0_dot_1_s_unc": "shown in the report",
    "Material.source": "shown in the report",
    "Material.g_inf_text_pa": "for the record, used by nothing",
    "Material.radius_m": "for the record: a drop uses its own diameter",
    "Material.density_kg_m3": "for the record: a drop uses its own density",
}


def _models(model: type[BaseModel]) -> Iterator[type[BaseModel]]:
    yield model
    for field in model.model_fields.values():
        for part in _parts(field.annotation):
            yield from _models(part)


def _parts(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [part for argument in get_args(annotation) for part in _parts(argument)]


def _keys(*models: type[BaseModel]) -> set[str]:
    found = {each for model in models for each in _models(model)}
    return {f"{each.__name__}.{name}" for each in found for name in each.model_fields}


@pytest.fixture(scope="module")
def drop(tmp_path_factory: pytest.TempPathFactory) -> Drop:
    """A deformable sphere filmed by both cameras: the scene that all stages run for."""
    folder = tmp_path_factory.mktemp("keys") / "deformable"
    render_drop(Scene.model_validate({**SMALL, "name": "deformable", **SCENES["deformable"][0]}), folder)
    given = overrides_document(("views.side.surface_y_px=120.4", "views.side.surface_y_px_unc=0.3"))
    return read_drop("deformable", folder, given)


def test_every_key_is_read_by_something(drop: Drop, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    keys = _keys(Experiment, Material)
    read: set[str] = set()

    def noting(self: Any, name: str) -> Any:
        read.add(f"{type(self).__name__}.{name}")
        return BaseModel.__getattribute__(self, name)

    monkeypatch.setattr(Part, "__getattribute__", noting, raising=False)
    failure = run_drop(tmp_path, drop, list(STAGES), Choice(), lambda event: None)
    monkeypatch.undo()
    assert failure is None
    assert keys - read == set(ELSEWHERE) & keys - read, "a key that nothing reads"
    assert set(ELSEWHERE) <= keys, "an exception for a key that is gone"


def _leaves(model: type[BaseModel], above: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    for name, field in model.model_fields.items():
        below = _parts(field.annotation)
        whole = below and get_origin(field.annotation) not in (Union, UnionType)
        optional = below and type(None) in get_args(field.annotation)
        if whole or optional:
            yield from _leaves(below[0], (*above, name))
        else:
            yield (*above, name)


def _changed(part: Any, path: tuple[str, ...]) -> Any:
    name, *rest = path
    value = _changed(getattr(part, name), tuple(rest)) if rest else "something else"
    return part.model_copy(update={name: value})


@pytest.mark.filterwarnings("ignore:Pydantic serializer warnings")
@pytest.mark.parametrize("path", list(_leaves(Experiment)), ids=".".join)
def test_every_key_makes_a_stage_stale(drop: Drop, tmp_path: Path, path: tuple[str, ...]) -> None:
    """Water at a temperature is stale by the properties that follow from it."""
    other = replace(drop, experiment=_changed(drop.experiment, path))
    stale = [stage.name for stage in STAGES if _marks(tmp_path, drop, stage) != _marks(tmp_path, other, stage)]
    assert stale


def _marks(folder: Path, drop: Drop, stage: Any) -> Any:
    return fingerprint(folder, drop, replace(stage, frames=False))


GIVEN = {
    "sphere": {"diameter_m": 0.05, "diameter_m_unc": 0.001, "mass_kg": 0.07, "mass_kg_unc": 0.0007},
    "gravity_m_s2_unc": 0.0981,
    "drop": {"height_m": 2.0, "height_m_unc": 0.08},
}


def _experiment(**changes: Any) -> Experiment:
    plain = {"kind": "water_entry", "views": {"side": {"source": "side"}}}
    return Experiment.model_validate({**plain, **GIVEN, **changes})


def test_one_number_at_a_time_is_moved_by_its_uncertainty() -> None:
    others = moved(_experiment())
    found = [(e.sphere.diameter_m, e.sphere.mass_kg, e.gravity_m_s2, e.drop.height_m) for e in others]
    np.testing.assert_allclose(
        np.array(found, float),
        [(0.051, 0.07, 9.81, 2.0), (0.05, 0.0707, 9.81, 2.0), (0.05, 0.07, 9.9081, 2.0), (0.05, 0.07, 9.81, 2.08)],
    )
    assert len(moved(_experiment(), but=("sphere.diameter_m",))) == 3
    assert moved(_experiment(sphere={"diameter_m": 0.05}, gravity_m_s2_unc=0.0, drop={})) == []


def test_uncertainties_by_hand_are_those_of_first_order() -> None:
    found = uncertainty_by_hand(
        lambda e: {"density": e.sphere.density or 0.0, "height": e.drop.height_m or 0.0, "kind": 1.0}, _experiment()
    )
    density = _experiment().sphere.density or 0.0
    assert found["density"] / density == pytest.approx((0.01**2 + 0.06**2) ** 0.5, rel=0.06)
    assert found["height"] == pytest.approx(0.08)
    assert found["kind"] == 0.0


def test_what_is_moved_are_the_numbers_that_have_an_uncertainty() -> None:
    """Those of a view act where it is tracked."""
    given = {".".join(path) for path in _leaves(Experiment)}
    assert {f"{key}_unc" for key in BY_HAND} == {key for key in given if key.endswith("_unc") and "views" not in key}


@pytest.mark.parametrize(
    ("view", "key"),
    [
        ("side", "offset_s: 0.1"),
        ("side", "camera_distance_m: 1.5"),
        ("side", "camera_distance_m_unc: 0.1"),
        ("top", "surface_y_px: 300"),
        ("top", "surface_y_px_unc: 1"),
        ("top", "optical_axis_y_px: 300"),
    ],
)
def test_a_key_of_the_other_view_is_refused(tmp_path: Path, view: str, key: str) -> None:
    (tmp_path / "experiment.yaml").write_text(
        f"kind: water_entry\nsphere: {{diameter_m: 0.05}}\nviews:\n  {view}: {{source: a, fps: 2000, {key}}}\n"
    )
    with pytest.raises(ConfigurationError, match=rf"{view}\.{key.partition(':')[0]} has no effect: it is a key of the"):
        read_drop("x", tmp_path)
