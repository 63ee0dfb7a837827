"""Safe YAML that remembers where each key stands, so that a message can name file, line and column."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from wentry_cli.errors import ConfigurationError

MAX_BYTES = 200_000
MAX_DEPTH = 20
KeyPath = tuple[str | int, ...]
_WORD = "tag:yaml.org,2002:str"


@dataclass(frozen=True)
class Place:
    """Where a key stands; line and column count from 1 (0: it stands on the command line, ``file`` is its option)."""

    file: Path
    line: int
    column: int

    def __str__(self) -> str:
        """``file:line:column`` as editors read it."""
        return f"{self.file}:{self.line}:{self.column}" if self.line else str(self.file)


@dataclass
class Document:
    """What a YAML file says and where it says it; ``empty`` are the keys that ``said`` took out."""

    data: dict[str, Any]
    places: dict[KeyPath, Place] = field(default_factory=dict)
    empty: dict[KeyPath, Place] = field(default_factory=dict)

    def place(self, path: KeyPath) -> Place | None:
        """The place of ``path`` or of its nearest parent."""
        for length in range(len(path), -1, -1):
            if path[:length] in self.places:
                return self.places[path[:length]]
        return None

    def over(self, other: Document) -> Document:
        """This document's keys over those of ``other``, mapping by mapping."""
        places = {**other.places, **self.places}
        empty = {path: place for path, place in {**other.empty, **self.empty}.items() if path not in places}
        return Document(_merge(other.data, self.data), places, empty)

    def said(self) -> Document:
        """This document without the keys that are left empty: they say nothing here, so that another one may."""
        empty = {path: place for path, place in self.places.items() if path and value_at(self.data, path) is None}
        places = {path: place for path, place in self.places.items() if path not in empty}
        return Document(_without_empty(self.data), places, empty)


class _Loader(yaml.SafeLoader):
    """Safe YAML whose numbers are those that everybody writes: 1e-4 is one; 0.051_1, 12:30, 0x10 and 010 are not."""


