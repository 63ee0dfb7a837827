"""Stage ``model``: the viscoelastic oscillation from λ_p1, scaled in time, and the motion that it implies.

Reads stretch, periods and kinematics; writes model.csv, model_fit.csv and, for an entry into water,
kinematics_model.csv: the paper's own route, y_c from the time-scaled model stretch.
"""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wentry_cli.config import campaign
from wentry_cli.doubts import puts_in_doubt
from wentry_cli.errors import ConfigurationError
from wentry_cli.kinematics.centre import early_shape_time
from wentry_cli.mechanics.bergstrom_boyce import Material
from wentry_cli.mechanics.plausibility import IN_AIR, IN_WATER, doubt_of_flow, doubt_of_ratio
from wentry_cli.mechanics.solver import solve_oscillation
from wentry_cli.mechanics.time_scaling import NOT_MEASURED, RATIO_RANGE, Measured, TimeScaling, fit_time_scale
from wentry_cli.stages.inputs.columns import column
from wentry_cli.stages.kinematics import entry_motion, motion_columns
from wentry_cli.tables import has_table, new_table, read_table, write_table

if TYPE_CHECKING:
    import pandas as pd

logger = logging.getLogger(__name__)
FloatArray = NDArray[np.float64]
ROWS_PER_PERIOD = 200
LEAST_PERIODS = 5.0
MOST_ROWS = 20_000


def run(folder: Path, drop: campaign.Drop) -> None:
    """Write the model tables of one deformable drop into ``folder``; nothing where the material is not known.

    Raises ``ConfigurationError`` where the density is missing or the material cannot be integrated, ``InputError``
    where a table is missing.
    """
    if drop.material is None:
        return
    material = sphere_material(drop)
    if doubt := doubt_of_flow(material):
        told = f"sphere.material {drop.experiment.sphere.material}: {doubt}"
        logger.warning("%s: %s", drop.name, told, extra=puts_in_doubt("flow of the material"))
    stretch, periods = read_table(folder, "stretch"), read_table(folder, "periods")
    fit = _fit(material, stretch, periods)
    first = first_peak(periods)
    if doubt := _doubt_of_scaling(drop, fit, first):
        logger.warning("%s: %s", drop.name, doubt, extra=puts_in_doubt("stiffness of the material"))
    write_table(folder, "model_fit", _fit_table(fit, first, material, stretch, _doubt_of_period(drop)))
    write_table(folder, "model", _model_table(fit, first, material, stretch))
    if drop.experiment.kind == "water_entry" and has_table(folder, "kinematics"):
        write_table(folder, "kinematics_model", _kinematics_table(folder, drop, (fit, first), stretch))


def sphere_material(drop: campaign.Drop) -> Material:
    """The material of a drop as the solver wants it, with the sphere's own radius and density.

    Raises ``ConfigurationError`` where there is no material or no density.
    """
    sphere, known = drop.experiment.sphere, drop.material
    if known is None:
        raise ConfigurationError(f"{drop.folder / 'experiment.yaml'}: sphere.material is not known; name one")
    density = sphere.density if sphere.density is not None else known.density_kg_m3
    if density is None:
        raise ConfigurationError(
            f"{drop.folder / 'experiment.yaml'}: sphere.density_kg_m3 is missing, which the model needs; "
            "add it, or mass_kg"
        )
    return Material(
        radius_m=sphere.radius_m,
        density_kg_m3=density,
        g_inf_pa=known.g_inf_pa,
        g_t_pa=known.g_t_pa,
        xi=known.xi,
        tau0_pa=known.tau0_pa,
        m=known.m,
        n=known.n,
        eps0_dot_1_s=known.eps0_dot_1_s,
    )


@dataclass(frozen=True)
class FirstPeak:
    """Time and stretch of the first peak, and the time to the second, from periods.csv; NaN where not measured."""

    time_s: float = math.nan
    stretch: Measured = NOT_MEASURED
    period: Measured = NOT_MEASURED

    @property
    def found(self) -> bool:
        """Whether there is a peak from which a model can be released."""
        return math.isfinite(self.time_s) and math.isfinite(self.stretch.value) and self.stretch.value > 1.0


