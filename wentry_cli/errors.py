"""What a user can get wrong, each with the exit code of the command line.

A ``WentryError`` is one sentence that says what is wrong, where, and what to do about it. Anything else
that is raised is a programmer's mistake and keeps its traceback.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


class WentryError(Exception):
    """A mistake the user can mend; ``str(error)`` is the sentence to show."""

    exit_code = 1


class ConfigurationError(WentryError):
    """The configuration is wrong: unknown, misspelt, mistyped, missing or contradictory keys."""

    exit_code = 3


class InputError(WentryError):
    """A file is missing, unreadable, truncated or disagrees with another."""

    exit_code = 4


class NoDropError(InputError):
    """A folder holds no drop."""


def on_one_line(error: Exception) -> str:
    """What ``error`` of another program says, without the line breaks that it may hold."""
    return " ".join(str(error).split())


class Gathered:
    """Mistakes that do not hide one another, told together."""

    def __init__(self) -> None:
        """Start with none."""
        self.errors: list[WentryError] = []

    @contextmanager
    def part(self) -> Iterator[None]:
        """Keep the ``WentryError`` of the block, and go on behind it."""
        try:
            yield
        except WentryError as error:
            self.errors.append(error)

    def complain(self) -> None:
        """Raise what was kept as one error: the class of the first, a line for each."""
        if self.errors:
            lines = dict.fromkeys(line for error in self.errors for line in str(error).splitlines())
            raise type(self.errors[0])("\n".join(lines)) from self.errors[0]


class FrameUnreadableError(InputError):
    """One frame of a readable recording is missing or damaged; the frame gets a status and the clip goes on.

    ``status`` is the word for ``frames.csv``: ``bad_frame`` or ``gap``; ``file`` the name of the frame's own file,
    empty where it has none.
    """

    def __init__(self, message: str, status: str = "bad_frame") -> None:
        """Keep the sentence and the status word."""
        super().__init__(message)
        self.status = status
        self.file = ""


class TooFewMeasurementsError(WentryError):
    """The recording was read, but too little of it could be measured; raised after the tables are written."""

    exit_code = 5


class CampaignError(WentryError):
    """Some drops of a campaign failed; the others are complete."""

    exit_code = 6


class LockedError(WentryError):
    """Another process is writing into the same results folder."""

    exit_code = 7
