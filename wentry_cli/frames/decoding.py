"""Bytes of a still image to grey levels: decoding by OpenCV, colour to luminance, damage told from content."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from wentry_cli.errors import FrameUnreadableError
from wentry_cli.frames.image_headers import is_damaged
from wentry_cli.frames.reader import Frame

# A damaged file becomes one sentence, not a page of warnings. OpenCV 4 has the function at its top, 5 in a module.
(cv2.setLogLevel if hasattr(cv2, "setLogLevel") else cv2.utils.logging.setLogLevel)(0)


def decode_grey(data: bytes, name: str) -> Frame:
    """Return the grey levels of the image in ``data``; ``name`` is for the message.

    Colour becomes luminance, which for equal channels is that channel exactly. Raises ``FrameUnreadableError`` where
    the bytes end early or cannot be decoded to 8 or 16 bit.
    """
    if is_damaged(data):
        raise FrameUnreadableError(f"{name}: the image is cut off or damaged")
    try:
        image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED) if data else None
    except cv2.error as error:
        raise FrameUnreadableError(f"{name}: cannot be decoded") from error
    if image is None:
        raise FrameUnreadableError(f"{name}: cannot be decoded")
    return to_grey(image, name)


def to_grey(image: NDArray[Any], name: str) -> Frame:
    """Return the one channel of ``image`` or the luminance of its three or four (blue, green, red, opacity)."""
    if image.dtype not in (np.uint8, np.uint16):
        raise FrameUnreadableError(f"{name}: grey levels of type {image.dtype} are not supported, save 8 or 16 bit")
    if image.ndim == 2:
        return image
    if image.shape[2] == 1:
        return image[:, :, 0]
    if image.shape[2] == 2:  # grey and opacity
        return image[:, :, 0].copy()
    code = cv2.COLOR_BGR2GRAY if image.shape[2] == 3 else cv2.COLOR_BGRA2GRAY
    return np.asarray(cv2.cvtColor(image, code))
