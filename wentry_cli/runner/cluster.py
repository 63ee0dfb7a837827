"""A campaign over the workers of a Dask cluster: the same work a drop as on one machine, on shared storage.

Install with ``pip install "wentry[cluster]"``. Videos and results lie where every worker sees them under one path; each
drop is one task, and a drop whose worker died is a failure like any other.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from wentry_cli.config.campaign import Drop
from wentry_cli.errors import InputError
from wentry_cli.runner.drop import Event, Failure, Report, run_drop
from wentry_cli.runner.work import Work, single_threaded


def run_on_cluster(address: str, work: Work, drops: list[Drop], report: Report) -> Iterator[Failure]:
    """Run every drop on the scheduler at ``address`` (``tcp://host:8786`` or a scheduler file); yields the failures.

    Raises ``InputError`` where Dask is not installed or the scheduler does not answer.
    """
    try:
        from dask.distributed import Client, as_completed
    except ImportError as error:
        raise InputError('--cluster needs Dask: pip install "wentry[cluster]"') from error
    try:
        known = {"scheduler_file": address} if address.endswith(".json") else {"address": address}
        client = Client(**known, timeout="10s")  # type: ignore[no-untyped-call]
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(f"{address}: no Dask scheduler answers there; start one with `dask scheduler`") from error
    with client:
        futures = {client.submit(run_remotely, work, drop.record(), pure=False): drop.name for drop in drops}
        for future in as_completed(futures):  # type: ignore[no-untyped-call]
            name = futures[future]
            lost = future.exception()
            if lost is not None:
                sentence = f"its worker failed ({type(lost).__name__}: {lost}); run it alone with --drop {name}"
                report(Event(name, "", "failed", sentence))
                yield Failure(name, "", 1, sentence)
                continue
            events, failure = future.result()
            for event in events:
                report(event)
            if failure is not None:
                yield failure


def run_remotely(work: Work, record: dict[str, Any]) -> tuple[list[Event], Failure | None]:
    """Run one drop in this process; what happened and the failure, if any."""
    single_threaded()
    events: list[Event] = []
    failure = run_drop(work.results, Drop.from_record(record), work.stages, work.choice, events.append)
    return [event for event in events if event.what != "tick"], failure
