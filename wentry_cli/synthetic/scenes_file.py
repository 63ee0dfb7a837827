"""Read a scenes file: defaults, materials and seed filled in, mistakes named with file, line and column."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import Field, ValidationError

from wentry_cli.config.messages import configuration_error, located, validate
from wentry_cli.config.places import Document, KeyPath, read_document
from wentry_cli.errors import ConfigurationError, InputError
from wentry_cli.synthetic.scene import Material, Part, Scene


class ScenesFile(Part):
    """The keys of a scenes file. ``materials`` are laws by name, or the name of a file that lists them."""

    drops: list[dict[str, Any]] = Field(min_length=1)
    materials: str | dict[str, Any] = Field(default_factory=dict)
    defaults: dict[str, Any] = Field(default_factory=dict)
    seed: int = Field(default=0, ge=0)


def load_scenes(path: Path) -> list[Scene]:
    """Read a scenes file: ``materials`` (laws by name, or the name of a file), ``defaults``, ``seed``, list ``drops``.

    Raises InputError if the file cannot be read and ConfigurationError, every problem on a line of its own, for
    unknown, mistyped or missing keys.
    """
    path = Path(path)
    document = _read(path)
    listed = validate(ScenesFile, document)
    laws = _load_laws(path, listed, document)
    scenes, problems = [], []
    for index, entry in enumerate(listed.drops):
        try:
            scenes.append(_make_scene(_fill(entry, index, listed, document, laws)))
        except ConfigurationError as error:
            problems += str(error).splitlines()
    if problems:
        # a mistake under defaults: shows in every drop; it is told once
        raise ConfigurationError("\n".join(dict.fromkeys(problems)))
    names = [scene.name for scene in scenes]
    for index, name in enumerate(names):
        if name in names[:index]:
            raise located(
                path, f"drops.{index}.name", f"two drops share the name {name}; give each its own", _by_text(document)
            )
    return scenes


def _read(path: Path) -> Document:
    if not path.is_file():
        raise InputError(f"{path}: no such file; give a YAML file with a list of drops, such as configs/demo.yaml")
    return read_document(path)


def _by_text(document: Document) -> Document:
    """The same places under keys whose list indices are text, as ``located`` looks them up."""
    return Document(document.data, {tuple(str(k) for k in path): place for path, place in document.places.items()})


def _load_laws(path: Path, listed: ScenesFile, document: Document) -> Document:
    """Laws by name with the places where they stand."""
    if isinstance(listed.materials, dict):
        return Document(listed.materials, _below(document, ("materials",)))
    file = path.parent / listed.materials
    if not file.is_file():
        raise InputError(f"{document.place(('materials',)) or path}: no file {listed.materials} beside {path.name}")
    read = read_document(file)
    laws = read.data.get("materials")
    if not isinstance(laws, dict) or not all(isinstance(law, dict) for law in laws.values()):
        raise ConfigurationError(f"{file}: error: materials: must hold materials by name")
    known = {name: {k: v for k, v in law.items() if k in Material.model_fields} for name, law in laws.items()}
    return Document(known, _below(read, ("materials",)))


def _below(document: Document, parent: KeyPath) -> dict[KeyPath, Any]:
    """Places of the keys below ``parent``, by their path from there."""
    n = len(parent)
    return {path[n:]: place for path, place in document.places.items() if path[:n] == parent}


def _fill(entry: dict[str, Any], index: int, listed: ScenesFile, document: Document, laws: Document) -> Document:
    """Defaults, material and seed of one drop; a view set to ``null`` drops the view."""
    own = Document(entry, _below(document, ("drops", index)))
    filled = own.over(Document(listed.defaults, _below(document, ("defaults",))))
    data, places = dict(filled.data), dict(filled.places)
    data.setdefault("seed", listed.seed * 1000 + index)
    ball = data.get("sphere")
    if isinstance(ball, dict) and ball.get("material", "rigid") != "rigid" and "law" not in ball:
        name = ball["material"]
        if name not in laws.data:
            message = f"{name!r} is not under materials:; known: {', '.join(sorted(laws.data)) or 'none'}"
            if not laws.data:
                message += "; give `materials: path/materials.yaml`, or the laws by name"
            raise ConfigurationError(f"{filled.place(('sphere', 'material'))}: error: sphere.material: {message}")
        data["sphere"] = {**ball, "law": laws.data[name]}
        places |= {("sphere", "law", *key[1:]): place for key, place in laws.places.items() if key[:1] == (name,)}
    return Document(data, places)


def _make_scene(document: Document) -> Scene:
    try:
        return Scene.model_validate(document.data)
    except ValidationError as error:
        # what concerns a drop as a whole has no key of its own
        text = str(configuration_error(error.errors(include_url=False), document, Scene))
        name = document.data.get("name", "without a name")
        raise ConfigurationError(text.replace("error: experiment:", f"error: drop {name}:")) from error
