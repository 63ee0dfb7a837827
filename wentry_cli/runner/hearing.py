"""What a stage warns of while it runs, kept for its record; it still reaches whoever listens to the log."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager

PACKAGE = "wentry_cli"


class _Kept(logging.Handler):
    """Keeps the sentences of warnings, without the drop's name in front, each once."""

    def __init__(self, drop: str) -> None:
        super().__init__(logging.WARNING)
        self.drop = drop
        self.sentences: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        sentence = record.getMessage().removeprefix(f"{self.drop}: ")
        if sentence not in self.sentences:
            self.sentences.append(sentence)
        if not logging.getLogger().handlers and logging.lastResort is not None:
            logging.lastResort.handle(record)  # it would have told the user, were there no handler


@contextmanager
def hear_warnings(drop: str) -> Iterator[list[str]]:
    """The warnings of the block about ``drop``, a growing list."""
    handler = _Kept(drop)
    logger = logging.getLogger(PACKAGE)
    logger.addHandler(handler)
    try:
        yield handler.sentences
    finally:
        logger.removeHandler(handler)
