"""Tables that are no longer what their stage wrote: somebody opened and saved them, or a copy was cut short."""

from __future__ import annotations

from pathlib import Path

from wentry_cli.pipeline import stages_of
from wentry_cli.provenance import digest_of_file
from wentry_cli.records import read_stages
from wentry_cli.tables import table_path


def edited_tables(folder: Path) -> dict[str, str]:
    """The stage of each table of the drop in ``folder`` that was changed after the stage had written it."""
    found: dict[str, str] = {}
    for stage, entry in read_stages(folder).items():
        for name, digest in entry.get("outputs", {}).items():
            today = digest_of_file(table_path(folder, name))
            if today and today != digest:
                found[name] = stage
    return found


def warn_of_edits(folder: Path) -> list[str]:
    """A sentence for each table of the drop in ``folder`` that was changed after its stage had written it."""
    fits = {stage.name for stage in stages_of("fit")}
    used = "its numbers are used as they are, `wentry run` or `wentry process` makes it anew"
    shown = "a report shows it as it is, `wentry fit` makes it anew"
    return [
        f"{table_path(folder, name)}: not as the stage {stage} wrote it; {shown if stage in fits else used}"
        for name, stage in edited_tables(folder).items()
    ]


def edits_to_show(folder: Path) -> list[tuple[str, str]]:
    """The same for a report: the stage, and a sentence that does not depend on where ``folder`` is."""
    fits = {stage.name for stage in stages_of("fit")}
    used = "its numbers are shown, and used, as they are"
    return [
        (stage, f"{name}.csv is not as this stage wrote it; {'it is shown as it is' if stage in fits else used}")
        for name, stage in edited_tables(folder).items()
    ]
