"""Open every recording of a campaign without measuring it."""

from __future__ import annotations

from wentry_cli.config.campaign import Drop
from wentry_cli.errors import Gathered, InputError, WentryError
from wentry_cli.runner.drop import Failure
from wentry_cli.runner.in_clip import check_times


def inspect_sources(drops: list[Drop]) -> tuple[dict[str, dict[str, str]], list[Failure]]:
    """What each view of each drop is, in a sentence, and the drops whose recordings cannot be used."""
    facts: dict[str, dict[str, str]] = {}
    failures: list[Failure] = []
    for drop in drops:
        try:
            facts[drop.name] = _sentences(drop)
        except WentryError as error:
            failures.append(Failure(drop.name, "ingest", error.exit_code, str(error)))
    return facts, failures


def _sentences(drop: Drop) -> dict[str, str]:
    from wentry_cli.stages.inputs.agreement import check_clocks

    problems, seen = Gathered(), {}
    for view in drop.experiment.sides:
        with problems.part():
            _check_background(drop, view)
        with problems.part():
            seen[view] = _look(drop, view)
    problems.complain()
    times = {view: time_s for view, (_, time_s) in seen.items()}
    check_clocks(drop, {view: (time_s[0], time_s[-1]) for view, time_s in times.items()})
    check_times(drop, times)
    return {view: sentence for view, (sentence, _) in seen.items()}


def _look(drop: Drop, view: str) -> tuple[str, list[float]]:
    """What a view is, in a sentence, and the times of its frames."""
    from wentry_cli.stages.ingest import frame_rate, frame_times, open_view
    from wentry_cli.stages.inputs.agreement import check_view

    opened = open_view(drop, view)
    try:
        info = opened.info
        rate = frame_rate(drop, view, info)
        check_view(drop, view, info)
        time_s = frame_times(drop, view, opened).tolist()
    finally:
        opened.recording.close()
    sentence = (
        f"{info.format}, {info.frame_count} frames of {info.width} x {info.height}, "
        f"{rate:g} frames/s ({info.fps_source})"
    )
    return sentence, time_s


def _check_background(drop: Drop, view: str) -> None:
    from wentry_cli.frames.formats import open_recording

    background = drop.view(view).background
    if isinstance(background, tuple):
        recording = open_recording(drop.source_path(view))
        last = recording.info.frame_count - 1
        recording.close()
        if background[1] > last:
            raise InputError(
                f"{drop.source_path(view)}: views.{view}.background names frames {list(background)}, "
                f"but the last frame is {last}"
            )
    elif background != "auto" and not (drop.folder / background).is_file():
        raise InputError(f"{drop.folder / background}: views.{view}.background: no such file")
