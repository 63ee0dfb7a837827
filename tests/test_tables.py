"""Tables: the contract's columns, round trips, atomic writes."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wentry_cli import tables
from wentry_cli.errors import InputError
from wentry_cli.schemas import STATUS_WORDS, TABLES
from wentry_cli.tables import new_table, read_table, replacing, write_table, write_text

ROOT = Path(__file__).resolve().parent.parent
CONTRACT = {
    "frames": "view frame camera_frame time_s mean_level saturated_fraction status",
    "neck": "frame t_s neck y_m radius_m radius_m_unc",
    "events": "event index t_s t_s_unc y_m y_m_unc value status",
    "stretch": "frame t_s stretch stretch_unc source stretch_top stretch_side",
    "model": "t_s t_scaled_s stretch stretch_viscous",
    "cavity": "frame t_s wall y_m left_m right_m",
}


@pytest.mark.parametrize("name", CONTRACT)
def test_columns_are_those_of_the_contract(name: str) -> None:
    assert TABLES[name].names == CONTRACT[name].split()


def test_every_column_has_unit_kind_and_meaning() -> None:
    for table in TABLES.values():
        assert len(set(table.names)) == len(table.names)
        for column in table.columns:
            assert column.kind in ("float", "int", "text")
            assert column.unit
            assert column.meaning


def test_status_words_are_unique() -> None:
    assert len(set(STATUS_WORDS)) == len(STATUS_WORDS)


@given(st.lists(st.floats(allow_nan=True, allow_infinity=False, width=32), min_size=1, max_size=20))
def test_floats_survive_with_nine_digits(tmp_path_factory: pytest.TempPathFactory, values: list[float]) -> None:
    folder = tmp_path_factory.mktemp("table")
    write_table(folder, "model", new_table("model", {"t_s": values}))
    back = read_table(folder, "model")["t_s"].to_numpy(float)
    np.testing.assert_allclose(back, values, rtol=1e-8)


def test_a_table_has_the_bytes_that_pandas_would_write(tmp_path: Path) -> None:
    texts = ["ok", None, 'a "b", c']
    numbers = {"t_s": [0.1, np.nan, -1e-12], "t_s_unc": [1e300, 1 / 3, 123456789.25], "index": [1, None, 3]}
    frame = new_table("events", {"event": texts, "status": texts, **numbers})
    written = write_table(tmp_path, "events", frame)
    frame.to_csv(tmp_path / "other.csv", index=False, float_format="%.9g", lineterminator="\n")
    assert written.read_bytes() == (tmp_path / "other.csv").read_bytes()


def test_missing_values_are_empty_cells(tmp_path: Path) -> None:
    frame = new_table("neck", {"frame": [3], "t_s": [np.nan], "neck": [1]})
    path = write_table(tmp_path, "neck", frame)
    assert path.read_text() == "frame,t_s,neck,y_m,radius_m,radius_m_unc\n3,,1,,,\n"
    assert read_table(tmp_path, "neck")["t_s"].isna().all()


def test_a_table_that_was_read_before_is_read_as_it_is_now(tmp_path: Path) -> None:
    write_table(tmp_path, "neck", new_table("neck", {"frame": [3], "y_m": [0.5]}))
    mine = read_table(tmp_path, "neck")
    mine.loc[0, "y_m"] = 7.0  # of one who was given it, and of nobody else
    assert read_table(tmp_path, "neck")["y_m"].tolist() == [0.5]
    path = tmp_path / "neck.csv"
    path.write_text(path.read_text().replace("0.5", "0.6"))
    assert read_table(tmp_path, "neck")["y_m"].tolist() == [0.6]
    path.unlink()
    with pytest.raises(InputError, match="missing"):
        read_table(tmp_path, "neck")


def test_unknown_column_is_a_programmers_mistake(tmp_path: Path) -> None:
    with pytest.raises(KeyError, match="no column colour"):
        new_table("neck", {"colour": [1]})
    with pytest.raises(KeyError, match="unknown columns"):
        write_table(tmp_path, "neck", new_table("neck", {"frame": [1]}).assign(colour=2))


@pytest.mark.parametrize("value", [np.inf, -np.inf])
def test_an_infinite_number_is_a_programmers_mistake(tmp_path: Path, value: float) -> None:
    """Only NaN says that there is no number; no half-written table is left."""
    frame = new_table("neck", {"frame": [1, 2], "radius_m": [np.nan, 0.1], "radius_m_unc": [0.1, value]})
    with pytest.raises(ValueError, match=r"^neck\.csv: infinite numbers in radius_m_unc$"):
        write_table(tmp_path, "neck", frame)
    assert not list(tmp_path.iterdir())


def test_missing_table_names_the_stage(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"side\.csv: missing; run `wentry process` \(stage track\)"):
        read_table(tmp_path, "side")


def test_damaged_tables_are_refused(tmp_path: Path) -> None:
    (tmp_path / "neck.csv").write_text("frame,t_s\n1,2\n")
    with pytest.raises(InputError, match="column neck is missing"):
        read_table(tmp_path, "neck")
    (tmp_path / "neck.csv").write_text("frame,t_s,neck,y_m,radius_m,radius_m_unc\nx,,1,,,\n")
    with pytest.raises(InputError, match="not the table neck"):
        read_table(tmp_path, "neck")
    (tmp_path / "neck.csv").write_text("frame,t_s,neck,y_m,radius_m,radius_m_unc\n1,0.1,1,inf,,\n")
    with pytest.raises(InputError, match=r"column y_m holds inf.* run cavity again"):
        read_table(tmp_path, "neck")
    (tmp_path / "neck.csv").write_text("frame,t_s,neck,y_m,radius_m,radius_m_unc\n1,,1,,,\n2,,1,,,,,9\n")
    with pytest.raises(InputError, match=r"^[^\n]*saw 8\); run the stage cavity again$"):
        read_table(tmp_path, "neck")
    (tmp_path / "neck.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError):
        read_table(tmp_path, "neck")


def test_a_failed_write_leaves_the_old_file_and_no_other(tmp_path: Path) -> None:
    path = tmp_path / "page.txt"
    write_text(path, "old")

    def write_half() -> None:
        with replacing(path) as temporary:
            temporary.write_text("half")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        write_half()
    assert path.read_text() == "old"
    assert [item.name for item in tmp_path.iterdir()] == ["page.txt"]


def test_page_of_tables_is_current() -> None:
    sys.path.insert(0, str(ROOT / "docs"))
    try:
        import make_tables
    finally:
        sys.path.pop(0)
    assert make_tables.PAGE.read_text(encoding="utf-8") == make_tables.page(), "run `make tables`"


def test_a_long_table_is_not_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tables, "KEPT_BYTES", 10)
    write_table(tmp_path, "geometry", new_table("geometry", {"view": ["side"]}))
    assert list(read_table(tmp_path, "geometry")["view"]) == ["side"]
    assert tmp_path / "geometry.csv" not in tables._READ
    monkeypatch.undo()
    read_table(tmp_path, "geometry")
    assert tmp_path / "geometry.csv" in tables._READ
