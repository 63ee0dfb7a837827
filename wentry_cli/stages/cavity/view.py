"""What the stage cavity takes from the tables of the side view: the sphere in every frame, scale, surface, impact."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wentry_cli.cavity.detachment import find_apex, hidden_rows
from wentry_cli.cavity.follow import sphere_outlines
from wentry_cli.cavity.nested import CavityStart, find_cavity_starts
from wentry_cli.cavity.profile import CavityProfile, SphereOutline
from wentry_cli.stages.inputs.clip import Clip
from wentry_cli.stages.track.scales import Scales, height_unc
from wentry_cli.tables import read_table
from wentry_cli.tracking.scale import PixelMap, pixel_to_metre

if TYPE_CHECKING:
    from wentry_cli.config.campaign import Drop

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class SideView:
    """What side.csv and geometry.csv say: arrays per frame, the map to metres, surface and radius in pixels."""

    t_s: Floats
    spheres: list[SphereOutline | None]
    starts: list[CavityStart]
    separation_px: Floats
    pixels: PixelMap
    surface_unc_px: float
    radius_px: float
    exposure_s: float
    scales: Scales
    axis_unc_px: float
    impact_unc_s: float

    @property
    def scale_unc(self) -> float:
        """Relative uncertainty of the scale of what is seen through the water."""
        return self.scales.water_unc / self.scales.water

    def metres(self, x_px: Floats | float, y_px: Floats | float) -> tuple[Floats, Floats]:
        """The one map from pixels to metres."""
        return pixel_to_metre(x_px, y_px, self.pixels)

    def height(self, y_px: float) -> float:
        """Height of a row of the picture above the surface, m."""
        return float(self.metres(self.below_impact(y_px), y_px)[1])

    def below_impact(self, y_px: float) -> float:
        """The column in which the vertical through the point of impact crosses a row."""
        return float(self.plumb(self.pixels.surface_x_px, self.pixels.surface_y_px, y_px))

    def plumb(self, x_px: float, y_px: float, rows_px: Floats | float) -> Floats:
        """The columns in which the vertical through a point of the picture crosses its rows."""
        return np.asarray(x_px - (np.asarray(rows_px) - y_px) * math.tan(self.pixels.roll_rad))

    def height_unc(self, y_px: float, y_unc_px: float) -> float:
        """Standard uncertainty of ``height``, m, of a row known to ``y_unc_px``."""
        rows = np.array([y_px]), np.array([y_unc_px])
        axis = self.pixels.axis_y_px, self.axis_unc_px
        return float(height_unc(rows, self.scales, (self.pixels.surface_y_px, self.surface_unc_px), axis)[0])

    def apex(self, profile: CavityProfile) -> float:
        """Depth of the cavity's apex below the surface, px."""
        depth = profile.y_px - self.pixels.surface_y_px
        return find_apex(depth, profile.width_px, hidden_rows(self.surface_unc_px))

    def after_impact(self, t_s: float, t_unc_s: float) -> tuple[float, float]:
        """A time after impact with the uncertainty of the impact in it."""
        return t_s, float(np.hypot(t_unc_s, np.nan_to_num(self.impact_unc_s)))


def read_side_view(folder: Path, drop: Drop, clip: Clip) -> SideView:
    """What stage track measured of the side view, of which ``clip`` are the frames."""
    side, geometry = read_table(folder, "side"), read_table(folder, "geometry")
    row = geometry[geometry["view"] == "side"].iloc[0]
    column = {name: side[name].to_numpy(float) for name in side.columns if name not in {"status", "y_b_source"}}
    air, water = float(row["scale_px_per_m"]), float(row["scale_water_px_per_m"])
    scales = Scales(
        air, float(row["scale_px_per_m_unc"]), water, float(row["scale_water_px_per_m_unc"]), str(row["scale_source"])
    )
    axis_x = clip.opened.middle_px[0]
    surface, roll = float(row["surface_y_px"]), math.radians(np.nan_to_num(row["roll_deg"]))
    level_at = float(np.nan_to_num(row["surface_x_px"]))
    pixels = PixelMap(air, water, surface, axis_x, float(row["optical_axis_y_px"]), level_at, roll)
    radius = water * drop.experiment.sphere.radius_m
    starts = find_cavity_starts(column["t_s"], column["stretch"], column["stretch_unc"], column["separation_y_m"])
    spheres = sphere_outlines(column["center_x_px"], column["center_y_px"], radius, column["stretch"])
    if not np.isfinite([radius, pixels.surface_y_px, *column["t_s"]]).all():
        spheres = [None] * len(side)  # without scale, surface or impact there is nothing to measure against
    return SideView(
        t_s=column["t_s"],
        spheres=spheres,
        starts=starts,
        separation_px=column["separation_y_px"],
        pixels=pixels,
        surface_unc_px=float(np.nan_to_num(row["surface_y_px_unc"])),
        radius_px=radius,
        exposure_s=float(np.nan_to_num(row["exposure_s"])),
        scales=scales,
        axis_unc_px=float(np.nan_to_num(row["optical_axis_y_px_unc"])),
        impact_unc_s=float(row["impact_time_s_unc"]),
    )
