"""``corrections.yaml`` beside ``experiment.yaml``: what a person decided by hand about frames and events."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Literal

from pydantic import model_validator

from wentry_cli.config.messages import validate
from wentry_cli.config.models import Experiment, Part
from wentry_cli.config.places import Document, KeyPath, read_document
from wentry_cli.config.values import (
    AfterImpact,
    Index,
    Level,
    LevelUncertainty,
    Number,
    Stretch,
    StretchUncertainty,
    TimeUncertainty,
    Which,
)
from wentry_cli.errors import ConfigurationError

CORRECTIONS = "corrections.yaml"
TOP_COLUMNS = ("stretch", "stretch_unc")


class FrameCorrection(Part):
    """Values by hand for one frame, or a range of frames that are not to be used."""

    view: Literal["side", "top"]
    frames: tuple[Index, Index]
    exclude: bool = False
    stretch: Stretch | None = None
    stretch_unc: StretchUncertainty | None = None
    y_b_m: Level | None = None
    y_b_m_unc: LevelUncertainty | None = None
    separation_y_m: Level | None = None
    separation_y_m_unc: LevelUncertainty | None = None

    @model_validator(mode="after")
    def _says_one_thing(self) -> FrameCorrection:
        if self.exclude == bool(self.by_column):
            raise ValueError("give either `exclude: true` or values such as y_b_m and stretch")
        if self.frames[0] > self.frames[1]:
            raise ValueError(f"frames: the first frame {self.frames[0]} lies after the last {self.frames[1]}")
        foreign = [name for name in self.by_column if self.view == "top" and name not in TOP_COLUMNS]
        if foreign:
            raise ValueError(f"{foreign[0]} is not measured in the top view; correct it in the side view")
        return self

    def overrules(self, other: FrameCorrection) -> bool:
        """Whether both say something about one cell of a table, so that the last would win unseen."""
        apart = self.frames[0] > other.frames[1] or other.frames[0] > self.frames[1]
        if apart or self.view != other.view:
            return False
        return self.exclude or other.exclude or bool(self.by_column.keys() & other.by_column.keys())

    @property
    def by_column(self) -> dict[str, float]:
        """The values by column name."""
        given = self.model_dump(exclude={"view", "frames", "exclude"}, exclude_none=True)
        return {name: float(value) for name, value in given.items()}


class EventCorrection(Part):
    """An event by hand; the impact is given on the camera clock, the others after impact."""

    event: Literal["impact", "dome_over", "second_cavity", "pinch_off"]
    index: Which = 1
    time_s: Number | None = None
    t_s: AfterImpact | None = None
    t_s_unc: TimeUncertainty | None = None
    y_m: Level | None = None
    y_m_unc: LevelUncertainty | None = None
    value: Literal["deep_seal", "surface_seal", "sphere_seal"] | None = None

    @model_validator(mode="after")
    def _has_its_time(self) -> EventCorrection:
        wanted = "time_s" if self.event == "impact" else "t_s"
        if getattr(self, wanted) is None:
            raise ValueError(f"{wanted} is needed for {self.event}")
        unused: tuple[str, ...] = ("t_s", "y_m", "y_m_unc", "value") if self.event == "impact" else ("time_s",)
        unused += () if self.event in ("impact", "pinch_off") else ("value",)
        given = [name for name in unused if getattr(self, name) is not None]
        if given:
            raise ValueError(f"{given[0]} has no meaning for {self.event}; remove it")
        if self.y_m_unc is not None and self.y_m is None:
            raise ValueError("y_m_unc has no meaning without y_m; give both or neither")
        if self.event == "impact" and self.index > 1:
            raise ValueError("index has no meaning for impact: there is but one; remove it")
        if self.value == "deep_seal" and self.y_m is not None and self.y_m >= 0:
            raise ValueError(f"y_m: a deep_seal lies below the surface, so y_m is negative, not {self.y_m:g}")
        return self


class Corrections(Part):
    """Everything that was decided by hand about one drop."""

    frames: tuple[FrameCorrection, ...] = ()
    events: tuple[EventCorrection, ...] = ()

    @property
    def impact(self) -> EventCorrection | None:
        """The impact by hand, if there is one."""
        return next((event for event in self.events if event.event == "impact"), None)


def read_corrections(folder: Path, experiment: Experiment) -> Corrections:
    """The corrections of the drop in ``folder``, empty where it has none.

    Raises ``ConfigurationError`` with every place where they are wrong, have no effect on ``experiment`` or overrule
    each other; what only the clip tells is for ``wentry_cli.runner.in_clip``.
    """
    path = folder / CORRECTIONS
    if not path.is_file():
        return Corrections()
    document = read_document(path)
    given = validate(Corrections, document)
    problems = [*_of_frames(given, experiment, document), *_of_events(given, experiment)]
    lines = [f"{document.place(key)}: error: {'.'.join(map(str, key))}: {told}" for key, told in problems]
    if lines:
        raise ConfigurationError("\n".join(lines))
    return given


def _of_frames(given: Corrections, experiment: Experiment, document: Document) -> Iterator[tuple[KeyPath, str]]:
    for number, entry in enumerate(given.frames):
        if entry.view not in experiment.sides:
            yield ("frames", number, "view"), f"the {entry.view} view was not filmed; remove the entry"
        if experiment.kind == "free_flight" and not entry.exclude:
            yield ("frames", number), "has no effect on a free flight, whose motion is that of the centre; use exclude"
        for earlier, other in enumerate(given.frames[:number]):
            if entry.overrules(other):
                line = document.places["frames", earlier].line
                yield ("frames", number), f"corrects frames that line {line} corrects too; keep one of the two"


def _of_events(given: Corrections, experiment: Experiment) -> Iterator[tuple[KeyPath, str]]:
    flight = experiment.kind == "free_flight"
    no_cavity = experiment.kind != "water_entry" or experiment.views.side is None
    for number, entry in enumerate(given.events):
        if flight or (no_cavity and entry.event != "impact"):
            why = "a free flight has no events" if flight else "no cavity is measured in this drop"
            yield ("events", number, "event"), f"{entry.event} has no effect: {why}; remove it"
        if any((entry.event, entry.index) == (other.event, other.index) for other in given.events[:number]):
            which = entry.event if entry.event == "impact" else f"{entry.event} {entry.index}"
            yield ("events", number), f"{which} stands twice; keep one"
