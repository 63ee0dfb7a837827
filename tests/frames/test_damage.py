"""Any truncation and any flipped byte of any recording ends in a sentence, never in a traceback or a huge array."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from recording_bytes import bmp, cih, cihx, cine, grey, pack_bits, png, tiff

from wentry_cli.errors import WentryError
from wentry_cli.frames.formats import open_recording

LEVELS = grey(8, 4, frames=2)
PIXELS = LEVELS.astype(np.uint8).tobytes()
SIZE = {"width": 8, "height": 4, "frames": 2}
RECORDINGS = {
    "clip.cih": cih(**SIZE).encode(),
    "clip.cihx": cihx(**SIZE),
    "eight.cine": cine([PIXELS[:32], PIXELS[32:]], width=8, height=4, times=[0, 0.1], setup_length=160),
    "ten.cine": cine([pack_bits(f, 10) for f in LEVELS], width=8, height=4, bits=16, packing=256, setup_length=160),
    "plain.tif": tiff(list(LEVELS), 8),
    "big.tif": tiff(list(LEVELS), 16, ">", big=True, compression=8),
    "images/f1.png": png(LEVELS[0], 16),
    "images/f1.bmp": bmp(LEVELS[0]),
    "images/f1.tif": tiff([LEVELS[0]], 8),
}


def read_all(path: Path) -> None:
    """Read what can be read; only a WentryError may come out."""
    try:
        recording = open_recording(path)
    except WentryError:
        return
    assert recording.info.frame_count < 10_000
    for index in range(min(3, recording.info.frame_count)):
        with suppress(WentryError):
            frame = recording.read(index)
            assert frame.shape == (recording.info.height, recording.info.width)
            assert frame.dtype in (np.uint8, np.uint16)
    recording.close()


def lay(folder: Path, name: str, data: bytes) -> Path:
    path = folder / name
    path.parent.mkdir(exist_ok=True)
    for old in path.parent.glob("*"):
        if old.is_file():
            old.unlink()
    path.write_bytes(data)
    if name.startswith("clip"):
        (folder / "clip.mraw").write_bytes(PIXELS)
    return path.parent if name.startswith("images/") else path


@pytest.mark.parametrize("name", RECORDINGS)
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(part=st.floats(0, 1))
def test_cut_anywhere(tmp_path: Path, name: str, part: float) -> None:
    data = RECORDINGS[name]
    read_all(lay(tmp_path, name, data[: int(part * len(data))]))


@pytest.mark.parametrize("name", RECORDINGS)
@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(changes=st.lists(st.tuples(st.floats(0, 1, exclude_max=True), st.integers(0, 255)), min_size=1, max_size=4))
def test_bytes_changed_anywhere(tmp_path: Path, name: str, changes: list[tuple[float, int]]) -> None:
    data = bytearray(RECORDINGS[name])
    for place, value in changes:
        data[int(place * len(data))] = value
    read_all(lay(tmp_path, name, bytes(data)))


@pytest.mark.parametrize("name", RECORDINGS)
def test_undamaged_it_is_read(tmp_path: Path, name: str) -> None:
    recording = open_recording(lay(tmp_path, name, RECORDINGS[name]))
    expected = LEVELS[0] if name != "eight.cine" else LEVELS[0][::-1]
    if name != "ten.cine":
        np.testing.assert_array_equal(recording.read(0), expected)
