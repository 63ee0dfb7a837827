"""What is found again below the surface must be confirmed: by its neighbours in time, or by its own outline."""

from __future__ import annotations

from collections.abc import Sequence

from wentry_cli.tracking.sighting import Sighting
from wentry_cli.tracking.wet_radius import LARGEST_GATE

NEIGHBOUR_FRAMES = 3
MOST_ALONE = 2


def without_unconfirmed(sightings: Sequence[Sighting]) -> list[Sighting]:
    """Call poor what was seen in one or two frames alone while much of the outline spoke against it.

    A path that was lost is searched for with many shapes in all of the picture, and one of them may fit something by
    chance. The sphere itself is seen again in the next frames, or with an outline that agrees; frames further apart
    than ``NEIGHBOUR_FRAMES`` are no neighbours.
    """
    kept = list(sightings)
    good = [index for index, item in enumerate(kept) if item.ok]
    for group in _neighbours(kept, good):
        if len(group) > MOST_ALONE:
            continue
        for index in group:
            fit = kept[index].fit
            if fit is not None and fit.gated_fraction > LARGEST_GATE:
                kept[index] = kept[index]._replace(status="poor_fit")
    return kept


def _neighbours(sightings: Sequence[Sighting], good: Sequence[int]) -> list[list[int]]:
    """The places ``good`` in groups of frames that follow each other closely."""
    groups: list[list[int]] = []
    for index in good:
        if groups and sightings[index].frame - sightings[groups[-1][-1]].frame <= NEIGHBOUR_FRAMES:
            groups[-1].append(index)
        else:
            groups.append([index])
    return groups
