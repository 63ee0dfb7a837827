"""What a user sees while stages run: a bar on a terminal, a line now and then elsewhere; all of it on stderr."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import click

from wentry_cli.pipeline import CampaignStage, Stage
from wentry_cli.runner.campaign_stages import ALL_DROPS
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


def show_plan(drops: dict[str, list[Step[Stage]]], over_all: list[Step[CampaignStage]], *, as_json: bool) -> None:
    """Print what would run for each drop and over all of them, and why."""
    rows = {name: [_plain(step) for step in steps] for name, steps in drops.items()}
    if over_all:
        rows[ALL_DROPS] = [_plain(step) for step in over_all]
    if as_json:
        show_json(rows)
        return
    for name, steps in rows.items():
        for step in steps:
            show_line(name, step["stage"], step["action"].replace("_", " "), step["reason"])


def show_line(drop: str, stage: str, state: str, reason: str) -> None:
    """Print one line of a plan or of the state of things."""
    click.echo(f"{'all drops' if drop == ALL_DROPS else drop:24} {stage:12} {state:12} {reason}".rstrip())


def _plain(step: Step[Any]) -> dict[str, str]:
    return {"stage": step.stage.name, "action": step.action, "reason": step.reason}


def show_json(content: Any) -> None:
    """Print plain data as JSON on stdout; a number that was not measured is ``null``."""
    click.echo(json.dumps(_without_nan(content), indent=1, sort_keys=True, ensure_ascii=False, allow_nan=False))


def _without_nan(content: Any) -> Any:
    if isinstance(content, dict):
        return {name: _without_nan(value) for name, value in content.items()}
    if isinstance(content, list | tuple):
        return [_without_nan(value) for value in content]
    return None if isinstance(content, float) and not math.isfinite(content) else content
