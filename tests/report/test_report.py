"""The whole report from a campaign of tables."""

from __future__ import annotations

import base64
import hashlib
import json
import os
import re
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import pytest
from fixture_campaign import CAMPAIGN, Made, configured, film, write_campaign

from wentry_cli.report.campaign import read_campaign
from wentry_cli.report.page import Content
from wentry_cli.report.print_text import closing_lines
from wentry_cli.stages.report import run

VOID = {"meta", "img", "br", "wbr", "hr", "link", "input"}


class _Page(HTMLParser):
    """Collect what a browser would open, and whether every element is closed in order."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[str] = []
        self.links: list[str] = []
        self.text = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.links += [value or "" for name, value in attrs if name in {"src", "href", "srcset", "data", "action"}]
        assert not [name for name, _ in attrs if name.startswith("on")]
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data


def read_page(results: Path) -> _Page:
    page = _Page()
    page.feed((results / "report.html").read_text(encoding="utf-8"))
    page.close()
    assert not page.open
    return page


def make(tmp_path: Path, drops: tuple[Made, ...], filmed: int = 0) -> Path:
    results, videos = tmp_path / "results", tmp_path / "videos"
    write_campaign(results, drops)
    if filmed:
        film(videos, drops[0], filmed)
    run(results, configured(videos, drops))
    return results


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    drops = tuple(CAMPAIGN[place] for place in (1, 0, 5, 6, 8))
    return make(tmp_path_factory.mktemp("report"), drops, filmed=36)


def test_page_is_one_file_that_fetches_nothing(campaign: Path) -> None:
    page = read_page(campaign)
    text = (campaign / "report.html").read_text(encoding="utf-8")
    assert all(link.startswith(("#", "data:image/svg+xml;base64,")) for link in page.links)
    assert not re.search(r"https?:|//[a-z]|url\(|@import", re.sub(r"base64,[A-Za-z0-9+/=]+", "", text))
    assert "script" not in page.tags
    anchors = [link[1:] for link in page.links if link.startswith("#")]
    assert all(f'id="{anchor}"' in text for anchor in anchors)


def test_pictures_are_whole_and_fetch_nothing(campaign: Path) -> None:
    pictures = [link for link in read_page(campaign).links if link.startswith("data:")]
    files = sorted((campaign / "figures").glob("*.svg"))
    assert len(pictures) == len(files) > 15
    for picture in pictures:
        tree = ElementTree.fromstring(base64.b64decode(picture.split(",", 1)[1]))
        for element in tree.iter():
            links = [value for name, value in element.attrib.items() if name.endswith("href")]
            assert all(link.startswith(("#", "data:image/png;base64,")) for link in links)
            assert not element.tag.endswith("}script")


def test_every_figure_has_its_three_files(campaign: Path) -> None:
    stems = {path.stem for path in (campaign / "figures").iterdir()}
    for stem in stems:
        for suffix in ("svg", "png", "csv"):
            assert (campaign / "figures" / f"{stem}.{suffix}").stat().st_size > 40


def test_every_panel_of_the_paper_is_there(campaign: Path) -> None:
    stems = {path.stem for path in (campaign / "figures").iterdir()}
    wanted = ["3c", "3d", "4b", "4c", "4d", "6a", "6b", "7a", "7b", "7d", "8", "12b"]
    assert [key for key in wanted if not any(stem.startswith(f"fig_{key}_") for stem in stems)] == []
    assert {"strip_side_g6p9_d51_h153", "strip_top_g6p9_d51_h153", "free_flight_ball"} <= stems
    text = read_page(campaign).text
    assert "no compression test" in text
    assert "the recording cannot be opened any more" in text


def test_pdf_is_complete_and_undated(campaign: Path) -> None:
    content = (campaign / "report.pdf").read_bytes()
    assert content.startswith(b"%PDF-")
    assert content.rstrip().endswith(b"%%EOF")
    assert b"CreationDate" not in content
    assert content.count(b"/Type /Page\n") + content.count(b"/Type /Page ") >= 5


def test_page_names_numbers_units_and_the_papers_values(campaign: Path) -> None:
    text = read_page(campaign).text
    for words in ("1.450 ± 0.020", "1.410 to 1.490", "tp (ms)", "103.76 ± 0.20", "k = 1", "sphere seal", "280 / 300"):
        assert words in text
    assert "no_edge" in text
    assert "nan" not in re.findall(r"[a-z]+", text.lower())


def test_same_results_give_the_same_bytes(tmp_path: Path) -> None:
    drops = (CAMPAIGN[6],)
    digests = []
    for part in ("one", "two"):
        results = make(tmp_path / part, drops, filmed=12)
        files = [results / "report.html", results / "report.pdf", *sorted((results / "figures").iterdir())]
        digests.append({path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in files})
    assert digests[0] == digests[1]


HOSTILE = (
    Made('<script>alert("x")</script>', kind="surface_impact", condition="</style><img src=x>", sphere="$\\frac{$"),
    Made("_$\\undefined$ ${jinja} {{ 7*7 }} ü漢字\u202e &amp; \x07'\"><svg onload=x>", speed=3.2),
)


def test_hostile_names_are_harmless(tmp_path: Path) -> None:
    results = tmp_path / "results"
    write_campaign(results, HOSTILE)
    problem = {"<b>drop</b>": {"stage": "<i>track</i>", "sentence": "<script>x</script>"}}
    (results / "run.json").write_text(json.dumps({"failures": problem, "version": "<u>", "drops": ["not", "a", "map"]}))
    run(results, configured(tmp_path / "videos", HOSTILE))
    page = read_page(results)
    assert not {"script", "svg", "b", "i", "u"} & set(page.tags)
    assert '<script>alert("x")</script>' in page.text
    assert "{{ 7*7 }}" in page.text
    for path in (results / "figures").glob("*.svg"):
        assert re.fullmatch(r"[A-Za-z0-9._-]+", path.name)
        assert not [e for e in ElementTree.parse(path).iter() if e.tag.endswith("}script")]


def test_what_the_stages_warned_of_is_shown(tmp_path: Path) -> None:
    results, (drop,) = tmp_path / "results", (CAMPAIGN[8],)
    write_campaign(results, (drop,))
    sentence = "a free flight falls with <9.81> m/s², but 96 was measured"
    entry = {"summary": {"warnings": [sentence]}, "track": {"error": "x"}}
    (results / drop.name / "stages.json").write_text(json.dumps(entry))
    run(results, configured(tmp_path / "videos", (drop,)))
    page = read_page(results).text
    assert sentence in page[page.index("Warnings") :]
    content = Content(read_campaign(results, [drop.name]), [], [], [])
    printed = [text for line in closing_lines(content) for _, text in line.cells]
    assert sentence in printed[printed.index("Warnings") :]


@pytest.mark.parametrize(
    ("kinds", "drawn", "silent"),
    [
        ((CAMPAIGN[0],), ["fig_3c", "fig_6a", "fig_7a", "fig_8"], ["fig_3d", "fig_4", "fig_7d"]),
        ((CAMPAIGN[8],), ["free_flight"], ["fig_"]),
        ((CAMPAIGN[6],), ["fig_12b"], ["fig_3", "fig_4", "fig_6", "fig_7", "fig_8"]),
    ],
    ids=["rigid only", "free flight only", "rigid surface only"],
)
def test_only_what_the_scene_allows_is_drawn(
    tmp_path: Path, kinds: tuple[Made, ...], drawn: list[str], silent: list[str]
) -> None:
    results = make(tmp_path, kinds)
    stems = [path.stem for path in (results / "figures").glob("*.svg")]
    assert [start for start in drawn if not any(stem.startswith(start) for stem in stems)] == []
    assert [stem for stem in stems if stem.startswith(tuple(silent))] == []
    assert read_page(results).text.count("no drop") + read_page(results).text.count("no deformable") >= 1


TABLES = [
    "side",
    "top",
    "stretch",
    "periods",
    "kinematics",
    "model",
    "model_fit",
    "forces",
    "events",
    "geometry",
    "summary",
]


@pytest.mark.parametrize("name", TABLES)
def test_a_missing_or_broken_table_costs_its_panels_only(tmp_path: Path, name: str) -> None:
    results, drops = tmp_path / "results", (CAMPAIGN[1], CAMPAIGN[0])
    write_campaign(results, drops)
    (results / drops[0].name / f"{name}.csv").unlink()
    broken = results / drops[1].name / f"{name}.csv"
    broken.write_bytes(b"frame,\xff\xfe\n1,2,3\n")
    from wentry_cli.report.panel import Panel
    from wentry_cli.report.panels import campaign_panels

    campaign = read_campaign(results, [drop.name for drop in drops])
    assert str(broken) in campaign.drops[1].problems[0]
    made = campaign_panels(campaign)
    assert sum(isinstance(panel, Panel) for panel in made) >= 4
    for panel in made:
        assert isinstance(panel, Panel) or panel.reason


def test_two_sheets_fill_a_page(campaign: Path) -> None:
    from wentry_cli.report.document import _onto_pages, _rows
    from wentry_cli.report.drawing import Drawn
    from wentry_cli.report.drop_sheets import drop_sheets
    from wentry_cli.report.panel import Panel

    soft = read_campaign(campaign, ["g6p9_d51_h153"])
    (sheet,) = drop_sheets(soft)
    assert isinstance(sheet, Panel)
    assert len(set(sheet.data["part"])) == 4
    pages = _onto_pages(_rows([Drawn(sheet, b"", ())] * 4))
    assert [len(page) for page in pages] == [2, 2]


def test_no_heading_of_the_pdf_is_alone_at_the_foot_of_a_page() -> None:
    from wentry_cli.report.document import USED, Line, _onto_pages
    from wentry_cli.report.print_text import _text, heading

    broken = 0
    for count in range(30, 90):
        text = [_text(f"line {number}") for number in range(count)]
        pages = _onto_pages([*text, *heading("Heading"), _text("header of a table", bold=True), *text[:3]])
        assert not any(isinstance(page[-1], Line) and page[-1].bold for page in pages)
        assert all(sum(line.height for line in page) <= USED for page in pages)
        assert sum(map(len, pages)) == count + 6
        broken += len(pages) > 1
    assert broken > 0


def test_a_table_wider_than_the_page_is_printed_in_parts_with_every_cell() -> None:
    from wentry_cli.report.print_text import _table
    from wentry_cli.report.tabulation import TextTable

    header = ("drop", *(f"column {n}" for n in range(12)))
    rows = tuple((name, *(f"{name} {n} ± 0.000123" for n in range(12))) for name in ("a", "b"))
    lines = _table(TextTable(header, rows))
    printed = [text for line in lines for _, text in line.cells]
    assert {cell for row in rows for cell in row} | set(header) == {text for text in printed if text}
    assert printed.count("a") == printed.count("b") == printed.count("drop") > 1
    assert all(x < 0.925 for line in lines for x, _ in line.cells)


def test_a_table_that_goes_on_on_another_page_has_its_header_again() -> None:
    from wentry_cli.report.document import USED, Line, _onto_pages
    from wentry_cli.report.print_text import _table, heading
    from wentry_cli.report.tabulation import TextTable

    rows = tuple((f"drop {n}", "a sentence of many words " * 12) for n in range(120))
    pages = _onto_pages([*heading("Heading"), *_table(TextTable(("drop", "what happened"), rows))])
    assert len(pages) > 2
    for page in pages[1:]:
        first = page[0]
        assert isinstance(first, Line)
        assert [text for _, text in first.cells] == ["drop", "what happened"]
        second = page[1]
        assert isinstance(second, Line)
        assert second.cells[0][1].startswith("drop ")  # no row is torn
        assert sum(line.height for line in page) <= USED


def test_no_printed_line_is_wider_than_the_page() -> None:
    from wentry_cli.report.letters import width_em
    from wentry_cli.report.print_text import A4, RIGHT, _table, _wrapped
    from wentry_cli.report.tabulation import TextTable

    digits = "0123456789abcdef" * 20
    table = TextTable(("drop", *("what it is",) * 4), ((digits, "side", f"/a/{digits}.cine", digits, "WWWW " * 60),))
    lines = [*_wrapped(f"the words {digits} {digits}"), *_table(table)]
    for line in lines:
        ends = [x + width_em(text, bold=line.bold) * line.size / 72.0 / A4[0] for x, text in line.cells]
        assert max(ends) <= RIGHT + 1e-3
        assert all(end < x for end, (x, _) in zip(ends, line.cells[1:], strict=False))
    printed = "".join(text for line in lines for _, text in line.cells)
    assert printed.count("W") >= 240


def test_names_in_letters_that_the_font_lacks_are_told_in_one_sentence(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, recwarn: pytest.WarningsRecorder
) -> None:
    drops = (Made("落下_1", kind="surface_impact", sphere="球"), Made("落下_2", kind="surface_impact", sphere="球"))
    make(tmp_path, drops)
    (told,) = [record.getMessage() for record in caplog.records]
    assert "落 下 球" in told
    assert not [str(warning.message) for warning in recwarn if "glyph" in str(warning.message).lower()]


def test_nothing_measured_is_a_page_that_says_so(tmp_path: Path) -> None:
    results = tmp_path / "results"
    results.mkdir()
    run(results, configured(tmp_path / "videos", CAMPAIGN[:1]))
    text = read_page(results).text
    assert "none of the paper's panels" in text
    assert "not finished" in text


def test_sections_with_nothing_in_them_are_left_out(tmp_path: Path) -> None:
    results = tmp_path / "results"
    write_campaign(results, (CAMPAIGN[8],))
    (results / "scaling.csv").unlink()
    run(results, configured(tmp_path / "videos", (CAMPAIGN[8],)))
    page = read_page(results)
    anchors = {link for link in page.links if link.startswith("#")}
    for word in ("figures", "regressions", "materials"):
        assert f'id="{word}"' not in (results / "report.html").read_text(encoding="utf-8")
        assert f"#{word}" not in anchors
    assert {"#drops", "#single", "#missing", "#provenance"} <= anchors


def test_the_date_is_that_of_the_results(tmp_path: Path) -> None:
    """A report that is drawn again on another day has the same bytes."""
    names = write_campaign(tmp_path, (CAMPAIGN[8],))
    for path in tmp_path.glob("*.csv"):
        os.utime(path, (1.6e9, 1.6e9))  # 13 September 2020, noon
    assert read_campaign(tmp_path, names).date == "2020-09-13"


def test_symbols_have_their_index_lowered_and_names_stay() -> None:
    from wentry_cli.report.symbols import as_html, as_mathtext

    assert as_html("t_p U₀/D_eff of <g6p70_d51_h227>") == "t<sub>p</sub> U₀/D<sub>eff</sub> of &lt;g6p70_d51_h227&gt;"
    assert as_mathtext("λ_pN $ of run_t_p") == r"$\lambda_{pN}$ \$ of run_t_p"


def test_long_words_of_a_page_can_be_broken_without_a_letter_more() -> None:
    from wentry_cli.report.symbols import as_breakable

    assert as_breakable("films/a&b/side.cihx") == "films/<wbr>a&amp;b/<wbr>side.cihx"
    broken = str(as_breakable("0123456789" * 6))
    assert broken.replace("<wbr>", "") == "0123456789" * 6
    assert max(map(len, broken.split("<wbr>"))) <= 32


def test_figures_of_an_earlier_report_go(tmp_path: Path) -> None:
    results = make(tmp_path, (CAMPAIGN[8],))
    old = results / "figures" / "fig_4b_period.svg"
    kept = results / "figures" / "notes.txt"
    old.write_text("old")
    kept.write_text("mine")
    run(results, configured(tmp_path / "videos", (CAMPAIGN[8],)))
    assert not old.exists()
    assert kept.exists()
