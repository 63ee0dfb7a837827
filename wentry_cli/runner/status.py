"""The state of each stage of each drop, as a table for the user."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from wentry_cli.config.campaign import Drop
from wentry_cli.errors import WentryError
from wentry_cli.pipeline import CAMPAIGN_STAGES, Stage
from wentry_cli.pipeline import STAGES as ALL_STAGES
from wentry_cli.records import read_stages
from wentry_cli.runner.campaign_stages import ALL_DROPS, Members, plan_campaign, rewritten_by
from wentry_cli.runner.lock import is_locked
from wentry_cli.runner.plan import INTERRUPTED, Choice, Step, plan
from wentry_cli.runner.processed import processed
from wentry_cli.runner.today import as_configured_today

States = dict[str, dict[str, tuple[str, str]]]


def campaign_status(results: Path, only: tuple[str, ...] = ()) -> States:
    """State and reason by drop and stage: ``fresh``, ``stale``, ``failed``, ``running``, ``not needed``.

    The reason of what is fresh are the warnings of that stage, if there were any.
    The stages over all drops stand under the name ``*``.
    """
    campaign = processed(results, only)
    busy = is_locked(results)
    states: States = {}
    steps: dict[str, list[Step[Stage]]] = {}
    for drop in campaign.drops:
        states[drop.name], steps[drop.name] = _states(results, drop, busy)
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
        steps = plan(results, as_configured_today(results, drop), list(ALL_STAGES), Choice())
    except WentryError as wrong:
        return {stage.name: ("stale", str(wrong)) for stage in ALL_STAGES}, []
    return {step.stage.name: _state(step, record.get(step.stage.name), busy) for step in steps}, steps


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
