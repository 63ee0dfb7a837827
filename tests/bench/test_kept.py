"""A folder with accuracy.md: one chapter is renewed, the others stay as they are."""

from __future__ import annotations

import math
from dataclasses import astuple, replace
from pathlib import Path

import pytest

from wentry_cli.bench.kept import MADE, UNKNOWN, Chapter, check_folder, keep_peers, read_makers, renew, table_of
from wentry_cli.bench.page import write_page
from wentry_cli.bench.row import BenchRow
from wentry_cli.bench.table import csv_of, read_csv
from wentry_cli.errors import InputError

DOCS = Path(__file__).resolve().parents[2] / "docs"
ORDER = ("pinch_off", "solvers", "smoothers")
FIRST, SECOND = ("wentry bench --seed 1", "wentry 0.1.0"), ("wentry bench --chapter solvers --seed 2", "wentry 0.2.0")
THIRD = math.pi * 1e-7


def rows_of(chapter: str, *times_us: float) -> list[BenchRow]:
    row = BenchRow(chapter, "a case, λ", "ours", "t_p", "ms", -THIRD, THIRD, math.nan, 0.0, 0.0, 'say "so"', items=7)
    return [replace(row, method=f"method {k}", time_us=time) for k, time in enumerate(times_us)]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Two chapters of one run, the later of the order first."""
    fresh = [Chapter(name, rows_of(name, 10.0, 20.0), FIRST) for name in ("solvers", "pinch_off")]
    write_page(renew(tmp_path, fresh, ORDER), tmp_path, {"solvers", "pinch_off"})
    return tmp_path


def test_rows_are_read_back_to_the_last_digit(tmp_path: Path) -> None:
    rows = [*rows_of("solvers", 1 / 3, 1e7 / 3), replace(rows_of("solvers", 1.0)[0], bias=math.inf, held=0.1 + 0.2)]
    (tmp_path / "rows.csv").write_text(csv_of(rows), encoding="utf-8")
    for read, written in zip(read_csv(tmp_path / "rows.csv"), rows, strict=True):
        for one, other in zip(astuple(read), astuple(written), strict=True):
            assert type(one) is type(other)
            assert one == other or (math.isnan(one) and math.isnan(other))


def test_tables_of_an_earlier_version_are_read(tmp_path: Path) -> None:
    text = "chapter,case,method,quantity,unit,bias,rmse,ratio_to_bound,failures,time_us,note,items\n"
    (tmp_path / "rows.csv").write_text(text + 'solvers,one,"ours, 1e-8",x,px,4.576e-05,,1.088,0,591.1,,1000\n', "utf-8")
    (row,) = read_csv(tmp_path / "rows.csv")
    assert (row.method, row.bias, row.time_us, row.items) == ("ours, 1e-8", 4.576e-05, 591.1, 1000)
    assert math.isnan(row.rmse)
    assert math.isnan(row.held)


def test_the_tables_of_the_docs_are_read() -> None:
    tables = [path for path in sorted(DOCS.glob("accuracy_*.csv")) if path.name != MADE]
    assert len(tables) > 5
    for path in tables:
        assert {row.chapter for row in read_csv(path)} == {path.stem.removeprefix("accuracy_")}


def test_a_foreign_table_is_one_sentence(tmp_path: Path) -> None:
    table_of(tmp_path, "solvers").write_text("t_s,y_m\n0,1\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"accuracy_solvers\.csv: is not a table of wentry bench"):
        renew(tmp_path, [], ORDER)


def test_one_chapter_is_renewed_and_the_others_stay(folder: Path) -> None:
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    (folder / "accuracy_solvers.svg").write_text("drawn before", encoding="utf-8")
    chapters = renew(folder, [Chapter("smoothers", rows_of("smoothers", 5.0, 6.0), SECOND)], ORDER)
    page = write_page(chapters, folder, {"smoothers"}).read_text(encoding="utf-8")
    assert [chapter.name for chapter in chapters] == [*ORDER]
    places = [page.index(f"## {title}") for title in ("Pinch-off", "Material model", "Velocity and acceleration")]
    assert places == sorted(places)
    assert (folder / "accuracy_solvers.svg").read_text(encoding="utf-8") == "drawn before"
    assert "](accuracy_solvers.svg)" in page
    assert (folder / "accuracy_smoothers.svg").is_file()
    for name in ("pinch_off", "solvers"):
        assert table_of(folder, name).read_bytes() == before[f"accuracy_{name}.csv"]
    old = before["accuracy.md"].decode()
    assert old[old.index("## Pinch-off") :].rstrip() in page  # what is kept reads as it did


def test_the_page_says_who_made_which_chapter(folder: Path) -> None:
    chapters = renew(folder, [Chapter("solvers", rows_of("solvers", 5.0), SECOND)], ORDER)
    head = write_page(chapters, folder, {"solvers"}).read_text(encoding="utf-8").partition("\n## ")[0]
    assert f"- Pinch-off: `{FIRST[0]}`, {FIRST[1]}" in head
    assert f"- Material model: `{SECOND[0]}`, {SECOND[1]}" in head
    assert read_makers(folder) == {"pinch_off": FIRST, "solvers": SECOND}
    (folder / MADE).unlink()
    assert {chapter.maker for chapter in renew(folder, [], ORDER)} == {UNKNOWN}


def test_a_quick_look_and_a_measurement_do_not_mix(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    check_folder(folder, quick=False)
    with pytest.raises(InputError, match="holds chapters measured in full"):
        check_folder(folder, quick=True)
    other = tmp_path_factory.mktemp("quick")
    check_folder(other, quick=True)
    renew(
        other, [Chapter("solvers", rows_of("solvers", 5.0), ("wentry bench --quick --seed 1", "wentry 0.1.0"))], ORDER
    )
    check_folder(other, quick=True)
    with pytest.raises(InputError, match="holds a quick look"):
        check_folder(other, quick=False)
    (folder / MADE).unlink()  # tables of a version that noted no command: measured in full
    with pytest.raises(InputError, match="holds chapters measured in full"):
        check_folder(folder, quick=True)


def test_rows_of_peers_stay_behind_ours_and_the_page_says_who_measured_them(folder: Path, tmp_path_factory) -> None:
    (row,) = rows_of("solvers", 5.0)
    old = [replace(row, case=case, method=name) for case in "AB" for name in ("wentry, gone", "wentry", "peer")]
    renew(folder, [Chapter("solvers", old, FIRST)], ORDER)
    fresh = [replace(row, case=case, method="wentry", rmse=1.0) for case in "AB"]
    alone = ("wentry bench --ours --seed 2", "wentry 0.2.0")
    for _ in range(2):
        kept = keep_peers(folder, Chapter("solvers", fresh, alone))
        assert [(row.case, row.method) for row in kept.rows] == [
            ("A", "wentry"), ("A", "peer"), ("B", "wentry"), ("B", "peer")
        ]  # fmt: skip
        assert kept.rows[0].rmse == 1.0
        assert kept.rows[1].rmse == THIRD
        assert kept.maker == ("wentry bench --ours --seed 2 (peers: wentry bench --seed 1)", "wentry 0.2.0")
        renew(folder, [kept], ORDER)
    nothing = tmp_path_factory.mktemp("nothing")
    assert keep_peers(nothing, Chapter("solvers", fresh, alone)) == Chapter("solvers", fresh, alone)
