"""Open every recording of a campaign without measuring it; on request every frame is read too."""

from __future__ import annotations

import logging
import time
from dataclasses import dataclass, field

from wentry_cli import progress
from wentry_cli.config.blame import place_of
from wentry_cli.config.campaign import SHOWN, Drop
from wentry_cli.config.plausible import doubtful
from wentry_cli.errors import Gathered, TooFewMeasurementsError, WentryError
from wentry_cli.runner.drop import Event, Failure, Report
from wentry_cli.runner.in_clip import check_times

logger = logging.getLogger(__name__)
LOOK = "frames"  # in the place of a stage's name


@dataclass
class Inspection:
    """What each view of each drop is, in a sentence, and the drops whose recordings cannot be used.

    ``damage`` holds, where every frame was read, the frames of each view that are not good, by status word.
    """

    facts: dict[str, dict[str, str]] = field(default_factory=dict)
    damage: dict[str, dict[str, dict[str, list[int]]]] = field(default_factory=dict)
    failures: list[Failure] = field(default_factory=list)


def inspect_sources(drops: list[Drop], report: Report | None = None) -> Inspection:
    """Open the recordings of ``drops``; with ``report``, which hears how far it is, every frame is read as well.

    A damaged frame is a warning, as it is to ``process``; too few that can be read make the drop a failure.
    """
    seen = Inspection()
    for drop in drops:
        try:
            seen.facts[drop.name] = _sentences(drop)
            if report is not None:
                seen.damage[drop.name] = _damage(drop, report)
        except WentryError as error:
            seen.failures.append(Failure(drop.name, "ingest", error.exit_code, str(error)))
    return seen


def _damage(drop: Drop, report: Report) -> dict[str, dict[str, list[int]]]:
    from wentry_cli.stages.ingest import look_at_frames, open_view

    words: dict[str, list[str]] = {}
    report(Event(drop.name, LOOK, "start"))
    progress.listen(lambda done, total: report(Event(drop.name, LOOK, "tick", "", done, total)))
    started = time.perf_counter()
    try:
        for view in drop.experiment.sides:
            opened = open_view(drop, view)
            try:
                words[view] = look_at_frames(drop, view, opened, sum(map(len, words.values())))[1]
            finally:
                opened.recording.close()
    finally:
        progress.listen(None)
        report(Event(drop.name, LOOK, "done", f"{time.perf_counter() - started:.1f} s"))
    _refuse_too_few(drop, words)
    return {
        view: {
            word: [index for index, other in enumerate(status) if other == word] for word in sorted({*status} - {"ok"})
        }
        for view, status in words.items()
    }


def _refuse_too_few(drop: Drop, words: dict[str, list[str]]) -> None:
    """No more frames can be measured than can be read, in the view that has most of them."""
    good = max(status.count("ok") for status in words.values())
    least = drop.experiment.analysis.min_frames
    if good < least:
        raise TooFewMeasurementsError(
            f"{drop.name}: only {good} frames can be read, analysis.min_frames asks for {least}; "
            "copy or export the recording again"
        )


def _refuse_too_short(drop: Drop, counts: list[int]) -> None:
    """Nor more than the header counts, within the range that was chosen."""
    least = drop.experiment.analysis.min_frames
    if max(counts) < least:
        raise TooFewMeasurementsError(
            f"{drop.name}: the recording has {max(counts)} frames, analysis.min_frames asks for {least}; "
            "give a longer clip or a wider range of frames"
        )


def _sentences(drop: Drop) -> dict[str, str]:
    from wentry_cli.stages.inputs.agreement import check_clocks

    problems, seen = Gathered(), {}
    for view in drop.experiment.sides:
        with problems.part():
            seen[view] = _look(drop, view)
    problems.complain()
    for key, value, told in doubtful(drop.experiment):
        logger.warning(f"{place_of(drop, key, value)}: warning: {key}: {told}")
    times = {view: time_s for view, (_, time_s) in seen.items()}
    _refuse_too_short(drop, [len(time_s) for time_s in times.values()])
    check_clocks(drop, {view: (time_s[0], time_s[-1]) for view, time_s in times.items()})
    check_times(drop, times)
    return {view: sentence for view, (sentence, _) in seen.items()}


def _look(drop: Drop, view: str) -> tuple[str, list[float]]:
    """What a view is, in a sentence, and the times of its frames."""
    from wentry_cli.stages.ingest import frame_rate, frame_times, open_view, tell_notes
    from wentry_cli.stages.inputs.agreement import check_view
    from wentry_cli.stages.inputs.empty_scene import check_empty_scene

    opened = open_view(drop, view)
    try:
        info = opened.info
        tell_notes(drop, view, info)
        rate = frame_rate(drop, view, info)
        check_view(drop, view, info)
        check_empty_scene(drop, view, (info.height, info.width))
        time_s = frame_times(drop, view, opened).tolist()
    finally:
        opened.recording.close()
    missing = f" ({info.gaps} missing by their numbers)" if info.gaps else ""
    if info.unreadable:
        more = " and others" if len(info.unreadable) > SHOWN else ""
        missing += f" ({len(info.unreadable)} cannot be read: {', '.join(info.unreadable[:SHOWN])}{more})"
    sentence = (
        f"{info.format}, {info.frame_count} frames of {info.width} x {info.height}{missing}, "
        f"{rate:g} frames/s ({info.fps_source})"
    )
    return sentence, time_s
