"""``report.html``: one file with everything in it; nothing is fetched when it is opened."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files

from jinja2 import Environment

from wentry_cli.report import regressions, run_tables, tabulation
from wentry_cli.report.campaign import Campaign
from wentry_cli.report.drawing import Drawn
from wentry_cli.report.light_limit import light_limit_table
from wentry_cli.report.panel import NotDrawn
from wentry_cli.report.symbols import as_breakable, as_html
from wentry_cli.report.words import MEANINGS

UNCERTAINTIES = (
    "Every ± and every column _unc is a standard uncertainty (k = 1): about two thirds of repeated measurements fall "
    "within it. It holds the noise of the images as the fits see it, carried through the definition of each number; "
    "quantities given by hand enter with the uncertainty given for them. Points of repeated drops show the mean with "
    "the sample standard deviation of the repeats, never less than the uncertainty of the mean. Intervals of "
    "regressions are 95 %, Student's t on the uncertainty beside them: spheres count, or conditions, not drops.",
    "Common to all frames of a drop: the row of the surface and the scale, below the surface the optical axis. They "
    "move all heights, and with the surface the moment of impact, together, and are in the uncertainty of every one of "
    "them; against each other the frames are known as well as the columns _unc_random say.",
    "Common to all drops of a kind: whether a sphere rings about λ = 1 or about a mean of its own. It is one "
    "uncertainty in the ends of all periods and in every ΔU/U₀, which may all be off to the same side; it does not "
    "average out over drops.",
    "Not contained: that a real sphere is no exact ellipsoid, beyond what the residuals of the fit tell; grey levels "
    "that do not follow the light (the gamma of a recording), which move every outline; the diameter, where its "
    "uncertainty is not stated; G∞, where the materials give it without one.",
)


@dataclass(frozen=True)
class Content:
    """Everything that the page and the PDF show, in order."""

    campaign: Campaign
    figures: Sequence[Drawn]  # of the campaign, in the order of the paper
    details: Sequence[Drawn]  # of single drops
    missing: Sequence[NotDrawn]


def write_page(content: Content) -> str:
    """Fill the template; every word that comes from names, tables and messages is escaped."""
    environment = Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
    environment.filters["symbols"] = as_html
    environment.filters["breakable"] = as_breakable
    template = environment.from_string(files("wentry_cli.report").joinpath("page.html.j2").read_text(encoding="utf-8"))
    campaign = content.campaign
    html: str = template.render(
        title=page_title(campaign),
        headline=headline(campaign),
        figures=[_shown(drawn) for drawn in content.figures],
        drops=[
            {
                "name": drop.name,
                "doubts": drop.text("doubts"),
                "figures": [_shown(drawn) for drawn in content.details if drawn.panel.drop == drop.name],
            }
            for drop in campaign.drops
        ],
        details=content.details,
        missing=content.missing,
        drop_table=tabulation.drop_table(campaign),
        check_table=tabulation.check_table(campaign),
        check_note=tabulation.check_note(campaign),
        entry_table=tabulation.entry_table(campaign),
        flight_table=tabulation.flight_table(campaign),
        regressions=regressions.regression_table(campaign),
        calibrated=tabulation.material_table(campaign.materials),
        table_1=tabulation.material_table(campaign.table_1),
        statuses=run_tables.status_table(campaign),
        meanings=MEANINGS,
        failures=run_tables.failure_table(campaign),
        warnings=run_tables.warning_table(campaign),
        provenance=run_tables.provenance_table(campaign),
        uncertainties=UNCERTAINTIES,
        light=light_limit_table(campaign),
        recordings=run_tables.recording_table(campaign),
        inputs=run_tables.input_table(campaign),
    )
    return html


def page_title(campaign: Campaign) -> str:
    """Name what was filmed: ``Water entry of deformable spheres and free flight``."""
    entries, parts = campaign.of("water_entry"), []
    if entries:
        soft = not all(drop.rigid for drop in entries)
        parts.append(f"water entry of {'deformable' if soft else 'rigid'} spheres")
    if campaign.of("surface_impact"):
        parts.append("impact on a rigid surface")
    if campaign.of("free_flight"):
        parts.append("free flight")
    if not campaign.drops and not campaign.compression.empty:
        parts.append("compression of spheres")
    text = (
        ", ".join(parts[:-1]) + (" and " if len(parts) > 1 else "") + parts[-1] if parts else "measurement of spheres"
    )
    return text[0].upper() + text[1:]


def headline(campaign: Campaign) -> str:
    """Count the drops: ``6 drops: 5 water entry (1 rigid), 1 free flight``."""
    parts = []
    for kind in ("water_entry", "surface_impact", "free_flight"):
        found = campaign.of(kind)
        rigid = sum(drop.rigid for drop in found)
        note = f" ({rigid} rigid)" if rigid and kind == "water_entry" else ""
        parts += [f"{len(found)} {kind.replace('_', ' ')}{note}"] if found else []
    unknown = len(campaign.drops) - sum(len(campaign.of(k)) for k in ("water_entry", "surface_impact", "free_flight"))
    parts += [f"{unknown} without a summary"] if unknown else []
    count = len(campaign.drops)
    if not count:
        return "no drops"
    return f"{count} drop{'s' if count != 1 else ''}: " + ", ".join(parts)


def _shown(drawn: Drawn) -> dict[str, str | bool]:
    panel = drawn.panel
    data = base64.b64encode(drawn.svg).decode("ascii")
    return {
        "key": panel.key,
        "numbered": panel.key[0].isdigit(),
        "title": panel.title,
        "caption": panel.caption,
        "stem": panel.stem,
        "wide": panel.size[0] > 5.0,
        "picture": f"data:image/svg+xml;base64,{data}",
    }
