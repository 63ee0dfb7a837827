"""Which ``campaign.yaml`` a drop inherits from, and which ``materials.yaml`` holds for it.

The nearest, but none that lies far above what was asked for.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

CAMPAIGN = "campaign.yaml"
MATERIALS = "materials.yaml"
MOST_ABOVE = 3  # folders above VIDEO_DIR: campaign/day/condition/drop, run alone


@dataclass(frozen=True)
class Shared:
    """The file that holds (``path``), or one that lies too far above to be meant (``beyond``).

    ``above`` tells whether ``path`` lies above VIDEO_DIR, so that the user should hear of it.
    """

    path: Path | None = None
    above: bool = False
    beyond: Path | None = None


def find_shared(folder: Path, top: Path, name: str = CAMPAIGN) -> Shared:
    """The file ``name`` for the drop in ``folder``, which was found in VIDEO_DIR ``top``.

    From the drop up to VIDEO_DIR the nearest holds, at any depth and by the path as it was walked. Above VIDEO_DIR,
    where a drop or a part of a campaign is run alone, one holds that is at most ``MOST_ABOVE`` folders away.
    """
    here, end = Path(os.path.abspath(folder)), Path(os.path.abspath(top))
    within = [level for level in (here, *here.parents) if level.is_relative_to(end)]
    for level in within:
        if (level / name).is_file():
            return Shared(level / name)
    for distance, level in enumerate(end.resolve().parents, start=1):
        if (level / name).is_file():
            near = distance <= MOST_ABOVE
            return Shared(level / name, above=True) if near else Shared(beyond=level / name)
    return Shared()


def find_materials(folder: Path, top: Path, campaign: Path | None) -> Shared:
    """The ``materials.yaml`` for the drop in ``folder``: beside its ``campaign.yaml``, else the nearest."""
    beside = (folder if campaign is None else campaign.parent) / MATERIALS
    return Shared(beside) if beside.is_file() else find_shared(folder, top, MATERIALS)


def notes_of(shared: Shared, top: Path, gives: str = "the keys that the drops share") -> list[str]:
    """What the user should hear of a file above VIDEO_DIR that ``gives`` something, in a sentence."""
    if shared.above:
        return [f"{shared.path}, above {top}, gives {gives}"]
    if shared.beyond is not None:
        return [
            f"warning: {shared.beyond} is not used: it lies more than {MOST_ABOVE} folders above {top}; if it is "
            f"meant, give {shared.beyond.parent} as VIDEO_DIR and choose with --drop"
        ]
    return []
