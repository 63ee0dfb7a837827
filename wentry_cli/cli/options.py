"""Options that several commands share."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

from wentry_cli.errors import InputError
from wentry_cli.pipeline import campaign_stages_of, stages_of

F = TypeVar("F", bound=Callable[..., Any])
MOST_JOBS = 1024


class Location(click.Path):
    """A file or folder that exists, or may come to."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The path; raises ``InputError`` for a relative one where the current directory was removed."""
        if not os.path.isabs(value):
            try:
                os.getcwd()
            except OSError as gone:
                raise InputError(
                    f"{value}: is told from the current directory, which was removed; change into one that is there, "
                    "or give whole paths"
                ) from gone
        return super().convert(value, param, ctx)


FOLDER = Location(path_type=Path)

video_dir = click.argument("video_dir", type=FOLDER)
results_argument = click.argument("results", type=FOLDER, default=Path("results"), required=False)
results_option = click.option(
    "-o", "--results", type=FOLDER, default=Path("results"), show_default=True, help="Folder to write into."
)


class Jobs(click.IntRange):
    """How many drops are worked on side by side."""

    def __init__(self) -> None:
        """Set the bounds."""
        super().__init__(1, MOST_JOBS)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """The number, or a sentence that says which there are."""
        try:
            return int(super().convert(value, param, ctx))
        except click.BadParameter:
            self.fail(f"{str(value)!r}: drops side by side are a whole number from 1 to {MOST_JOBS}.", param, ctx)


jobs = click.option("-j", "--jobs", type=Jobs(), default=1, show_default=True, help="Drops side by side.")
cluster = click.option("--cluster", metavar="ADDRESS", help="Run the drops on this Dask scheduler; storage is shared.")
dry_run = click.option("-n", "--dry-run", is_flag=True, help="Show what would run, and why; do nothing.")


def _stages(*commands: str) -> list[str]:
    """The stages that the given commands run, in order; those of the campaign come last."""
    own = [stage.name for stage in stages_of(*commands)]
    return own + [stage.name for stage in campaign_stages_of(*commands)]


def until(*commands: str) -> Callable[[F], F]:
    """Option ``--until`` with the stages of ``commands``."""
    return click.option("--until", type=click.Choice(_stages(*commands)), help="Last stage to run.")


def force(*commands: str) -> Callable[[F], F]:
    """Option ``--force[=STAGE]`` with the stages of ``commands``."""
    return click.option(
        "--force",
        is_flag=False,
        flag_value="all",
        type=click.Choice(["all", *_stages(*commands)]),
        help="Run again even if fresh; --force=STAGE for one stage and what depends on it.",
    )


settings = click.option(
    "--set", "settings", multiple=True, metavar="KEY.PATH=VALUE", help="Override a configuration key."
)
as_json = click.option("--json", "as_json", is_flag=True, help="Print the record as JSON on stdout.")
quiet = click.option("-q", "--quiet", is_flag=True, help="Errors and warnings only.")
verbose = click.option("-v", "--verbose", is_flag=True, help="Also say what is skipped, and why.")
only = click.option("--drop", "only", multiple=True, metavar="NAME", help="This drop only; may be repeated.")
verify = click.option("--verify", is_flag=True, help="Hash whole recordings instead of samples.")


def options(*decorators: Callable[[F], F]) -> Callable[[F], F]:
    """Apply several options in the order in which ``--help`` shall list them."""

    def apply(function: F) -> F:
        for decorator in reversed(decorators):
            function = decorator(function)
        return function

    return apply


def counted(number: int, noun: str) -> str:
    """``1 drop``, ``2 drops``."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
