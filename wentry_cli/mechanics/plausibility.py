"""Whether the flow and the modulus of a material are such that a ringing sphere shows: a wrong unit is told."""

from __future__ import annotations

import math

from wentry_cli.mechanics.bergstrom_boyce import Material, find_groups
from wentry_cli.mechanics.calibration import REFERENCE_HARDENING

# Of A* c_refⁿ, which is .5 to 1.1 for the six spheres of Table 1: a factor 1000 in tau0_pa falls outside.
FLOW_RANGE = (1e-2, 1e2)
# T_exp/T_model: 1 in air; in water the mass that moves along makes it 1.14 (half wetted) to 1.5 (wetted all round).
IN_AIR, IN_WATER = (1.0, 1.0), (1.14, 1.5)
RATIO_RANGE = (0.7, 2.5)  # what G∞, within a factor of two or three, makes of these


def doubt_of_flow(material: Material) -> str:
    """What is odd about the flow per time of the oscillation, A* c_refⁿ, in a sentence; nothing where it is usual.

    A material without a second network or without flow is meant so. Raises as ``find_groups``.
    """
    flow = find_groups(material).flow
    if flow == 0.0:
        return ""
    flow = math.log10(flow) + material.n * math.log10(REFERENCE_HARDENING)
    low, high = (math.log10(end) for end in FLOW_RANGE)
    if low <= flow <= high:
        return ""
    told = "so slowly that it hardly damps" if flow < low else "at once, as if only g_inf_pa were there"
    return (
        f"the second network flows {told} (about {10.0**flow:.1g} times per R/√(G_inf/density), and .5 to 1.1 in "
        "Table 1): check eps0_dot_1_s and that tau0_pa is in Pa"
    )


def doubt_of_ratio(ratio: float, expected: tuple[float, float]) -> str:
    """What is odd about ``ratio``, T_exp/T_model, in a sentence, where ``expected`` are its bounds; else nothing."""
    low, high = RATIO_RANGE
    if not math.isfinite(ratio) or low <= ratio <= high:
        return ""
    least, most = expected
    usual = f"about {least:g}" if least == most else f"about {least:g} to {most:g}"
    needed = least * most / ratio**2
    return (
        f"T_exp/T_model is {ratio:.3g}, outside {low:g} to {high:g}, where {usual} is expected: G∞ goes as its "
        f"inverse square, so that {needed:.2g} times the g_inf_pa given would explain it; check g_inf_pa "
        "(Pa) and its calibration, sphere.diameter_m and fps"
    )
