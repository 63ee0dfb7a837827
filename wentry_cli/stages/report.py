"""The report stage: every figure that the tables allow, one page, one PDF."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import pandas as pd

from wentry_cli.config.campaign import Drop
from wentry_cli.config.materials import Material, find_material
from wentry_cli.errors import WentryError
from wentry_cli.progress import tick
from wentry_cli.provenance import digest_of
from wentry_cli.records import STAGES, read_json
from wentry_cli.report.campaign import Campaign, read_campaign
from wentry_cli.report.document import write_document
from wentry_cli.report.drawing import save_panel
from wentry_cli.report.film_strips import OpenView, film_strips
from wentry_cli.report.letters import lacking
from wentry_cli.report.page import Content, write_page
from wentry_cli.report.panel import NotDrawn, Panel, merged
from wentry_cli.report.panels import campaign_panels, drop_panels
from wentry_cli.schemas import TABLES
from wentry_cli.stages.ingest import open_view
from wentry_cli.tables import write_text

FIGURES = "figures"
logger = logging.getLogger(__name__)


def run(results: Path, drops: list[Drop]) -> None:
    """Write ``report.html``, ``report.pdf`` and ``figures/`` into ``results``.

    Figures of an earlier report that are not drawn any more are removed. Raises ``InputError`` where ``results`` cannot
    be written.
    """
    campaign = read_campaign(results, [drop.name for drop in drops], table_1(results, drops))
    _tell_lacking(campaign)
    made_of_drops = _by_drop(campaign, _opener(drops))
    made = [*campaign_panels(campaign), *made_of_drops]
    panels = [panel for panel in made if isinstance(panel, Panel)]
    figures = results / FIGURES
    _sweep(figures, {panel.stem for panel in panels})
    drawn = []
    for count, panel in enumerate(panels, start=1):
        drawn.append(save_panel(panel, figures))
        tick(count, len(panels) + 1)
    own = [one for one in drawn if one.panel in made_of_drops]
    content = Content(
        campaign=campaign,
        figures=[one for one in drawn if one not in own],
        details=own,
        missing=merged([one for one in made if isinstance(one, NotDrawn)]),
    )
    write_document(content, results / "report.pdf")
    write_text(results / "report.html", write_page(content))
    tick(len(panels) + 1, len(panels) + 1)


def _tell_lacking(campaign: Campaign) -> None:
    """Warn of letters in names that figures and PDF cannot show."""
    names = [drop.name + drop.text("sphere_id") for drop in campaign.drops]
    letters = lacking("".join([*names, *campaign.materials["material"].fillna("").astype(str)]))
    if letters:
        logger.warning(
            "report: the font of the figures has no %s, boxes stand for them in figures/ and report.pdf; report.html "
            "writes names in full", " ".join(letters[:12]) + (" …" if len(letters) > 12 else "")
        )  # fmt: skip


def table_1(results: Path, drops: list[Drop]) -> pd.DataFrame:
    """The materials that the drops use, a row each, in the columns of ``materials.csv``.

    Below a material that was calibrated stands what its file gives: for the paper's spheres, Table 1. One that the
    model of a drop has not used yet says so under ``source``.
    """
    rows: dict[tuple[str, int], dict[str, Any]] = {}
    waiting: set[tuple[str, int]] = set()
    for drop in drops:
        name, size = drop.experiment.sphere.material or "", drop.experiment.sphere.diameter_m
        for place, material in enumerate((drop.material, _given(drop))):
            if material is not None:
                known = material.model_dump()
                row = {column: known.get(column) for column in TABLES["materials"].names}
                rows[name, place] = row | {"material": name, "diameter_m": size}
        if drop.material is not None and not _fitted_with(results, drop, drop.material):
            waiting.add((name, 0))
    for key in waiting:
        rows[key]["source"] = f"{rows[key]['source'] or 'materials.yaml'}, not yet fitted with"
    return pd.DataFrame.from_records([rows[key] for key in sorted(rows)], columns=TABLES["materials"].names)


def _fitted_with(results: Path, drop: Drop, material: Material) -> bool:
    """Whether the model of a drop was made with this material; also where a drop has none to be made."""
    model = read_json(results / drop.name / STAGES).get("model")
    marks = model.get("fingerprint") if isinstance(model, dict) else None
    return not isinstance(marks, dict) or marks.get("material") == digest_of(material.model_dump(mode="json"))


def _given(drop: Drop) -> Material | None:
    """The material of a calibrated drop as its file has it; nothing where that is gone."""
    if drop.material is None or not (drop.material.source or "").startswith("materials.csv"):
        return None
    try:
        return find_material(drop.experiment.sphere.material, drop.materials_path)
    except WentryError:
        return None


def _by_drop(campaign: Campaign, open_view: OpenView) -> list[Panel | NotDrawn]:
    sheets = drop_panels(campaign)
    strips = [strip for drop in campaign.drops for strip in film_strips(drop, open_view)]
    return [*strips, *sheets]


def _opener(drops: list[Drop]) -> OpenView:
    known = {drop.name: drop for drop in drops}
    return lambda name, view: open_view(known[name], view).recording


def _sweep(figures: Path, stems: set[str]) -> None:
    for path in figures.glob("*.*") if figures.is_dir() else []:
        if path.suffix in {".svg", ".png", ".csv"} and path.stem not in stems:
            path.unlink()
