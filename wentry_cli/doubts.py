"""Doubts: warnings that what was measured contradicts what was told, each named in a few words for the tables."""

from __future__ import annotations

import logging

_WHAT = "wentry_doubt"  # the attribute of a log record


def puts_in_doubt(what: str) -> dict[str, str]:
    """The ``extra`` of a warning that tells of a contradiction; ``what`` names it in summary.csv and in the report."""
    return {_WHAT: what}


def doubt_in(record: logging.LogRecord) -> str:
    """What a log record puts in doubt, in a few words; empty where it is another warning."""
    return str(getattr(record, _WHAT, ""))
