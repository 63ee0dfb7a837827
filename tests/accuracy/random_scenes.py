"""Scenes that nobody has chosen: material, size, speed, light and faults drawn at random, at 1024 × 1024.

`python -m tests.accuracy.random_scenes SEED COUNT > scenes.yaml` writes a file for `wentry render`.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import yaml

MATERIALS = (
    "dragonskin_70p2_small",
    "dragonskin_6p70_small",
    "dragonskin_1p12_small",
    "dragonskin_70p2_large",
    "dragonskin_6p70_large",
    "dragonskin_1p12_large",
    "rigid",
)
CONFIGS = Path(__file__).resolve().parents[2] / "configs"
SIDE_PX = 1024


def draw_scenes(seed: int, count: int) -> dict[str, Any]:
    """A scenes file of ``count`` water entries; the same ``seed`` gives the same scenes."""
    rng = np.random.default_rng(seed)
    drops = [_draw_drop(rng, k) for k in range(count)]
    return {"seed": 100 + seed, "materials": str(CONFIGS / "materials.yaml"), "drops": drops}


def _draw_drop(rng: np.random.Generator, k: int) -> dict[str, Any]:
    material = str(rng.choice(MATERIALS))
    diameter = 0.100 if material.endswith("large") else 0.051
    radius_px = rng.uniform(30, 75)
    scale = radius_px / (diameter / 2)
    surface = rng.uniform(2.6 * radius_px, 3.6 * radius_px)
    fps = float(rng.choice([1000, 2000, 2000, 4000]))
    side = {
        "width": SIDE_PX,
        "height": SIDE_PX,
        "scale_px_per_m": float(scale),
        "surface_y_px": float(surface),
        "center_x_px": float(rng.uniform(420, 600)),
        "fps": fps,
        "exposure_s": float(rng.uniform(0.1, 0.5) / fps),
        "bits": 12,
        "format": "mraw",
        "lamp": _draw_lamp(rng),
    }
    drop = {
        "name": f"r{k:02d}",
        "sphere": {"id": f"S{k}", "diameter_m": diameter, "material": material},
        "height_m": float(rng.uniform(0.4, 2.3)),
        "physics": _draw_physics(rng, material),
        "side": side,
        "switches": _draw_switches(rng, diameter, (0.5 * SIDE_PX - surface) / scale, 40.0 / scale),
        "clip": {
            "before_s": float(rng.uniform(6, 16) / fps + 0.004),
            "after_pinch_off_s": 0.006,
            "longest_s": 400 / fps,
        },
    }
    if material != "rigid" and rng.random() < 0.5:
        drop["top"] = {
            "width": 384, "height": 384, "scale_px_per_m": float(rng.uniform(1.0, 1.2) * scale), "fps": fps,
            "exposure_s": side["exposure_s"], "camera_distance_m": 1.5, "bits": 12, "format": "mraw",
        }  # fmt: skip
    return drop


def _draw_lamp(rng: np.random.Generator) -> dict[str, Any]:
    return {
        "level": float(rng.uniform(0.5, 0.85)),
        "gradient": [float(rng.uniform(-0.15, 0.15)), float(rng.uniform(-0.15, 0.15))],
        "noise": float(rng.uniform(0.004, 0.03)),
        "psf_px": float(rng.uniform(0.7, 1.8)),
        "lamp_half_angle_deg": float(rng.uniform(20, 60)),
    }


def _draw_physics(rng: np.random.Generator, material: str) -> dict[str, Any]:
    soft = material.startswith("dragonskin_1p12")
    return {
        "drag": float(rng.uniform(0.25, 0.6)),
        "loading_rate": float(rng.uniform(0.25, 0.32) if soft else rng.uniform(0.35, 0.5)),
        "shallow_valleys": float(rng.choice([0.0, rng.uniform(0.1, 0.3)])),
        "period_growth": float(rng.choice([0.0, rng.uniform(0.02, 0.08)])),
        "wall_speed": float(rng.uniform(0.28, 0.36)),
        "dome_over_time": float(rng.uniform(2.5, 6.0)),
    }


def _draw_switches(rng: np.random.Generator, diameter: float, middle_m: float, aim_m: float) -> dict[str, Any]:
    """Each fault of real frames in about a quarter of the scenes.

    A camera whose optical axis nobody tells was aimed at the middle of its picture, ``middle_m`` below the surface.
    """
    told = bool(rng.random() < 0.8)
    axis = rng.uniform(0.5, 2.5) * diameter if told else middle_m + aim_m * rng.uniform(-1.0, 1.0)

    def now_and_then(value: Any, chance: float = 0.25) -> Any:
        return value if rng.random() < chance else None

    drawn = {
        "misfit": now_and_then([float(rng.uniform(-0.004, 0.004)), float(rng.uniform(-0.004, 0.004))]),
        "droplets": now_and_then(int(rng.integers(10, 80))),
        "bubbles": now_and_then(int(rng.integers(5, 20))),
        "wet_scale": now_and_then(float(rng.uniform(1.03, 1.08)), 0.5),
        "optical_axis_below_m": float(axis),
        "tell_optical_axis": told,
        "mirror_image": now_and_then(True),
        "surface_band_px": float(rng.uniform(2, 20)),
        "surface_band_uneven": now_and_then(float(rng.uniform(0.1, 0.4))),
        "opaque_crown": now_and_then(True),
        "ragged_crown": now_and_then(float(rng.uniform(0.1, 0.5))),
        "translucent_sphere": now_and_then(True, 0.15),
        "tilt_deg": now_and_then(float(rng.uniform(-4, 4))),
        "drift_m_s": now_and_then(float(rng.uniform(-0.15, 0.15))),
        "flicker": now_and_then(float(rng.uniform(0.002, 0.02))),
        "duplicated_frames": now_and_then([int(rng.integers(40, 80))], 0.1),
        "hot_pixels": now_and_then(int(rng.integers(5, 60))),
        "lamp_image": now_and_then(True, 0.15),
        "jets": now_and_then(True, 0.15),
        "wet_highlights": now_and_then(int(rng.integers(2, 8)), 0.15),
    }
    return {key: value for key, value in drawn.items() if value is not None}


if __name__ == "__main__":
    yaml.safe_dump(draw_scenes(int(sys.argv[1]), int(sys.argv[2])), sys.stdout, sort_keys=False)
