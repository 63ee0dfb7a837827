"""Read and write a table, checked against its schema; writes are atomic and the same data give the same bytes."""

from __future__ import annotations

import io
import os
import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wentry_cli.errors import InputError, on_one_line
from wentry_cli.schemas import TABLES, Table

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    from numpy.typing import NDArray

FLOAT_FORMAT = "%.9g"
QUOTED = re.compile(r'[,"\r\n]')  # a cell with one of these goes between quotes
GREATEST_INT = 10**9
MANY_CELLS = 2000  # of so many the text is written by compiled code
_KINDS = {"float": "float64", "int": "Int64", "text": "string"}
KEPT, KEPT_BYTES = 6, 4_000_000  # so many tables are kept, no longer one: memory must not grow with the clip
_READ: dict[Path, tuple[bytes, pd.DataFrame]] = {}
"""The tables that were read last, which several stages ask for: their bytes and what these say."""


@cache
def _dtypes() -> dict[str, Any]:
    """The type of a column by its kind: looking one up by its name is slow, and there is one for every column."""
    import pandas as pd

    return {kind: pd.api.types.pandas_dtype(name) for kind, name in _KINDS.items()}


def make_folder(folder: Path) -> None:
    """Make ``folder`` and those above it; raises ``InputError`` where one is a file or cannot be made."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        files = [path for path in (folder, *folder.parents) if os.path.isfile(path)]
        what = f"{files[0]}: is a file, not a folder" if files else f"{folder}: cannot be made ({error.strerror})"
        raise InputError(f"{what}; choose another folder with -o") from error


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a temporary path beside ``path`` that takes its place when the block ends well, and vanishes otherwise.

    Raises ``InputError`` where the folder cannot be written.
    """
    make_folder(path.parent)
    try:
        handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".part", dir=path.parent)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror}); choose another folder with -o") from error
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        temporary.chmod(0o644)
        temporary.replace(path)
    except BaseException as error:
        temporary.unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise InputError(
                f"{path}: cannot be written ({error.strerror}); free space or choose another folder"
            ) from error
        raise


