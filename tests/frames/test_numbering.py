"""Numbers in file names: natural order, gaps, duplicates, and folders that hold more than one series."""

from __future__ import annotations

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wentry_cli.errors import InputError
from wentry_cli.frames.numbering import natural_key, number_files


def test_natural_order_is_not_alphabetical() -> None:
    names = ["f10.png", "f9.png", "f1.png", "f2.png", *(f"f{i}.png" for i in range(3, 9))]
    numbering = number_files(names, "here")
    assert numbering.names == tuple(f"f{i}.png" for i in range(1, 11))
    assert numbering.numbers.tolist() == list(range(1, 11))
    assert (numbering.gaps, numbering.duplicates, numbering.notes) == (0, (), ())


@given(st.sets(st.integers(0, 300), min_size=40, max_size=120), st.integers(1, 6), st.randoms())
def test_any_order_of_files_gives_the_same_frames(numbers: set[int], pad: int, shuffler: random.Random) -> None:
    names = [f"img-{number:0{pad}d}.tif" for number in numbers]
    shuffled = names.copy()
    shuffler.shuffle(shuffled)
    numbering = number_files(shuffled, "here")
    found = {int(n): name for n, name in zip(numbering.numbers, numbering.names, strict=True) if name is not None}
    assert found == dict(zip(numbers, names, strict=True))
    assert numbering.gaps == max(numbers) - min(numbers) + 1 - len(numbers)


def test_a_gap_is_a_frame_without_a_file() -> None:
    numbering = number_files(["a7.png", "a8.png", "a10.png"], "here")
    assert numbering.names == ("a7.png", "a8.png", None, "a10.png")
    assert numbering.gaps == 1


@pytest.mark.parametrize("pair", [("f003.png", "f3.png"), ("f3.png", "f3.jpg"), ("f3.PNG", "f03.tif")])
def test_a_number_taken_twice_is_reported(pair: tuple[str, str]) -> None:
    numbering = number_files(["f1.png", "f2.png", *pair], "here")
    assert numbering.names == ("f1.png", "f2.png", pair[0])
    assert numbering.duplicates == (pair[1],)
    assert numbering.notes == (f"'{pair[1]}' has the number of '{pair[0]}', which is used",)


@pytest.mark.parametrize(
    ("names", "shown"),
    [
        (["top_1.png", "top_2.png", "side_1.png"], "'side_*' (1), 'top_*' (2)"),
        (["f1.png", "f2.png", "background.png"], "'f*' (2), 'background.png'"),
        (["cam1_0001.png", "cam2_0001.png"], "'cam1_*' (1), 'cam2_*' (1)"),
    ],
)
def test_several_series_in_one_folder_are_asked_about(names: list[str], shown: str) -> None:
    with pytest.raises(InputError, match="which one") as caught:
        number_files(names, "here")
    assert shown in str(caught.value)


def test_the_question_names_a_pattern_that_answers_it() -> None:
    with pytest.raises(InputError, match=r"for example 'top_\*\.png'"):
        number_files(["top_1.png", "top_2.png", "side_1.png"], "here")


def test_a_clock_before_the_number_is_no_series() -> None:
    names = [f"20240101_1200{i:02d}_{i:04d}.png" for i in range(5)]
    assert number_files(names, "here").names == tuple(names)


@pytest.mark.parametrize("names", [["f1.png", "f1000000.png"], [f"f{i * 100}.png" for i in range(9)]])
def test_an_absurd_hole_is_a_mistake_in_the_names(names: list[str]) -> None:
    with pytest.raises(InputError, match="would be missing"):
        number_files(names, "here")


def test_numbers_beyond_any_camera() -> None:
    with pytest.raises(InputError):
        number_files([f"f{10**30}.png", f"f{10**30 + 1}.png"], "here")


def test_names_without_numbers_are_taken_alphabetically() -> None:
    numbering = number_files(["b.png", "A.png", "c.png"], "here")
    assert numbering.names == ("A.png", "b.png", "c.png")
    assert numbering.notes == ("file names carry no number: alphabetical order",)


def test_steps_are_said() -> None:
    numbering = number_files(["f0.png", "f2.png", "f4.png", "f6.png"], "here")
    assert numbering.gaps == 3
    assert numbering.notes == ("the numbers go in steps of 2: what lies between counts as gaps",)


def test_natural_key_compares_digits_with_letters() -> None:
    assert sorted(["x", "1", "x10", "x9", "10", "9"], key=natural_key) == ["x", "x9", "x10", "1", "9", "10"]
