"""What a stage warns of while it runs, kept for its record; it still reaches whoever listens to the log."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from wentry_cli.doubts import doubt_in

PACKAGE = "wentry_cli"


@dataclass
class Heard:
    """The sentences of warnings, without the drop's name in front, each once, and what they put in doubt."""

    warnings: list[str] = field(default_factory=list)
    doubts: list[str] = field(default_factory=list)


class _Kept(logging.Handler):
    """Keeps what it hears of a drop."""

    def __init__(self, drop: str) -> None:
        super().__init__(logging.WARNING)
        self.drop = drop
        self.heard = Heard()

    def emit(self, record: logging.LogRecord) -> None:
        sentence = record.getMessage().removeprefix(f"{self.drop}: ")
        for known, new in ((self.heard.warnings, sentence), (self.heard.doubts, doubt_in(record))):
            if new and new not in known:
                known.append(new)
        if not logging.getLogger().handlers and logging.lastResort is not None:
            logging.lastResort.handle(record)  # it would have told the user, were there no handler


@contextmanager
def hear_warnings(drop: str) -> Iterator[Heard]:
    """The warnings of the block about ``drop``, in lists that grow."""
    handler = _Kept(drop)
    logger = logging.getLogger(PACKAGE)
    logger.addHandler(handler)
    try:
        yield handler.heard
    finally:
        logger.removeHandler(handler)
