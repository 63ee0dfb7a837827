"""The arc of the ellipse cut into sectors: where they are, where they look, and how they move.

Ellipse frame: u across, v along the axis (down); a point is (a cos phi, b sin phi). A sector index runs with phi,
from the right over the bottom to the left and over the top. Sectors are equal in a blend of arc length and turning
angle, so that the sharp ends of an oblate ellipse are not lumped together.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled

Floats = NDArray[np.float64]

QUADRANT_NODES = 256
# Columns of the table that `arc_geometry` returns; J is the derivative of the outward displacement of the edge,
# DEPARTURE how far the outline is known to lie outside of the ellipse, ANGLE the eccentric one.
X, Y, NX, NY, KAPPA, J, LENGTH, DEPARTURE, ANGLE, COLUMNS = 0, 1, 2, 3, 4, 5, 10, 11, 12, 13
# A shape vector may go on behind its five parameters with a known departure: the cosines and sines of waves of this
# many periods and more round the sphere, as shares of the distance from the centre.
FIRST_WAVE = 3


@compiled
def semi_axes(shape: Floats) -> tuple[float, float]:
    """Semi-axes across and along, px, of the parameter vector (x, y, R, stretch, tilt in radians)."""
    return shape[2] * shape[3], shape[2] / (shape[3] * shape[3])


@compiled
def quadrant_table(a: float, b: float, step_px: float, step_angle: float) -> tuple[int, Floats]:
    """Sectors in a quadrant and, on a grid of the pseudo-angle q = sin/(sin + cos), the running sector number."""
    densities, table = np.empty(QUADRANT_NODES), np.zeros(QUADRANT_NODES + 1)
    for node in range(QUADRANT_NODES):  # apart from the running sum, so that it becomes vector instructions
        q = (node + 0.5) / QUADRANT_NODES
        square = q * q + (1.0 - q) * (1.0 - q)
        speed2 = (a * a * q * q + b * b * (1.0 - q) * (1.0 - q)) / square
        density = math.sqrt(speed2) / step_px + a * b / (speed2 * step_angle)
        densities[node] = density / (square * QUADRANT_NODES)
    for node in range(QUADRANT_NODES):
        table[node + 1] = table[node] + densities[node]
    count = max(4, math.ceil(table[QUADRANT_NODES]))
    table *= count / table[QUADRANT_NODES]
    return count, table


@compiled
def sector_at(share: float, right: bool, below: bool, count: int, table: Floats) -> int:
    """Index of the sector that holds the pseudo-angle ``share`` (see `quadrant_table`) of one of the four quadrants."""
    # a boundary may fall on a node: rounding must not choose the side
    local = min(int(table[int(QUADRANT_NODES * share)] + 1e-9), count - 1)
    if below:
        return local if right else 2 * count - 1 - local
    return 4 * count - 1 - local if right else 2 * count + local


@compiled
def sector_angles(count: int, table: Floats) -> Floats:
    """Eccentric angles at the middle of each of the 4 * count sectors, radians."""
    phi = np.empty(4 * count)
    node = 0
    for k in range(count):
        while table[node + 1] < k + 0.5:
            node += 1
        q = (node + (k + 0.5 - table[node]) / (table[node + 1] - table[node])) / QUADRANT_NODES
        angle = math.atan2(q, 1.0 - q)
        phi[k] = angle
        phi[2 * count - 1 - k] = math.pi - angle
        phi[2 * count + k] = math.pi + angle
        phi[4 * count - 1 - k] = 2.0 * math.pi - angle
    return phi


@compiled
def departure_at(shape: Floats, cosine: float, sine: float) -> float:
    """Relative departure of the outline from the ellipse at an eccentric angle; its phase is 0 at the lower pole."""
    # powers of the unit number that turns with the angle from the pole, whose cosine is the sine of the eccentric one
    real, imaginary = sine, cosine
    for _ in range(FIRST_WAVE - 1):
        real, imaginary = real * sine - imaginary * cosine, real * cosine + imaginary * sine
    total = 0.0
    for index in range(5, shape.size, 2):
        total += shape[index] * real + shape[index + 1] * imaginary
        real, imaginary = real * sine - imaginary * cosine, real * cosine + imaginary * sine
    return total


@compiled
def lowest_angle(shape: Floats) -> tuple[float, float]:
    """Eccentric angle of the lowest point, and its depth below the centre, px."""
    a, b = semi_axes(shape)
    across, along = -a * math.sin(shape[4]), b * math.cos(shape[4])
    return math.atan2(along, across), math.hypot(across, along)


@compiled
def perimeter_of(a: float, b: float) -> float:
    """Perimeter of an ellipse with these semi-axes (Ramanujan)."""
    h = ((a - b) / (a + b)) ** 2
    return math.pi * (a + b) * (1.0 + 3.0 * h / (10.0 + math.sqrt(4.0 - 3.0 * h)))


@compiled
def sector_widths(phi: Floats) -> Floats:
    """Widths of sectors round the whole ellipse, from halfway to one neighbour to halfway to the other, radians."""
    count = phi.size
    width = np.empty(count)
    for k in range(count):
        before = phi[k - 1] if k > 0 else phi[count - 1] - 2.0 * math.pi
        after = phi[k + 1] if k + 1 < count else phi[0] + 2.0 * math.pi
        width[k] = 0.5 * (after - before)
    return width


@compiled
def arc_geometry(shape: Floats, phi: Floats) -> Floats:
    """`arc_rows` of sectors round the whole ellipse."""
    return arc_rows(shape, phi, sector_widths(phi))


@compiled
def arc_rows(shape: Floats, phi: Floats, width: Floats) -> Floats:
    """Point, outward normal, curvature (1/px), Jacobian, length, departure (px) and angle of each sector, COLUMNS.

    Sectors are told by their middle and their width, eccentric angles in radians.
    """
    a, b = semi_axes(shape)
    radius, stretch, departs = shape[2], shape[3], shape.size > 5
    cos_tilt, sin_tilt = math.cos(shape[4]), math.sin(shape[4])
    rows = np.empty((phi.size, COLUMNS))
    for k in range(phi.size):
        cosine, sine = math.cos(phi[k]), math.sin(phi[k])
        u, v = a * cosine, b * sine
        speed = math.sqrt(a * sine * (a * sine) + b * cosine * (b * cosine))
        nu, nv = b * cosine / speed, a * sine / speed
        rows[k, X] = shape[0] + u * cos_tilt + v * sin_tilt
        rows[k, Y] = shape[1] - u * sin_tilt + v * cos_tilt
        rows[k, NX] = nu * cos_tilt + nv * sin_tilt
        rows[k, NY] = -nu * sin_tilt + nv * cos_tilt
        rows[k, KAPPA] = a * b / (speed * speed * speed)
        rows[k, J] = rows[k, NX]
        rows[k, J + 1] = rows[k, NY]
        rows[k, J + 2] = (u * nu + v * nv) / radius
        rows[k, J + 3] = (u * nu - 2.0 * v * nv) / stretch
        rows[k, J + 4] = v * nu - u * nv
        rows[k, ANGLE] = phi[k]
        rows[k, DEPARTURE] = (u * nu + v * nv) * departure_at(shape, cosine, sine) if departs else 0.0
        rows[k, LENGTH] = speed * width[k]
    return rows


@compiled
def displacement_of(row: Floats, moved: Floats) -> float:
    """How far outwards a sector or ray moves under a parameter step, px; ``row`` is one of `arc_rows`."""
    displacement = 0.0
    for i in range(5):
        displacement += row[J + i] * moved[i]
    return displacement


@compiled
def farthest(rows: Floats, moved: Floats) -> float:
    """Greatest displacement of the outline under a parameter step, px."""
    far = 0.0
    for k in range(rows.shape[0]):
        far = max(far, abs(displacement_of(rows[k], moved)))
    return far
