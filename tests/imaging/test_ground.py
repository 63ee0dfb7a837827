"""The empty scene, block by block."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from wentry_cli.imaging.clean_mean import BLOCK_PX
from wentry_cli.imaging.ground import block_means


@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.float32])
@pytest.mark.parametrize("shape", [(64, 48), (61, 50), (33, 101)])
def test_block_means_are_those_of_an_area_average(kind: type, shape: tuple[int, int]) -> None:
    image = (np.random.default_rng(2).random(shape) * 250.0).astype(kind)
    rows, columns = (-(-length // BLOCK_PX) for length in shape)
    beyond = rows * BLOCK_PX - shape[0], columns * BLOCK_PX - shape[1]
    whole = np.pad(image, ((0, beyond[0]), (0, beyond[1])), mode="edge")
    expected = cv2.resize(whole, (columns, rows), interpolation=cv2.INTER_AREA)
    np.testing.assert_allclose(block_means(image), expected, rtol=1e-6)
