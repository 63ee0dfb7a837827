"""``wentry info``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from wentry_cli.cli import options as opt

MEANT = {
    "duplicates": "  (files whose frame number another one has)",
    "duplicate_frames": "  (frames that equal the one before; --duplicates counts them)",
}


@click.command(name="info")
@click.argument("paths", type=opt.FOLDER, nargs=-1, required=True)
@click.option("--duplicates", is_flag=True, help="Read every frame and count those that equal the one before.")
@opt.as_json
def command(paths: tuple[Path, ...], duplicates: bool, as_json: bool) -> None:
    """Say what each recording in PATHS is: format, frames, size, bit depth, frame rate and where that came from.

    A path is a recording, a drop or a campaign (each view is shown), or a folder of recordings.
    """
    from wentry_cli.cli.console import show_json
    from wentry_cli.errors import Gathered
    from wentry_cli.runner.recordings import describe_all

    described: list[dict[str, Any]] = []
    problems = Gathered()
    for path in paths:
        with problems.part():
            described += describe_all(path, problems, count_duplicates=duplicates)
    if as_json:
        show_json(described)
    else:
        for facts in described:
            for name, value in facts.items():
                meant = "" if name == "duplicate_frames" and value is not None else MEANT.get(name, "")
                click.echo(f"{name + ':':22} {_shown(value)}{meant}")
            click.echo()
    problems.complain()


def _shown(value: Any) -> str:
    if isinstance(value, list):
        return "; ".join(map(str, value)) or "–"
    return "–" if value is None else f"{value:.9g}" if isinstance(value, float) else str(value)
