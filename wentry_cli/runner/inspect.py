"""Open every recording of a campaign without measuring it."""

from __future__ import annotations

from wentry_cli.config.campaign import Drop
from wentry_cli.errors import ConfigurationError, WentryError
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
    from wentry_cli.frames.formats import open_recording

    given = drop.view(view).fps
    rate = given if isinstance(given, float) else None
    recording = open_recording(drop.source_path(view), fps=rate, frames=drop.view(view).frames)
    try:
        info = recording.info
    finally:
        recording.close()
    if info.fps is None or not info.rate_trusted:
        raise ConfigurationError(
            f"{drop.folder / 'experiment.yaml'}: views.{view}.fps is needed: "
            f"{info.path.name} does not tell the camera's rate"
        )
    return (
        f"{info.format}, {info.frame_count} frames of {info.width} x {info.height}, {info.bit_depth} bit, "
        f"{info.fps:g} frames/s ({info.fps_source})"
    )
