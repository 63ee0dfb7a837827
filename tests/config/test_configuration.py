"""Configuration: every mistake a sentence with file, line and column; inheritance; safety."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

from wentry_cli.config.blame import wrong_key
from wentry_cli.config.campaign import Drop, find_drops, read_drop
from wentry_cli.config.inheritance import Shared, notes_of
from wentry_cli.config.materials import packaged_config
from wentry_cli.config.messages import validate
from wentry_cli.config.models import Experiment, water_properties
from wentry_cli.config.places import Document, read_document
from wentry_cli.config.scaffold import write_scaffold
from wentry_cli.errors import ConfigurationError, InputError
from wentry_cli.frames.reader import RATE_UNKNOWN, RecordingInfo
from wentry_cli.runner.commands import overrides_document, read_campaign
from wentry_cli.stages.ingest import frame_rate

GOOD = """\
kind: water_entry
sphere: {diameter_m: 0.051, density_kg_m3: 1070, material: rigid}
views:
  side: {source: side, fps: 2000}
"""


def _write(folder: Path, text: str, name: str = "experiment.yaml") -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_text(text, encoding="utf-8")
    return folder


def _message(folder: Path, text: str) -> str:
    with pytest.raises(ConfigurationError) as caught:
        read_drop("drop", _write(folder, text))
    return str(caught.value)


def test_a_good_file_is_read(tmp_path: Path) -> None:
    drop = read_drop("drop", _write(tmp_path, GOOD))
    assert drop.experiment.sphere.rigid
    assert drop.experiment.sides == ["side"]
    assert drop.source_path("side") == tmp_path / "side"
    assert Drop.from_record(drop.record()) == drop  # the folder of a test is absolute


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (("diameter_m", "diametre_m"), "2:10: error: sphere.diametre_m: unknown key; did you mean diameter_m?"),
        (("0.051", "-0.051"), "2:10: error: sphere.diameter_m: must be at least 1e-05 m, not -0.051"),
        (("0.051", "51"), "sphere.diameter_m: must be at most 1 m, not 51; 51 mm is 0.051 m"),
        (("1070", "1.07"), "sphere.density_kg_m3: must be at least 10 kg/m³, not 1.07; 1.07 g/cm³ is 1070 kg/m³"),
        (("0.051", "true"), "sphere.diameter_m: must be a number, not True"),
        (("0.051", ".nan"), "sphere.diameter_m: must be"),
        (("0.051", "51 mm"), "sphere.diameter_m: must be a number in metres, as 0.051, not '51 mm'"),
        (("0.051", '"0,051"'), "sphere.diameter_m: must be a number, not '0,051'; write 0.051"),
        (("1070", '"1,070"'), "sphere.density_kg_m3: must be a number, not '1,070'; write 1070 or 1.070"),
        (("fps: 2000", 'fps: "2000,5"'), "must be a number or 'from_header', not '2000,5'; write 2000.5"),
        (("0.051", '"5,1cm"'), "sphere.diameter_m: must be a number in metres, as 0.051, not '5,1cm'"),
        (("0.051", "51 inches"), "sphere.diameter_m: must be a number, not '51 inches'"),
        (("1070", "1.07 g/cm3"), "sphere.density_kg_m3: must be a number in kg/m³, as 1070, not '1.07 g/cm3'"),
        (
            ("fps: 2000", "fps: 2 kHz"),
            "views.side.fps: must be a number in frames/s, as 2000, or 'from_header', not '2 kHz'",
        ),
        (
            ("fps: 2000", "scale_px_per_m: {air: 4 px/mm}"),
            "scale_px_per_m.air: must be a number in px/m, as 4000, or 'auto', not '4 px/mm'",
        ),
        (("fps: 2000", "scale: 4000"), "4:24: error: views.side.scale: unknown key; did you mean scale_px_per_m?"),
        (("fps: 2000", "fps: 0"), "4:24: error: views.side.fps: must be at least 0.01 frames/s, not 0"),
        (("fps: 2000", "fps: fast"), "views.side.fps: must be a number or 'from_header', not 'fast'"),
        (("fps: 2000", "frames: [9, 1]"), "the first frame 9 lies after the last 1"),
        (("fps: 2000", "rotate: 45"), "views.side.rotate: must be one of 0, 90, 180 or 270, not 45"),
        (("water_entry", "water_entery"), "1:1: error: kind: must be one of"),
        (("rigid", "rigd"), "2:50: error: sphere.material: rigd does not stand in"),
        (("side:", "sied:"), "views.sied: unknown key; did you mean side?"),
        (("material: rigid", "mass_kg: 1.0"), "density_kg_m3 1070 and mass_kg 1 disagree"),
        (("0.051", "0.051_1"), "2:10: error: sphere.diameter_m: must be a number, not '0.051_1'"),
        (("0.051", "0:3"), "sphere.diameter_m: must be a number, not '0:3'"),
        (("0.051", "0x1"), "sphere.diameter_m: must be a number, not '0x1'"),
        (("fps: 2000", "fps: 02000"), "views.side.fps: must be a number or 'from_header', not '02000'"),
        (("0.051", "9" * 5000), "sphere.diameter_m: must be a number, not '999"),
        (("source: side", 'source: ""'), "4:10: error: views.side.source: must not be empty"),
        (("kind:", f"condition: {'x' * 201}\nkind:"), "condition: must have at most 200 characters"),
        (
            ("kind:", 'condition: "a\\nb,c\\0"\nkind:'),
            "1:1: error: condition: must be one line of text without control",
        ),
        (("kind:", 'condition: " "\nkind:'), "1:1: error: condition: must not be empty"),
        (
            ("kind:", "condition: =HYPERLINK()\nkind:"),
            "1:1: error: condition: must not begin with =, which makes it a formula",
        ),
        (("{diameter_m", '{id: " @a", diameter_m'), "2:10: error: sphere.id: must not begin with @, which"),
        (("side,", '"si\\0de",'), "4:10: error: views.side.source: must be one line of text"),
        (("kind:", "repeat: -1.5\nkind:"), "1:1: error: repeat: must be text or a whole number from 0, not -1.5"),
        (("kind:", "repeat: .nan\nkind:"), "1:1: error: repeat: must be text or a whole number from 0, not nan"),
        (("fps: 2000", "fps: 1e9"), "4:24: error: views.side.fps: must be at most 1e+07 frames/s, not 1000000000.0"),
        (
            ("fps: 2000", "surface_y_px: 99999"),
            "4:24: error: views.side.surface_y_px: must be at most 20000 px, not 99999",
        ),
        (
            ("kind:", "analysis: {min_frames: 1000000000000000000000000000}\nkind:"),
            "1:12: error: analysis.min_frames: must",
        ),
        (("side: {", "top: {offset_s: 1e300, "), "4:9: error: views.top.offset_s: must be at most 1000 s, not 1e+300"),
        (("fps: 2000", "roi_px: [0, 0]"), "views.side.roi_px.2: is required"),
        (("  side", "\tside"), "4:1: error: not valid YAML: a tab stands here; write spaces instead of it"),
        (("kind: ", "kind:\t"), "1:6: error: not valid YAML: a tab stands here; write spaces instead of it"),
    ],
)
def test_a_mistake_is_a_sentence_with_its_place(tmp_path: Path, change: tuple[str, str], expected: str) -> None:
    message = _message(tmp_path, GOOD.replace(*change))
    assert expected in message
    assert str(tmp_path / "experiment.yaml") in message


def test_of_several_forms_the_one_that_was_meant_is_spoken_of(tmp_path: Path) -> None:
    message = _message(tmp_path, GOOD.replace("fps: 2000", "fps: 2000, scale_px_per_m: {air: 1000, wasser: 3}"))
    place = tmp_path / "experiment.yaml"
    assert message == f"{place}:4:63: error: views.side.scale_px_per_m.wasser: unknown key; did you mean water?"


def test_all_problems_are_told_at_once(tmp_path: Path) -> None:
    message = _message(tmp_path, GOOD.replace("0.051", "-1").replace("2000", "0").replace("kind: water_entry\n", ""))
    assert message.count("error:") == 3


def test_the_campaign_is_inherited_and_overridden(tmp_path: Path) -> None:
    _write(tmp_path, "gravity_m_s2: 9.79\nviews: {side: {fps: 1000, exposure_s: 1e-4}}\n", "campaign.yaml")
    _write(tmp_path / "a", GOOD)
    drop = read_drop("a", tmp_path / "a")
    side = drop.view("side")
    assert drop.experiment.gravity_m_s2 == 9.79
    assert (side.fps, side.exposure_s) == (2000, 1e-4)


def test_a_key_that_is_left_empty_says_nothing(tmp_path: Path) -> None:
    """As in the file that init writes: what the campaign or the default says holds, and mistakes are told there."""
    shared = "gravity_m_s2:\nsphere: {diameter_m: 0.051, material: rigid}\nviews: {side: {fps: 1000}}\n"
    _write(tmp_path, shared, "campaign.yaml")
    write_scaffold(tmp_path / "a")
    drop = read_drop("a", tmp_path / "a", top=tmp_path)
    assert (drop.experiment.sphere.material, drop.experiment.sphere.diameter_m) == ("rigid", 0.051)
    assert (drop.view("side").fps, drop.experiment.gravity_m_s2) == (1000, 9.81)
    told = wrong_key(drop, "sphere.diameter_m", 0.051, "is wrong")
    assert str(told).startswith(f"{tmp_path / 'campaign.yaml'}:2:10: error: sphere.diameter_m: is wrong")
    unsaid = overrides_document(("sphere.material=null",))
    assert read_drop("a", tmp_path / "a", unsaid, tmp_path).experiment.sphere.material is None, "for one run"
    _write(tmp_path, shared.replace("0.051", "51"), "campaign.yaml")
    with pytest.raises(ConfigurationError, match=r"campaign\.yaml:2:10: error: sphere\.diameter_m: must be at most"):
        read_drop("a", tmp_path / "a", top=tmp_path)


@pytest.mark.parametrize(
    ("shared", "told"),
    [
        ("", r"experiment\.yaml:4:3: error: sphere\.diameter_m: {0}, or remove the line and say it in campaign\.yaml"),
        ("sphere:\n  diameter_m:\n", r"experiment\.yaml:4:3: error: sphere\.diameter_m: {0}, or remove the line"),
    ],
)
def test_what_no_file_says_is_asked_for(tmp_path: Path, shared: str, told: str) -> None:
    _write(tmp_path, shared, "campaign.yaml")
    write_scaffold(tmp_path / "a")
    with pytest.raises(ConfigurationError, match=told.format("is left empty; fill it in")):
        read_drop("a", tmp_path / "a", top=tmp_path)
    _write(tmp_path, "sphere:\n  diameter_m:\n", "campaign.yaml")
    _write(tmp_path / "a", GOOD.replace("diameter_m: 0.051, ", ""))
    with pytest.raises(ConfigurationError, match=r"campaign\.yaml:2:3: error: sphere\.diameter_m: [^,]*fill it in$"):
        read_drop("a", tmp_path / "a", top=tmp_path)


def test_within_the_campaign_its_keys_reach_any_depth(tmp_path: Path) -> None:
    _write(tmp_path, "gravity_m_s2: 9.79\n", "campaign.yaml")
    deep = _write(tmp_path / "1" / "2" / "3" / "4" / "5", GOOD)
    assert read_drop("x", deep, top=tmp_path).experiment.gravity_m_s2 == 9.79
    _write(tmp_path / "1" / "2", "gravity_m_s2: 9.80\n", "campaign.yaml")
    drop = read_drop("x", deep, top=tmp_path)
    assert drop.experiment.gravity_m_s2 == 9.80, "the nearest holds"
    assert drop.shared == Shared(tmp_path / "1" / "2" / "campaign.yaml")


@pytest.mark.parametrize(("folders", "gravity"), [(1, 9.79), (2, 9.79), (3, 9.79), (4, 9.81), (7, 9.81)])
def test_a_drop_run_alone_inherits_from_its_campaign_and_from_no_stray_file(
    tmp_path: Path, folders: int, gravity: float
) -> None:
    _write(tmp_path, "gravity_m_s2: 9.79\n", "campaign.yaml")
    folder = _write(tmp_path.joinpath(*"1234567"[:folders]), GOOD)
    drop = read_drop("x", folder)
    assert drop.experiment.gravity_m_s2 == gravity
    (note,) = notes_of(drop.shared, folder)
    assert str(tmp_path / "campaign.yaml") in note
    assert ("is not used: it lies more than 3 folders above" in note) == (gravity == 9.81)


def test_a_drop_that_is_linked_into_a_campaign_belongs_to_it(tmp_path: Path) -> None:
    store = _write(tmp_path / "store" / "run", GOOD)
    _write(tmp_path / "store", "gravity_m_s2: 9.70\n", "campaign.yaml")
    campaign = _write(tmp_path / "campaign", "gravity_m_s2: 9.79\n", "campaign.yaml")
    try:
        (campaign / "run").symlink_to(store, target_is_directory=True)
    except OSError:
        pytest.skip("no links here")
    (folder,) = find_drops(campaign).values()
    drop = read_drop("run", folder, top=campaign)
    assert drop.experiment.gravity_m_s2 == 9.79
    again = Drop.from_record(drop.record())
    assert read_drop("run", again.folder, top=again.top).experiment.gravity_m_s2 == 9.79


def test_a_mistake_in_the_campaign_names_the_campaign(tmp_path: Path) -> None:
    _write(tmp_path, "gravty_m_s2: 9.79\n", "campaign.yaml")
    with pytest.raises(
        ConfigurationError, match=r"campaign\.yaml:1:1: error: gravty_m_s2: unknown key; did you mean grav"
    ):
        read_drop("a", _write(tmp_path / "a", GOOD))


@pytest.mark.parametrize(("text", "key"), [("sphere: [1]\n", "sphere"), ("views:\n  side: film\n", "views.side")])
def test_a_part_of_the_campaign_has_keys_or_is_refused(tmp_path: Path, text: str, key: str) -> None:
    """Mixed into a drop that has the part with its keys, anything else would be lost without a word."""
    _write(tmp_path, text, "campaign.yaml")
    with pytest.raises(ConfigurationError, match=rf"campaign\.yaml:\d:\d+: error: {key}: must be keys with values"):
        read_drop("a", _write(tmp_path / "a", GOOD))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("kind: [", "not valid YAML"),
        ('kind: water_entry\nviews:\n  side: {source: "run12, fps: 2000}\n', "3:18: error: not valid YAML: the quote"),
        ("kind: 'water_entry\nb: 1\n", "1:7: error: not valid YAML: the quote that opens here is not closed; close it"),
        ("- a\n- b\n", "must hold `key: value` lines"),
        ("kind: water_entry\nkind: free_flight\n", "2:1: error: kind: stands twice"),
        ("b: *x\n", "1:4: error: aliases (*x) are not read"),
        ("a: &x [1]\nb: *x\n", "1:4: error: anchors (&x) are not read; write the value alone"),
        ("kind: &x water_entry\n", "1:7: error: anchors (&x) are not read"),
        ("kind: !!python/object/apply:os.system [ls]\n", "1:7: error: tags (!…) are not read"),
        ("a: !!int abc\n", "1:4: error: tags (!…) are not read"),
        ('a: "\\U00110000"\n', "an escape such as \\U names no character"),
        ("", "kind: is required"),
        ("? [1, 2]\n: 3\n", "a key must be a plain word"),
        ("1: 2\n", "1:1: error: a key must be a plain word, not 1"),
        ("kind: water_entry\nnull: 3\n", "2:1: error: a key must be a plain word, not null"),
        ("<<: {kind: water_entry}\n", "1:1: error: a key must be a plain word, not <<"),
    ],
)
def test_hostile_and_broken_yaml(tmp_path: Path, text: str, expected: str) -> None:
    assert expected in _message(tmp_path, text)


def test_deep_nesting_and_great_size_are_refused(tmp_path: Path) -> None:
    assert "error" in _message(tmp_path / "deep", "a: " + "[" * 20000)
    assert "larger than" in _message(tmp_path / "large", "# " + "x" * 1_100_000)


def test_not_text_is_refused(tmp_path: Path) -> None:
    (tmp_path / "experiment.yaml").write_bytes(b"\x80\x81")
    with pytest.raises(ConfigurationError, match="not UTF-8"):
        read_drop("drop", tmp_path)


def test_own_materials_stand_beside_the_campaign(tmp_path: Path) -> None:
    _write(tmp_path, "", "campaign.yaml")
    _write(
        tmp_path, "materials: {jelly: {g_inf_pa: 900, g_t_pa: 900, n: -0.5, eps0_dot_1_s: 0.01}}\n", "materials.yaml"
    )
    drop = read_drop("a", _write(tmp_path / "a", GOOD.replace("rigid", "jelly")))
    assert drop.material is not None
    assert drop.material.g_inf_pa == 900


JELLY = "materials: {jelly: {g_inf_pa: 900, g_t_pa: 900, n: -0.5, eps0_dot_1_s: 0.01}}\n"
SOFTER = JELLY.replace("g_inf_pa: 900", "g_inf_pa: 800")


def _modulus(folder: Path, top: Path | None = None) -> float:
    material = read_drop("a", folder, top=top).material
    assert material is not None
    return material.g_inf_pa


def test_own_materials_need_no_campaign_file(tmp_path: Path) -> None:
    deep = _write(tmp_path / "1" / "2" / "3" / "4" / "a", GOOD.replace("rigid", "jelly"))
    _write(tmp_path, JELLY, "materials.yaml")
    assert _modulus(deep, tmp_path) == 900, "at any depth below VIDEO_DIR"
    _write(tmp_path / "1" / "2", SOFTER, "materials.yaml")
    assert _modulus(deep, tmp_path) == 800, "the nearest holds"
    _write(deep, JELLY, "materials.yaml")
    assert _modulus(deep, tmp_path) == 900
    _write(tmp_path / "1", "", "campaign.yaml")
    _write(tmp_path / "1", SOFTER, "materials.yaml")
    assert _modulus(deep, tmp_path) == 800, "what lies beside campaign.yaml comes first"
    (tmp_path / "1" / "materials.yaml").unlink()
    assert _modulus(deep, tmp_path) == 900, "where nothing does, the nearest holds too"


def test_materials_above_a_drop_run_alone_are_used_and_told(tmp_path: Path) -> None:
    folder = _write(tmp_path / "a", GOOD.replace("rigid", "jelly"))
    _write(tmp_path, JELLY, "materials.yaml")
    assert _modulus(folder) == 900
    assert read_campaign(folder).notes == [f"{tmp_path / 'materials.yaml'}, above {folder}, gives the materials"]
    assert read_campaign(tmp_path).notes == []


def test_an_unknown_material_is_told_where_ones_own_belong(tmp_path: Path) -> None:
    _write(tmp_path / "a", GOOD.replace("rigid", "jelly"))
    told = f"write a material of your own into {tmp_path / 'materials.yaml'}"
    with pytest.raises(ConfigurationError, match=re.escape(told)) as caught:
        read_drop("a", tmp_path / "a", top=tmp_path)
    assert "sphere.material: jelly does not stand in the packaged materials.yaml; known: drag" in str(caught.value)
    _write(tmp_path, JELLY.replace("jelly", "jello"), "materials.yaml")
    with pytest.raises(ConfigurationError) as caught:
        read_drop("a", tmp_path / "a", top=tmp_path)
    told = f"sphere.material: jelly does not stand in {tmp_path / 'materials.yaml'}; did you mean jello?"
    assert str(caught.value).endswith(told)


def test_what_every_drop_overrides_is_checked_too(tmp_path: Path) -> None:
    """Keys that stand in campaign.yaml are right each by itself; that they are not all keys is no mistake."""
    for text in ("kind: free_flight\nsphere:\n  material: rigid\nviews: {side: {fps: 1000}}\n", "sphere:\nviews:\n"):
        _write(tmp_path, text, "campaign.yaml")
        read_drop("a", _write(tmp_path / "a", GOOD), top=tmp_path)
    shared = _write(tmp_path, "kind: water_entryy\nviews: {side: {fps: -1}}\n", "campaign.yaml") / "campaign.yaml"
    with pytest.raises(ConfigurationError) as caught:
        read_drop("a", tmp_path / "a", top=tmp_path)
    first, second = str(caught.value).splitlines()
    assert first.startswith(f"{shared}:1:1: error: kind: must be one of")
    assert second.startswith(f"{shared}:2:16: error: views.side.fps: must be")


def test_a_source_that_is_missing_does_not_hide_behind_an_empty_key(tmp_path: Path) -> None:
    _write(tmp_path, "kind: water_entry\nsphere:\n  diameter_m:\nviews:\n  side: {source: gone, fps: 2000}\n")
    with pytest.raises(ConfigurationError) as caught:
        read_campaign(tmp_path)
    told = str(caught.value)
    assert "experiment.yaml:3:3: error: sphere.diameter_m: is left empty" in told
    assert f"experiment.yaml:5:10: error: views.side.source: {tmp_path / 'gone'}: no such file or folder" in told


def test_drops_are_found_at_any_depth(tmp_path: Path) -> None:
    for name in ("b/2", "b/10", "a"):
        _write(tmp_path / name, GOOD)
    _write(tmp_path / "a" / "side", GOOD)  # a drop does not hold drops
    assert list(find_drops(tmp_path)) == ["a", "b__10", "b__2"]
    assert list(find_drops(tmp_path / "a")) == ["a"]


@pytest.mark.skipif(os.name == "nt", reason="links need rights there")
def test_a_link_to_a_folder_above_is_not_followed(tmp_path: Path) -> None:
    for name in ("outside", "videos/in", "store"):
        (tmp_path / name).mkdir(parents=True)
        (tmp_path / name / "experiment.yaml").write_text("")
    (tmp_path / "videos" / "loop").symlink_to(tmp_path, target_is_directory=True)
    (tmp_path / "videos" / "far").symlink_to(tmp_path / "store", target_is_directory=True)
    assert list(find_drops(tmp_path / "videos")) == ["far", "in"]


@pytest.mark.skipif(os.name == "nt", reason="no such names there")
@pytest.mark.parametrize("name", ["new\nline", "a\x1b[31m"])
def test_a_drop_whose_name_breaks_a_line_is_refused_in_one(tmp_path: Path, name: str) -> None:
    _write(tmp_path / "campaign" / name, GOOD)
    for folder in (tmp_path / "campaign", tmp_path / "campaign" / name):
        with pytest.raises(InputError, match="must have a name of one line of text; rename it") as caught:
            find_drops(folder)
        assert repr(name) in str(caught.value)
        assert str(caught.value).isprintable()


@pytest.mark.parametrize("name", ["=cmd()", "+a", "-a", "@a", " =a"])
def test_a_drop_whose_name_is_a_formula_to_a_spreadsheet_is_refused(tmp_path: Path, name: str) -> None:
    _write(tmp_path / "campaign" / name, GOOD)
    for folder in (tmp_path / "campaign", tmp_path / "campaign" / name):
        with pytest.raises(InputError, match=r"begins a formula; rename its folder$") as caught:
            find_drops(folder)
        assert str(caught.value).startswith(name)


@pytest.mark.parametrize("name", ["a=b", "-20", "+1.5e3"])
def test_a_name_with_a_sign_within_or_of_a_number_is_none(tmp_path: Path, name: str) -> None:
    _write(tmp_path / "campaign" / name, GOOD.replace("kind:", f"condition: {name}\nkind:"))
    found = find_drops(tmp_path / "campaign")
    assert read_drop(name, found[name]).experiment.condition is not None


def test_no_drop_and_no_folder(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such folder"):
        find_drops(tmp_path / "nowhere")
    with pytest.raises(InputError, match=r"holds no experiment\.yaml; `wentry init"):
        find_drops(tmp_path)


@pytest.mark.parametrize("source", ["cam", "cam/clip.avi"])
def test_a_view_of_a_drop_is_no_drop_without_its_file(tmp_path: Path, source: str) -> None:
    (tmp_path / "cam").mkdir()
    (tmp_path / "cam" / "clip.avi").touch()
    (tmp_path / "experiment.yaml").write_text(f"views:\n  side: {{source: {source}}}\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"cam: is the side view of the drop .*; give that folder$"):
        find_drops(tmp_path / "cam")


def test_set_overrides_and_is_located(tmp_path: Path) -> None:
    _write(tmp_path, GOOD)
    drop = read_drop("drop", tmp_path, overrides_document(("analysis.tracking=fast", "views.side.fps=1e3")))
    assert drop.experiment.analysis.tracking == "fast"
    assert drop.view("side").fps == 1000
    with pytest.raises(ConfigurationError, match=r"--set analysis\.trucking.*did you mean tracking"):
        read_drop("drop", tmp_path, overrides_document(("analysis.trucking=fast",)))
    with pytest.raises(ConfigurationError) as caught:
        read_drop("drop", tmp_path, overrides_document(("analysis.smother=gcv",)))
    assert str(caught.value).startswith("--set analysis.smother: error: analysis.smother: unknown key")
    with pytest.raises(ConfigurationError, match=r"write key\.path=value"):
        overrides_document(("tracking",))


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        ("!!int abc", "1:1: error: tags (!…) are not read"),
        ("&a x", "1:1: error: anchors (&a) are not read"),
        ("{1: 2}", "1:2: error: a key must be a plain word, not 1"),
        ('"\\U00110000"', "1:1: error: not valid YAML: an escape such as \\U names no character"),
        ("[", "error: not valid YAML"),
        (
            "a\n---\nb",
            "2:1: error: not valid YAML: expected a single document in the stream, but found another document",
        ),
    ],
)
def test_set_reads_as_a_file_does(value: str, expected: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        overrides_document((f"condition={value}",))
    assert str(caught.value).startswith("--set condition:")
    assert expected in str(caught.value)


def test_water_at_twenty_degrees() -> None:
    water = water_properties(20.0)
    assert water["density_kg_m3"] == pytest.approx(998.204, abs=0.02)
    assert water["viscosity_pa_s"] == pytest.approx(1.0016e-3, rel=0.01)
    assert water["surface_tension_n_m"] == pytest.approx(0.07275, abs=1e-4)


def filled(folder: Path) -> Path:
    """What a user fills in."""
    path = folder / "experiment.yaml"
    text = path.read_text(encoding="utf-8")
    for key, value in (("diameter_m", "0.051"), ("density_kg_m3", "1070"), ("material", "rigid"), ("fps", "2000")):
        text = re.sub(rf"^( +{key}:) +#", rf"\1 {value} #", text, flags=re.MULTILINE)
    path.write_text(text, encoding="utf-8")
    return path


def test_the_scaffold_asks_for_what_only_the_user_knows(tmp_path: Path) -> None:
    write_scaffold(tmp_path)
    with pytest.raises(ConfigurationError, match=r"diameter_m: is left empty; fill it in"):
        read_drop("drop", tmp_path)
    given = read_drop("drop", tmp_path, overrides_document(("sphere.diameter_m=0.051",)))
    info = RecordingInfo(tmp_path / "side", "PNG images", 20, 64, 64, 8, None, RATE_UNKNOWN, None)
    with pytest.raises(
        ConfigurationError, match=r"yaml:13:5: error: views\.side\.fps: side has no frame rate .* give that of"
    ):
        frame_rate(given, "side", info)


def test_the_filled_scaffold_is_valid_and_never_overwritten(tmp_path: Path) -> None:
    (tmp_path / "run_top.cihx").touch()
    (tmp_path / "run_side.cine").touch()
    write_scaffold(tmp_path)
    filled(tmp_path)
    drop = read_drop("drop", tmp_path)
    assert drop.view("side").source == "run_side.cine"
    assert drop.view("top").source == "run_top.cihx"
    with pytest.raises(InputError, match="stands already"):
        write_scaffold(tmp_path)


@pytest.mark.parametrize("kind", ["water_entry", "surface_impact", "free_flight"])
def test_the_scaffold_is_of_the_kind_asked_for(tmp_path: Path, kind: str) -> None:
    write_scaffold(tmp_path, kind)
    path = filled(tmp_path)
    drop = read_drop("drop", tmp_path)
    assert drop.experiment.kind == kind
    assert ("material" in path.read_text(encoding="utf-8")) is (kind != "free_flight")


def test_the_scaffold_needs_a_folder(tmp_path: Path) -> None:
    (tmp_path / "clip.avi").touch()
    for folder in (tmp_path / "clip.avi", tmp_path / "clip.avi" / "below"):
        with pytest.raises(InputError, match=r"clip\.avi: is a file; give the folder that holds the recording"):
            write_scaffold(folder)
    with pytest.raises(InputError, match=r"new: no such folder; check the name, or make it first"):
        write_scaffold(tmp_path / "new" / "drop")
    assert not (tmp_path / "new").exists()
    assert write_scaffold(tmp_path / "new").path.is_file()


@pytest.mark.parametrize(
    ("images", "others", "sources"),
    [
        ("img_{:04d}.png", ["Camera_1.cih"], {"side": "."}),
        ("img_{:04d}.tif", ["results/x.csv"], {"side": "."}),
        ("img_{:04d}.png", ["dark.png"], {"side": "img_*.png"}),
        ("img_{:04d}.png", ["top_1.png", "top_2.png", "top_3.png"], {"side": "img_*.png", "top": "top_*.png"}),
        ("photo_{:04d}.jpg", ["run.cihx", "run.mraw"], {"side": "run.cihx"}),
    ],
)
def test_the_scaffold_names_images_beside_it(
    tmp_path: Path, images: str, others: list[str], sources: dict[str, str]
) -> None:
    for name in [*(images.format(number) for number in range(3)), *others]:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    write_scaffold(tmp_path)
    filled(tmp_path)
    drop = read_drop("drop", tmp_path)
    assert {view: drop.view(view).source for view in drop.experiment.sides} == sources


def test_two_stacks_are_no_series_of_images(tmp_path: Path) -> None:
    for name in ("cam1.tif", "cam2.tif"):
        (tmp_path / name).touch()
    assert write_scaffold(tmp_path).sources == {"side": "cam1.tif"}


def test_the_page_of_defaults_is_true() -> None:
    document = read_document(packaged_config("default.yaml"))
    required = Document({"kind": "water_entry", "sphere": {"diameter_m": 0.1}, "views": {"side": {"source": "x"}}})
    assert validate(Experiment, document.over(required)) == validate(Experiment, required)
