"""Unpacking against bits written one by one."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from recording_bytes import pack_bits

from wentry_cli.frames.linearisation import levels_of_10bit_codes
from wentry_cli.frames.packed import unpack_10bit, unpack_12bit


@settings(max_examples=60, deadline=None)
@given(width=st.integers(1, 13), height=st.integers(1, 6), seed=st.integers(0, 99), data=st.data())
def test_any_rectangle_of_12_bit_rows(width: int, height: int, seed: int, data: st.DataObject) -> None:
    levels = np.random.default_rng(seed).integers(0, 4096, (height, width))
    packed = np.frombuffer(pack_bits(levels, 12), np.uint8).copy()
    x0, y0 = data.draw(st.integers(0, width - 1)), data.draw(st.integers(0, height - 1))
    x1, y1 = data.draw(st.integers(x0 + 1, width)), data.draw(st.integers(y0 + 1, height))
    out = np.full((y1 - y0, x1 - x0), 7, np.uint16)
    unpack_12bit(packed, y0 * width + x0, width, out)
    np.testing.assert_array_equal(out, levels[y0:y1, x0:x1])


@settings(max_examples=60, deadline=None)
@given(width=st.integers(1, 13), height=st.integers(1, 6), seed=st.integers(0, 99), data=st.data())
def test_any_rectangle_of_10_bit_rows_through_a_table(width: int, height: int, seed: int, data: st.DataObject) -> None:
    codes = np.random.default_rng(seed).integers(0, 1024, (height, width))
    table = np.arange(1024, dtype=np.uint16)[::-1].copy()
    x0, y0 = data.draw(st.integers(0, width - 1)), data.draw(st.integers(0, height - 1))
    x1, y1 = data.draw(st.integers(x0 + 1, width)), data.draw(st.integers(y0 + 1, height))
    out = np.empty((y1 - y0, x1 - x0), np.uint16)
    packed = np.frombuffer(pack_bits(codes, 10), np.uint8).copy()
    unpack_10bit(packed, y0 * width + x0, width, table, out)
    np.testing.assert_array_equal(out, 1023 - codes[y0:y1, x0:x1])


def test_the_most_significant_bits_come_first() -> None:
    out = np.empty((1, 2), np.uint16)
    unpack_12bit(np.array([0x12, 0x34, 0x56], np.uint8), 0, 2, out)
    assert out.tolist() == [[0x123, 0x456]]


def test_linearisation_at_published_codes() -> None:
    levels = levels_of_10bit_codes()
    assert levels.shape == (1024,)
    assert [int(levels[code]) for code in (0, 1, 2, 100, 300, 450, 1014, 1015, 1023)] == [
        2, 5, 6, 98, 374, 777, 4064, 4095, 4095,
    ]  # fmt: skip
    steps = np.diff(levels.astype(int))
    assert steps.min() == 0
    assert steps[:1014].max() == 9
    assert int(levels.astype(np.int64).sum()) == 1398175
