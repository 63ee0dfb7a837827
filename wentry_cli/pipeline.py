"""The stages in order, of a drop and of the campaign: what each reads and writes, and which scenes need it.

A stage that a scene does not need does not run and writes nothing; ``why_not`` says why in a few words.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from wentry_cli.config.campaign import Drop

Reason = str | None


@dataclass(frozen=True)
class Stage:
    """One stage of one drop.

    ``reads`` and ``writes`` are table names; ``keys`` are the parts of the configuration that the result depends on
    (dotted, properties too; ``material`` for the parameters of the material, one of them by its name);
    ``frames`` tells whether the recording is read again; ``why_not`` gives the reason why a drop does not need it.
    """

    name: str
    command: str
    summary: str
    reads: tuple[str, ...]
    writes: tuple[str, ...]
    keys: tuple[str, ...]
    frames: bool
    why_not: Callable[[Drop], Reason]


def _always(drop: Drop) -> Reason:
    del drop
    return None


def _needs_cavity(drop: Drop) -> Reason:
    if drop.experiment.kind != "water_entry":
        return f"{drop.experiment.kind} has no cavity"
    return None if drop.experiment.views.side else "the cavity is seen in the side view, which was not filmed"


def _needs_stretch(drop: Drop) -> Reason:
    if drop.experiment.kind == "free_flight":
        return "a free flight has no oscillation"
    return "a rigid sphere does not stretch" if drop.experiment.sphere.rigid else None


def _needs_kinematics(drop: Drop) -> Reason:
    if drop.experiment.kind == "surface_impact":
        return "a drop on a rigid surface is analysed by its stretch alone"
    if drop.experiment.kind == "water_entry" and drop.experiment.views.side is None:
        return "the height is seen in the side view, which was not filmed"
    return None


def _needs_model(drop: Drop) -> Reason:
    reason = _needs_stretch(drop)
    if reason is None and drop.experiment.kind == "water_entry" and drop.experiment.views.side is None:
        return "the model serves y_c, which needs the side view"
    if reason is None and drop.material is None:
        return "the material is not known"
    return reason


_SPHERE = ("sphere.diameter_m", "sphere.diameter_m_unc", "sphere.rigid")

STAGES: tuple[Stage, ...] = (
    Stage(
        "ingest", "process", "list the frames of each recording, their times and levels",
        (), ("frames",), ("views",), True, _always,
    ),
    Stage(
        "track", "process", "fit circle and ellipse, bottom, separation line, scale, impact time",
        ("frames",), ("geometry", "top", "side"),
        ("kind", *_SPHERE, "gravity_m_s2", "views", "drop", "analysis.tracking", "analysis.min_frames"), True, _always,
    ),
    Stage(
        "cavity", "process", "cavity profile, necks, pinch-off, dome-over",
        ("frames", "geometry", "top", "side"), ("cavity", "neck", "events"),
        ("kind", *_SPHERE, "gravity_m_s2", "views"), True, _needs_cavity,
    ),
    Stage(
        "stretch", "process", "merge both views to λ(t), find its periods",
        ("geometry", "top", "side", "events"), ("stretch", "periods"), ("kind", *_SPHERE, "views"), False,
        _needs_stretch,
    ),
    Stage(
        "kinematics", "process", "position, velocity and acceleration with error bars",
        ("geometry", "top", "side", "events", "stretch", "periods"), ("kinematics",),
        ("kind", *_SPHERE, "sphere.density", "gravity_m_s2", "views", "analysis", "material.g_inf_pa"), False,
        _needs_kinematics,
    ),
    Stage(
        "model", "fit", "viscoelastic model from the first peak, scaled in time",
        ("geometry", "side", "stretch", "periods", "kinematics", "events"),
        ("model", "model_fit", "kinematics_model"),
        ("kind", "sphere", "gravity_m_s2", "analysis", "material"), False, _needs_model,
    ),
    Stage(
        "summary", "fit", "the numbers of the drop and its force coefficients",
        (
            "frames", "geometry", "side", "top", "events", "neck", "stretch", "periods", "kinematics", "model",
            "model_fit", "kinematics_model",
        ),
        ("forces", "summary"),
        (
            "kind", "condition", "repeat", "sphere", "liquid", "gravity_m_s2", "gravity_m_s2_unc", "drop", "views",
            "analysis", "material",
        ),
        False, _always,
    ),
)  # fmt: skip


@dataclass(frozen=True)
class CampaignStage:
    """One stage over all drops of a RESULTS folder.

    ``drop_reads`` are tables of each drop, ``reads`` tables of RESULTS, ``writes`` patterns of files below RESULTS;
    ``shows_all`` tells whether it shows everything there is, also of drops that failed: their configuration, their
    recordings, versions and failures. Otherwise it works on those drops alone that have all of ``drop_reads``.
    """

    name: str
    command: str
    summary: str
    drop_reads: tuple[str, ...]
    reads: tuple[str, ...]
    writes: tuple[str, ...]
    shows_all: bool = False

    def uses(self, file: str) -> bool:
        """Whether the table ``file`` (``drop/name.csv``, or ``name.csv`` in RESULTS) is read."""
        *below, name = file.removesuffix(".csv").split("/")
        return name in (self.drop_reads if below else self.reads)


CAMPAIGN_STAGES: tuple[CampaignStage, ...] = (
    CampaignStage(
        "scaling", "fit", "all summaries in one table, regressions over the campaign",
        ("summary",), (), ("summary.csv", "scaling.csv"),
    ),
    CampaignStage(
        "report", "report", "figures, page and PDF",
        tuple(dict.fromkeys(name for stage in STAGES for name in stage.writes)),
        ("summary", "scaling", "materials", "compression", "calibration"),
        ("report.html", "report.pdf", "figures/*.*"), shows_all=True,
    ),
)  # fmt: skip

KERNELS = {"track": "contours", "cavity": "cavity", "model": "mechanics"}  # the room whose kernels a stage calls first

_ORDER = [*(stage.name for stage in STAGES), *(stage.name for stage in CAMPAIGN_STAGES)]


def _is_within(name: str, until: str | None) -> bool:
    return until is None or _ORDER.index(name) <= _ORDER.index(until)


def stages_of(*commands: str, until: str | None = None) -> list[Stage]:
    """The stages of a drop that the given commands run, in order, ending with ``until``."""
    return [stage for stage in STAGES if stage.command in commands and _is_within(stage.name, until)]


def campaign_stages_of(*commands: str, until: str | None = None) -> list[CampaignStage]:
    """The stages of the campaign that the given commands run, in order, ending with ``until``."""
    return [stage for stage in CAMPAIGN_STAGES if stage.command in commands and _is_within(stage.name, until)]
