"""Run many drops: one after another, or each in a process of its own, so that one bad drop stops no other."""

from __future__ import annotations

import multiprocessing
import signal
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import TYPE_CHECKING, Any, NamedTuple, cast

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


class Worker(NamedTuple):
    """A process and the name of the drop that it is at work on, empty where it waits for one."""

    process: SpawnProcess
    drop: str


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
    """One process a job, each with one drop after the other: to start one takes as long as many a drop."""
    waiting = list(reversed(drops))
    running = dict(_start(work, waiting.pop()) for _ in range(min(jobs, len(drops))))
    try:
        while running:
            for ready in cast("list[Connection]", wait(list(running))):
                yield from _hear(ready, running, report)
                worker = running.get(ready)
                if worker is not None and worker.drop:
                    continue
                if worker is not None and waiting:
                    running[ready] = _give(worker.process, ready, waiting.pop())
                elif worker is not None:
                    ready.send(None)
                    del running[ready]
                    worker.process.join()
                elif waiting:  # it broke down over its drop, and the others go on in another
                    running |= dict([_start(work, waiting.pop())])
    finally:
        for worker in running.values():
            worker.process.terminate()


def _start(work: Work, drop: Drop) -> tuple[Connection, Worker]:
    """A new process at work on a drop, and the pipe to it."""
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=_in_child, args=(work, theirs), daemon=True)
    process.start()
    theirs.close()
    return ours, _give(process, ours, drop)


def _give(process: SpawnProcess, pipe: Connection, drop: Drop) -> Worker:
    pipe.send(drop.record())
    return Worker(process, drop.name)


def _hear(pipe: Connection, running: dict[Connection, Worker], report: Report) -> Iterator[Failure]:
    """Pass on what a process says: an event, a failure, or ``None`` where its drop is done."""
    process, name = running[pipe]
    try:
        message = pipe.recv()
    except (EOFError, OSError):
        process.join()
        del running[pipe]
        sentence = f"its process ended with code {process.exitcode}; run it alone with --drop {name} to see why"
        report(Event(name, "", "failed", sentence))
        yield Failure(name, "", 1, sentence)
        return
    if isinstance(message, Event):
        report(message)
    elif isinstance(message, Failure):
        yield message
    else:
        running[pipe] = Worker(process, "")


def _in_child(work: Work, pipe: Connection) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent hears Ctrl-C and ends its children
    single_threaded()
    last_tick = 0.0

    def send(event: Event) -> None:
        nonlocal last_tick
        now = time.monotonic()
        if event.what == "tick" and now - last_tick < 0.2:
            return
        last_tick = now if event.what == "tick" else last_tick
        _tell(pipe, event)

    while (record := _asked(pipe)) is not None:
        failure = run_drop(work.results, Drop.from_record(record), work.stages, work.choice, send)
        if failure is not None:
            _tell(pipe, failure)
        _tell(pipe, None)
    pipe.close()


def _tell(pipe: Connection, message: Event | Failure | None) -> None:
    """Send ``message`` to the parent; where that was killed, end as if interrupted."""
    try:
        pipe.send(message)
    except OSError:
        sys.exit(1)


def _asked(pipe: Connection) -> dict[str, Any] | None:
    """The record of the next drop; ``None`` where there is none, or nobody to ask for it."""
    try:
        return cast("dict[str, Any] | None", pipe.recv())
    except (EOFError, OSError):
        return None
