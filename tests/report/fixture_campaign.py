"""A small campaign of tables made from simple formulas: enough for every panel, no measurement behind it."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import pandas as pd

from wentry_cli.config.campaign import Drop
from wentry_cli.config.models import Experiment
from wentry_cli.tables import new_table, write_table

G = 9.81
WATER = 998.2
DENSITY = 1070.0
PEAK = math.atan(2 * math.pi * 1.6) / (2 * math.pi)  # where stretch_of is greatest, in periods


@dataclass(frozen=True)
class Made:
    name: str
    kind: str = "water_entry"
    g_inf: float = 6900.0
    diameter: float = 0.051
    speed: float = 5.3
    rigid: bool = False
    seal: str = "deep_seal"
    condition: str | None = None
    repeat: str | None = None
    sphere: str | None = None

    @property
    def soft_entry(self) -> bool:
        return self.kind == "water_entry" and not self.rigid

    @property
    def ratio(self) -> float:
        return math.nan if self.rigid else self.g_inf / (WATER * self.speed**2)

    @property
    def period(self) -> float:
        return 1.45 * self.diameter / math.sqrt(self.g_inf / DENSITY)

    @property
    def first_peak(self) -> float:
        return 1.0 + 0.22 * self.ratio**-0.45

    @property
    def froude(self) -> float:
        return self.speed / math.sqrt(G * self.diameter)

    @property
    def t_p(self) -> float:
        size = self.diameter if self.rigid else self.diameter * (1 + 0.5 * (self.first_peak - 1))
        return 1.31 * math.sqrt(size / G)

    @property
    def loss(self) -> float:
        return min(0.95, 0.8 * self.ratio**-0.5)


CAMPAIGN = (
    Made("rigid_51_h153", rigid=True, g_inf=math.nan),
    Made("g6p9_d51_h153", sphere="S2", condition="soft", repeat="1"),
    Made("g6p9_d51_h153_again", sphere="S2", condition="soft", repeat="2", speed=5.34),
    Made("g74_d51_h053", sphere="S1", g_inf=74690.0, speed=3.1),
    Made("g74_d100_h153", sphere="S4", g_inf=74690.0, diameter=0.0974, speed=5.4),
    Made("g1p2_d100_h227", sphere="S6", g_inf=1235.0, diameter=0.0974, speed=6.5, seal="sphere_seal"),
    Made("plate_h153", kind="surface_impact", sphere="S2"),
    Made("plate_h053", kind="surface_impact", sphere="S2", speed=3.2),
    Made("ball", kind="free_flight", diameter=0.0025, speed=1.57, rigid=True, g_inf=math.nan),
)


def write_campaign(results: Path, drops: tuple[Made, ...] = CAMPAIGN) -> list[str]:
    """Write the tables of ``drops`` and of their campaign; the names of the drops are returned."""
    for made in drops:
        folder = results / made.name
        folder.mkdir(parents=True, exist_ok=True)
        for name, columns in drop_tables(made).items():
            write_table(folder, name, new_table(name, columns))
    write_table(results, "summary", pd.concat([new_table("summary", _summary(made)) for made in drops]))
    write_table(results, "scaling", new_table("scaling", scaling()))
    (results / "run.json").write_text(json.dumps({"version": "0.1.0", "command": "wentry run videos", "drops": {}}))
    return [made.name for made in drops]


def stretch_of(made: Made, t: np.ndarray) -> np.ndarray:
    decay = np.exp(-np.maximum(t, 0) / (1.6 * made.period))
    wave = (made.first_peak - 1.0) * 1.2 * decay * np.sin(2 * np.pi * np.maximum(t, 0) / made.period)
    return 1.0 + np.where(wave > 0, wave, 0.55 * wave)


def drop_tables(made: Made) -> dict[str, dict[str, object]]:
    if made.kind == "free_flight":
        return _flight(made)
    t = np.arange(-16, int(2000 * 1.4 * made.t_p)) / 2000.0 + 1.7e-4
    stretch = np.ones_like(t) if made.rigid else stretch_of(made, t)
    tables = _views(made, t, stretch)
    if not made.rigid:
        tables |= _oscillation(made, t, stretch)
    if made.kind == "water_entry":
        tables |= _motion(made, t, stretch)
    tables["summary"] = _summary(made)
    return tables


def _views(made: Made, t: np.ndarray, stretch: np.ndarray) -> dict[str, dict[str, object]]:
    radius_px = 2000.0 * made.diameter
    depth = _depth(made, t)
    bottom = 300.0 + 4000.0 * depth
    status = np.where(np.arange(t.size) % 29 == 13, "no_edge", "ok")
    good = status == "ok"
    shown = {"frame": np.arange(t.size), "t_s": t, "status": status, "center_x_px": 512.0 + 0 * t}
    side = {
        **shown, "center_y_px": bottom - radius_px / stretch**2, "radius_px": radius_px, "radius_px_unc": 0.02,
        "stretch": np.nan if made.rigid else np.where(good, stretch, np.nan), "stretch_unc": 4e-4,
        "bottom_y_px": bottom, "bottom_y_px_unc": 0.05, "bottom_local_y_px": bottom, "bottom_local_y_px_unc": 0.05,
        "y_b_m": np.where(good, -depth, np.nan), "y_b_m_unc": 2e-5, "y_b_source": "local",
        "separation_y_px": bottom - radius_px, "separation_y_px_unc": 0.4, "separation_y_m": made.diameter / 2 - depth,
        "separation_y_m_unc": 1e-4,
        "arc_fraction": 0.5, "gated_fraction": 0.02, "residual_rms_px": 0.06,
    }  # fmt: skip
    top = {**shown, "center_y_px": 512.0, "radius_px": radius_px * stretch, "radius_px_unc": 0.03, "stretch": stretch,
           "stretch_unc": 3e-4, "gated_fraction": 0.1, "residual_rms_px": 0.07}  # fmt: skip
    both = ["side", "top"] if made.soft_entry else ["side"]
    geometry = {"view": both, "fps": 2000.0, "fps_source": "given", "exposure_s": 1e-4, "scale_px_per_m": 4000.0,
                "scale_water_px_per_m": 4000.0, "scale_source": "given", "surface_y_px": 300.0, "radius_px": radius_px,
                "impact_time_s": 0.01}  # fmt: skip
    frames = {"view": "side", "frame": np.arange(t.size), "camera_frame": np.arange(t.size), "time_s": t + 0.01,
              "mean_level": 120.0, "saturated_fraction": 0.0, "status": "ok"}  # fmt: skip
    tables: dict[str, dict[str, object]] = {"frames": frames, "geometry": geometry, "side": side}
    return tables | ({"top": top} if made.soft_entry else {})


def _depth(made: Made, t: np.ndarray) -> np.ndarray:
    late = np.maximum(t, 0.0)
    drag = 0.9 / made.diameter * (0.25 if made.rigid else 0.25 + made.loss)
    return np.where(t < 0, made.speed * t, np.log1p(drag * made.speed * late) / drag)


def _oscillation(made: Made, t: np.ndarray, stretch: np.ndarray) -> dict[str, dict[str, object]]:
    seen = t >= 0
    source = np.where(t[seen] < 0.03, "top", "side")
    merged = {
        "frame": np.flatnonzero(seen),
        "t_s": t[seen],
        "stretch": stretch[seen],
        "stretch_unc": 5e-4,
        "source": source,
    }
    numbers = np.arange(1, 4)
    starts = (numbers - 1) * made.period
    peaks = starts + PEAK * made.period
    periods = {"period": numbers, "t_start_s": starts, "t_end_s": starts + made.period, "t_peak_s": peaks,
               "t_valley_s": peaks + made.period / 2, "peak_to_peak_s": made.period, "peak_to_peak_s_unc": 2e-4,
               "stretch_peak": stretch_of(made, peaks), "stretch_peak_unc": 1e-3,
               "stretch_valley": stretch_of(made, peaks + made.period / 2), "status": "ok"}  # fmt: skip
    clock = np.linspace(0, 3 * made.period, 400)
    model = {"t_s": clock / 1.25, "t_scaled_s": peaks[0] + clock, "stretch": stretch_of(made, peaks[0] + clock),
             "stretch_viscous": 1.0}  # fmt: skip
    fit = {
        "period_exp_s": [made.period],
        "period_model_s": made.period / 1.25,
        "time_ratio": 1.25,
        "time_ratio_unc": 3e-3,
        "stretch_0": made.first_peak,
        "residual_rms": 0.01,
        "eps0_dot_1_s": 0.02,
        "n": -0.2,
        "status": "ok",
    }
    return {"stretch": merged, "periods": periods, "model": model, "model_fit": fit}


def _motion(made: Made, t: np.ndarray, stretch: np.ndarray) -> dict[str, dict[str, object]]:
    height = -_depth(made, t)
    velocity, acceleration = np.gradient(height, t), np.gradient(np.gradient(height, t), t)
    wanted = {
        "frame": np.arange(t.size),
        "t_s": t,
        "x_c_m": 0.0,
        "y_b_m": height,
        "y_b_m_unc": 2e-5,
        "y_c_m": height + made.diameter / 2 / stretch**2,
        "y_c_m_unc": 3e-5,
        "v_b_m_s": velocity,
        "v_b_m_s_unc": 0.01,
        "v_c_m_s": velocity,
        "v_c_m_s_unc": 0.01,
        "a_c_m_s2": acceleration,
        "a_c_m_s2_unc": 1.5,
        "status": "ok",
    }
    value = made.seal
    events = {
        "event": ["impact", "pinch_off"],
        "index": [1, 1],
        "t_s": [0.0, made.t_p],
        "t_s_unc": [1e-5, 1e-4],
        "y_m": [0.0, -0.12],
        "value": ["", value],
        "status": "ok",
    }
    if made.rigid:
        late = t > 0.002
        c = 0.3 + 0.4 * np.exp(-t[late] / 0.02)
        forces = {
            "t_mid_s": t[late],
            "t_mid_over_tp": t[late] / made.t_p,
            "force_coefficient": c,
            "force_coefficient_unc": 0.02,
            "force_coefficient_hydro": c,
            "force_coefficient_hydro_unc": 0.02,
        }
        return {"kinematics": wanted, "events": events, "forces": forces}
    middle = (np.arange(1, 4) - 0.5) * made.period
    forces = {
        "period": np.arange(1, 4),
        "t_mid_s": middle,
        "t_mid_over_tp": middle / made.t_p,
        "force_coefficient": [1.1, 0.5, 0.3],
        "force_coefficient_unc": 0.04,
        "force_coefficient_hydro": [1.0, 0.4, 0.2],
        "force_coefficient_hydro_unc": 0.04,
    }
    return {
        "kinematics": wanted,
        "kinematics_model": {**wanted, "stretch_source": "model"},
        "events": events,
        "forces": forces,
    }


def _flight(made: Made) -> dict[str, dict[str, object]]:
    t = np.arange(15) / 30000.0
    wobble = 2e-7 * np.cos(np.arange(15) * 2.1)
    path = {"frame": np.arange(15), "t_s": t, "x_c_m": wobble[::-1], "y_c_m": -1.57 * t - 4.9 * t**2 + wobble,
            "y_c_m_unc": 2e-7, "v_c_m_s": -1.57 - 9.8 * t, "v_c_m_s_unc": 0.01, "a_c_m_s2": -9.8, "a_c_m_s2_unc": 2.0,
            "status": "ok"}  # fmt: skip
    side = {"frame": np.arange(15), "t_s": t, "center_x_px": 190.0, "center_y_px": 110 + 2.647 * np.arange(15),
            "radius_px": 63.2, "stretch": 1.0, "status": "ok"}  # fmt: skip
    geometry = {"view": ["side"], "fps": 30000.0, "scale_px_per_m": 50000.0, "scale_px_per_m_unc": 250.0}
    return {"kinematics": path, "side": side, "geometry": geometry, "summary": _summary(made)}


def _summary(made: Made) -> dict[str, object]:
    common = {
        "drop": [made.name],
        "kind": made.kind,
        "condition": made.condition,
        "repeat": made.repeat,
        "sphere_id": made.sphere,
        "rigid": str(made.rigid).lower(),
        "diameter_m": made.diameter,
        "density_kg_m3": DENSITY,
        "g_inf_pa": made.g_inf,
        "impact_speed_m_s": made.speed,
        "impact_speed_m_s_unc": 0.01,
        "frames_measured": 280,
        "frames_total": 300,
        "status": "ok",
    }
    if made.kind == "free_flight":
        common |= {"velocity_m_s": -1.62, "velocity_m_s_unc": 0.013}
        return common | {"acceleration_m_s2": -9.8, "acceleration_m_s2_unc": 2.0}
    if not made.rigid:
        common |= {
            f"stretch_peak_{n}": float(stretch_of(made, np.array((n - 1 + PEAK) * made.period))) for n in range(1, 4)
        }
        common |= {"period_s": made.period, "period_s_unc": 2e-4, "stiffness_ratio": made.ratio, "time_ratio": 1.25}
    if made.kind == "surface_impact":
        return common
    t_p, seal = made.t_p, made.seal
    size = math.nan if seal == "sphere_seal" else made.diameter * (1 if made.rigid else 1 + 0.5 * (made.first_peak - 1))
    common |= {"froude": made.froude, "t_p_s": t_p, "t_p_s_unc": 2e-4, "y_p_m": -0.12, "seal_type": seal,
               "pinch_off_cavity": None if made.rigid else 2, "diameter_eff_m": size, "velocity_source": "kinematics",
               "tp_u0_over_d": t_p * made.speed / made.diameter, "bond": 350.0, "reynolds": 2.7e5}  # fmt: skip
    if math.isfinite(size):
        common |= {"froude_eff": made.speed / math.sqrt(G * size), "tp_u0_over_deff": t_p * made.speed / size}
    if made.soft_entry:
        common |= {
            "speed_after_period_m_s": made.speed * (1 - made.loss),
            "delta_u_over_u0": made.loss,
            "delta_u_over_u0_unc": 0.01,
        }
    return common


def scaling() -> dict[str, object]:
    names = ["period_exp", "period_model", "pinch_off_deff", "pinch_off_deff_intercept", "delta_u"]
    return {"relation": names, "x": "x", "y": "y", "slope": [1.45, 1.16, 1.31, 1.28, 0.8], "slope_unc": 0.02,
            "slope_low": [1.41, 1.13, 1.26, 1.2, 0.7], "slope_high": [1.49, 1.19, 1.36, 1.37, 0.9],
            "intercept": [None, None, None, 0.1, None], "exponent": [None, None, None, None, -0.5],
            "exponent_unc": [None, None, None, None, 0.03],
            "exponent_low": [None, None, None, None, -0.58], "exponent_high": [None, None, None, None, -0.42],
            "dof": 3.2, "n_conditions": 4, "n_spheres": 3, "r_squared": 0.99, "residual_scatter": 0.02, "n": 5,
            "paper_value": [1.4, 1.2, 1.3, 1.3, -0.5], "status": "ok"}  # fmt: skip


def configured(videos: Path, drops: Iterable[Made] = CAMPAIGN) -> list[Drop]:
    """Drops as the runner hands them over; their recordings exist only where ``film`` made them."""
    return [Drop(made.name, videos / made.name, Experiment.model_validate(_experiment(made))) for made in drops]


def _experiment(made: Made) -> dict[str, object]:
    views = {"side": {"source": "side", "fps": 2000.0}}
    if made.soft_entry:
        views["top"] = {"source": "top", "fps": 2000.0}
    return {"kind": made.kind, "sphere": {"diameter_m": made.diameter, "density_kg_m3": DENSITY}, "views": views}


def film(videos: Path, made: Made, count: int = 60) -> None:
    """Draw dark ellipses on a bright ground for the first frames of both views, as small PNG images."""
    for view in ("side", "top") if made.soft_entry else ("side",):
        folder = videos / made.name / view
        folder.mkdir(parents=True, exist_ok=True)
        table = drop_tables(made)[view]
        for frame in range(count):
            picture = np.full((1000, 1024), 200, np.uint8)
            radius = 2000.0 * made.diameter
            stretch = 1.0 if made.rigid else float(table["stretch"][frame])  # type: ignore[index]
            stretch = stretch if math.isfinite(stretch) else 1.0
            y = 512.0 if view == "top" else float(table["center_y_px"][frame])  # type: ignore[index]
            axes = (round(radius * stretch), round(radius * (stretch if view == "top" else stretch**-2)))
            cv2.ellipse(picture, (512, round(y)), axes, 0, 0, 360, 40, -1)
            cv2.imwrite(str(folder / f"{frame:04d}.png"), picture)
