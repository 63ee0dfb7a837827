"""Whether the flow of a material is one that a ringing sphere shows; a wrong unit makes it stiff or undamped."""

from __future__ import annotations

import math

from wentry_cli.mechanics.bergstrom_boyce import Material, find_groups
from wentry_cli.mechanics.calibration import REFERENCE_HARDENING

# Of A* c_refⁿ, which is .5 to 1.1 for the six spheres of Table 1: a factor 1000 in tau0_pa falls outside.
FLOW_RANGE = (1e-2, 1e2)


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
