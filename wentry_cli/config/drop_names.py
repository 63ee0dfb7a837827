"""Which names a drop can have: they stand in messages and tables, and beside the tool's own files in RESULTS."""

from __future__ import annotations

import os
import sys

from wentry_cli.config.values import LONGEST_NAME, is_formula, is_one_line
from wentry_cli.errors import ConfigurationError, InputError
from wentry_cli.pipeline import CAMPAIGN_STAGES
from wentry_cli.records import DROP, ERROR_LOG, LOCK, RUN, STAGES

OWN_NAMES = {DROP, ERROR_LOG, LOCK, RUN, STAGES} | {
    name
    for stage in CAMPAIGN_STAGES
    for name in (*(f"{table}.csv" for table in stage.reads), *(pattern.split("/")[0] for pattern in stage.writes))
}


def speakable(name: str) -> str:
    """``name`` of a drop; raises ``InputError`` where its folders' names spoil messages, tables and files.

    ``ConfigurationError`` where it is that of a file of the tool's own in RESULTS, in capitals or not: many disks do
    not tell these apart.
    """
    if not is_one_line(name):
        raise InputError(f"{name!r}: {_why_unreadable(name)}")
    size = len(os.fsencode(name))
    if size > LONGEST_NAME:
        raise InputError(
            f"{name}: the name of a drop, its folders joined by __, is that of a folder in the results and has at most "
            f"{LONGEST_NAME} bytes, not {size}; give VIDEO_DIR nearer to the drop, or rename its folders"
        )
    if is_formula(name):
        raise InputError(
            f"{name}: the name of a drop stands in tables, where {name.lstrip()[0]} begins a formula; rename its folder"
        )
    if name.casefold() in OWN_NAMES:
        raise ConfigurationError(
            f"{name}: the name of a drop is that of its folder in the results, where wentry writes a file or folder "
            "of its own by this name; rename it"
        )
    return name


def _why_unreadable(name: str) -> str:
    """A name in UTF-8 is no line of text to a Python that was told that names are in ASCII."""
    encoding = sys.getfilesystemencoding()
    try:
        letters = os.fsencode(name).decode("utf-8")
    except UnicodeError:
        letters = name
    if letters != name and is_one_line(letters):
        return (
            f"the locale says that names of files are in {encoding}, and this one is in UTF-8; set a UTF-8 locale "
            "(LC_ALL=C.UTF-8, or PYTHONUTF8=1), or rename the folder"
        )
    return "a folder that holds a drop must have a name of one line of text; rename it"
