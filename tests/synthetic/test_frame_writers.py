from __future__ import annotations

import xml.etree.ElementTree as ET

import cv2
import numpy as np
import pytest

from wentry_cli.synthetic.frame_writers import PhotronWriter, open_writer, pack_12bit
from wentry_cli.synthetic.scene import Camera


def camera(**keys) -> Camera:
    return Camera.model_validate({"width": 32, "height": 33, "scale_px_per_m": 100.0, **keys})


def test_twelve_bits_are_packed_most_significant_first():
    assert pack_12bit(np.array([[0xABC, 0xDEF], [0x001, 0xF00]], np.uint16)) == bytes.fromhex("abcdef001f00")


def test_mraw_bytes_decode_by_hand(tmp_path):
    rng = np.random.default_rng(0)
    frames = rng.integers(0, 4096, (3, 33, 32)).astype(np.uint16)
    writer = PhotronWriter(tmp_path, "side", camera(bits=12, format="mraw", fps=2000.0))
    for k, frame in enumerate(frames):
        writer.write(52 + k, frame)
    writer.close()
    raw = (tmp_path / "side.mraw").read_bytes()
    assert len(raw) == 3 * 33 * 32 * 3 // 2
    pixels = []
    for a, b, c in zip(raw[::3], raw[1::3], raw[2::3], strict=True):
        pixels += [a << 4 | b >> 4, (b & 15) << 8 | c]
    np.testing.assert_array_equal(np.reshape(pixels, frames.shape), frames)


def test_cihx_header_says_what_was_written(tmp_path):
    writer = PhotronWriter(tmp_path, "side", camera(bits=12, format="mraw", fps=2000.0, exposure_s=5e-5))
    for k in range(4):
        writer.write(7 + k, np.zeros((33, 32), np.uint16))
    writer.close()
    data = (tmp_path / "side.cihx").read_bytes()
    assert data.startswith(b"!!! This file can not be edited. !!!")
    root = ET.fromstring(data[data.index(b"<?xml") :])
    values = {
        "imageDataInfo/resolution/width": "32", "imageDataInfo/resolution/height": "33",
        "imageDataInfo/colorInfo/bit": "12", "imageDataInfo/effectiveBit/side": "Lower",
        "frameInfo/totalFrame": "4", "frameInfo/startFrame": "7", "frameInfo/skipFrame": "1",
        "recordInfo/recordRate": "2000", "recordInfo/shutterSpeedNsec": "50000",
    }  # fmt: skip
    assert {path: root.findtext(path) for path in values} == values


@pytest.mark.parametrize(("form", "bits", "suffix"), [("png", 8, ".png"), ("png", 12, ".png"), ("tiff", 16, ".tif")])
def test_images_come_back_as_they_were(tmp_path, form, bits, suffix):
    levels = np.random.default_rng(1).integers(0, 2**bits, (33, 32))
    levels = levels.astype(np.uint8 if bits == 8 else np.uint16)
    writer = open_writer(tmp_path, "side", camera(format=form, bits=bits))
    writer.write(12, levels)
    writer.close()
    np.testing.assert_array_equal(cv2.imread(str(tmp_path / "side" / f"side_000012{suffix}"), -1), levels)
