"""What a user sees while stages run: a bar on a terminal, a line now and then elsewhere; all of it on stderr."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import click

from wentry_cli.runner.drop import Event, Report
from wentry_cli.runner.plan import Step


@contextmanager
def reporting(*, quiet: bool, verbose: bool) -> Iterator[Report]:
    """A listener for the events of a run."""
    if quiet:
        yield _say_failure
    elif sys.stderr.isatty():
        with _bars(verbose) as report:
            yield report
    else:
        yield lambda event: _say(event, verbose)


def _label(event: Event) -> str:
    return f"{event.drop}: {event.stage}" if event.drop and event.stage else event.drop or event.stage


def _say_failure(event: Event) -> None:
    if event.what == "failed":
        click.echo(f"{_label(event)}: {event.text}", err=True)


def _say(event: Event, verbose: bool) -> None:
    if event.what == "failed":
        _say_failure(event)
    elif event.what == "done":
        click.echo(f"{_label(event)} done {event.text}".rstrip(), err=True)
    elif event.what in ("fresh", "not_needed") and verbose:
        click.echo(f"{_label(event)} {event.what.replace('_', ' ')}: {event.text}", err=True)


@contextmanager
def _bars(verbose: bool) -> Iterator[Report]:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        tasks: dict[str, TaskID] = {}

        def report(event: Event) -> None:
            label = _label(event)
            if event.what == "start":
                tasks[label] = progress.add_task(label, total=None)
            elif event.what == "tick" and label in tasks:
                progress.update(tasks[label], completed=event.done, total=event.total)
            else:
                if label in tasks:
                    progress.remove_task(tasks.pop(label))
                _say(event, verbose)

        yield report


def show_plan(plans: dict[str, list[Step]], *, as_json: bool) -> None:
    """Print what would run, and why."""
    if as_json:
        rows = {
            name: [{"stage": step.stage.name, "action": step.action, "reason": step.reason} for step in steps]
            for name, steps in plans.items()
        }
        show_json(rows)
        return
    for name, steps in plans.items():
        for step in steps:
            click.echo(f"{name:24} {step.stage.name:12} {step.action.replace('_', ' '):12} {step.reason}")


def show_json(content: Any) -> None:
    """Print plain data as JSON on stdout."""
    click.echo(json.dumps(content, indent=1, sort_keys=True, ensure_ascii=False))
