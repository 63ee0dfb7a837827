"""The recordings that a path stands for: itself, those of the drops in a folder, or those that lie in it."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from wentry_cli.config.campaign import find_drops, named_sources, read_drop
from wentry_cli.errors import ConfigurationError, Gathered, NoDropError
from wentry_cli.frames.description import describe
from wentry_cli.frames.listing import recordings_in


def describe_all(path: Path, problems: Gathered, *, count_duplicates: bool = False) -> list[dict[str, Any]]:
    """What is known of each recording at ``path``; those that cannot be read are told in ``problems``.

    In the folder of a drop or of a campaign these are the views that its configuration names, described with ``drop``
    and ``view`` and with the frame rate and the exposure that it gives. In another folder they are whatever
    lies in it and below, as in that of a drop whose configuration is wrong, not filled in for example, which is told
    in ``problems`` too; there ``drop`` and ``view`` stand beside those alone that the configuration names.
    """
    folder = os.path.isdir(path)  # unlike the path's own it takes a name that is too long
    if folder:
        try:
            return _of_drops(path, find_drops(path), problems, count_duplicates)
        except NoDropError:
            pass
    return _described((recordings_in(path) if folder else []) or [path], problems, count_duplicates)


def _described(recordings: list[Path], problems: Gathered, count_duplicates: bool) -> list[dict[str, Any]]:
    found = []
    for one in recordings:
        with problems.part():
            found.append(describe(one, count_duplicates=count_duplicates))
    return found


def _of_drops(
    top: Path, drops: dict[str, Path], problems: Gathered, count_duplicates: bool
) -> list[dict[str, Any]]:  # fmt: skip
    described: list[dict[str, Any]] = []
    for name, folder in drops.items():
        with problems.part():
            try:
                drop = read_drop(name, folder, top=top)
            except ConfigurationError:
                named = named_sources(folder)
                for facts in _described(recordings_in(folder), problems, count_duplicates):
                    view = named.get(str(facts["path"]))
                    described.append(({"drop": name, "view": view} if view else {}) | facts)
                raise
            for view in drop.experiment.sides:
                given = drop.view(view)
                fps = None if given.fps == "from_header" else float(given.fps)
                with problems.part():
                    facts = describe(
                        drop.source_path(view),
                        count_duplicates=count_duplicates,
                        fps=fps,
                        exposure_s=given.exposure_s,
                        frames=given.frames,
                    )
                    described.append({"drop": name, "view": view} | facts)
    return described