def first_peak(periods: pd.DataFrame) -> FirstPeak:
    """The first peak of a drop as ``periods.csv`` has it."""
    rows = periods[periods["period"] == 1]
    if not len(rows):
        return FirstPeak()
    names = ("t_peak_s", "stretch_peak", "stretch_peak_unc", "peak_to_peak_s", "peak_to_peak_s_unc")
    time, peak, peak_unc, period, period_unc = (float(column(rows, name)[0]) for name in names)
    return FirstPeak(time, Measured(peak, peak_unc), Measured(period, period_unc))


def _fit(material: Material, stretch: pd.DataFrame, periods: pd.DataFrame) -> TimeScaling:
    first = first_peak(periods)
    if not first.found:
        nan = math.nan
        return TimeScaling(nan, nan, nan, nan, nan, nan, nan, 0, "too_few")
    times = column(stretch, "t_s") - first.time_s
    after = times >= 0.0
    if not after.any():
        times, after = np.array([0.0]), np.array([True])
    return fit_time_scale(
        material,
        first.stretch,
        times[after],
        column(stretch, "stretch")[after],
        np.nan_to_num(column(stretch, "stretch_unc")[after], nan=1.0),
        period=first.period,
    )


def _doubt_of_scaling(drop: campaign.Drop, fit: TimeScaling, first: FirstPeak) -> str:
    """A sentence where the ratio of the periods is missing though there is a peak, or is none that a sphere shows."""
    if math.isfinite(fit.ratio) or not first.found:
        return doubt_of_ratio(fit.ratio, IN_WATER if drop.experiment.kind == "water_entry" else IN_AIR)
    periods = f"the model's period is {1e3 * fit.period_model_s:.3g} ms"
    if math.isfinite(first.period.value):
        periods += f", the measured one {1e3 * first.period.value:.3g} ms"
    why = "λ does not tell it" if fit.status == "not_identified" else "too little of λ was measured"
    return (
        f"no T_exp/T_model: {why} between {RATIO_RANGE[0]:g} and {RATIO_RANGE[1]:g}, so the model is not "
        f"scaled in time; {periods}: check g_inf_pa (Pa) and its calibration, sphere.diameter_m and fps"
    )


def _doubt_of_period(drop: campaign.Drop) -> float:
    """Relative uncertainty of the model's period, which goes as R √(ρ/G∞), from those of G∞ and the diameter."""
    sphere, known = drop.experiment.sphere, drop.material
    if known is None:
        return 0.0
    return math.hypot(0.5 * known.g_inf_pa_unc / known.g_inf_pa, sphere.diameter_m_unc / sphere.diameter_m)


def _fit_table(
    fit: TimeScaling, first: FirstPeak, material: Material, stretch: pd.DataFrame, doubt: float
) -> pd.DataFrame:
    return new_table(
        "model_fit",
        {
            "period_exp_s": [fit.period_exp_s],
            "period_model_s": [fit.period_model_s],
            "time_ratio": [fit.ratio],
            "time_ratio_unc": [math.hypot(fit.ratio_unc, doubt * fit.ratio)],
            "stretch_0": [first.stretch.value if first.found else math.nan],
            "residual_rms": [_misfit(fit, first, material, stretch)],
            "eps0_dot_1_s": [material.eps0_dot_1_s],
            "n": [material.n],
            "status": [fit.status],
        },
    )


def _scaled_stretch(fit: TimeScaling, first: FirstPeak, material: Material, times_s: FloatArray) -> FloatArray:
    """λ of the time-scaled model at ``times_s`` (rising, after impact), NaN before the first peak."""
    own = (times_s - first.time_s) / fit.ratio
    values = np.full(times_s.shape, np.nan)
    after = own >= 0.0
    if math.isfinite(fit.ratio) and after.any():
        values[after] = solve_oscillation(material, first.stretch.value, own[after]).stretch
    return values


def _misfit(fit: TimeScaling, first: FirstPeak, material: Material, stretch: pd.DataFrame) -> float:
    """Rms of measured minus time-scaled model λ over all frames after the first peak, valleys included."""
    residual = column(stretch, "stretch") - _scaled_stretch(fit, first, material, column(stretch, "t_s"))
    seen = np.isfinite(residual)
    return float(np.sqrt(np.mean(residual[seen] ** 2))) if seen.any() else math.nan


