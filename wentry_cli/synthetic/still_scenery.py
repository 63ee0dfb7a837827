"""What stands about a still sphere in the hard cases, as polygons in pixels: drawn, never measured."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from wentry_cli.synthetic.outline import draw_blob, draw_sphere_outline, shift_outline
from wentry_cli.synthetic.raster import Polygon
from wentry_cli.synthetic.still import StillBody

IN_FRONT, INSIDE, BEHIND = 6, 4, 0


def mirror_image(body: StillBody, gap_px: float) -> list[Polygon]:
    """The twin of a sphere that hovers half of ``gap_px`` above the surface, fainter than the sphere itself."""
    outline = draw_sphere_outline(body.radius_px, body.stretch)
    lowest = body.center_y_px + float(outline[:, 1].max())
    twin = np.column_stack([outline[:, 0], -outline[:, 1]])
    below = 2.0 * (lowest + 0.5 * gap_px) - body.center_y_px
    return [Polygon(shift_outline(twin, body.center_x_px, below), 0.4, BEHIND)]


def surface_band(body: StillBody, lower_edge_y_px: float, thickness_px: float, rng: np.random.Generator) -> Polygon:
    """A free surface edge on, in front of the sphere: dark, thick, its edges wavy (the meniscus on the near glass)."""
    reach = 2.0 * body.stretch * body.radius_px
    x = np.linspace(body.center_x_px - reach, body.center_x_px + reach, 160)
    edges = []
    for y in (lower_edge_y_px - thickness_px, lower_edge_y_px):
        wave = sum(
            0.06 * thickness_px * rng.normal() / k * np.sin(k * x / 40.0 + rng.uniform(0.0, 6.28)) for k in range(1, 6)
        )
        edges.append(np.column_stack([x, y + np.asarray(wave)]))
    return Polygon(np.concatenate([edges[0], edges[1][::-1]]), 0.3, IN_FRONT)


def translucent_body(body: StillBody, rng: np.random.Generator) -> list[Polygon]:
    """Light through a sphere of clear silicone: a bright core, a mould seam and embedded bubbles."""
    at = np.array([body.center_x_px, body.center_y_px])
    polygons = []
    for share, level in ((0.75, 0.3), (0.6, 0.5), (0.4, 0.75)):
        core = draw_sphere_outline(share * body.radius_px, body.stretch)
        polygons.append(Polygon(core + at, level, INSIDE))
    across, half = body.stretch * body.radius_px, 0.012 * body.radius_px
    seam = np.array([[-0.97, -1.0], [0.97, -1.0], [0.97, 1.0], [-0.97, 1.0]]) * np.array([across, half])
    polygons.append(Polygon(seam + at, 0.15, IN_FRONT))
    for _ in range(8):
        angle, reach = rng.uniform(0.0, 2.0 * np.pi), 0.85 * np.sqrt(rng.uniform())
        x = body.center_x_px + reach * across * np.cos(angle)
        y = body.center_y_px + reach * body.radius_px / body.stretch**2 * np.sin(angle)
        size = body.radius_px * rng.uniform(0.02, 0.06)
        polygons.append(Polygon(draw_blob((x, y), size, rng), float(rng.uniform(0.1, 0.9)), IN_FRONT))
    return polygons


def lamp_lit_cavity(body: StillBody, light_half: float) -> Polygon:
    """The bright core of the cavity above the sphere that a lamp of a small angle leaves: a narrow wedge."""
    top = -20.0
    foot = body.separation_y_px - 0.1 * body.radius_px
    half = light_half * body.stretch * body.radius_px
    points: NDArray[np.float64] = np.array([[-half, top], [half, top], [0.3 * half, foot], [-0.3 * half, foot]])
    return Polygon(points + np.array([body.center_x_px, 0.0]), 0.8, INSIDE)
