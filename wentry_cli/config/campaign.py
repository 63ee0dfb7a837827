"""Find the drops of a campaign and read what is said about each."""

from __future__ import annotations

import difflib
import os
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from wentry_cli.config.corrections import Corrections, read_corrections
from wentry_cli.config.drop_names import speakable
from wentry_cli.config.inheritance import MATERIALS, Shared, find_materials, find_shared
from wentry_cli.config.materials import Material, calibrated, find_material, packaged_config
from wentry_cli.config.messages import located, validate, validate_part
from wentry_cli.config.models import Experiment, View
from wentry_cli.config.places import Document, KeyPath, followed, read_document
from wentry_cli.config.plausible import refuse_implausible
from wentry_cli.errors import ConfigurationError, Gathered, InputError, NoDropError

PARTS = ("sphere", "liquid", "drop", "views", "analysis")
EXPERIMENT = "experiment.yaml"
SHOWN = 12  # names of files that a message lists


@dataclass(frozen=True)
class Drop:
    """One drop: its name, the folder of its ``experiment.yaml``, its validated configuration and its material.

    ``top`` is the VIDEO_DIR in which it was found, ``shared`` the ``campaign.yaml`` that it inherits from,
    ``overrides`` the keys of ``--set``, which are in no file.
    """

    name: str
    folder: Path
    experiment: Experiment
    material: Material | None = None
    materials_path: Path = field(default_factory=lambda: packaged_config(MATERIALS))
    corrections: Corrections = field(default_factory=Corrections)
    top: Path | None = None
    shared: Shared = field(default_factory=Shared)
    overrides: dict[str, Any] = field(default_factory=dict)

    def view(self, name: str) -> View:
        """The configuration of the view ``name``; raises ``KeyError`` where it was not filmed."""
        view: View | None = getattr(self.experiment.views, name)
        if view is None:
            raise KeyError(f"{self.name} has no {name} view")
        return view

    def source_path(self, view: str) -> Path:
        """Where the recording of ``view`` lies."""
        return self.folder / self.view(view).source

    def existing_source(self, view: str) -> Path:
        """Where the recording of ``view`` lies; raises ``InputError`` with what lies there where it does not."""
        path = self.source_path(view)
        try:
            path.stat()
        except (FileNotFoundError, NotADirectoryError):
            if not set(path.name) & set("*?["):
                raise InputError(self._not_there(view, path)) from None
        except OSError:
            pass  # it is opened, and then told
        return path

    def _not_there(self, view: str, path: Path) -> str:
        from wentry_cli.config.blame import place_of

        there = path.parent if path.parent.is_dir() else self.folder
        names = sorted(item.name for item in there.iterdir() if not item.name.startswith(".")) if there.is_dir() else []
        near = difflib.get_close_matches(path.name, names, n=1, cutoff=0.6)
        shown = ", ".join(names[:SHOWN]) + (" and others" if len(names) > SHOWN else "")
        hint = f"did you mean '{near[0]}'? " if near else ""
        where = f"{place_of(self, f'views.{view}.source', self.view(view).source)}: error: views.{view}.source"
        return f"{where}: {path}: no such file or folder; {hint}in {there} lie {shown or 'no files'}"

    def with_calibration(self, results: Path) -> Drop:
        """The same drop with the material that a calibration in ``results`` gave, where there is one."""
        sphere = self.experiment.sphere
        return replace(self, material=calibrated(self.material, sphere.material, sphere.group, results))

    def record(self) -> dict[str, Any]:
        """What ``from_record`` needs to make this drop again, as plain data."""
        return {
            "name": self.name,
            "folder": os.path.abspath(self.folder),
            "top": None if self.top is None else os.path.abspath(self.top),
            "campaign": None if self.shared.path is None else str(self.shared.path),
            "experiment": self.experiment.model_dump(mode="json"),
            "material": None if self.material is None else self.material.model_dump(mode="json"),
            "materials_path": str(self.materials_path),
            "corrections": self.corrections.model_dump(mode="json"),
            "overrides": self.overrides,
        }

    @classmethod
    def from_record(cls, record: dict[str, Any]) -> Drop:
        """Make a drop from its record."""
        material, top, campaign = (record.get(key) for key in ("material", "top", "campaign"))
        return cls(
            name=record["name"],
            folder=Path(record["folder"]),
            experiment=Experiment.model_validate(record["experiment"]),
            material=None if material is None else Material.model_validate(material),
            materials_path=Path(record["materials_path"]),
            corrections=Corrections.model_validate(record["corrections"]),
            top=None if top is None else Path(top),
            shared=Shared(None if campaign is None else Path(campaign)),
            overrides=record.get("overrides", {}),
        )


