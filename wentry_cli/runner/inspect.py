"""Open every recording of a campaign without measuring it."""

from __future__ import annotations

from wentry_cli.config.campaign import Drop
from wentry_cli.errors import InputError, WentryError
from wentry_cli.runner.drop import Failure


def inspect_sources(drops: list[Drop]) -> tuple[dict[str, dict[str, str]], list[Failure]]:
    """What each view of each drop is, in a sentence, and the drops whose recordings cannot be used."""
    facts: dict[str, dict[str, str]] = {}
    failures: list[Failure] = []
    for drop in drops:
        try:
            facts[drop.name] = {view: _sentence(drop, view) for view in drop.experiment.sides}
        except WentryError as error:
            failures.append(Failure(drop.name, "ingest", error.exit_code, str(error)))
    return facts, failures


def _sentence(drop: Drop, view: str) -> str:
    from wentry_cli.stages.ingest import frame_rate, open_view

    _check_background(drop, view)
    opened = open_view(drop, view)
    try:
        info = opened.info
        rate = frame_rate(drop, view, info)
    finally:
        opened.recording.close()
    return (
        f"{info.format}, {info.frame_count} frames of {info.width} x {info.height}, "
        f"{rate:g} frames/s ({info.fps_source})"
    )


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
