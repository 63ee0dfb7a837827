"""Which file is which frame: numbers read from file names, natural order, gaps, duplicates, mixed series."""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import PurePath

import numpy as np
from numpy.typing import NDArray

from wentry_cli.errors import InputError

MISSING_PER_FILE = 10  # more missing numbers than this per file is a mistake in the names, not lost frames
LOSSLESS_FIRST = (".png", ".tif", ".tiff", ".bmp", ".jpg", ".jpeg")

_DIGITS = re.compile(r"(\d+)")


@dataclass(frozen=True)
class Numbering:
    """Frame ``i`` is ``names[i]`` with the number ``numbers[i]``; None where no file has that number."""

    names: tuple[str | None, ...]
    numbers: NDArray[np.int64]
    duplicates: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def gaps(self) -> int:
        """How many numbers between the first and the last have no file."""
        return sum(name is None for name in self.names)


def natural_key(name: str) -> tuple[tuple[int, str] | tuple[int, int], ...]:
    """Return a key that sorts ``frame2`` before ``frame10``, whatever the case of the letters."""
    parts = _DIGITS.split(name.casefold())
    return tuple((1, int(part)) if part.isdecimal() else (0, part) for part in parts if part)


def number_files(names: Iterable[str], where: str) -> Numbering:
    """Order the images ``names`` of the folder ``where`` by the number in their names.

    The number is the last run of digits of the stem. Raises InputError where several series lie side by side, where
    numbered and unnumbered images are mixed, and where the hole in the numbers is absurd.
    """
    ordered = sorted(names, key=lambda name: (natural_key(name), name))
    series: dict[tuple[str, str], list[str]] = defaultdict(list)
    plain: list[str] = []
    for name in ordered:
        match = _last_number(name)
        if match is None:
            plain.append(name)
        else:
            stem = PurePath(name).stem
            series[stem[: match.start()], stem[match.end() :]].append(name)
    if not series:
        note = ("file names carry no number: alphabetical order",) if len(plain) > 1 else ()
        return Numbering(tuple(plain), np.arange(len(plain), dtype=np.int64), (), note)
    if plain or len(series) > 1:
        _refuse_mixture(series, plain, ordered, where)
    return _one_series(ordered, where)


def _last_number(name: str) -> re.Match[str] | None:
    found = list(_DIGITS.finditer(PurePath(name).stem))
    return found[-1] if found else None


def _number(name: str) -> int:
    match = _last_number(name)
    return int(match.group()) if match else -1


def _refuse_mixture(series: dict[tuple[str, str], list[str]], plain: list[str], ordered: list[str], where: str) -> None:
    """Raise InputError unless the differing parts of the names are only a date or clock beside one running number."""
    numbers = Counter(_number(name) for name in ordered)
    if not plain and len(series) == len(ordered) and max(numbers.values()) == 1:
        return
    patterns = [f"'{before}*{after}' ({len(files)})" for (before, after), files in series.items()]
    patterns += [f"'{name}'" for name in plain]
    shown = ", ".join(patterns[:4]) + (f" and {len(patterns) - 4} more" if len(patterns) > 4 else "")
    raise InputError(
        f"{where}: holds several series of images: {shown}; which one? "
        f"Move the others elsewhere, or name the files in the source, for example '{_example(series)}'"
    )


def _example(series: dict[tuple[str, str], list[str]]) -> str:
    (before, after), files = max(series.items(), key=lambda item: len(item[1]))
    return f"{before}*{after}{PurePath(files[0]).suffix}"


def _one_series(ordered: list[str], where: str) -> Numbering:
    by_number: dict[int, str] = {}
    duplicates: list[str] = []
    for name in sorted(ordered, key=_preference):
        number = _number(name)
        if number in by_number:
            duplicates.append(name)
        else:
            by_number[number] = name
    first, last = min(by_number), max(by_number)
    missing = last - first + 1 - len(by_number)
    if missing > MISSING_PER_FILE * len(by_number) or last > np.iinfo(np.int64).max:
        raise InputError(
            f"{where}: {len(by_number)} images are numbered from {first} to {last}, so {missing} would be missing; "
            f"give the images of one recording consecutive numbers"
        )
    numbers = np.arange(first, last + 1, dtype=np.int64)
    names = tuple(by_number.get(int(number)) for number in numbers)
    return Numbering(names, numbers, tuple(duplicates), _notes(by_number, duplicates))


def _preference(name: str) -> tuple[int, str]:
    suffix = PurePath(name).suffix.lower()
    rank = LOSSLESS_FIRST.index(suffix) if suffix in LOSSLESS_FIRST else len(LOSSLESS_FIRST)
    return rank, name


def _notes(by_number: dict[int, str], duplicates: list[str]) -> tuple[str, ...]:
    notes: list[str] = []
    if duplicates:
        number = _number(duplicates[0])
        notes.append(f"'{duplicates[0]}' has the number of '{by_number[number]}', which is used")
    steps = np.gcd.reduce(np.diff(np.sort(np.fromiter(by_number, np.int64)))) if len(by_number) > 2 else 1
    if steps > 1:
        notes.append(f"the numbers go in steps of {steps}: what lies between counts as gaps")
    return tuple(notes)