def find_drops(video_dir: Path) -> dict[str, Path]:
    """Name and folder of every drop in ``video_dir``, sorted by name; drops do not nest.

    Links are followed, except to a folder seen before or to one that holds ``video_dir``.

    Raises ``InputError`` where the folder is missing, where two drops would have one name, or one a name that breaks a
    line, is a formula to a spreadsheet or too long for a folder; ``NoDropError`` where it holds no ``experiment.yaml``;
    ``ConfigurationError`` where a drop has the name of a file of the tool's own in RESULTS.
    """
    if os.path.isfile(video_dir):  # unlike the path's own it takes a name that is too long
        raise InputError(f"{video_dir}: is a file; give the folder that holds {EXPERIMENT}, which names the recording")
    if not os.path.isdir(video_dir):
        raise InputError(f"{video_dir}: no such folder; give the folder of a drop or of a campaign")
    root = video_dir.resolve()
    if (root / EXPERIMENT).is_file():
        return {speakable(root.name): video_dir}
    drops: dict[str, Path] = {}
    seen: set[str] = set()
    for folder, below, files in os.walk(video_dir, followlinks=True):
        seen.add(os.path.realpath(folder))
        paths = {name: Path(folder, name).resolve() for name in below}
        below[:] = sorted(
            name for name, path in paths.items()
            if not name.startswith(".") and str(path) not in seen and not root.is_relative_to(path)
        )  # fmt: skip
        if EXPERIMENT not in files:
            continue
        below.clear()
        name = speakable("__".join(Path(folder).relative_to(video_dir).parts))
        if name in drops:
            raise InputError(f"{folder}: its name {name} is that of {drops[name]}; rename one of the two folders")
        drops[name] = Path(folder)
    if not drops:
        if (view := _view_of_drop_above(root)) is not None:
            raise NoDropError(f"{video_dir}: is the {view} view of the drop {root.parent}; give that folder")
        raise NoDropError(
            f"{video_dir}: holds no {EXPERIMENT}; `wentry init {video_dir}` writes one to fill in, beside the recording"
        )
    return dict(sorted(drops.items()))


def _view_of_drop_above(folder: Path) -> str | None:
    """The view whose recording is or lies in ``folder``, as an ``experiment.yaml`` beside that folder names it."""
    for source, view in named_sources(folder.parent).items():
        path = followed(Path(source))
        if folder in (path, path.parent):
            return view
    return None


def read_drop(name: str, folder: Path, overrides: Document | None = None, top: Path | None = None) -> Drop:
    """Read one drop: its ``experiment.yaml`` over the ``campaign.yaml`` that ``find_shared`` finds for it.

    A key that is left empty in one of the files is not said there. ``overrides`` (from ``--set``) stand over both;
    ``top`` is the VIDEO_DIR in which the drop was found, itself where it stands alone. Raises ``ConfigurationError``
    with every problem and its place.
    """
    document = read_document(folder / EXPERIMENT).said()
    shared, problems = find_shared(folder, top or folder), Gathered()
    if shared.path is not None:
        beneath = _shared_keys(shared.path)
        with problems.part():  # also those that every drop overrides
            validate_part(Experiment, beneath)
        document = document.over(beneath)
    if overrides is not None:
        document = overrides.over(document)
    with problems.part():
        validate(Experiment, document)
    problems.complain()  # those of campaign.yaml too
    experiment = validate(Experiment, document)
    with problems.part():
        refuse_implausible(experiment, folder, document)
    own = find_materials(folder, top or folder, shared.path).path
    materials = own or packaged_config(MATERIALS)
    material, corrections = None, Corrections()
    with problems.part():
        material = _material(experiment, materials, document, where=None if own else (top or folder) / MATERIALS)
    with problems.part():
        corrections = read_corrections(folder, experiment)
    problems.complain()
    given = {} if overrides is None else overrides.data
    return Drop(name, folder, experiment, material, materials, corrections, top or folder, shared, given)


def missing_sources(folder: Path, overrides: Document | None = None) -> list[str]:
    """Of a drop whose keys are not all right: those recordings that it names and that are not there, by place."""
    try:
        document = read_document(folder / EXPERIMENT)
    except ConfigurationError:
        return []
    document = overrides.over(document) if overrides else document
    return [
        str(located(folder / EXPERIMENT, f"views.{name}.source", f"{path}: no such file or folder", document))
        for path, name in _sources(folder, document).items()
        if not set(Path(path).name) & set("*?[") and not os.path.exists(path)
    ]


def named_sources(folder: Path) -> dict[str, str]:
    """Of a drop whose keys are not all right: the view of each recording that it names, by the recording's path."""
    try:
        return _sources(folder, read_document(folder / EXPERIMENT))
    except ConfigurationError:
        return {}


def _sources(folder: Path, document: Document) -> dict[str, str]:
    views = document.data.get("views")
    shown = views.items() if isinstance(views, dict) else ()
    given = {name: view.get("source") for name, view in shown if isinstance(view, dict)}
    return {str(folder / source): name for name, source in given.items() if isinstance(source, str)}


def _shared_keys(path: Path) -> Document:
    """The keys of a ``campaign.yaml``; what has keys of its own must have them here too, since it is mixed in."""
    document = read_document(path)
    views = document.data.get("views")
    flat: list[KeyPath] = [(name,) for name in PARTS if not _has_keys(document.data.get(name))]
    if isinstance(views, dict):
        flat += [("views", name) for name in ("side", "top") if not _has_keys(views.get(name))]
    if flat:
        raise ConfigurationError(
            "\n".join(
                f"{document.place(key)}: error: {'.'.join(map(str, key))}: must be keys with values" for key in flat
            )
        )
    return document.said()


def _has_keys(value: object) -> bool:
    return value is None or isinstance(value, dict)


def _material(
    experiment: Experiment, materials: Path, document: Document, *, where: Path | None = None
) -> Material | None:
    """``where`` a file of the user's own would be found, if there is none yet."""
    try:
        return find_material(experiment.sphere.material, materials, where)
    except ConfigurationError as error:
        if "sphere.material" not in str(error):
            raise
        raise ConfigurationError(f"{document.place(('sphere', 'material'))}: error: {error}") from error
