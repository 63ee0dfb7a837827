"""Time against error as pictures: outlines over all cases of a kind, other chapters case by case; ΔU by its λ."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from wentry_cli.bench.outline_cases import CASES
from wentry_cli.bench.row import BenchRow

MARKS = "osD^vP*X<>pd"
STYLE: dict[Any, Any] = {"svg.hashsalt": "wentry", "svg.fonttype": "none", "font.size": 8}
# What the two panels of the outlines show.
CLEAN_GROUPS, HIDDEN_CASES = ("noise and light", "shape and arc", "blur"), ("droplets on", "bright spots")
MOST_CASES = 6


def draw_chapter(chapter: str, rows: list[BenchRow], path: Path) -> None:
    """Draw the figure of a chapter; nothing where no row has both a time and an error."""
    shown = [row for row in rows if math.isfinite(row.rmse) and row.time_us > 0.0]
    if not shown:
        return
    with mpl.rc_context(STYLE):
        figure = {"contours": _outlines, "delta_u": _choices}.get(chapter, _cases)(shown)
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, metadata={"Date": None})


def _outlines(rows: list[BenchRow]) -> Figure:
    """Median over the cases of time and of RMSE over the bound (stretch and lowest row), bars from least to most."""
    group = {case.name: case.group for case in CASES}
    clean = [row for row in rows if group[row.case] in CLEAN_GROUPS]
    hidden = [row for row in rows if row.case.startswith(HIDDEN_CASES)]
    figure = Figure(figsize=(7.4, 4.6), layout="constrained")
    axes = figure.subplots(1, 2, sharex=True, sharey=True)
    methods = list(dict.fromkeys(row.method for row in rows))
    for ax, part, title in zip(axes, (clean, hidden), ("clean", "occluded"), strict=True):
        ax.set_title(title)
        for number, method in enumerate(methods):
            _one_method(ax, [row for row in part if row.method == method], number, method)
        ax.axhline(1.0, color="0.4", linewidth=0.8, linestyle=":")
        ax.axvline(500.0, color="0.4", linewidth=0.8, linestyle="--")
        ax.set_xlabel("time per frame, µs (dashed: a camera of 2000 frames/s)")
    axes[0].set_ylabel("RMSE / Cramér–Rao bound, λ and y_b")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False)
    return figure


def _one_method(ax: Axes, rows: list[BenchRow], number: int, method: str) -> None:
    ratios = [
        r.ratio_to_bound for r in rows if r.quantity in {"stretch", "bottom_y"} and math.isfinite(r.ratio_to_bound)
    ]
    ax.set_xscale("log")
    ax.set_yscale("log")
    if not ratios:
        ax.plot([], [], MARKS[number % len(MARKS)], color=f"C{number % 10}", label=method)
        return
    middle, time = float(np.median(ratios)), float(np.median([row.time_us for row in rows]))
    reach = [[middle - min(ratios)], [max(ratios) - middle]]
    size = 8.0 if method.startswith("wentry") else 5.0
    ax.errorbar(
        time, middle, yerr=reach, fmt=MARKS[number % len(MARKS)], markersize=size, color=f"C{number % 10}",
        elinewidth=0.7, label=method,
    )  # fmt: skip


def _cases(rows: list[BenchRow]) -> Figure:
    """One panel a case, one mark a method: of the first quantity, or where others are compared at all, of those."""
    compared = {row.quantity for row in rows if row.method != rows[0].method}
    quantities = {rows[0].quantity} if rows[0].quantity in compared else compared
    shown = [row for row in rows if row.quantity in quantities]
    cases = list(dict.fromkeys(row.case for row in shown))[:MOST_CASES]
    named = {row.case: f"{row.case}: {row.quantity}" if len(quantities) > 1 else row.case for row in shown}
    methods = list(dict.fromkeys(row.method for row in rows))
    columns = min(3, len(cases))
    lines = math.ceil(len(cases) / columns)
    rows_of_legend = math.ceil(len(methods) / min(3, columns + 1))
    height = 2.6 * lines + 0.4 + 0.16 * rows_of_legend
    figure = Figure(figsize=(3.4 * max(columns, 2) - (0.8 if columns == 1 else 0.0), height), layout="constrained")
    grid = figure.subplots(lines, columns, squeeze=False, sharex=True, sharey=True)
    for axes in grid.ravel()[len(cases) :]:
        axes.axis("off")
    for axes, case in zip(grid.ravel(), cases, strict=False):
        axes.set_title(named[case], fontsize=8)
        for row in (row for row in shown if row.case == case):
            number = methods.index(row.method)
            axes.loglog(row.time_us, row.rmse, MARKS[number % len(MARKS)], color=f"C{number % 10}", label=row.method)
        axes.set_xlabel("time per item, µs")
        _few_labels(axes)
    grid[0, 0].set_ylabel(f"RMSE of {shown[0].quantity}, {shown[0].unit}" if len(quantities) == 1 else "RMSE")
    found = [axes.get_legend_handles_labels() for axes in grid.ravel()]
    handles = {label: handle for pair in found for handle, label in zip(*pair, strict=True)}
    figure.legend(
        handles.values(), handles.keys(), loc="outside lower center", ncols=min(3, columns + 1), frameon=False
    )
    return figure


def _choices(rows: list[BenchRow]) -> Figure:
    """A bar for each choice of λ, a colour for each case, on a logarithmic scale of the error."""
    cases, methods = (list(dict.fromkeys(names)) for names in zip(*((r.case, r.method) for r in rows), strict=True))
    reached = {(row.case, row.method): row.rmse for row in rows}
    figure = Figure(figsize=(6.4, 3.2), layout="constrained")
    axes = figure.subplots()
    width = 0.8 / len(cases)
    for i, case in enumerate(cases):
        heights = [reached.get((case, method), math.nan) for method in methods]
        axes.barh(np.arange(len(methods)) + (i - 0.5) * width, heights, width, label=case.removeprefix("ΔU, "))
    axes.set_yticks(range(len(methods)), methods)
    axes.invert_yaxis()
    axes.set_xscale("log")
    axes.set_xlabel(f"RMSE of {rows[0].quantity}, {rows[0].unit} (dotted: what was asked)")
    axes.axvline(2.0, color="0.5", linestyle=":")
    axes.legend(frameon=False)
    return figure


def _few_labels(axes: Axes) -> None:
    """Labels at 1, 2 and 5 where less than two decades are shown, at the decades otherwise."""
    for axis, (low, high) in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
        axis.set_minor_formatter(NullFormatter())
        if high < 100.0 * low:
            axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axis.set_major_formatter(StrMethodFormatter("{x:g}"))
