"""What a report is made from: the tables of a results folder, read with tolerance.

A table that is missing is empty; one that cannot be read is empty and noted. Nothing here measures or fits.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd

from wentry_cli.errors import WentryError
from wentry_cli.records import DROP, RUN, read_json, read_stages
from wentry_cli.schemas import TABLES
from wentry_cli.tables import has_table, read_table

DROP_TABLES = (
    "frames", "geometry", "top", "side", "cavity", "neck", "events", "stretch", "periods",
    "kinematics", "model", "model_fit", "kinematics_model", "forces", "summary",
)  # fmt: skip


@dataclass(frozen=True)
class DropResults:
    """One drop: its row of the summary and its tables."""

    name: str
    summary: Mapping[str, Any]
    tables: Mapping[str, pd.DataFrame]
    problems: tuple[str, ...] = ()
    configuration: Mapping[str, Any] = field(default_factory=dict)
    stages: Mapping[str, Any] = field(default_factory=dict)

    def table(self, name: str) -> pd.DataFrame:
        """Return a table of this drop, empty with its columns where it was not written."""
        found = self.tables.get(name)
        return pd.DataFrame(columns=TABLES[name].names) if found is None else found

    def number(self, column: str) -> float:
        """Return a number of the summary, NaN where it was not measured."""
        return as_number(self.summary.get(column))

    def text(self, column: str) -> str:
        """Return a word of the summary, empty where it was not written."""
        return as_text(self.summary.get(column))

    @property
    def kind(self) -> str:
        """Water entry, surface impact or free flight, as the contract writes them."""
        return self.text("kind")

    @property
    def rigid(self) -> bool:
        """Whether the sphere is rigid."""
        return self.text("rigid").lower() in {"true", "1", "yes"}

    @property
    def deformable_entry(self) -> bool:
        """Whether this is the water entry of a deformable sphere."""
        return self.kind == "water_entry" and not self.rigid

    @property
    def track_failure(self) -> str:
        """Why the stage track failed, without the drop's name; empty where it did not."""
        entry = self.stages.get("track")
        return as_text(entry.get("error")).removeprefix(f"{self.name}: ") if isinstance(entry, Mapping) else ""

    @property
    def seal(self) -> str:
        """Seal type, empty where there is none."""
        return self.text("seal_type")


@dataclass(frozen=True)
class Campaign:
    """All drops with the tables that belong to the campaign."""

    folder: Path
    drops: tuple[DropResults, ...]
    scaling: pd.DataFrame
    materials: pd.DataFrame
    table_1: pd.DataFrame
    compression: pd.DataFrame
    calibration: pd.DataFrame
    run: Mapping[str, Any] = field(default_factory=dict)
    problems: tuple[str, ...] = ()
    date: str = ""  # day on which the results were made, year-month-day

    def relation(self, name: str) -> dict[str, Any]:
        """Return the row of ``scaling.csv`` of a relation, empty where it was not fitted."""
        found = self.scaling[self.scaling["relation"] == name]
        return {} if found.empty else dict(found.iloc[0])

    def of(self, kind: str) -> list[DropResults]:
        """Return the drops of a kind."""
        return [drop for drop in self.drops if drop.kind == kind]


def doubts_of(drops: Iterable[DropResults]) -> str:
    """The drops whose measurements contradict what was told, and in what: ``a (fall before impact)``; else empty."""
    return ", ".join(f"{drop.name} ({drop.text('doubts')})" for drop in drops if drop.text("doubts"))


def as_number(value: Any) -> float:
    """Turn a cell into a float, NaN where it is empty or no number."""
    try:
        return math.nan if value is None or value is pd.NA else float(value)
    except (TypeError, ValueError):
        return math.nan


def as_text(value: Any) -> str:
    """Turn a cell into a word, empty where the cell is."""
    if value is None or value is pd.NA or (isinstance(value, float) and math.isnan(value)):
        return ""
    return str(value)