_NUMBERS = {
    "tag:yaml.org,2002:int": re.compile(r"^[-+]?(0|[1-9]\d{0,299})$"),
    "tag:yaml.org,2002:float": re.compile(
        r"^([-+]?(\d+\.\d*|\.\d+)([eE][-+]?\d+)?|[-+]?\d+[eE][-+]?\d+|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN))$"
    ),
}
_UNREAD = {*_NUMBERS, "tag:yaml.org,2002:timestamp"}
_Loader.yaml_implicit_resolvers = {
    letter: [(tag, pattern) for tag, pattern in pairs if tag not in _UNREAD]
    for letter, pairs in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
for _tag, _pattern in _NUMBERS.items():
    _Loader.add_implicit_resolver(_tag, _pattern, list("-+.0123456789"))


def followed(path: Path) -> Path:
    """The absolute path with its links followed; as it is written where they lead in a circle."""
    try:
        return path.resolve()
    except (OSError, RuntimeError):  # what a circle raises depends on the version of Python
        return path.absolute()


def read_document(path: Path) -> Document:
    """Read a YAML mapping with the place of every key.

    Anchors and aliases are refused (a short file can describe an endless one), as are tags, keys that are no words
    and duplicate keys. Raises ``ConfigurationError`` with file, line and column.
    """
    data, places = _build(_read_text(path), path)
    if data is None:
        return Document({}, places)
    if not isinstance(data, dict):
        raise ConfigurationError(f"{path}:1:1: error: the file must hold `key: value` lines")
    return Document(data, places)


def read_value(text: str, origin: Path) -> Any:
    """Any YAML value, read as in a file; ``ConfigurationError`` names ``origin`` as that file."""
    return _build(text, origin)[0]


def _build(text: str, origin: Path) -> tuple[Any, dict[KeyPath, Place]]:
    places: dict[KeyPath, Place] = {(): Place(origin, 1, 1)}
    try:
        loader = _Loader(text)
        _refuse_traps(origin, text)
        node = loader.get_single_node()
        if node is None:
            return None, places
        _note_places(node, (), places, origin)
        return loader.construct_document(node), places
    except yaml.YAMLError as error:
        raise ConfigurationError(_sentence(origin, error)) from error
    except (ValueError, OverflowError) as error:
        told = "not valid YAML: an escape such as \\U names no character"
        raise ConfigurationError(f"{origin}:1:1: error: {told}") from error


def _read_text(path: Path) -> str:
    try:
        if path.exists() and not path.is_file():
            raise ConfigurationError(f"{path}: is no plain file; write the configuration into one")
        if path.stat().st_size > MAX_BYTES:
            raise ConfigurationError(f"{path}: larger than {MAX_BYTES} bytes; a configuration is a short text")
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise ConfigurationError(f"{path}: cannot be read ({error.strerror}); check the name and the rights") from error
    except UnicodeDecodeError as error:
        raise ConfigurationError(f"{path}: not UTF-8 text (byte {error.start}); save it as UTF-8") from error


def _refuse_traps(path: Path, text: str) -> None:
    """Stop at the first anchor, alias or tag, or at a depth no configuration has, before anything is built."""
    depth = 0
    for event in yaml.parse(text, Loader=yaml.SafeLoader):
        mark = event.start_mark
        where = f"{path}:{mark.line + 1}:{mark.column + 1}" if mark else str(path)
        if isinstance(event, yaml.AliasEvent):
            raise ConfigurationError(f"{where}: error: aliases (*{event.anchor}) are not read; write the value out")
        anchor = getattr(event, "anchor", None)
        if anchor is not None:
            raise ConfigurationError(f"{where}: error: anchors (&{anchor}) are not read; write the value alone")
        if getattr(event, "tag", None) is not None:
            raise ConfigurationError(f"{where}: error: tags (!…) are not read; write the value alone")
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if depth > MAX_DEPTH:
            raise ConfigurationError(f"{where}: error: nested deeper than {MAX_DEPTH} levels; no key needs that")


def _sentence(path: Path, error: yaml.YAMLError) -> str:
    mark = getattr(error, "problem_mark", None)
    where = f"{path}:{mark.line + 1}:{mark.column + 1}" if mark else f"{path}:1:1"
    problem = getattr(error, "problem", None) or str(error)
    if repr("\t") in problem:
        return f"{where}: error: not valid YAML: a tab stands here; write spaces instead of it"
    if "quoted scalar" in (getattr(error, "context", None) or "") and "end of" in problem:
        start = error.context_mark  # type: ignore[attr-defined]
        return (
            f"{path}:{start.line + 1}:{start.column + 1}: error: not valid YAML: the quote that opens here is not "
            "closed; close it, or leave it out: words need none"
        )
    context = getattr(error, "context", None) if problem.startswith("but ") else None
    return f"{where}: error: not valid YAML: {f'{context}, ' if context else ''}{problem}"


def _note_places(node: yaml.Node, path: KeyPath, places: dict[KeyPath, Place], file: Path) -> None:
    if isinstance(node, yaml.MappingNode):
        for key_node, value_node in node.value:
            here = Place(file, key_node.start_mark.line + 1, key_node.start_mark.column + 1)
            if not isinstance(key_node, yaml.ScalarNode) or key_node.tag != _WORD:
                shown = f", not {key_node.value}" if isinstance(key_node, yaml.ScalarNode) else ""
                raise ConfigurationError(f"{here}: error: a key must be a plain word{shown}")
            below = (*path, key_node.value)
            if below in places:
                raise ConfigurationError(f"{here}: error: {_dotted(below)}: stands twice; keep one")
            places[below] = here
            _note_places(value_node, below, places, file)
    elif isinstance(node, yaml.SequenceNode):
        for number, value_node in enumerate(node.value):
            below = (*path, number)
            places[below] = Place(file, value_node.start_mark.line + 1, value_node.start_mark.column + 1)
            _note_places(value_node, below, places, file)


def _dotted(path: KeyPath) -> str:
    return ".".join(str(part) for part in path)


def value_at(data: Any, path: KeyPath) -> Any:
    """What ``data`` holds at ``path``, which it has."""
    for part in path:
        data = data[part]
    return data


def _without_empty(data: dict[str, Any]) -> dict[str, Any]:
    return {
        key: _without_empty(value) if isinstance(value, dict) else value
        for key, value in data.items()
        if value is not None
    }


def _merge(lower: dict[str, Any], upper: dict[str, Any]) -> dict[str, Any]:
    merged = dict(lower)
    for key, value in upper.items():
        both = isinstance(value, dict) and isinstance(merged.get(key), dict)
        merged[key] = _merge(merged[key], value) if both else value
    return merged
