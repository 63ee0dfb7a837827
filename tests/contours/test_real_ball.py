"""A real recording: a dark ball with a bright middle before a clipped back light (data/README.md)."""

from pathlib import Path

import numpy as np
import pytest

from wentry_cli.contours.ellipse import EllipseShape
from wentry_cli.contours.local_bottom import fit_local_bottom
from wentry_cli.contours.silhouette import fit_silhouette
from wentry_cli.imaging.patch import Patch

RECORDING = Path(__file__).parents[3] / "shared" / "data" / "photron" / "ball_12bit.mraw"
MOTION_PX = 2.647 * 30_000 * 20e-6

pytestmark = pytest.mark.skipif(not RECORDING.is_file(), reason=f"no recording at {RECORDING}")


def frames():
    triples = np.fromfile(RECORDING, np.uint8).reshape(-1, 3).astype(np.uint16)
    first = triples[:, 0] << 4 | triples[:, 1] >> 4
    second = (triples[:, 1] & 15) << 8 | triples[:, 2]
    return np.stack([first, second], axis=1).reshape(15, 384, 384)


@pytest.mark.parametrize("level", ["fast", "accurate"])
@pytest.mark.parametrize("clip", ["kept", "masked"])
def test_the_ball_is_a_falling_sphere(level, clip):
    if (level, clip) == ("fast", "masked"):
        pytest.skip("edges along normals need the light that was masked")
    fits = []
    for index, frame in enumerate(frames()):
        values = (frame / 4095.0).astype(np.float32)
        if clip == "masked":
            values[frame == 4095] = np.nan
        y0 = int(20 + 2.6 * index)
        patch = Patch(
            np.ascontiguousarray(values[y0 : y0 + 180, 90:270]), 90, y0, 0.0, 0.999 if clip == "kept" else np.inf
        )
        guess = EllipseShape(172.0, 112.0 + 2.6 * index, 62.0)
        fit = fit_silhouette(patch, guess, free="x y R stretch", motion_px=(0.0, MOTION_PX), level=level)
        assert fit.status == "ok"
        fits.append((fit, fit_local_bottom(patch, fit, motion_px=(0.0, MOTION_PX))))
    number = np.arange(15)
    rows = np.array([fit.center_y_px for fit, _ in fits])
    assert all(125.5 < 2 * fit.radius_px < 127.2 for fit, _ in fits)
    assert all(abs(fit.stretch - 1.0) < 0.005 for fit, _ in fits)
    assert np.polyfit(number, rows, 1)[0] == pytest.approx(2.647, abs=0.01)
    assert rows[0] == pytest.approx(109.594, abs=0.1)
    assert rows[14] == pytest.approx(146.653, abs=0.1)
    scatter = np.std(rows - np.polyval(np.polyfit(number, rows, 2), number), ddof=3)
    assert scatter < 2.0 * np.mean([fit.center_y_unc_px for fit, _ in fits])
    caps = np.array([cap.y_px for _, cap in fits if cap.status == "ok"])
    assert len(caps) >= (12 if clip == "kept" else 0)
