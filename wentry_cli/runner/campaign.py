"""Run many drops: one after another, or each in a process of its own, so that one bad drop stops no other."""

from __future__ import annotations

import multiprocessing
import signal
import time
from collections.abc import Iterator
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import TYPE_CHECKING, Any

from wentry_cli.config.campaign import Drop
from wentry_cli.runner.drop import Event, Failure, Report, run_drop
from wentry_cli.runner.work import Work, single_threaded

if TYPE_CHECKING:
    from multiprocessing.context import SpawnProcess


@dataclass(frozen=True)
class Hands:
    """Who does the work: ``jobs`` processes of this machine, or the Dask scheduler at ``cluster``."""

    jobs: int = 1
    cluster: str | None = None


def run_campaign(work: Work, drops: list[Drop], hands: Hands, report: Report) -> list[Failure]:
    """Run every drop; the failures come back in the order of the drops."""
    single_threaded()
    if hands.cluster is not None:
        from wentry_cli.runner.cluster import run_on_cluster

        return _in_order(drops, run_on_cluster(hands.cluster, work, drops, report))
    if hands.jobs <= 1 or len(drops) <= 1:
        found = [run_drop(work.results, drop, work.stages, work.choice, report) for drop in drops]
        return [failure for failure in found if failure is not None]
    return _in_order(drops, _side_by_side(work, drops, hands.jobs, report))


def _in_order(drops: list[Drop], found: Iterator[Failure]) -> list[Failure]:
    failures = {failure.drop: failure for failure in found}
    return [failures[drop.name] for drop in drops if drop.name in failures]


def _side_by_side(work: Work, drops: list[Drop], jobs: int, report: Report) -> Iterator[Failure]:
    context = multiprocessing.get_context("spawn")
    waiting = list(reversed(drops))
    running: dict[Connection, tuple[SpawnProcess, str]] = {}
    try:
        while waiting or running:
            while waiting and len(running) < jobs:
                drop = waiting.pop()
                ours, theirs = context.Pipe(duplex=False)
                process = context.Process(target=_in_child, args=(work, drop.record(), theirs), daemon=True)
                process.start()
                theirs.close()
                running[ours] = (process, drop.name)
            for ready in wait(list(running)):
                yield from _hear(ready, running, report)  # type: ignore[arg-type]
    finally:
        for process, _ in running.values():
            process.terminate()


def _hear(pipe: Connection, running: dict[Connection, tuple[SpawnProcess, str]], report: Report) -> Iterator[Failure]:
    process, name = running[pipe]
    try:
        message = pipe.recv()
    except EOFError:
        process.join()
        del running[pipe]
        if process.exitcode:
            sentence = f"its process ended with code {process.exitcode}; run it alone with --drop {name} to see why"
            report(Event(name, "", "failed", sentence))
            yield Failure(name, "", 1, sentence)
        return
    if isinstance(message, Event):
        report(message)
    elif isinstance(message, Failure):
        yield message


def _in_child(work: Work, record: dict[str, Any], pipe: Connection) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent hears Ctrl-C and ends its children
    single_threaded()
    last_tick = 0.0

    def send(event: Event) -> None:
        nonlocal last_tick
        now = time.monotonic()
        if event.what == "tick" and now - last_tick < 0.2:
            return
        last_tick = now if event.what == "tick" else last_tick
        pipe.send(event)

    failure = run_drop(work.results, Drop.from_record(record), work.stages, work.choice, send)
    if failure is not None:
        pipe.send(failure)
    pipe.close()
