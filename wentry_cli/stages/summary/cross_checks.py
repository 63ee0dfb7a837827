"""What a drop was told to be against what was measured: its height, its fall through air, the stretch of its material.

Each check gives a sentence, and nothing where both agree.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from wentry_cli.kinematics.entry import fall_before_impact
from wentry_cli.scaling.dimensionless import elastic_time
from wentry_cli.stages.inputs.columns import Row, column
from wentry_cli.stages.kinematics import NOMINAL_DENSITY
from wentry_cli.stages.summary.speeds import Speeds
from wentry_cli.tables import has_table, read_table

if TYPE_CHECKING:
    from wentry_cli.config.campaign import Drop
    from wentry_cli.config.models import Experiment

# Standard uncertainties where none is told: of a height, m, and of a speed, as a share of it.
HEIGHT_UNC_M, SPEED_UNC = 0.01, 0.01
CLEARLY_APART, RELEASE = 3.0, 0.01  # standard uncertainties, and share of the speed that a release may give or take
FREE_FALL, FREE_FALL_SIGMA = 0.2, 4.0
# The stretch that a sphere must show at least: this share of a low estimate, and the most of that; the frames
# about its first peak, in D/√(G∞/ρ_s) after impact, and how many of them tell.
CERTAIN_SHARE, MOST_EXPECTED, PEAK_WINDOW, FEWEST_AT_PEAK = 1.0 / 3.0, 0.5, (0.2, 0.8), 5


def air_takes(experiment: Experiment, speed: float) -> float:
    """What drag takes at most of the ``speed`` (m/s, without air) of a fall from rest, m/s; NaN where that is.

    Drag grows with the square of the speed, and so in proportion to the height fallen: by the work that it does the
    speed at the end is lower by a quarter of drag over weight there.
    """
    sphere = experiment.sphere
    drag = fall_before_impact(
        experiment.gravity_m_s2, speed, sphere.radius_m, sphere.density or NOMINAL_DENSITY
    ).uncertainty
    return 0.25 * speed * drag / experiment.gravity_m_s2


def doubt_of_speed(drop: Drop, speeds: Speeds, row: Row) -> str:
    """Where U₀ is not the speed that ``row`` has from the height of the drop, or that was given.

    They may differ by three standard uncertainties of both, by a hundredth at least; below a height, by what air takes
    too. A height without an uncertainty counts as good to a centimetre, a speed to a hundredth.
    """
    release, expected = drop.experiment.drop, float(row["speed_from_height_m_s"])
    if not (math.isfinite(expected) and math.isfinite(speeds.impact)):
        return ""
    unc = float(np.nan_to_num(row["speed_from_height_m_s_unc"]))
    air, key = 0.0, "drop.impact_speed_m_s"
    if release.impact_speed_m_s is not None:
        unc = unc if release.impact_speed_m_s_unc > 0.0 else math.hypot(unc, SPEED_UNC * expected)
    elif release.height_m is not None:
        air, key = float(row["speed_taken_by_air_m_s"]) / expected, "drop.height_m"
        if release.height_m_unc == 0.0:
            unc = math.hypot(unc, 0.5 * HEIGHT_UNC_M / release.height_m * expected)
    off = speeds.impact / expected - 1.0
    limit = max(CLEARLY_APART * math.hypot(unc, speeds.impact_unc) / expected, RELEASE)
    if -limit - air <= off <= limit:
        return ""
    without = f", of which air takes {100.0 * air:.1f} % at most" if air else ""
    return (
        f"the impact speed is {speeds.impact:.3g} m/s by measurement and {expected:.3g} m/s by {key}{without}: "
        f"{100.0 * abs(off):.1f} % {'more' if off > 0.0 else 'less'}, where {100.0 * limit:.1f} % would be usual; "
        f"check {key}, fps, scale_px_per_m and sphere.diameter_m"
    )


def doubt_of_flight(drop: Drop, row: Row) -> str:
    """Where a free flight does not fall with gravity."""
    value, unc = row.get("acceleration_m_s2", math.nan), row.get("acceleration_m_s2_unc", math.nan)
    gravity = drop.experiment.gravity_m_s2
    if not abs(value + gravity) > max(FREE_FALL_SIGMA * unc, FREE_FALL * gravity):
        return ""
    return (
        f"a free flight falls with {-gravity:.3g} m/s², but the acceleration is measured to be {value:.3g} ± {unc:.2g} "
        "m/s²; check kind, sphere.diameter_m, fps and polarity, and that the camera does not shake"
    )


def doubt_of_softness(folder: Path, drop: Drop, speed: float) -> str:
    """Where a sphere of a soft material stays round about the time at which its impact must have stretched it most."""
    material, sphere = drop.material, drop.experiment.sphere
    if material is None or sphere.rigid or not speed > 0.0 or not has_table(folder, "stretch"):
        return ""
    density = sphere.density or NOMINAL_DENSITY
    expected = _expected_stretch(drop, material.g_inf_pa + material.g_t_pa, density, speed)
    table = read_table(folder, "stretch")
    since = column(table, "t_s") / elastic_time(sphere.diameter_m, material.g_inf_pa, density)
    off, unc = np.abs(column(table, "stretch") - 1.0), column(table, "stretch_unc")
    seen = (since > PEAK_WINDOW[0]) & (since < PEAK_WINDOW[1]) & np.isfinite(off) & np.isfinite(unc)
    if seen.sum() < FEWEST_AT_PEAK:
        return ""
    most = float(np.max(off[seen] + CLEARLY_APART * unc[seen]))
    if most >= CERTAIN_SHARE * expected:
        return ""
    return (
        f"sphere.material is {sphere.material}, whose G∞ of {material.g_inf_pa / 1e3:.3g} kPa makes one expect a "
        f"stretch of {1.0 + expected:.3g} or more at {speed:.3g} m/s, but λ is within {most:.2g} of 1 in the "
        f"{seen.sum()} frames about the time of its first peak: is the sphere rigid, or of another material?"
    )


def _expected_stretch(drop: Drop, modulus_pa: float, density: float, speed: float) -> float:
    """λ − 1 at the first peak, a low estimate, of a sphere of shear ``modulus_pa`` before anything in it flows.

    In water the pressure of impact, half of ρ_w U₀² on the bottom and none at the top, strains a bar of modulus 3 G by
    a sixth of ρ_w U₀²/G, twice what it does at rest; on a plate the energy of the fall goes into that bar. The stretch
    sideways is half of the strain along the height.
    """
    if drop.experiment.kind == "water_entry":
        strain = drop.experiment.liquid.density_kg_m3 * speed**2 / (6.0 * modulus_pa)
    else:
        strain = speed * math.sqrt(density / (3.0 * modulus_pa))
    return min(0.5 * strain, MOST_EXPECTED)
