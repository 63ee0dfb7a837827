"""``corrections.yaml`` beside ``experiment.yaml``: what a person decided by hand about frames and events."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from wentry_cli.config.messages import validate
from wentry_cli.config.models import Part
from wentry_cli.config.places import read_document
from wentry_cli.config.values import Index, Number, Positive, Uncertainty

CORRECTIONS = "corrections.yaml"
TOP_COLUMNS = ("stretch", "stretch_unc")


class FrameCorrection(Part):
    """Values by hand for one frame, or a range of frames that are not to be used."""

    view: Literal["side", "top"]
    frames: tuple[Index, Index]
    exclude: bool = False
    stretch: Positive | None = None
    stretch_unc: Uncertainty | None = None
    y_b_m: Number | None = None
    y_b_m_unc: Uncertainty | None = None
    separation_y_m: Number | None = None

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

    @property
    def by_column(self) -> dict[str, float]:
        """The values by column name."""
        given = self.model_dump(exclude={"view", "frames", "exclude"}, exclude_none=True)
        return {name: float(value) for name, value in given.items()}


class EventCorrection(Part):
    """An event by hand; the impact is given on the camera clock, the others after impact."""

    event: Literal["impact", "dome_over", "second_cavity", "pinch_off"]
    index: Annotated[int, Field(strict=True, ge=1)] = 1
    time_s: Number | None = None
    t_s: Number | None = None
    t_s_unc: Uncertainty = 0.0
    y_m: Number | None = None
    value: Literal["deep_seal", "surface_seal", "sphere_seal"] | None = None

    @model_validator(mode="after")
    def _has_its_time(self) -> EventCorrection:
        wanted = "time_s" if self.event == "impact" else "t_s"
        if getattr(self, wanted) is None:
            raise ValueError(f"{wanted} is needed for {self.event}")
        unused: tuple[str, ...] = ("t_s", "y_m", "value") if self.event == "impact" else ("time_s",)
        unused += () if self.event in ("impact", "pinch_off") else ("value",)
        given = [name for name in unused if getattr(self, name) is not None]
        if given:
            raise ValueError(f"{given[0]} has no meaning for {self.event}; remove it")
        return self


class Corrections(Part):
    """Everything that was decided by hand about one drop."""

    frames: tuple[FrameCorrection, ...] = ()
    events: tuple[EventCorrection, ...] = ()

    @property
    def impact(self) -> EventCorrection | None:
        """The impact by hand, if there is one."""
        return next((event for event in self.events if event.event == "impact"), None)


def read_corrections(folder: Path) -> Corrections:
    """The corrections of the drop in ``folder``, empty where it has none."""
    path = folder / CORRECTIONS
    return validate(Corrections, read_document(path)) if path.is_file() else Corrections()
