"""Film strips: where the overlay of a sphere in water ends."""

from __future__ import annotations

import math

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from wentry_cli.report.film_strips import _draw_strip
from wentry_cli.report.moments import Moment
from wentry_cli.report.strip_frames import Shot

SIZE = 100
SURFACE = 45.0
ROW = {"center_x_px": 50.0, "center_y_px": 45.0, "radius_px": 20.0, "stretch": 1.0, "tilt_deg": math.nan,
       "bottom_y_px": 65.0, "bottom_local_y_px": math.nan, "separation_y_px": math.nan, "status": "ok"}  # fmt: skip


def _yellow_rows(t_s: float, surface: float) -> NDArray[np.float64]:
    """The rows of the picture in which something of the ellipse is drawn, in pixels of the frame."""
    picture = np.full((SIZE, SIZE), 128, np.uint8)
    figure = Figure(figsize=(4.0, 4.0), dpi=100)
    canvas = FigureCanvasAgg(figure)
    shot = Shot(picture, {**ROW, "t_s": t_s, "frame": 0}, Moment(t_s, ""))
    _draw_strip(figure, [shot], (0, 0, SIZE, SIZE), "side", math.nan, surface)
    canvas.draw()
    levels = np.asarray(canvas.buffer_rgba())[:, :, :3] / 255.0
    yellow = levels[:, :, :2].min(axis=2) - levels[:, :, 2] > 0.25  # the picture below is grey
    shown = np.flatnonzero(yellow.any(axis=1))
    to_frame = figure.axes[0].transData.inverted()
    rows = [to_frame.transform((0.0, levels.shape[0] - 0.5 - row))[1] for row in shown]
    return np.array(rows)


@pytest.mark.parametrize("dark_side", ["right", "left"])
def test_the_scale_bar_stands_out_from_the_ground_below_it(dark_side: str) -> None:
    picture = np.full((SIZE, SIZE), 255, np.uint8)
    picture[:, slice(SIZE // 2, None) if dark_side == "right" else slice(0, SIZE // 2)] = 0
    figure = Figure(figsize=(4.0, 4.0), dpi=100)
    shot = Shot(picture, {"t_s": 0.0, "status": "gap"}, Moment(0.0, ""))
    _draw_strip(figure, [shot], (0, 0, SIZE, SIZE), "side", 1000.0, math.nan)
    (bar,) = figure.axes[0].patches
    assert bar.get_window_extent().width > 20.0
    assert bar.get_facecolor()[:3] == ((1.0,) * 3 if dark_side == "right" else (0.0,) * 3)


def test_the_ellipse_of_a_sphere_in_water_ends_at_the_surface() -> None:
    rows = _yellow_rows(0.01, SURFACE)
    assert rows.min() == pytest.approx(SURFACE, abs=1.0)
    assert rows.max() == pytest.approx(65.0, abs=1.0)


@pytest.mark.parametrize(("t_s", "surface"), [(-0.01, SURFACE), (0.01, math.nan)])
def test_before_impact_and_without_a_surface_it_is_whole(t_s: float, surface: float) -> None:
    rows = _yellow_rows(t_s, surface)
    assert (rows.min(), rows.max()) == (pytest.approx(25.0, abs=1.0), pytest.approx(65.0, abs=1.0))
