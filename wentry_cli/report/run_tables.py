"""How a run went, as rows of text: status words, failures, warnings, versions, recordings."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from wentry_cli.pipeline import CAMPAIGN_STAGES, STAGES, CampaignStage, Stage
from wentry_cli.provenance import digest_of
from wentry_cli.report.campaign import Campaign, DropResults, as_number, as_text
from wentry_cli.report.numbers import DASH, with_uncertainty
from wentry_cli.report.tabulation import TextTable


def status_table(campaign: Campaign) -> TextTable:
    """How often each status word stands in the tables of each drop."""
    rows = []
    for drop in campaign.drops:
        for name in ("frames", "side", "top", "kinematics", "periods", "events"):
            table = drop.table(name)
            if not table.empty:
                counts = table["status"].fillna("none").astype(str).value_counts()
                words = sorted(counts.items(), key=lambda pair: (pair[0] != "ok", -int(pair[1]), str(pair[0])))
                rows.append((drop.name, f"{name}.csv", ", ".join(f"{count} {word}" for word, count in words)))
    return TextTable(("drop", "table", "rows by status"), tuple(rows))


def failure_table(campaign: Campaign) -> TextTable:
    """What failed: drop, stage and the sentence that was shown."""
    rows: list[tuple[str, str, str]] = []
    given = campaign.run.get("failures")
    for drop, failure in sorted((given if isinstance(given, Mapping) else {}).items()):
        found = failure if isinstance(failure, Mapping) else {"sentence": failure}
        sentence = next((as_text(found[key]) for key in ("sentence", "error", "message") if key in found), "")
        rows.append((str(drop), as_text(found.get("stage")), sentence))
    named = {row[0] for row in rows}
    for drop in campaign.drops:
        for stage, entry in drop.stages.items():
            error = as_text(entry.get("error")) if isinstance(entry, Mapping) else ""
            if error and drop.name not in named:
                rows.append((drop.name, stage, error))
    rows += [("", "report", problem) for problem in campaign.problems]
    rows += [(drop.name, "report", problem) for drop in campaign.drops for problem in drop.problems]
    return TextTable(("drop", "stage", "what happened"), tuple(rows))


def warning_table(campaign: Campaign) -> TextTable:
    """What each stage of each drop warned of when it ran, then what the stages over all drops did.

    With it stands what is known of tables that are not those of today's files, as ``run.json`` has it.
    """
    over_all = campaign.run.get("stages")
    notes = campaign.run.get("notes")
    rows = [
        row
        for drop in campaign.drops
        for row in (*_warnings(drop.name, drop.stages, STAGES), *_notes(drop.name, notes))
    ]
    rows += _warnings("all drops", over_all if isinstance(over_all, Mapping) else {}, CAMPAIGN_STAGES)
    return TextTable(("drop", "stage", "warning"), tuple(rows))


def _notes(who: str, notes: Any) -> Iterator[tuple[str, str, str]]:
    for note in notes if isinstance(notes, list) else ():
        if isinstance(note, list) and len(note) == 3 and note[0] == who:
            yield who, as_text(note[1]), as_text(note[2])


def _warnings(
    who: str, record: Mapping[str, Any], stages: Iterable[Stage | CampaignStage]
) -> Iterator[tuple[str, str, str]]:
    for stage in stages:
        entry = record.get(stage.name)
        given = entry.get("warnings") if isinstance(entry, Mapping) else None
        yield from ((who, stage.name, as_text(sentence)) for sentence in (given if isinstance(given, list) else ()))


def provenance_table(campaign: Campaign) -> TextTable:
    """What made the results: version, command, and the versions of everything whose numbers reach the tables."""
    run = campaign.run
    rows = [(name, as_text(run[name])) for name in ("version", "command") if as_text(run.get(name))]
    environment = run.get("environment")
    versions = environment if isinstance(environment, Mapping) else {}
    rows += [(name, as_text(value)) for name, value in sorted(versions.items()) if name != "wentry"]
    return TextTable(("what", "value"), tuple(rows))


GEOMETRY_NUMBERS = (
    "fps", "exposure_s", "scale_px_per_m", "scale_px_per_m_unc", "scale_water_px_per_m", "scale_water_px_per_m_unc",
    "width_px", "height_px",
)  # fmt: skip
RECORDING_COLUMNS = (
    "drop, view", "frames", "pixels", "rate (1/s)", "exposure (µs)", "px/mm, air", "px/mm, water",
    "rate from", "scale from",
)  # fmt: skip


def recording_table(campaign: Campaign) -> TextTable:
    """How each drop and view was filmed: frames, rate, exposure and scale."""
    rows = [(f"{drop.name}, {view}", *_taken(drop, view, found)) for drop, view, found in _views(campaign)]
    return TextTable(RECORDING_COLUMNS, tuple(rows))


def input_table(campaign: Campaign) -> TextTable:
    """What was read for each drop and view: the source, the identity of the recording, the configuration's hash."""
    rows = []
    for drop, view, found in _views(campaign):
        identity = _mark(drop, f"recording {view}") or DASH
        rows.append((drop.name, view, as_text(found.get("source")), identity, digest_of(dict(drop.configuration))))
    return TextTable(("drop", "view", "source", "identity of the recording", "hash of the configuration"), tuple(rows))


def _views(campaign: Campaign) -> Iterator[tuple[DropResults, str, Mapping[str, Any]]]:
    """Every view of every drop with its part of the configuration."""
    for drop in campaign.drops:
        views = drop.configuration.get("views")
        for view, found in sorted((views if isinstance(views, Mapping) else {}).items()):
            if isinstance(found, Mapping):
                yield drop, str(view), found


def _taken(drop: DropResults, view: str, configured: Mapping[str, Any]) -> tuple[str, ...]:
    """Frames, rate, exposure and scales of a view as geometry.csv has them; before it exists, as configured."""
    table = drop.table("geometry")
    found = table[table["view"] == view].to_dict("records")
    row: Mapping[Any, Any] = found[0] if found else configured
    number = {name: as_number(row.get(name)) for name in GEOMETRY_NUMBERS}
    frames = int((drop.table("frames")["view"] == view).sum())
    scales = [
        with_uncertainty(1e-3 * number[name], 1e-3 * number[f"{name}_unc"])
        for name in ("scale_px_per_m", "scale_water_px_per_m")
    ]
    return (
        str(frames) if frames else DASH,
        f"{number['width_px']:.0f} × {number['height_px']:.0f}" if number["width_px"] > 0.0 else DASH,
        with_uncertainty(number["fps"], digits=6),
        with_uncertainty(1e6 * number["exposure_s"]),
        *scales,
        as_text(row.get("fps_source")).replace("_", " ") or DASH,
        as_text(row.get("scale_source")).replace("_", " ") or DASH,
    )


def _mark(drop: DropResults, key: str) -> str:
    ingest = drop.stages.get("ingest")
    marks = ingest.get("fingerprint") if isinstance(ingest, Mapping) else None
    return as_text(marks.get(key)) if isinstance(marks, Mapping) else ""
