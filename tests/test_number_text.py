"""The text of many numbers is what ``%.9g`` makes of each."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from wentry_cli.number_text import text_of
from wentry_cli.tables import MANY_CELLS, new_table, write_table

SPECIAL = [
    0.0,
    -0.0,
    1e-5,
    1e8,
    1e9,
    -123456789.5,
    999999999.5,
    9.999999995,
    99999.99995,
    9.9999999999e-5,
    5e-324,
    1e300,
]


def plain(values: NDArray[np.float64]) -> bytes:
    rows = (",".join("" if np.isnan(cell) else f"{cell:.9g}" for cell in row) for row in values)
    return "".join(f"{row}\n" for row in rows).encode()


def _numbers(kind: str) -> NDArray[np.float64]:
    random = np.random.default_rng(7)
    shape = (3000, 4)
    sizes = random.normal(size=shape) * 10.0 ** random.uniform(-25, 25, shape)
    return {
        "of any size": sizes,
        "rounded": np.round(random.normal(size=shape) * 100.0, 3),
        "of nine digits": np.array([float(f"{cell:.9g}") for cell in sizes.flat]).reshape(shape),
        "whole": random.integers(-(10**10), 10**10, shape).astype(float),
        "half way": random.integers(0, 10**6, shape) / 2.0 ** random.integers(0, 30, shape),
        "special": np.resize(SPECIAL, shape),
    }[kind]


@pytest.mark.parametrize("kind", ["of any size", "rounded", "of nine digits", "whole", "half way", "special"])
def test_text_is_that_of_each_number(kind: str) -> None:
    values = _numbers(kind)
    values[::7, 1] = np.nan
    assert text_of(values) == plain(values)


def test_words_stand_between_numbers() -> None:
    values = np.array([[1.5, 0.0, np.nan], [np.nan, 2.0, 1.0], [-2.0, np.nan, 0.0]])
    words = {1: [b"ok", b"", b"poor_fit"], 2: [b'"a,b"', b"late"]}
    assert text_of(values, words) == b'1.5,ok,\n,poor_fit,late\n-2,,"a,b"\n'


def test_a_large_table_of_words_has_the_bytes_of_its_parts(tmp_path) -> None:
    words = np.array(["ok", "", None, 'of "5" kinds, one', "ö"], dtype=object)
    count = MANY_CELLS
    columns = {"view": ["side"] * count, "frame": np.arange(count), "time_s": np.arange(count) / 3.0}
    columns["status"] = np.resize(words, count)

    def body(part: slice) -> bytes:
        table = new_table("frames", {name: values[part] for name, values in columns.items()})
        return write_table(tmp_path, "frames", table).read_bytes().split(b"\n", 1)[1]

    step = MANY_CELLS // 10
    assert body(slice(None)) == b"".join(body(slice(first, first + step)) for first in range(0, count, step))


def test_a_large_table_has_the_bytes_of_its_parts(tmp_path) -> None:
    random = np.random.default_rng(8)
    whole = np.arange(2 * MANY_CELLS)
    columns = {"frame": whole, "t_s": random.normal(size=whole.size), "wall": whole % 3, "y_m": whole / 7.0}
    columns["left_m"] = np.where(whole % 5, -columns["y_m"], np.nan)

    def body(part: slice) -> bytes:
        table = new_table("cavity", {name: values[part] for name, values in columns.items()})
        return write_table(tmp_path, "cavity", table).read_bytes().split(b"\n", 1)[1]

    step = MANY_CELLS // 10
    parts = b"".join(body(slice(first, first + step)) for first in range(0, whole.size, step))
    assert body(slice(None)) == parts
