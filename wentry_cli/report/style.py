"""The look of every figure in one place: fonts, colours, symbols and how stiffness and size are shown.

The paper's conventions: large symbols for large spheres, grey shades by stiffness (lighter is softer), blue for
rigid. The other colours are of the Okabe-Ito set, which people with any colour vision can tell apart.
"""

from __future__ import annotations

import math
import re
from typing import Any

Look = dict[str, Any]

STYLE: Look = {
    "font.family": "DejaVu Sans",  # comes with matplotlib: the same glyphs on every machine
    "mathtext.fontset": "dejavusans",
    "font.size": 8.0,
    "axes.labelsize": 8.5,
    "axes.titlesize": 9.0,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.linewidth": 0.7,
    "axes.axisbelow": True,
    "axes.unicode_minus": True,
    "axes.formatter.use_mathtext": False,  # plain tick labels: mathematics costs half the drawing time
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "xtick.top": True,
    "ytick.right": True,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "xtick.minor.width": 0.5,
    "ytick.minor.width": 0.5,
    "lines.linewidth": 1.1,
    "lines.markersize": 4.0,
    "errorbar.capsize": 0.0,
    "legend.fontsize": 6.8,
    "legend.frameon": False,
    "legend.handlelength": 1.6,
    "legend.borderaxespad": 0.4,
    "legend.labelspacing": 0.35,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "svg.fonttype": "path",
    "svg.hashsalt": "wentry",  # the same results give the same bytes
    "pdf.fonttype": 42,
    "pdf.compression": 9,
    "image.interpolation": "none",
}

BLUE = "#0072B2"  # rigid
VERMILION = "#D55E00"  # model, own fits
GREEN = "#009E73"
PURPLE = "#CC79A7"
ORANGE = "#E69F00"
SKY = "#56B4E9"
BLACK = "#000000"
GREY = "#8A8A8A"
QUOTED: Look = {"color": "#444444", "linestyle": (0, (1, 1.6)), "linewidth": 1.0}  # a value that the paper states
QUOTED_MODEL: Look = {**QUOTED, "linestyle": (0, (5, 1.6, 1, 1.6))}  # one of its model

OVERLAY_CIRCLE = "#00FFFF"
OVERLAY_BOTTOM = "#FF2020"
OVERLAY_SEPARATION = "#00E000"
OVERLAY_ELLIPSE = "#FFE600"

PANEL_SIZE = (3.5, 2.75)  # inches, a column of a journal
WIDE_SIZE = (7.2, 2.75)

PAPER_SIZE_LIMIT_M = 0.075  # between the paper's 51 mm and 100 mm
LARGE, SMALL = 7.0, 4.0  # symbol sizes in points
THICK, THIN = 1.8, 0.9


def stiffness_shade(g_inf_pa: float, rigid: bool) -> str:
    """Colour of a sphere: blue for rigid, else a grey between 1 kPa (light) and 100 kPa (nearly black).

    Purple where the stiffness is not known.
    """
    if rigid:
        return BLUE
    if not math.isfinite(g_inf_pa) or g_inf_pa <= 0:
        return PURPLE
    part = (math.log10(g_inf_pa) - 3.0) / 2.0
    level = 0.74 - 0.66 * min(max(part, 0.0), 1.0)
    return f"#{round(255 * level):02x}" + f"{round(255 * level):02x}" * 2


def is_large(diameter_m: float) -> bool:
    """Whether a sphere counts as large in symbol size and line width."""
    return math.isfinite(diameter_m) and diameter_m >= PAPER_SIZE_LIMIT_M


def marker_size(diameter_m: float) -> float:
    """Symbol size in points: large symbols for large spheres."""
    return LARGE if is_large(diameter_m) else SMALL


def line_width(diameter_m: float) -> float:
    """Line width in points: thick lines for large spheres."""
    return THICK if is_large(diameter_m) else THIN


def plain(text: str) -> str:
    """Make text from outside (names of drops, status words) safe to draw: no mathematics, no control characters."""
    shown = text.encode("utf-8", "replace").decode("utf-8")
    shown = re.sub(r"[\x00-\x1f\x7f-\x9f\ufffe\uffff]", "?", shown)
    return shown.replace("$", r"\$")


def kilopascal(g_inf_pa: float) -> str:
    """G∞ as the paper writes it, with three digits: ``6.90 kPa``."""
    return f"{g_inf_pa / 1e3:#.3g} kPa".replace(". ", " ")
