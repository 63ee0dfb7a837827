"""The state of each stage of each drop, as a table for the user."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from wentry_cli.config.campaign import Drop, find_drops, read_drop
from wentry_cli.errors import WentryError
from wentry_cli.pipeline import CAMPAIGN_STAGES, Stage
from wentry_cli.pipeline import STAGES as ALL_STAGES
from wentry_cli.records import RUN, read_json, read_stages
from wentry_cli.runner.campaign_stages import ALL_DROPS, Members, plan_campaign, rewritten_by
from wentry_cli.runner.lock import is_locked
from wentry_cli.runner.plan import INTERRUPTED, Choice, Step, plan
from wentry_cli.runner.processed import processed
from wentry_cli.runner.today import as_configured_today, look_at_input

INPUT = "input"  # in the place of a stage's name
States = dict[str, dict[str, tuple[str, str]]]


def campaign_status(results: Path, only: tuple[str, ...] = ()) -> States:
    """State and reason by drop and stage: ``fresh``, ``stale``, ``failed``, ``running``, ``not needed``.

    The reason of what is fresh are the warnings of that stage, if there were any.
    What is wrong with the configuration or the recordings of a drop stands before its stages as ``input``, ``wrong``;
    also of drops that lie beside these and could not be measured. The stages over all drops stand under the name ``*``.
    """
    campaign = processed(results, only)
    busy = is_locked(results)
    states: States = {}
    steps: dict[str, list[Step[Stage]]] = {}
    for drop in campaign.drops:
        states[drop.name], steps[drop.name] = _states(results, drop, busy)
    if not only:
        states |= _never_measured(results, campaign.drops)
    for failure in campaign.failures:  # one of which not even the record can be read
        states.setdefault(failure.drop, {"record": ("wrong", _one_line(failure.sentence))})
    if not only:
        # a drop whose tables were removed is stale, and takes part again once it runs
        going = {name: own for name, own in steps.items() if own and not _has_failed(states[name])}
        failed = frozenset(failure.drop for failure in campaign.failures if failure.drop not in going)
        members = Members(results, campaign.drops, failed)
        rewritten = rewritten_by(going)
        record = read_stages(results)
        over_all = plan_campaign(members, list(CAMPAIGN_STAGES), Choice(), rewritten)
        states[ALL_DROPS] = {step.stage.name: _state(step, record.get(step.stage.name), busy) for step in over_all}
    return states


def _has_failed(states: dict[str, tuple[str, str]]) -> bool:
    return any(state == "failed" for state, _ in states.values())


def _states(results: Path, drop: Drop, busy: bool) -> tuple[dict[str, tuple[str, str]], list[Step[Stage]]]:
    record = read_stages(results / drop.name)
    try:
        today = as_configured_today(results, drop)
        look_at_input(today)
        steps = plan(results, today, list(ALL_STAGES), Choice())
    except WentryError as wrong:
        stages = {stage.name: ("stale", f"see {INPUT}") for stage in ALL_STAGES}
        return {INPUT: ("wrong", _one_line(wrong)), **stages}, []
    return {step.stage.name: _state(step, record.get(step.stage.name), busy) for step in steps}, steps


def _never_measured(results: Path, drops: list[Drop]) -> States:
    """The drops beside ``drops`` of which nothing could be measured, by what is wrong with their input."""
    known = {drop.name for drop in drops}
    found = {
        name: {INPUT: ("wrong", _one_line(told.get("sentence")))}
        for name, told in read_json(results / RUN).get("failures", {}).items()
        if name not in known
    }
    for top in sorted({drop.top for drop in drops if drop.top is not None}):
        for name, folder in _drops_in(top).items():
            try:
                if name not in known:
                    look_at_input(read_drop(name, folder, top=top))
                    found.pop(name, None)  # it was mended
            except WentryError as wrong:
                found[name] = {INPUT: ("wrong", _one_line(wrong))}
    return found


def _drops_in(top: Path) -> dict[str, Path]:
    try:
        return find_drops(top)
    except WentryError:  # it was moved
        return {}


def _one_line(told: object) -> str:
    return "; ".join(str(told).splitlines())


def _state(step: Step[Any], known: Any, busy: bool) -> tuple[str, str]:
    if step.action == "not_needed":
        return "not needed", step.reason
    error = known.get("error") if isinstance(known, dict) else None
    if error == INTERRUPTED:
        return ("running", "") if busy else ("stale", INTERRUPTED)
    if error:
        return "failed", str(error)
    if step.action != "fresh":
        return "stale", step.reason
    return "fresh", "; ".join(f"warning: {sentence}" for sentence in known.get("warnings", ()))
