"""Hard sequences: the scene of each, and what is done to its frames where no switch of a scene does it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pandas as pd
from numpy.typing import NDArray

from wentry_cli.synthetic.scene import Scene

Levels = NDArray[np.uint8]
SOFT = {"g_inf_pa": 6900.0, "g_t_pa": 6900.0, "n": -0.1902, "eps0_dot_1_s": 0.021}
VERY_SOFT = {"g_inf_pa": 1235.0, "g_t_pa": 1235.0, "n": -1.0, "eps0_dot_1_s": 0.0056}
SMALL = {"diameter_m": 0.051, "material": "dragonskin_6p70_small", "law": SOFT}
SIDE = {"width": 320, "height": 440, "scale_px_per_m": 1400.0, "surface_y_px": 110.3, "exposure_s": 1e-4}
BASE: dict[str, Any] = {
    "sphere": SMALL,
    "height_m": 0.53,
    "side": SIDE,
    "clip": {"before_s": 0.008, "longest_s": 0.05},
}
TO_PINCH_OFF = {"before_s": 0.008, "after_pinch_off_s": 0.006}


@dataclass(frozen=True)
class Rendered:
    """A rendered drop: its folder, the truth of its frames, whose order is that of the files, and of the drop."""

    folder: Path
    frames: pd.DataFrame
    numbers: dict[str, Any]

    @property
    def files(self) -> list[Path]:
        """The images of the side view in the order of their numbers."""
        return sorted((self.folder / "side").glob("*.png"))

    def place(self, row: Any) -> tuple[float, float]:
        """Row of the centre of the sphere and its R in pixels."""
        scale = self.numbers["scale_px_per_m"]
        return self.numbers["surface_y_px"] - scale * row.y_c_m, 0.5 * scale * SMALL["diameter_m"]

    def bottom_row(self) -> NDArray[np.float64]:
        """Row of the lowest point in each frame of the side view, as seen through the water below the surface."""
        y_b, scale = self.frames["y_b_m"].to_numpy(float), self.numbers["scale_px_per_m"]
        row: NDArray[np.float64] = self.numbers["surface_y_px"] - scale * y_b
        axis = self.numbers["optical_axis_y_px"]
        if axis is None:
            return row
        seen = axis + (row - axis) * self.numbers["scale_water_px_per_m"] / scale
        return np.asarray(np.where(y_b < 0.0, seen, row))


Spoil = Callable[[Rendered], Rendered]


def hide(clip: Rendered) -> Rendered:
    """A cloud of spray stands over the whole sphere for some frames: the truth cannot be measured in them."""
    hidden = slice(40, 52)
    centre, radius = clip.place(clip.frames.iloc[(hidden.start + hidden.stop) // 2])
    for number, path in list(enumerate(clip.files))[hidden]:
        rng = np.random.default_rng(number)
        levels = _read(path)
        theta = np.linspace(0.0, 2.0 * np.pi, 90, endpoint=False)
        rough = 2.3 + 0.25 * cv2.GaussianBlur(rng.normal(size=(90, 1)), (1, 9), 2.0)[:, 0]
        middle = 0.5 * (levels.shape[1] - 1)
        edge = np.column_stack([middle + radius * rough * np.cos(theta), centre + radius * rough * np.sin(theta)])
        cover = _cover(levels.shape, edge)
        texture = 45.0 + 60.0 * cv2.GaussianBlur(rng.normal(size=levels.shape), (0, 0), 2.5)
        _write(path, levels * (1.0 - cover) + np.clip(texture, 10.0, 110.0) * cover)
    frames = clip.frames.copy()
    frames.loc[frames.index[hidden], "measurable"] = 0
    return replace(clip, frames=frames)


def add_ball(clip: Rendered, aside: float) -> Rendered:
    """A smaller dark ball overtakes the sphere, ``aside`` R from its axis and nearer to the camera."""
    _, radius = clip.place(clip.frames.iloc[0])
    theta = np.linspace(0.0, 2.0 * np.pi, 90, endpoint=False)
    for number, path in enumerate(clip.files):
        levels = _read(path)
        x, y = 0.5 * (levels.shape[1] - 1) + aside * radius, -40.0 + 4.5 * number
        edge = np.column_stack([x + 0.5 * radius * np.cos(theta), y + 0.5 * radius * np.sin(theta)])
        cover = _cover(levels.shape, edge)
        _write(path, levels * (1.0 - 0.9 * cover))
    return clip


def renumber(clip: Rendered) -> Rendered:
    """Two frames are lost, one in air and one in water, and the frames behind them are numbered anew."""
    lost = [9, 60]
    files = clip.files
    kept = [path for number, path in enumerate(files) if number not in lost]
    images = [path.read_bytes() for path in kept]
    for path, image in zip(files, images, strict=False):
        path.write_bytes(image)
    for path in files[len(kept) :]:
        path.unlink()
    frames = clip.frames.drop(index=lost).reset_index(drop=True)
    return replace(clip, frames=frames.assign(frame=frames.index))


def _read(path: Path) -> Levels:
    levels = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    assert levels is not None
    return levels.astype(np.uint8, copy=False)


def _write(path: Path, levels: NDArray[Any]) -> None:
    cv2.imwrite(str(path), np.clip(np.round(levels), 0, 255).astype(np.uint8))


def _cover(shape: tuple[int, ...], edge: NDArray[np.float64]) -> NDArray[np.float64]:
    """Which share of each pixel lies within a closed outline (x, y), blurred by 1 px."""
    mask = np.zeros(shape, np.uint8)
    cv2.fillPoly(mask, [np.round(16.0 * edge).astype(np.int32)], 255, cv2.LINE_AA, 4)
    return np.asarray(cv2.GaussianBlur(mask / 255.0, (0, 0), 1.0), np.float64)


@dataclass(frozen=True)
class HardSequence:
    """A name, the keys of the scene, what spoils its frames, the view and the events that are judged."""

    name: str
    keys: dict[str, Any] = field(default_factory=dict)
    spoil: Spoil | None = None
    view: str = "side"
    events: tuple[str, ...] = ()

    def scene(self, seed: int) -> Scene:
        """The scene of this sequence."""
        return Scene.model_validate(BASE | self.keys | {"name": "bench", "seed": seed})


CLOSURE, IMPACT = ("pinch_off",), ("impact",)
SEQUENCES = (
    HardSequence("hot pixels", {"switches": {"hot_pixels": 200}}),
    HardSequence("frames missing, numbers tell", {"switches": {"dropped_frames": [9, 60, 61]}}, events=IMPACT),
    HardSequence("frames missing, numbered anew", spoil=renumber),
    HardSequence("flicker of 10 %", {"switches": {"flicker": 0.1}}),
    HardSequence(
        "lost behind a splash",
        {"switches": {"opaque_crown": True, "ragged_crown": 0.5, "droplets": 60}},
        spoil=hide,
    ),
    HardSequence(
        "surface band, meniscus, reflection",
        {"switches": {"surface_band_px": 14.0, "surface_band_uneven": 0.3, "mirror_image": True, "wet_scale": 1.05}},
        events=IMPACT,
    ),
    HardSequence("a bar stands in view", {"switches": {"second_object": True}}),
    HardSequence("another ball falls beside", spoil=partial(add_ball, aside=2.8)),
    HardSequence("another ball passes the edge", spoil=partial(add_ball, aside=0.9)),
    HardSequence(
        "top view, before and after dome-over",
        {
            "height_m": 1.27,
            "side": SIDE | {"scale_px_per_m": 1200.0},
            "top": {"width": 320, "height": 320, "scale_px_per_m": 1600.0, "camera_distance_m": 1.5},
            "switches": {"ragged_crown": 0.4},
            "clip": {"before_s": 0.008, "longest_s": 0.06},
        },
        view="top",
        events=("dome_over",),
    ),
    HardSequence(
        "nested cavity walls at the sphere",
        {
            "sphere": {"diameter_m": 0.051, "material": "dragonskin_1p12_small", "law": VERY_SOFT},
            "physics": {"shallow_valleys": 0.1},
            "switches": {"lamp_image": True},
            "clip": TO_PINCH_OFF,
        },
        events=CLOSURE,
    ),
    HardSequence(
        "seal at the top of the sphere",
        {
            "sphere": {"diameter_m": 0.1, "material": "dragonskin_1p12_large", "law": VERY_SOFT | {"n": -0.5}},
            "height_m": 2.27,
            "physics": {"loading_rate": 0.3, "drag": 1.2},
            "side": SIDE | {"width": 352, "height": 300, "scale_px_per_m": 720.0, "surface_y_px": 140.4},
            "clip": {"before_s": 0.01, "after_pinch_off_s": 0.012},
        },
        events=CLOSURE,
    ),
    HardSequence(
        "jets and bubbles after closure",
        {"switches": {"jets": True, "bubbles": 60}, "clip": TO_PINCH_OFF | {"after_pinch_off_s": 0.02}},
        events=CLOSURE,
    ),
    HardSequence(
        "sphere and cavity of 20 % contrast",
        {"side": SIDE | {"lamp": {"dark": 0.8}}, "clip": TO_PINCH_OFF, "switches": {"lamp_image": True}},
        events=CLOSURE,
    ),
    HardSequence("few frames, 500 a second", {"side": SIDE | {"fps": 500.0}, "clip": TO_PINCH_OFF}, events=CLOSURE),
)
