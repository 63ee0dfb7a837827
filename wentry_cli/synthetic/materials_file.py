"""``materials.yaml`` beside the rendered drops: a laboratory knows what its spheres are made of."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import yaml

from wentry_cli.config.inheritance import MATERIALS
from wentry_cli.config.materials import RIGID, packaged_config, read_materials
from wentry_cli.config.places import read_document
from wentry_cli.errors import ConfigurationError, InputError
from wentry_cli.synthetic.drop_folder import write_whole
from wentry_cli.synthetic.scene import Material, Scene

MARK = "# Written by `wentry render`: what the rendered spheres are made of."
Laws = dict[str, dict[str, float]]


def plan_materials(scenes: Sequence[Scene], folder: Path) -> str | None:
    """The text of ``folder/materials.yaml`` for ``scenes``; ``None`` where the packaged file has all their materials.

    Materials of an earlier rendering stay in it, since its drops may still lie there. Raises ``ConfigurationError``
    where two scenes give one name two laws, ``InputError`` where a file stands there that no rendering wrote.
    """
    laws: Laws = {}
    for scene in scenes:
        name, law = scene.sphere.material, scene.sphere.law
        if law is None or name == RIGID or scene.kind == "free_flight":
            continue
        if laws.setdefault(name, law.model_dump()) != law.model_dump():
            raise ConfigurationError(
                f"drop {scene.name}: error: sphere.law: {name} has another law in a drop before it"
            )
    path = folder / MATERIALS
    ours = is_ours(path)
    if ours:
        laws = _as_written(path) | laws
    packaged = {name: _law(given.model_dump()) for name, given in read_materials(packaged_config(MATERIALS)).items()}
    if all(packaged.get(name) == law for name, law in laws.items()):
        return None
    if path.exists() and not ours:
        raise InputError(f"{path}: not written by `wentry render`; move it away, or choose another folder with -o")
    return f"{MARK}\n{yaml.safe_dump({'materials': laws}, sort_keys=False)}"


def put_materials(text: str | None, folder: Path) -> None:
    """Write ``folder/materials.yaml``, or remove that of an earlier rendering where ``text`` is ``None``."""
    path = folder / MATERIALS
    if text is not None:
        write_whole(path, text)
    elif is_ours(path):
        path.unlink()


def is_ours(path: Path) -> bool:
    """Whether a rendering wrote the file at ``path``."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        return file.readline().rstrip() == MARK.encode()


def _as_written(path: Path) -> Laws:
    found = read_document(path).data.get("materials")
    return {name: _law(law) for name, law in found.items() if isinstance(law, dict)} if isinstance(found, dict) else {}


def _law(given: dict[str, float]) -> dict[str, float]:
    return {name: given[name] for name in Material.model_fields if name in given}
