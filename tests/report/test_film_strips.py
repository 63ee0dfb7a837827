"""Film strips: where the overlay of a sphere in water ends."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fixture_campaign import Made, configured, film, write_campaign
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from wentry_cli.report.campaign import read_campaign
from wentry_cli.report.drop_sheets import drop_sheets
from wentry_cli.report.film_strips import _draw_strip, film_strips
from wentry_cli.report.moments import Moment
from wentry_cli.report.panel import NotDrawn, Panel
from wentry_cli.report.strip_frames import Shot, _region
from wentry_cli.stages.ingest import open_view

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


@pytest.mark.parametrize("level", [0, 128, 255, "mixed"])
def test_the_scale_bar_stands_out_from_any_ground(level: int | str) -> None:
    picture = np.full((SIZE, SIZE), 255 if level == "mixed" else level, np.uint8)
    if level == "mixed":  # half of the bar over black, in every corner
        picture[:, 16:84] = 0
    figure = Figure(figsize=(4.0, 4.0), dpi=100)
    canvas = FigureCanvasAgg(figure)
    shot = Shot(picture, {"t_s": 0.0, "status": "gap"}, Moment(0.0, ""))
    _draw_strip(figure, [shot], (0, 0, SIZE, SIZE), "side", 1000.0, math.nan)
    canvas.draw()
    levels = np.asarray(canvas.buffer_rgba())[:, :, 0].astype(float)
    bar = figure.axes[0].patches[-1].get_window_extent()
    assert bar.width > 20.0
    rows = slice(round(levels.shape[0] - bar.y1) - 3, round(levels.shape[0] - bar.y0) + 3)
    across = levels[rows, round(bar.x0) + 2 : round(bar.x1) - 2]
    assert np.ptp(across, axis=0).min() > 100.0  # along all of its length
    (length,) = figure.axes[0].texts
    assert length.get_text() == "20 mm"
    assert figure.axes[0].bbox.contains(*length.get_window_extent().min)
    assert figure.axes[0].bbox.contains(*length.get_window_extent().max)


@pytest.mark.parametrize(("ground", "sphere"), [(255, 0), (0, 255), (180, 90)])
@pytest.mark.parametrize(
    ("covered", "right", "low"),
    [
        ([], True, True),
        ([(80, 80)], False, True),
        ([(80, 80), (20, 80)], True, False),
        ([(80, 20)], True, True),
        ([(50, 82)], True, False),
    ],
)
def test_the_scale_bar_keeps_off_the_sphere(
    ground: int, sphere: int, covered: list[tuple[int, int]], right: bool, low: bool
) -> None:
    across, down = np.meshgrid(np.arange(SIZE), np.arange(SIZE))
    picture = np.full((SIZE, SIZE), ground, np.uint8)
    for x, y in covered:
        picture[np.hypot(across - x, down - y) < 19.0] = sphere
    figure = Figure(figsize=(1.4, 1.8), dpi=100)
    canvas = FigureCanvasAgg(figure)
    shot = Shot(picture, {"t_s": 0.0, "status": "gap"}, Moment(0.0, ""))
    _draw_strip(figure, [shot], (0, 0, SIZE, SIZE), "side", 1000.0, math.nan)
    canvas.draw()
    ax = figure.axes[0]
    (x0, y0), (x1, y1) = ax.transData.inverted().transform(ax.patches[-1].get_window_extent().get_points())
    assert (0.5 * (x0 + x1) > 50.0, 0.5 * (y0 + y1) > 50.0) == (right, low)
    (length,) = ax.texts
    for corner in (length.get_window_extent().min, length.get_window_extent().max):
        assert ax.bbox.contains(*corner)


@pytest.mark.parametrize(
    ("status", "title"), [("ok", "18.4 ms\nlongest"), ("poor_fit", "18.4 ms\nlongest\n(poor fit)")]
)
def test_a_picture_names_its_moment_and_what_was_not_measured(status: str, title: str) -> None:
    figure = Figure()
    shots = [
        Shot(np.zeros((SIZE, SIZE), np.uint8), {**ROW, "t_s": t, "status": status}, Moment(t, "longest"))
        for t in (0.0184, 0.03)
    ]
    _draw_strip(figure, shots, (0, 0, SIZE, SIZE), "side", math.nan, math.nan)
    assert figure.axes[0].get_title(loc="center") == title


def test_the_caption_of_a_strip_says_how_its_greys_are_stretched(tmp_path: Path) -> None:
    """The film has levels 40 and 200 only."""
    made = Made("soft")
    (drop,) = read_campaign(tmp_path, write_campaign(tmp_path, (made,))).drops
    film(tmp_path / "videos", made)
    (configuration,) = configured(tmp_path / "videos", (made,))
    side, _ = film_strips(drop, lambda name, view: open_view(configuration, view).recording)
    assert isinstance(side, Panel)
    assert "Grey levels 40 to 200 of the recording" in side.caption


def test_a_drop_that_was_not_tracked_has_no_sheet_and_its_strip_says_so(tmp_path: Path) -> None:
    made = Made("plate", kind="surface_impact")
    campaign = read_campaign(tmp_path, write_campaign(tmp_path, (made,)))
    (drop,) = campaign.drops
    film(tmp_path / "videos", made)
    (configuration,) = configured(tmp_path / "videos", (made,))
    for error, told in (("", False), ("plate: no plate was found", True)):
        failed = replace(drop, stages={"track": {"error": error} if error else {}})
        (sheet,) = drop_sheets(replace(campaign, drops=(failed,)))
        assert isinstance(sheet, NotDrawn) is told
        (strip, *_) = film_strips(failed, lambda name, view: open_view(configuration, view).recording)
        assert isinstance(strip, Panel)
        assert ("could not be tracked (no plate was found): what is drawn is no measurement" in strip.caption) is told
        if isinstance(sheet, NotDrawn):
            assert sheet.reason == "it could not be tracked: no plate was found"


def test_the_region_of_a_strip_holds_every_outline_that_is_drawn(tmp_path: Path) -> None:
    """A sphere that is wide in a few frames only is whole in them."""
    made = Made("soft")
    (drop,) = read_campaign(tmp_path, write_campaign(tmp_path, (made,))).drops
    film(tmp_path / "videos", made, 36)
    top = drop.table("top").copy()
    wide = top.index[10]
    radius = float(top["radius_px"].median())
    top.loc[wide, ["radius_px", "status"]] = [1.7 * radius, "ok"]
    drops = configured(tmp_path / "videos", (made,))
    recording = open_view(drops[0], "top").recording
    shown: dict[str, Any] = {str(key): value for key, value in top.loc[wide].items()}
    drop = replace(drop, tables={**drop.tables, "top": top})
    left, upper, right, lower = _region(drop, "top", recording, [shown])
    x, y, size = shown["center_x_px"], shown["center_y_px"], shown["radius_px"]
    info = recording.info
    assert left <= max(x - 1.1 * size, 0) + 1
    assert upper <= max(y - 1.1 * size, 0) + 1
    assert right >= min(x + 1.1 * size, info.width) - 1
    assert lower >= min(y + 1.1 * size, info.height) - 1
    recording.close()


def test_the_ellipse_of_a_sphere_in_water_ends_at_the_surface() -> None:
    rows = _yellow_rows(0.01, SURFACE)
    assert rows.min() == pytest.approx(SURFACE, abs=1.0)
    assert rows.max() == pytest.approx(65.0, abs=1.0)


@pytest.mark.parametrize(("t_s", "surface"), [(-0.01, SURFACE), (0.01, math.nan)])
def test_before_impact_and_without_a_surface_it_is_whole(t_s: float, surface: float) -> None:
    rows = _yellow_rows(t_s, surface)
    assert (rows.min(), rows.max()) == (pytest.approx(25.0, abs=1.0), pytest.approx(65.0, abs=1.0))