def read_campaign(results: Path, names: list[str], table_1: pd.DataFrame | None = None) -> Campaign:
    """Read what there is of the drops ``names`` and of their campaign from a results folder.

    ``table_1`` are the materials that the drops use, in the columns of ``materials.csv``.
    """
    problems: list[str] = []
    summary = _read(results, "summary", problems)
    rows = {as_text(row["drop"]): row for row in summary.to_dict("records")}
    drops = tuple(_read_drop(results / name, name, rows.get(name)) for name in names)
    return Campaign(
        folder=results,
        drops=drops,
        scaling=_read(results, "scaling", problems),
        materials=_read(results, "materials", problems),
        table_1=pd.DataFrame(columns=TABLES["materials"].names) if table_1 is None else table_1,
        compression=_read(results, "compression", problems),
        calibration=_read(results, "calibration", problems),
        run=read_json(results / RUN),
        problems=tuple(problems),
        date=_day(results),
    )


def _day(results: Path) -> str:
    """The day on which the tables of the campaign were written, empty without one; the report writes none of them."""
    tables = [results / f"{name}.csv" for name in ("summary", "scaling", "materials", "compression")]
    times = [path.stat().st_mtime for path in tables if path.is_file()]
    return time.strftime("%Y-%m-%d", time.localtime(max(times))) if times else ""


def _read_drop(folder: Path, name: str, row: dict[Any, Any] | None) -> DropResults:
    problems: list[str] = []
    tables = {table: _read(folder, table, problems) for table in DROP_TABLES if has_table(folder, table)}
    own = tables.get("summary")
    if row is None and own is not None and not own.empty:
        row = dict(own.iloc[0])
    experiment = read_json(folder / DROP).get("experiment")
    configuration = experiment if isinstance(experiment, dict) else {}
    summary = _configured(configuration) if row is None else {str(key): value for key, value in row.items()}
    return DropResults(name, summary, tables, tuple(problems), configuration, read_stages(folder))


def _configured(configuration: Mapping[str, Any]) -> dict[str, Any]:
    """What is known of a drop without a summary: what its configuration says."""
    sphere = configuration.get("sphere")
    sphere = sphere if isinstance(sphere, Mapping) else {}
    rigid = "true" if sphere.get("material") == "rigid" else "false"
    known = {"kind": configuration.get("kind"), "condition": configuration.get("condition"), "rigid": rigid}
    return known | {"diameter_m": sphere.get("diameter_m"), "sphere_id": sphere.get("id")}


def _read(folder: Path, name: str, problems: list[str]) -> pd.DataFrame:
    empty = pd.DataFrame(columns=TABLES[name].names)
    if not has_table(folder, name):
        return empty
    try:
        return read_table(folder, name)
    except WentryError as error:
        problems.append(str(error))
        return empty


PAPER_CASE = {"g_inf_pa": 6900.0, "diameter_m": 0.051, "impact_speed_m_s": 5.3}
NEAREST = (
    "nearest to the paper's case (G∞ = 6.9 kPa, D = 51 mm, U₀ = 5.3 m/s, deep seal), of those alike the one with the "
    "most measured frames"
)
ALIKE = 0.1  # sum of the logarithmic distances by which drops of one case differ


def example_drop(drops: Iterable[DropResults], needed: str) -> DropResults | None:
    """Choose the drop that single-drop panels show: with the table ``needed``, nearest to the paper's case.

    The paper shows G∞ = 6.9 kPa (Table 1), D = 51 mm, U₀ = 5.3 m/s with a deep seal. Of drops that are alike it is the
    one with the most measured frames.
    """
    able = _able(drops, needed)
    nearest = min(map(_distance_to_paper, able), default=0.0)
    alike = [drop for drop in able if _distance_to_paper(drop) <= nearest + ALIKE]
    return min(alike, key=lambda drop: (-drop.number("frames_measured"), drop.name), default=None)


def why_shown(drops: Iterable[DropResults], needed: str, having: str) -> str:
    """Why ``example_drop`` shows its drop, of those ``having`` what is drawn, in brackets; nothing of the only one."""
    return f" (of those with {having} the {NEAREST})" if len(_able(drops, needed)) > 1 else ""


def _able(drops: Iterable[DropResults], needed: str) -> list[DropResults]:
    return [drop for drop in drops if drop.deformable_entry and not drop.table(needed).empty]


def _distance_to_paper(drop: DropResults) -> float:
    gap = 0.0 if drop.seal == "deep_seal" else 5.0
    for column, aim in PAPER_CASE.items():
        value = drop.number(column)
        gap += abs(math.log(value / aim)) if math.isfinite(value) and value > 0 else 5.0
    return gap
