"""Legend entries and axes that several panels share."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.container import ErrorbarContainer
from matplotlib.lines import Line2D
from matplotlib.textpath import TextPath
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter, NullLocator

from wentry_cli.report.numbers import true_minus
from wentry_cli.report.style import (
    LARGE,
    PANEL_SIZE,
    SMALL,
    Look,
    is_large,
    kilopascal,
    line_width,
    marker_size,
    stiffness_shade,
)  # fmt: skip

SEAL_MARKS = {"sphere_seal": ("D", "sphere seal"), "surface_seal": ("s", "surface seal")}
EDGE: Look = {"markeredgecolor": "#222222", "markeredgewidth": 0.5}
LETTERS_PT = 6.4  # size of the letters of a legend above the axes
HANDLE = 2.0  # length of its lines, in letters
DOUBT: Look = {"linestyle": "", "marker": "x", "markersize": 9.0, "markeredgewidth": 1.0, "color": "#C00000"}
TICKS, FEWEST_TICKS = ((1.0,), (1.0, 2.0, 5.0), (1.0, 2.0, 3.0, 5.0), (1.0, 2.0, 3.0, 4.0, 6.0, 8.0)), 3
COVERED = 0.7  # of the sum of two radii: nearer than that, one symbol hides the other
ON_ANOTHER = " A symbol that lies on another is open."
GAP = 1.0  # between its columns, in letters


def legend_above(
    ax: Axes, handles: Sequence[Artist] | None = None, width_in: float = PANEL_SIZE[0], **look: Any
) -> None:
    """Put the legend above the axes, where it hides no data: as many columns as ``width_in`` inches hold.

    ``handles`` are the labelled artists, those of the axes by default; nothing is drawn where there is none.
    """
    found = list(ax.get_legend_handles_labels()[0] if handles is None else handles)
    labels = [str(handle.get_label()) for handle in found]
    if not found:
        return
    handle = float(look.get("handlelength", HANDLE))
    widths = [_width_pt(label) + LETTERS_PT * (handle + 0.8) for label in labels]
    most = max(n for n in range(1, len(found) + 1) if n == 1 or _spread_pt(widths, n) < 72.0 * (width_in - 0.3))
    columns = math.ceil(len(found) / math.ceil(len(found) / most))  # as even as the number of rows allows
    settings: Look = {
        "loc": "lower right",
        "bbox_to_anchor": (1.0, 1.0),
        "fontsize": LETTERS_PT,
        "handlelength": handle,
        "columnspacing": GAP,
        "borderpad": 0.2,
    }
    ax.legend(found, labels, ncols=columns, **settings | look)


def _width_pt(label: str) -> float:
    """Width of a label in points."""
    return float(TextPath((0.0, 0.0), label, size=LETTERS_PT).get_extents().width) if label.strip() else 0.0


def _spread_pt(widths: Sequence[float], columns: int) -> float:
    """Width in points of a legend whose entries run down its columns, the longer columns first."""
    columns_of = np.array_split(np.asarray(widths), columns)
    return float(sum(part.max() for part in columns_of)) + GAP * LETTERS_PT * (columns - 1)


def point_handles(points: pd.DataFrame) -> list[Line2D]:
    """Entries of ``draw_points``: stiffness, size, and the seals that have a symbol of their own (``seal_type``)."""
    handles = [*stiffness_handles(points), *size_handles(points)]
    for seal, (mark, label) in SEAL_MARKS.items():
        if bool((points["seal_type"] == seal).any()):
            look: Look = {"linestyle": "", "marker": mark, "markersize": 4.5, "color": "#222222", "mfc": "none"}
            handles.append(Line2D([], [], label=label, **look))
    return [*handles, *doubt_handles(points)]


def doubt_handles(points: pd.DataFrame) -> list[Line2D]:
    """The entry of ``mark_doubts``, only where there is something to mark."""
    return [Line2D([], [], label="in doubt", **DOUBT)] if bool(_doubtful(points).any()) else []


def mark_doubts(ax: Axes, points: pd.DataFrame, x: str, y: str) -> None:
    """Put a red cross on each point of a drop that was measured otherwise than it was told (column ``doubts``)."""
    found = points[_doubtful(points)]
    ax.plot(found[x], found[y], zorder=6, **DOUBT)


def crossed(points: pd.DataFrame) -> str:
    """The sentence of a caption that names the drops that ``mark_doubts`` marks; empty without one."""
    named = points.loc[_doubtful(points), "doubts"].unique()
    return f" Crossed, in doubt: {', '.join(named)}." if len(named) else ""


def _doubtful(points: pd.DataFrame) -> pd.Series[bool]:
    return points["doubts"].fillna("") != ""


def stiffness_handles(data: pd.DataFrame, line: bool = False) -> list[Line2D]:
    """One entry for each stiffness among the rows (columns ``rigid``, ``g_inf_pa``), the stiffest first.

    Spheres whose stiffness is not known follow, then the rigid ones.
    """
    deformable = data.loc[~data["rigid"].astype(bool), "g_inf_pa"].astype(float)
    soft = sorted(set(deformable.dropna()), reverse=True)
    entries = [(stiffness_shade(g, False), f"$G_\\infty$ = {kilopascal(g)}") for g in soft]
    if bool(deformable.isna().any()):
        entries.append((stiffness_shade(float("nan"), False), "$G_\\infty$ not known"))
    if bool(data["rigid"].astype(bool).any()):
        entries.append((stiffness_shade(float("nan"), True), "rigid"))
    look: Look = {"linewidth": 1.6} if line else {"linestyle": "", "marker": "o", "markersize": 5.5, **EDGE}
    return [Line2D([], [], color=color, label=label, **look) for color, label in entries]


def size_handles(data: pd.DataFrame, line: bool = False) -> list[Line2D]:
    """Entries for large and small spheres, only where both occur among the rows (column ``diameter_m``)."""
    sizes = sorted({float(d) for d in data["diameter_m"].dropna()})
    if not sizes or is_large(sizes[0]) == is_large(sizes[-1]):
        return []
    entries = []
    for large in (False, True):
        found = [d for d in sizes if is_large(d) == large]
        label = f"$D$ = {span_of(1e3 * found[0], 1e3 * found[-1])} mm"
        look: Look = {"linewidth": line_width(found[0])}
        if not line:
            look = {"linestyle": "", "marker": "o", "markersize": LARGE if large else SMALL, "mfc": "none"}
        entries.append(Line2D([], [], color="#222222", label=label, **look))
    return entries


def span_of(low: float, high: float) -> str:
    """Write a span of numbers with three digits, a single number where both ends agree."""
    return f"{low:.3g}" if f"{low:.3g}" == f"{high:.3g}" else f"{low:.3g}–{high:.3g}"


def draw_points(ax: Axes, data: pd.DataFrame, x: str, y: str) -> None:
    """Draw rows as symbols with error bars: grey by stiffness, blue for rigid, size by diameter; doubts crossed.

    A drop that seals at the sphere is a diamond, one that seals at the surface a square. ``<x>_unc`` and ``<y>_unc``
    are the error bars where they exist.
    """
    for row in data.to_dict("records"):
        look = SEAL_MARKS.get(str(row.get("seal_type")), ("o", ""))[0]
        size = marker_size(float(row["diameter_m"])) * (1.0 if look == "o" else 0.85)
        shade = stiffness_shade(float(row["g_inf_pa"]), bool(row["rigid"]))
        bars = {f"{axis}err": row.get(f"{name}_unc", np.nan) for axis, name in (("x", x), ("y", y))}
        bars = {axis: value for axis, value in bars.items() if np.isfinite(value)}
        ax.errorbar(
            row[x],
            row[y],
            **bars,
            fmt=look,
            color=shade,
            markersize=size,
            ecolor=shade,
            elinewidth=0.9,
            zorder=4,
            **EDGE,
        )
    mark_doubts(ax, data, x, y)


def uncover(ax: Axes) -> None:
    """Draw a symbol of ``draw_points`` open where it lies on another; call it with the limits set."""
    marks = [container.lines[0] for container in ax.containers if isinstance(container, ErrorbarContainer)]
    marks = sorted((mark for mark in marks if mark is not None), key=lambda mark: -mark.get_markersize())
    places = [ax.transData.transform(np.column_stack(mark.get_data()).astype(float))[0] for mark in marks]
    dots = ax.figure.get_figure(root=True).dpi / 72.0
    for number, (mark, place) in enumerate(zip(marks, places, strict=True)):
        mark.set_zorder(4.0 + 1e-3 * number)  # small symbols lie on large ones
        reach = [0.5 * COVERED * dots * (mark.get_markersize() + other.get_markersize()) for other in marks[:number]]
        if any(math.dist(place, other) < far for other, far in zip(places, reach, strict=False)):
            mark.set(markerfacecolor="none", markeredgecolor=mark.get_color(), markeredgewidth=1.2)


def clear_limits(ax: Axes, x: Iterable[float], y: Iterable[float], pad: float = 0.12) -> None:
    """Set limits of both axes from the data, with room around them; values that are no numbers do not count."""
    for values, scale, setter in ((x, ax.get_xscale(), ax.set_xlim), (y, ax.get_yscale(), ax.set_ylim)):
        good = np.array([value for value in values if np.isfinite(value)], dtype=float)
        if good.size == 0:
            continue
        low, high = float(good.min()), float(good.max())
        if scale == "log":
            ratio = max((high / low) ** pad, 1.25)
            setter(low / ratio, high * ratio)
        else:
            room = pad * (high - low) or 0.1 * abs(high) or 1.0
            setter(low - room, high + room)


def plain_decades(axis: Axis) -> None:
    """Label a logarithmic axis with plain numbers: powers of ten, where they are few more digits, then even steps.

    Call it with the limits set.
    """
    low, high = axis.get_view_interval()
    decades = 10.0 ** np.arange(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    for digits in TICKS:
        ticks = np.outer(decades, digits).ravel()
        if np.count_nonzero((ticks >= low) & (ticks <= high)) >= FEWEST_TICKS:
            axis.set_major_locator(LogLocator(base=10.0, subs=digits))
            break
    else:
        axis.set_major_locator(MaxNLocator(nbins=5, steps=[1, 2, 5, 10]))
        axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _: true_minus(f"{value:g}")))
    axis.set_minor_formatter(NullFormatter())