def _model_table(fit: TimeScaling, first: FirstPeak, material: Material, stretch: pd.DataFrame) -> pd.DataFrame:
    if not first.found or not math.isfinite(fit.period_model_s):
        return new_table("model", {})
    reach = float(stretch["t_s"].max()) - first.time_s
    ratio = fit.ratio if math.isfinite(fit.ratio) else 1.0
    duration = max(reach / ratio, LEAST_PERIODS * fit.period_model_s)
    count = min(math.ceil(duration / fit.period_model_s * ROWS_PER_PERIOD) + 1, MOST_ROWS)
    times = np.linspace(0.0, duration, count)
    model = solve_oscillation(material, first.stretch.value, times)
    return new_table(
        "model",
        {
            "t_s": times,
            "t_scaled_s": first.time_s + fit.ratio * times,
            "stretch": model.stretch,
            "stretch_viscous": model.stretch_viscous,
        },
    )


def _kinematics_table(
    folder: Path, drop: campaign.Drop, model: tuple[TimeScaling, FirstPeak], stretch: pd.DataFrame
) -> pd.DataFrame:
    """The motion with λ of the model after the first peak, measured λ before it."""
    fit, first = model
    material, kinematics = sphere_material(drop), read_table(folder, "kinematics")
    times = column(kinematics, "t_s")
    measured = stretch.set_index("frame").reindex(kinematics["frame"])
    seen = column(measured, "stretch")
    after = times >= (first.time_s if first.found else 0.0)
    used = np.where(after, _scaled_stretch(fit, first, material, times), seen)
    # The smoother sees the noise of the images; the misfit of the model is no noise and is added afterwards.
    used_unc = np.where(after, 0.0, column(measured, "stretch_unc"))
    by_model = np.where(np.isfinite(seen), "model", "bridge") if first.found else np.full(times.shape, "")
    source = np.where(after, by_model, "measured")
    motion = entry_motion(folder, drop, (used, used_unc))
    columns: dict[str, Any] = {name: kinematics[name] for name in ("frame", "t_s", "x_c_m")}
    columns |= motion_columns(motion) | {"stretch_source": [word or None for word in source]}
    misfit = np.where(after, _misfit(fit, first, material, stretch), 0.0)
    _add_misfit(columns, 2.0 * material.radius_m / used**3 * misfit, 2.0 * math.pi / fit.period_exp_s)
    early = early_shape_time(material.radius_m, material.g_inf_pa, material.density_kg_m3)
    lacking = "not_identified" if first.found else fit.status
    columns["status"] = _statuses(kinematics["status"], columns, (early, lacking))
    return new_table("kinematics_model", columns)


def _add_misfit(columns: dict[str, Any], height: FloatArray, frequency: float) -> None:
    """Add an error of y_c of standard size ``height`` that swings with the sphere to the uncertainties."""
    if not math.isfinite(frequency):
        return
    for power, name in enumerate(("y_c_m_unc", "v_c_m_s_unc", "a_c_m_s2_unc")):
        columns[name] = np.hypot(columns[name], height * frequency**power)


def _statuses(given: pd.Series[str], columns: dict[str, Any], model: tuple[float, str]) -> list[str]:
    """A word per frame: that of kinematics.csv where the track lacks something, else what the model's route lacks."""
    early_s, lacking = model
    tracked = np.isfinite(columns["x_c_m"].to_numpy()) & np.isfinite(columns["v_b_m_s"])
    computed = np.isfinite(columns["v_c_m_s"]) & np.isfinite(columns["y_c_m_unc"])
    times = columns["t_s"].to_numpy()
    words = []
    for i, word in enumerate(given.fillna("no_edge")):
        if not tracked[i]:
            words.append(word if word not in ("ok", "early_shape") else "no_edge")
        elif not computed[i]:
            words.append("no_edge" if columns["stretch_source"][i] == "measured" else lacking)
        else:
            words.append("early_shape" if 0.0 <= times[i] < early_s else "ok")
    return words
