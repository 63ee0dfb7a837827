"""Level "fast": matched edges along the normals of the predicted ellipse and a robust fit of its parameters."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wentry_cli.compiled import compiled
from wentry_cli.contours.arc import (
    DEPARTURE,
    KAPPA,
    LENGTH,
    NX,
    NY,
    X,
    Y,
    arc_rows,
    displacement_of,
    farthest,
    lowest_angle,
    perimeter_of,
    quadrant_table,
    sector_angles,
    sector_widths,
    semi_axes,
)
from wentry_cli.contours.ray_fit import consensus, rest_of, tukey_fit
from wentry_cli.contours.ray_scatter import scan_covariance
from wentry_cli.contours.turning import no_turn, ray_turn, wants_tilt
from wentry_cli.imaging.edges import CANDIDATES, KERNEL_SIGMA_PX, edge_candidates
from wentry_cli.imaging.order_statistics import quantile_of

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

COARSE, MIDDLE, FINE = 0, 1, 2
# Half-length of the scans, px: the first is told.
MIDDLE_PX, FINE_PX, CROWDED_PX = 6.0, 3.0, 4.0
COARSE_RAYS = 48
# More rays than so many are taken only as far as they are so far apart: their lines lie side by side, or, where much is
# hidden and each gap counts, overlap.
ENOUGH_RAYS, APART_PX, DENSE_PX = 64, 3.0, 1.5
# Steps along the rays, px, and lines beside each other.
COARSE_STEP_PX, COARSE_LINES, FINE_STEP_PX, FINE_LINES = 1.0, 1, 0.5, 3
# A wider filter locates a noisy edge better by its peak, up to √5 times the blur, but sees more of what is near.
FINE_SIGMA_PX = 1.9
LINE_VARIANCE = 2.0 / 3.0
# The middle scan is left out where the first moved the outline by less, and nearly all rays agreed.
SETTLED_PX = 1.0
OCCLUDED_SHARE = 0.15
# A fine scan of an outline that was followed is believed where it moved by less and so few rays were left out; it is
# the last where the rays of the guess, which know nothing of the curvature, are wrong by less.
ASTRAY_PX, MOST_LEFT_OUT, BENT_PX = 1.5, 0.15, 0.001
# Transmission by which the ground must be brighter than the sphere.
LEAST_HEIGHT = 0.02
# Rays farther off than this count as outliers, by scan; the last never less than what a real sphere departs.
LIMITS_PX = (1.2, 0.7, 0.6)
SLACK_OF_R = 0.006
# Entries of the report of a scan.
STATUS, SEEN, LEFT_OUT, SCALE, CONTRAST, BELOW, REPORT = 0, 1, 2, 3, 4, 5, 6
GOOD, NO_EDGE, NO_CONSENSUS = 0.0, 1.0, 2.0


@compiled
def visible_rays(
    shape: Floats, top_y: float, wanted: int, apart_px: float, size: tuple[int, int]
) -> tuple[Floats, float, float]:
    """Sector rows below ``top_y`` whose points lie in the image, with two shares of the whole perimeter.

    About ``wanted`` rows, fewer where they would be less than ``apart_px`` from each other. The shares are of what lies
    below ``top_y`` and of the part of it that lies in the image.
    """
    a, b = semi_axes(shape)
    sine = min(1.0, max(-1.0, (top_y - shape[1]) / b))
    share = max(0.1, 0.5 - math.asin(sine) / math.pi)
    around = 2.0 * math.pi * math.sqrt(0.5 * (a * a + b * b))
    wanted = min(wanted, max(ENOUGH_RAYS, int(share * around / apart_px)))
    turns = wanted / share
    count, table = quadrant_table(a, b, 1.3 * around / turns, 1.3 * 2.0 * math.pi / (0.3 * turns))
    phi = sector_angles(count, table)
    width = sector_widths(phi)
    lowest, depth = lowest_angle(shape)
    reach = math.acos(min(1.0, max(-1.0, (top_y - shape[1]) / depth)))
    chosen = 0
    for k in range(phi.size):
        away = abs(phi[k] - lowest)
        if min(away, 2.0 * math.pi - away) <= reach:
            phi[chosen], width[chosen] = phi[k], width[k]
            chosen += 1
    rows = arc_rows(shape, phi[:chosen], width[:chosen])
    number, length, below, total = 0, 0.0, 0.0, perimeter_of(a, b)
    for k in range(chosen):
        below += rows[k, LENGTH]
        if 1.0 <= rows[k, X] < size[1] - 2.0 and 1.0 <= rows[k, Y] < size[0] - 2.0:
            length += rows[k, LENGTH]
            rows[number] = rows[k]
            number += 1
    return rows[:number], below / total, length / total


@compiled
def correct_edges(at: Floats, rays: Floats, variance: float, motion: Floats) -> None:
    """Undo what moves the edge off the ellipse.

    A blurred convex edge lies further inside by half the curvature times the variance along the edge; the known
    departure is taken off.
    """
    for k in range(rays.shape[0]):
        along = (motion[0] * rays[k, NY] - motion[1] * rays[k, NX]) ** 2 / 12.0
        for slot in range(CANDIDATES):
            at[k, slot] += 0.5 * rays[k, KAPPA] * (variance + along) - rays[k, DEPARTURE]


@compiled
def clamp_step(shape: Floats, step: Floats) -> None:
    """Move the shape, at most by a third of its radius and a fifth of its stretch at a time."""
    bound = 0.34 * shape[2]
    for i in range(3):
        shape[i] += min(bound, max(-bound, step[i]))
    shape[3] *= math.exp(min(0.2, max(-0.2, step[3] / shape[3])))
    shape[4] += min(0.3, max(-0.3, step[4]))


@compiled
def bent(rays: Floats, step: Floats) -> float:
    """Greatest error of a displacement along the rays for the curvature of the outline: half of it times the square."""
    worst = 0.0
    for k in range(rays.shape[0]):
        worst = max(worst, 0.5 * rays[k, KAPPA] * displacement_of(rays[k], step) ** 2)
    return worst


@compiled
def scan_once(
    values: NDArray[np.float32],
    shape: Floats,
    free: Ints,
    top_y: float,
    search: Floats,
    kind: int,
    factor: Floats,
    report: Floats,
) -> tuple[Floats, Floats, Floats]:
    """One scan, of a ``kind``, from a shape, which is moved in place.

    ``search`` as in `scan_shape`; ``factor`` receives the Cholesky factor of the normal equations, ``report``, which is
    that of the scan before, what that of `scan_shape` holds. Returns the rays, how far the edges lie outside of the
    ellipse that was found (rays, 1), and the parameter step.
    """
    fine, size = kind == FINE, free.size
    crowded = fine and report[LEFT_OUT] > OCCLUDED_SHARE  # by the scan before
    nothing, step = np.empty((0, 1)), np.zeros(5)
    report[STATUS] = NO_EDGE
    wanted, apart_px = int(search[2]) if fine else COARSE_RAYS, DENSE_PX if crowded else APART_PX
    rays, report[BELOW], report[SEEN] = visible_rays(shape, top_y, wanted, apart_px, values.shape)
    number = rays.shape[0]
    if number < size + 4:
        return rays, nothing, step
    half = min((search[0], MIDDLE_PX, CROWDED_PX if crowded else FINE_PX)[kind], 0.8 * number + 4.0)
    step_px, lines, sigma = COARSE_STEP_PX, COARSE_LINES, KERNEL_SIGMA_PX
    if fine:
        step_px, lines, sigma = FINE_STEP_PX, FINE_LINES, KERNEL_SIGMA_PX if crowded else FINE_SIGMA_PX
    at, height, noise = edge_candidates(values, rays, half, step_px, lines, sigma)
    heights = height[:, 0].copy()
    report[CONTRAST] = quantile_of(heights, number, 0.5)
    noise = search[7] if search[7] > 0.0 else noise
    limit = max(LIMITS_PX[kind], SLACK_OF_R * shape[2])
    least = max(0.3 * quantile_of(heights, number, 0.75), LEAST_HEIGHT, noise if fine else 2.0 * noise)
    if quantile_of(heights, number, 1.0 - max((size + 3.0) / number, 0.15)) < least:
        return rays, nothing, step
    correct_edges(at, rays, search[3] + (LINE_VARIANCE if fine else 0.0), search[5:7])
    settings = np.array([least, limit, 0.6 * limit if search[1] > 0.0 else limit])
    if not fine:
        step = consensus(at, height, rays, free, settings)
    step, report[SCALE], share = tukey_fit(at, height, rays, free, step, settings, np.zeros(size), factor)
    report[LEFT_OUT] = 1.0 - share
    report[STATUS] = NO_CONSENSUS if math.isnan(report[SCALE]) or share < 0.2 else GOOD
    off = np.empty((number, 1))
    rest_of(at, height, rays, step, least, off[:, 0])
    if report[STATUS] == GOOD:
        clamp_step(shape, step)
    return rays, off, step


@compiled
def scan_shape(
    values: NDArray[np.float32], shape: Floats, free: Ints, top_y: float, search: Floats, followed: bool
) -> tuple[Floats, Floats, Floats]:
    """Find the ellipse from a guess, which is moved in place (patch pixels, tilt in radians, departure).

    ``search`` holds the half-length of the first scan (px), 1 where outliers lie outside only, the number of rays of
    the last scan, the variance of the blur along the edge (px^2), the number of scans (3, or 2 where the third and
    fine one is only for outlines that are partly hidden), the motion (x, y), px, and the noise of a pixel, 0 where it
    is not known. An outline that is ``followed`` is looked for where the guess has it, and only where it is not found
    there further off. Returns, of three scans, the covariance of the free parameters; (status, share of the perimeter
    that is visible, share of rays left out, scale of the residual in px, contrast, share below the top row), status 0
    being good, 1 no edge, 2 no consensus; and, of three scans, the turn (see `turning`).
    """
    report, factor = np.zeros(REPORT), np.zeros((free.size, free.size))
    guess, kind = shape.copy(), FINE if followed else COARSE
    while True:
        rays, off, step = scan_once(values, shape, free, top_y, search, kind, factor, report)
        moved = farthest(rays, step)
        if followed and (report[STATUS] != GOOD or report[LEFT_OUT] > MOST_LEFT_OUT or moved > ASTRAY_PX):
            followed, kind, shape[:] = False, COARSE, guess
            continue
        if report[STATUS] != GOOD:
            return np.zeros((free.size, free.size)), report, no_turn()
        if kind == FINE:
            if not (followed and bent(rays, step) > BENT_PX):
                break
            followed = False
            continue
        settled = kind == COARSE and report[LEFT_OUT] < 0.1 and moved < SETTLED_PX
        kind = MIDDLE if kind == COARSE and not settled else FINE
        if kind == FINE and search[4] < 3.0 and report[LEFT_OUT] < OCCLUDED_SHARE:
            break
    if search[4] < 3.0:
        return np.zeros((free.size, free.size)), report, no_turn()
    found = scan_covariance(off, rays, free, factor, report[SCALE])
    if not wants_tilt(free):
        return found, report, no_turn()
    return found, report, ray_turn(off, rays, free, report[SCALE])
