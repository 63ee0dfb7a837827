"""From metres to pixels of the side camera, with refraction below the surface where the scene asks for it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wentry_cli.synthetic.raster import Polygon
from wentry_cli.synthetic.scene import Scene

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class SideGeometry:
    """Place of the scene in the side frame: y down, ``surface_y_px`` the row of height 0."""

    scale_px_per_m: float
    center_x_px: float
    surface_y_px: float
    wet_scale: float = 1.0
    axis_y_px: float = 0.0
    axis_x_px: float = 0.0

    def to_air(self, points: Floats) -> Floats:
        """Points (x right, y up, metres) as seen through air."""
        s = self.scale_px_per_m
        return np.stack([self.center_x_px + s * points[:, 0], self.surface_y_px - s * points[:, 1]], axis=1)

    def to_water(self, points: Floats) -> Floats:
        """Points as seen through water: magnified by ``wet_scale`` about the optical axis."""
        p = self.to_air(points)
        axis = np.array([self.axis_x_px, self.axis_y_px])
        return np.asarray(axis + (p - axis) * self.wet_scale)

    def draw(self, points: Floats, level: float, layer: int) -> list[Polygon]:
        """Polygons of a body: its part in air and its part in water, each bounded by the surface."""
        if not len(points):
            return []
        line = self.surface_y_px
        if self.wet_scale == 1.0:
            return [Polygon(self.to_air(points), level, layer)]
        parts = []
        if points[:, 1].max() > 0.0:
            dry = self.to_air(np.column_stack([points[:, 0], np.maximum(points[:, 1], 0.0)]))
            parts.append(Polygon(dry, level, layer))
        if points[:, 1].min() < 0.0:
            wet = self.to_water(np.column_stack([points[:, 0], np.minimum(points[:, 1], 0.0)]))
            wet[:, 1] = np.maximum(wet[:, 1], line)
            parts.append(Polygon(wet, level, layer))
        return parts


def place_side(scene: Scene) -> SideGeometry:
    """Geometry of the side view of ``scene``: by default centred, the surface a fifth down the frame."""
    camera, switches = scene.side, scene.switches
    assert camera is not None
    cx = 0.5 * (camera.width - 1) if camera.center_x_px is None else camera.center_x_px
    sy = 0.2 * camera.height if camera.surface_y_px is None else camera.surface_y_px
    axis_y = sy + switches.optical_axis_below_m * camera.scale_px_per_m
    return SideGeometry(camera.scale_px_per_m, cx, sy, switches.wet_scale, axis_y, 0.5 * (camera.width - 1))
