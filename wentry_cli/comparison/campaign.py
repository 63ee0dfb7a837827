"""Compare the tables of a campaign with its truth folder, or with a hand-tracked table of one drop."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from wentry_cli.comparison.hand_table import read_hand_table, read_numbers
from wentry_cli.comparison.pairs import TOP_TABLE, TRUTH_TABLE, truths_of
from wentry_cli.comparison.statistics import ErrorStatistics, error_statistics
from wentry_cli.config.places import read_document
from wentry_cli.errors import InputError
from wentry_cli.records import DROP, read_json
from wentry_cli.schemas import TABLES
from wentry_cli.tables import has_table, read_table

Series = tuple[tuple[str, str, str], ...]
# table, column of the table, column of the truth
SERIES = (
    ("side", "stretch", "stretch"),
    ("side", "y_b_m", "y_b_m"),
    ("side", "separation_y_m", "separation_y_m"),
    ("stretch", "stretch", "stretch"),
    ("kinematics", "y_c_m", "y_c_m"),
    ("kinematics", "v_c_m_s", "v_c_m_s"),
    ("kinematics", "a_c_m_s2", "a_c_m_s2"),
    ("kinematics_model", "v_c_m_s", "v_c_m_s"),
)
OF_TOP = (("top", "radius_px", "radius_px"), ("top", "stretch", "stretch"))  # by the frames of the top view
# key of truth.yaml, table, column
NUMBERS = (
    ("u0_m_s", "summary", "impact_speed_m_s"),
    ("free_period_s", "summary", "period_s"),
    ("t_p_s", "summary", "t_p_s"),
    ("y_p_m", "summary", "y_p_m"),
    ("delta_u_over_u0", "summary", "delta_u_over_u0"),
    ("impact_time_s", "geometry", "impact_time_s"),
    ("scale_px_per_m", "geometry", "scale_px_per_m"),
    ("surface_y_px", "geometry", "surface_y_px"),
)
DOME_OVER = "dome_over_s"  # key of truth.yaml; measured, it is a row of events.csv
OF_CLOSURE = ("t_p_s", "y_p_m")
OF_IMPACT = ("u0_m_s", "surface_y_px")  # what meets no surface has neither
WORDS = (("seal_type", "seal_type"), ("pinch_off_cavity", "pinch_off_cavity"))


@dataclass(frozen=True)
class Comparison:
    """One line of the comparison; a single number has ``measurable`` 1."""

    drop: str
    table: str
    quantity: str
    unit: str
    errors: ErrorStatistics
    note: str = ""

    def row(self) -> dict[str, Any]:
        """Plain data for a table or JSON."""
        head = {"drop": self.drop, "table": self.table, "quantity": self.quantity, "unit": self.unit}
        return {**head, **asdict(self.errors), "note": self.note}


def compare(results: Path, truth: Path, only: Sequence[str] = ()) -> list[Comparison]:
    """Compare every drop of ``results`` that has a truth, or those named in ``only``.

    ``truth`` is a folder as ``wentry render`` writes it (drops with ``truth/``), one of its drops, or a hand-tracked
    table of one drop (see ``read_hand_table``). Raises ``InputError`` where nothing can be compared.
    """
    if (results / DROP).is_file():
        folder = results.absolute() if results.name in ("", "..") else results
        told = f"wentry compare {folder.parent} {truth} --drop {folder.name}"
        raise InputError(f"{results}: is the folder of one drop; give the one above it: {told}")
    drops = sorted(path.parent for path in results.glob(f"*/{DROP}"))
    unknown = sorted(set(only) - {folder.name for folder in drops})
    if unknown:
        known = ", ".join(folder.name for folder in drops)
        raise InputError(f"{results}: has no drop {unknown[0]}; its drops are {known or 'none'}")
    drops = [folder for folder in drops if not only or folder.name in only]
    if not truth.exists():
        raise InputError(f"{truth}: no such file or folder; give the folder that `wentry render` wrote, or a CSV")
    if truth.is_file():
        if len(drops) != 1:
            raise InputError(
                f"{truth}: a hand-tracked table is of one drop, but {results} holds {len(drops)}; name it with --drop"
            )
        accepted = tuple(dict.fromkeys(column for *_, column in SERIES))
        found = list(_against_table(drops[0], read_hand_table(truth, drops[0], accepted)))
    else:
        pairs = truths_of(results, [folder.name for folder in drops], truth)
        found = [line for drop, place in pairs.items() for line in _against_truth(results / drop, place)]
    if not found:
        raise InputError(f"{results}: holds no table to compare with {truth}; run `wentry run` on its videos first")
    return found


def _against_truth(folder: Path, truth: Path) -> Iterator[Comparison]:
    frame = _shown(truth / TRUTH_TABLE, SERIES)
    yield from _against_table(folder, frame)
    if (truth / TOP_TABLE).is_file():
        yield from _against_table(folder, _shown(truth / TOP_TABLE, OF_TOP), OF_TOP)
    numbers = read_document(truth / "truth.yaml").data
    yield from _numbers(folder, numbers, closed=not _after_clip(numbers.get("t_p_s"), frame))
    if not _after_clip(numbers.get(DOME_OVER), frame):
        yield from _dome_over(folder, numbers.get(DOME_OVER))


def _shown(table: Path, series: Series) -> pd.DataFrame:
    """The rows of a rendered ``table``; what a frame does not show is NaN."""
    frame = read_numbers(table, {"frame", *(column for *_, column in series)})
    if "frame" not in frame:
        raise InputError(f"{table}: has no column frame; give the folder that `wentry render` wrote")
    if "measurable" in frame:
        hidden = ~frame["measurable"].astype(str).str.lower().isin(["true", "1", "1.0"])
        frame.loc[hidden, [name for name in frame if name not in ("frame", "time_s", "t_s")]] = np.nan
    return frame


def _after_clip(time_s: Any, frame: pd.DataFrame) -> bool:
    """Whether something closes after the clip: that cannot be measured, and nobody is blamed for it."""
    return isinstance(time_s, int | float) and "t_s" in frame and bool(time_s > frame["t_s"].max())


def _against_table(folder: Path, truth: pd.DataFrame, series: Series = SERIES) -> Iterator[Comparison]:
    rigid = has_table(folder, "summary") and read_table(folder, "summary")["rigid"].iloc[0] == "true"
    for table, column, truth_column in series:
        if truth_column not in truth or not has_table(folder, table) or (column == "stretch" and rigid):
            continue
        measured = read_table(folder, table).merge(
            truth[["frame", truth_column]], on="frame", how="right", suffixes=("", "_truth")
        )
        name = f"{truth_column}_truth" if f"{truth_column}_truth" in measured else truth_column
        uncertainty = measured[f"{column}_unc"].to_numpy(float) if f"{column}_unc" in measured else None
        ok = (measured["status"] == "ok").fillna(False).to_numpy(bool) if "status" in measured else None
        errors = error_statistics(measured[column].to_numpy(float), measured[name].to_numpy(float), uncertainty, ok)
        if errors.measurable:
            yield Comparison(folder.name, table, column, _unit(table, column), errors)


def _numbers(folder: Path, truth: dict[str, Any], *, closed: bool) -> Iterator[Comparison]:
    kind = _kind(folder)
    for key, table, column in NUMBERS:
        wanted = None if kind == "free_flight" and key in OF_IMPACT else truth.get(key)
        if not isinstance(wanted, int | float) or not has_table(folder, table) or (key in OF_CLOSURE and not closed):
            continue
        row = read_table(folder, table).iloc[0]
        stated = np.array([row[f"{column}_unc"]], float) if f"{column}_unc" in row.index else None
        errors = error_statistics(np.array([row[column]], float), np.array([wanted], float), stated)
        yield Comparison(folder.name, table, column, _unit(table, column), errors)
    yield from _peaks(folder, truth.get("peaks") or [])
    if not has_table(folder, "summary"):
        return
    row = read_table(folder, "summary").iloc[0]
    for key, column in WORDS if kind == "water_entry" and closed else ():
        # only the cavity that closes at a neck at depth has a number
        if key in truth and not (key == "pinch_off_cavity" and truth.get("seal_type", "deep_seal") != "deep_seal"):
            measured, wanted = _word(row[column]), _word(truth[key])
            # nothing said of what there was is no wrong word, and nothing said of nothing is a right one
            silent = np.nan if wanted else 1.0
            hit = float(measured == wanted) if measured else silent
            errors = error_statistics(np.array([hit]), np.array([1.0]))
            yield Comparison(folder.name, "summary", column, "–", errors, f"{measured or '–'}; truth {wanted or '–'}")


def _kind(folder: Path) -> str:
    """The kind of the drop as it was processed; a damaged record is taken for an entry into water."""
    experiment = read_json(folder / DROP).get("experiment")
    return str(experiment.get("kind", "water_entry")) if isinstance(experiment, dict) else "water_entry"


def _peaks(folder: Path, peaks: list[float]) -> Iterator[Comparison]:
    """The greatest stretch of each period, all periods together."""
    if not peaks or not has_table(folder, "periods"):
        return
    found = read_table(folder, "periods").set_index("period").reindex(range(1, len(peaks) + 1))
    stated = found["stretch_peak_unc"].to_numpy(float)
    errors = error_statistics(found["stretch_peak"].to_numpy(float), np.array(peaks, float), stated)
    yield Comparison(folder.name, "periods", "stretch_peak", "1", errors)


def _dome_over(folder: Path, wanted: Any) -> Iterator[Comparison]:
    """When the crown has closed over the sphere."""
    if not isinstance(wanted, int | float) or _kind(folder) != "water_entry" or not has_table(folder, "events"):
        return
    events = read_table(folder, "events")
    found = events[events["event"] == "dome_over"].reset_index().reindex([0])
    errors = error_statistics(found["t_s"].to_numpy(float), np.array([wanted], float), found["t_s_unc"].to_numpy(float))
    yield Comparison(folder.name, "events", DOME_OVER, _unit("events", "t_s"), errors)


def _word(value: Any) -> str:
    return "" if value is None or pd.isna(value) or value == "none" else str(value)


def _unit(table: str, column: str) -> str:
    return next(item.unit for item in TABLES[table].columns if item.name == column)
