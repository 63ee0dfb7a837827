"""Drops whose tables are written by hand from a motion that is known: an own equation, no import from the package."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from wentry_cli.config.campaign import Drop
from wentry_cli.config.materials import Material
from wentry_cli.config.models import Experiment
from wentry_cli.tables import new_table, write_table

D, R, RHO, FPS = 0.051, 0.0255, 1070.0, 2000.0
SCALE = 4000.0


@dataclass(frozen=True)
class Known:
    """The truth behind the tables: times after impact, λ, heights, speed, acceleration, and what follows from them."""

    t: np.ndarray
    stretch: np.ndarray
    y_b: np.ndarray
    y_c: np.ndarray
    v_c: np.ndarray
    a_c: np.ndarray
    u0: float
    u1: float
    period: float


def motion(
    u0: float = 5.0, *, amplitude: float = 0.3, period: float = 0.03, damping: float = 12.0, n: int = 300
) -> Known:
    """A sphere that slows as v = −u0/(1 + t/τ) after impact and rings with a damped sine in ln λ."""
    t = (np.arange(n) - 40.3) / FPS
    s, tau, g = np.maximum(t, 0.0), 0.08, 9.81
    stretch = np.exp(amplitude * np.exp(-damping * s) * np.sin(2 * np.pi * s / period))
    y_c = np.where(t < 0, R - u0 * t - 0.5 * g * t**2, R - u0 * tau * np.log1p(s / tau))
    v_c = np.where(t < 0, -u0 - g * t, -u0 / (1 + s / tau))
    a_c = np.where(t < 0, -g, u0 / tau / (1 + s / tau) ** 2)
    return Known(t, stretch, y_c - R / stretch**2, y_c, v_c, a_c, u0, u0 / (1 + period / tau), period)


def make_drop(name: str = "d1", **changes: Any) -> Drop:
    """A drop as ``experiment.yaml`` would give it; ``changes`` replace whole parts, ``material`` the material."""
    material = changes.pop("material", "soft")
    said = {
        "kind": "water_entry",
        "condition": "c",
        "repeat": "1",
        "sphere": {"diameter_m": D, "density_kg_m3": RHO, "material": material, "diameter_m_unc": 0.0001},
        "drop": {"height_m": 1.27},
        "views": {"side": {"source": "side", "fps": FPS}},
    } | changes
    law = None if material == "rigid" else Material(g_inf_pa=6900.0, g_t_pa=6900.0, n=-0.5, eps0_dot_1_s=0.01)
    return Drop(name, Path("nowhere"), Experiment.model_validate(said), law)


def write_views(folder: Path, known: Known, *, noise: float = 0.1, seed: int = 0, rigid: bool = False) -> None:
    """Write geometry.csv and side.csv: heights to ``noise`` px, λ to 0.001, the separation line at the equator."""
    random = np.random.default_rng(seed)
    n = known.t.size
    y_b = known.y_b + noise / SCALE * random.normal(size=n)
    stretch = known.stretch + 0.001 * random.normal(size=n)
    separation = np.where(known.t > 0.004, np.minimum(known.y_c, 0.0), np.nan)
    side = {
        "frame": np.arange(n),
        "t_s": known.t,
        "center_x_px": np.full(n, 500.0),
        "center_y_px": 300.0 - SCALE * known.y_c,
        "radius_px": np.full(n, SCALE * R),
        "radius_px_unc": np.full(n, 0.05),
        "bottom_y_px": 300.0 - SCALE * (known.y_c - R / (1.0 if rigid else stretch) ** 2),
        "bottom_y_px_unc": np.full(n, noise),
        "y_b_m": y_b,
        "y_b_m_unc": np.full(n, noise / SCALE),
        "y_b_source": ["local"] * n,
        "separation_y_m": separation,
        "separation_y_m_unc": np.where(np.isfinite(separation), noise / SCALE, np.nan),
        "status": ["ok"] * n,
    }
    if not rigid:
        side |= {"stretch": stretch, "stretch_unc": np.full(n, 0.001)}
    write_table(folder, "side", new_table("side", side))
    geometry = {"view": ["side"], "fps": [FPS], "scale_px_per_m": [SCALE], "scale_px_per_m_unc": [0.002 * SCALE]}
    geometry |= {"scale_water_px_per_m": [SCALE], "scale_water_px_per_m_unc": [0.002 * SCALE], "surface_y_px": [300.0]}
    geometry |= {"optical_axis_y_px": [300.0], "optical_axis_y_px_unc": [0.0]}
    write_table(folder, "geometry", new_table("geometry", geometry))


def write_events(folder: Path, t_p: float = 0.11, y_p: float = -0.08, value: str = "deep_seal") -> None:
    """Write events.csv with impact, dome-over and pinch-off (NaN time: the clip ended before)."""
    status = "ok" if np.isfinite(t_p) else "clip_ended"
    events = {
        "event": ["impact", "dome_over", "pinch_off"],
        "index": [1, 1, 1],
        "t_s": [0.0, 0.03, t_p],
        "t_s_unc": [1e-5, 1e-3, 2e-4 if np.isfinite(t_p) else np.nan],
        "y_m": [0.0, 0.05, y_p],
        "value": [None, None, value if np.isfinite(t_p) else None],
        "status": ["ok", "ok", status],
    }
    write_table(folder, "events", new_table("events", events))