def write_text(path: Path, text: str) -> None:
    """Write ``text`` as UTF-8 with plain line ends, all of it or nothing."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def table_path(folder: Path, name: str) -> Path:
    """Where the table ``name`` lies in ``folder``."""
    return folder / f"{TABLES[name].name}.csv"


def has_table(folder: Path, name: str) -> bool:
    """Whether the table ``name`` was written into ``folder``."""
    return table_path(folder, name).is_file()


def new_table(name: str, columns: dict[str, Any]) -> pd.DataFrame:
    """Make the table ``name`` from arrays by column name; columns that are left out are empty.

    Raises ``KeyError`` for a column that the schema does not know.
    """
    import pandas as pd

    table = TABLES[name]
    unknown = sorted(set(columns) - set(table.names))
    if unknown:
        raise KeyError(f"{name}.csv has no column {', '.join(unknown)}")
    frame = pd.DataFrame(columns)
    return _typed(frame.reindex(columns=table.names), table)


def vouched(name: str, columns: dict[str, Any]) -> list[str]:
    """The status words of a table, ``ok`` only where every cell that this word promises is filled.

    Other rows that were said to be ``ok`` are ``not_identified``. ``KeyError`` where a promised column is missing.
    """
    import numpy as np

    full = np.all([_filled(columns[key]) for key in TABLES[name].promised], axis=0)
    pairs = zip(columns["status"], full, strict=True)
    return ["not_identified" if word == "ok" and not filled else str(word) for word, filled in pairs]


def _filled(cells: Any) -> NDArray[np.bool_]:
    """Which cells of a column hold a number or a word."""
    import numpy as np
    import pandas as pd

    values = np.asarray(cells)
    if values.dtype.kind == "f":
        return np.asarray(~np.isnan(values))
    return np.array([not pd.isna(cell) and cell != "" for cell in values.tolist()], bool)


def _typed(frame: pd.DataFrame, table: Table) -> pd.DataFrame:
    found = dict(zip(frame.columns, frame.dtypes, strict=True))
    types = {column.name: _dtypes()[column.kind] for column in table.columns}
    wrong = {name: kind for name, kind in types.items() if found[name] != kind}
    # in a third of the time that all of them at once take
    return frame.assign(**{name: frame[name].astype(kind) for name, kind in wrong.items()}) if wrong else frame


def write_table(folder: Path, name: str, frame: pd.DataFrame) -> Path:
    """Write ``frame`` as the table ``name`` into ``folder``: schema order, 9 significant digits, NaN as an empty cell.

    Raises ``KeyError`` where a column is missing or unknown and ``ValueError`` where a number is infinite (what is not
    known is NaN), which are a programmer's mistakes.
    """
    table = TABLES[name]
    missing = [column for column in table.names if column not in frame.columns]
    unknown = [column for column in frame.columns if column not in table.names]
    if missing or unknown:
        raise KeyError(f"{name}.csv: missing columns {missing}, unknown columns {unknown}")
    path = table_path(folder, name)
    _READ.pop(path, None)
    ordered = _typed(_ordered(frame, table), table)
    infinite = _infinite(ordered, table)
    if infinite:
        raise ValueError(f"{name}.csv: infinite numbers in {', '.join(infinite)}")
    text = _compiled_text(ordered, table) if ordered.size >= MANY_CELLS else None
    with replacing(path) as temporary, temporary.open("wb") as stream:
        stream.write(f"{','.join(table.names)}\n".encode())
        stream.write(_lines(ordered, table).encode() if text is None else text)
    return path


def _compiled_text(frame: pd.DataFrame, table: Table) -> bytes | None:
    """The text of the rows of a table; None where it has whole numbers that are too great."""
    import numpy as np
    import pandas as pd

    from wentry_cli.number_text import text_of

    cells = np.empty((len(frame), len(table.columns)))
    places = {column.name: place for place, column in enumerate(table.columns)}
    floats = _floats(table)
    cells[:, [places[name] for name in floats]] = frame[floats].to_numpy(dtype=float)
    words: dict[int, list[bytes]] = {}
    for column in table.columns:
        place = places[column.name]
        if column.kind == "int":
            cells[:, place] = frame[column.name].to_numpy(dtype=float, na_value=np.nan)
            if np.any(np.abs(cells[:, place]) >= GREATEST_INT):
                return None
        elif column.kind == "text":
            which, known = pd.factorize(frame[column.name])
            cells[:, place] = np.where(which < 0, np.nan, which)
            words[place] = [_quoted(str(word)).encode() for word in known]
    return text_of(cells, words)


def _quoted(cell: str) -> str:
    """A cell as it stands in the file."""
    return '"{}"'.format(cell.replace('"', '""')) if QUOTED.search(cell) else cell


def _floats(table: Table) -> list[str]:
    return [column.name for column in table.columns if column.kind == "float"]


def _lines(frame: pd.DataFrame, table: Table) -> str:
    """The text of the rows of a table."""
    columns = [_cells(frame[column.name], column.kind) for column in table.columns]
    return "".join(f"{','.join(row)}\n" for row in zip(*columns, strict=True))


def _infinite(frame: pd.DataFrame, table: Table) -> list[str]:
    """The columns that hold an infinite number, which neither is a measurement nor says that there is none."""
    import numpy as np

    # one after the other: a part of a table is slow to take out
    return [name for name in _floats(table) if np.isinf(frame[name].to_numpy(dtype=float)).any()]


def _cells(column: pd.Series[Any], kind: str) -> list[str]:
    """The text of a column: one format for all of its numbers at once is five times faster than one after the other."""
    if kind == "float":
        numbers = column.to_numpy().tolist()
        text = (f"{FLOAT_FORMAT}\n" * len(numbers) % tuple(numbers)).split("\n")[:-1]
        return ["" if cell == "nan" else cell for cell in text]
    if kind == "int" and not column.hasnans:
        return [str(number) for number in column.to_numpy(int).tolist()]
    return [
        "" if gone else _quoted(str(cell)) for cell, gone in zip(column.tolist(), column.isna().tolist(), strict=True)
    ]


def read_table(folder: Path, name: str) -> pd.DataFrame:
    """Read the table ``name`` from ``folder`` with the types of its schema (float64, Int64, string).

    Columns that somebody added are dropped. Raises ``InputError`` where the file is missing, is not a table, lacks a
    column or holds an infinite number.
    """
    path = table_path(folder, name)
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        raise InputError(f"{path}: missing; run `wentry process` (stage {TABLES[name].stage}) first") from None
    before, frame = _READ.pop(path, (b"", None))
    if frame is None or before != content:
        frame = _parsed(path, name, content)
    if len(content) > KEPT_BYTES:
        return frame
    _READ[path] = content, frame
    if len(_READ) > KEPT:
        del _READ[next(iter(_READ))]
    return frame.copy()


def _parsed(path: Path, name: str, content: bytes) -> pd.DataFrame:
    """The table ``name`` in what was read from ``path``."""
    import pandas as pd

    table = TABLES[name]
    types = {column.name: _dtypes()[column.kind] for column in table.columns}
    try:
        frame = pd.read_csv(io.BytesIO(content), dtype=types, encoding="utf-8")
    except (ValueError, UnicodeDecodeError) as error:
        raise InputError(
            f"{path}: not the table {name} ({on_one_line(error)}); run the stage {table.stage} again"
        ) from error
    missing = [column for column in table.columns if column.name not in frame.columns]
    if table.stage == "calibrate":  # these tables outlive a run: what an earlier version did not know is empty
        missing = [column for column in missing if not column.may_be_empty]
    if missing:
        raise InputError(f"{path}: column {missing[0].name} is missing; run the stage {table.stage} again")
    if len(frame.columns.intersection(table.names)) < len(table.names):
        frame = _typed(frame.reindex(columns=table.names), table)
    infinite = _infinite(frame, table)
    if infinite:
        raise InputError(
            f"{path}: column {infinite[0]} holds inf, which wentry does not write; run {table.stage} again"
        )
    return _ordered(frame, table)


def _ordered(frame: pd.DataFrame, table: Table) -> pd.DataFrame:
    """The columns of the schema in its order: the frame itself where it has these."""
    return frame if list(frame.columns) == list(table.names) else frame[table.names]
