"""From what the validator found to sentences: ``file:line:column: error: key: message``, all at once."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from pathlib import Path
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ValidationError

from wentry_cli.config.inheritance import CAMPAIGN
from wentry_cli.config.places import Document, KeyPath, Place
from wentry_cli.config.units import probably_meant, unit_of, with_a_point, with_its_unit
from wentry_cli.errors import ConfigurationError

M = TypeVar("M", bound=BaseModel)

_PLAIN = {
    "missing": "is required",
    "greater_than": "must be greater than {gt:g}{unit}, not {input}",
    "greater_than_equal": "must be at least {ge:g}{unit}, not {input}{meant}",
    "less_than_equal": "must be at most {le:g}{unit}, not {input}{meant}",
    "float_type": "must be a number{as_number} not {input}",
    "int_type": "must be a whole number, not {input}",
    "finite_number": "must be a finite number, not {input}",
    "string_type": "must be text, not {input}",
    "literal_error": "must be one of {expected}, not {input}",
    "form": "must be {expected}, not {input}",
    "model_type": "must hold `key: value` lines, not {input}",
    "tuple_type": "must be a list such as [0, 100], not {input}",
    "too_long": "has too many entries: {input}",
    "too_short": "has too few entries: {input}",
    "string_too_short": "must not be empty",
    "string_too_long": "must have at most {max_length} characters, not {input}",
    "dict_type": "must hold `key: value` lines, not {input}",
    "model_attributes_type": "must hold `key: value` lines, not {input}",
    "bool_type": "must be true or false, not {input}",
}
NUMBERS = ("float_type", "int_type", "form")
LEFT_EMPTY = "is left empty; fill it in"
_SHAPES = ("float_type", "int_type", "model_type", "tuple_type", "string_type", "model_attributes_type")


def configuration_error(found: Iterable[Any], document: Document, model: type[BaseModel]) -> ConfigurationError:
    """One error that lists every problem that was ``found`` on a line of its own, in the order of the file."""
    by_path: dict[KeyPath, list[Any]] = {}
    for problem in found:
        by_path.setdefault(_key_path(problem, document.data), []).append(problem)
    lines: list[tuple[int, int, str]] = []
    for path, problems in by_path.items():
        if _is_answered_below(path, problems, by_path):
            continue
        left_empty = document.empty.get(path)
        place = left_empty or document.place(path)
        key = ".".join(str(part) for part in path) or "experiment"
        where, order = (f"{place}: ", (place.line, place.column)) if place else ("", (0, 0))
        told = _empty(left_empty) if left_empty else _message(_nearest_form(problems), path, model)
        lines.append((*order, f"{where}error: {key}: {told}"))
    return ConfigurationError("\n".join(line for *_, line in sorted(lines)))


def _key_path(problem: Any, data: Any) -> KeyPath:
    """Drop the names of union branches that the validator puts into a location; a key that is missing is kept."""
    path: list[str | int] = []
    *above, last = problem["loc"] or (None,)
    for part in above:
        if _holds(data, part):
            path.append(part)
            data = data[part]
    if last is not None and (_holds(data, last) or problem["type"] == "missing"):
        path.append(last)
    return tuple(path)


def _is_answered_below(path: KeyPath, problems: list[Any], by_path: dict[KeyPath, list[Any]]) -> bool:
    """Where a form with keys of its own was meant, as its wrong keys show, the other forms are not spoken of."""
    deeper = any(len(other) > len(path) and other[: len(path)] == path for other in by_path)
    return deeper and all(problem["type"] in (*_SHAPES, "literal_error") for problem in problems)


def _holds(data: Any, part: str | int) -> bool:
    if isinstance(data, dict):
        return part in data
    return isinstance(data, list | tuple) and isinstance(part, int) and part < len(data)


def _nearest_form(problems: list[Any]) -> Any:
    """Where several forms are allowed (a number or ``auto``), speak of the form that came nearest."""
    for unwanted in ((*_SHAPES, "literal_error"), _SHAPES):
        near = [problem for problem in problems if problem["type"] not in unwanted]
        if near:
            break
    best = (near or problems)[0]
    if best["type"] == "literal_error" and any(problem["type"] == "float_type" for problem in problems):
        expected = f"a number or {best['ctx']['expected']}"
        return {**best, "ctx": {"expected": expected}, "type": "form"}
    return best


def _message(problem: Any, path: KeyPath, model: type[BaseModel]) -> str:
    kind = problem["type"]
    if kind == "extra_forbidden":
        return "unknown key" + _did_you_mean(path, model)
    if kind == "value_error":
        return str(problem["ctx"]["error"])
    if problem["input"] is None and kind != "missing":
        return LEFT_EMPTY
    sentence = _PLAIN.get(kind, "cannot be {input}")
    context, key = _context(problem), _name_of(path)
    meant = probably_meant(key, problem["input"], low=context.get("ge"), high=context.get("le"))
    converted = with_its_unit(key, problem["input"])
    if converted and kind == "form":
        context["expected"] = context["expected"].replace("a number", "a number" + converted)
    as_number = converted or ","
    shown, point = _shown(problem["input"]), with_a_point(problem["input"]) if kind in NUMBERS else ""
    return sentence.format(input=shown, unit=unit_of(key), meant=meant, as_number=as_number, **context) + point


def _empty(place: Place) -> str:
    elsewhere = "" if place.file.name == CAMPAIGN else f", or remove the line and say it in {CAMPAIGN}"
    return LEFT_EMPTY + elsewhere


def _name_of(path: KeyPath) -> str:
    """The last part of ``path`` that tells a unit: ``air`` and ``water`` have that of their scale."""
    return str(path[-2] if path[-1:] in (("air",), ("water",)) else path[-1]) if path else ""


def _context(problem: Any) -> dict[str, Any]:
    return {key: value for key, value in problem.get("ctx", {}).items() if key != "input"}


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "…"


def _did_you_mean(path: KeyPath, model: type[BaseModel]) -> str:
    known, key = sorted(_known_keys(path[:-1], model)), str(path[-1])
    longer = [name for name in known if name.startswith(f"{key}_")]  # the unit was left out
    near = longer or difflib.get_close_matches(key, known, n=1, cutoff=0.6)
    return f"; did you mean {near[0]}?" if near else f"; known here: {', '.join(known)}"


def _known_keys(path: KeyPath, model: type[BaseModel]) -> set[str]:
    for part in (item for item in path if isinstance(item, str)):
        field = model.model_fields.get(str(part))
        below = _models_in(field.annotation) if field else []
        if not below:
            return set()
        model = below[0]
    return set(model.model_fields)


def _models_in(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for argument in get_args(annotation) for model in _models_in(argument)]


def validate(model: type[M], document: Document) -> M:
    """Make ``model`` from ``document``; raises ``ConfigurationError`` with every problem and its place."""
    try:
        return model.model_validate(document.data)
    except ValidationError as error:
        raise configuration_error(error.errors(include_url=False), document, model) from error


def validate_part(model: type[BaseModel], document: Document) -> None:
    """Check the keys that ``document`` gives of ``model``, each by itself: others are given elsewhere.

    Raises ``ConfigurationError`` with every problem and its place.
    """
    try:
        model.model_validate(document.data)
    except ValidationError as error:
        whole = (dict, BaseModel, type(None))  # not wrong in themselves: something is missing there
        found = [
            one for one in error.errors(include_url=False)
            if one["type"] != "missing" and not isinstance(one["input"], whole)
        ]  # fmt: skip
        if found:
            raise configuration_error(found, document, model) from error


def located(file: Path, key: str, message: str, document: Document) -> ConfigurationError:
    """An error about ``key`` (dotted) that the validator could not see."""
    place = document.place(tuple(key.split(".")))
    return ConfigurationError(f"{place or file}: error: {key}: {message}")
