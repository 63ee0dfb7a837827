"""The page docs/accuracy.md: what was asked and reached, compact tables by chapter, all numbers in files beside it."""

from __future__ import annotations

import math
from collections.abc import Collection
from itertools import groupby
from pathlib import Path

from wentry_cli.bench.contours import TOLD
from wentry_cli.bench.figures import draw_chapter
from wentry_cli.bench.kept import Chapter, Maker
from wentry_cli.bench.outline_cases import CASES, GROUPS
from wentry_cli.bench.row import BenchRow
from wentry_cli.bench.smoother_page import explain
from wentry_cli.bench.speed_page import speed_tables
from wentry_cli.bench.table import DASH, figure, markdown, pivot, share
from wentry_cli.bench.targets import OURS, list_targets
from wentry_cli.tables import write_text

TITLES = {
    "contours": "Outlines",
    "separation": "Separation line",
    "pinch_off": "Pinch-off",
    "top_clips": "Top view of whole drops",
    "sequences": "Hard sequences",
    "ball": "A real ball",
    "extremes": "Hard cases of the material model",
    "calibrations": "Calibrations",
    "delta_u": "Loss of velocity over the first period",
    "smoothers": "Velocity and acceleration",
    "solvers": "Material model",
    "throughput": "Whole recordings",
}
SHORT = {"x": "x₀", "y": "y₀", "stretch": "λ", "bottom_y": "y_b", "local_bottom_y": "y_b, bottom alone"}
CONTOURS = """\
Rendered spheres (R 60 px, λ 1.2, the lower half seen, 1 % noise, PSF 1 px, 12 bit unless the case says otherwise), 1000
frames a case for ours, 200 for the peers and 40 for RANSAC; all get the same flat-fielded region, the radius, and the
row below which the outline is the sphere's. The Cramér–Rao bound (`wentry_cli/contours/bounds.py`) has grey levels,
slope of the ground and blur as nuisances; of *occlusion* and *model errors* it is that of the scene without the
trouble. Differentiating the renderer pixel by pixel, light within 12 px of the edge gives bounds from 2 % lower to 2 %
higher, but of y₀ 5 % higher at λ 1.8, where the outline turns within a few pixels at its sides: that much its ratio is
too large. Light farther away makes them up to 5 % lower. *Failures* have no number or are off by more than 5 px; RMSE
is over the others. *False ok*: called ok with an error beyond five stated uncertainties and 0.1 px. *Pull* is the
standard deviation of error over stated uncertainty. The recipes of the peers are in
`wentry_cli/bench/outline_peers.py`.

Droplets are drawn until their chords add up to the share that names the case; their blurred rims spoil more of the edge
than that. What is left of the light has a bound of its own in each frame. The *limit* is the root mean square of these
over the unoccluded bound: of the fit of who is told which pixels droplets change (by 0.3 % of the ground, a third of
the noise), and who loses these; and of who knows the droplets themselves, so that a pixel that they cover in part still
tells what the rest of it shows. *Told what is hidden* is our fit with the former pixels masked."""
NOTES = {
    "contours": CONTOURS,
    "separation": """\
Contacts by stretch; the cavity opens by 0.15 to 0.5 px across per pixel up, and by at least 0.1 more than the sphere
itself (else it lies behind the sphere). Those far above the middle of a flat sphere cannot be seen: empty.""",
    "pinch_off": "Radii of 45 frames with 0.2 px of noise, averaged over half a frame; errors in frames.",
    "top_clips": """\
Drops filmed from the side and from above, tracked as `wentry process` does. Errors of λ in the frames in which the
crown leaves the whole circle to see.""",
    "sequences": """\
Three drops each of a soft sphere (R 36 px), 2000 frames/s, 8 bit, 1 % noise, through the stages up to `cavity`, against
the renderer's truth. *Measurable* are frames that show at least a fifth of the outline, which is no more than a rule:
of the others those that are called ok need not be wrong. *False ok*: called ok, measurable or not, with an error beyond
five stated uncertainties and 0.1 px. Errors are over all frames called ok. The bottom is counted in rows of the
picture, with the uncertainty of its frame; y_b also has what all frames share, above all where in its dark band the
surface lies, and is listed without its pull. *Worst* is the largest error over its uncertainty. *Said*: frames by their
status, and events.""",
    "ball": """\
A 2.5 mm ball at 30 000 frames/s (FASTCAM Nova, 12 bit packed) before a back light that clips. Centres must lie on a
parabola; χ² has the interval of 95 %. What is stated also holds errors that are the same in every frame (the ball is no
ellipse, its edge is textured, and the texture counts as noise): those do not scatter, so the scatter lies below. *What
changes from frame to frame* is the share of it that the edge along fixed rays, about the ellipse of each frame, does
not show alike in all frames; with that the scatter must agree. Radii by definition of the edge differ by what no fit
can know while the light is clipped: a systematic uncertainty of scale.""",
    "delta_u": """\
Soft spheres rendered and measured from their frames, on the model (slowed down by the water) and off it (valleys 30 %
too shallow, a period that grows with depth), by the λ that places the centre. The gap takes all frames within 4 ms of
the end of the first period away: left empty, it gives no ΔU.""",
    "extremes": """\
λ(t) over nine periods of small oscillation, unless the case is stiffer, against an integration in extended precision.
*Energy* is the largest violation of the balance of energy over what there is, *steps* are those that were taken and
those that were refused. *Says*: the warning, or the sentence with which it is refused, of `wentry fit`.""",
    "throughput": """\
A drop filmed from the side, frames of 1024 × 1024 from the page cache, processor time on one core. The files with one
sphere hold the same scene; PNG has the fastest compression, AVI is motion JPEG. *Decoding alone* reads every frame
whole. *process* is all stages at the accurate level; what is compressed is decoded once, in *track* too. The recipe
thresholds the flat-fielded frame at half level and fits an ellipse to its largest contour. The sphere is in
view in a part of the frames only, and those after it has left cost little: the slope of seconds against frames is not
the time of a measured frame.""",
}
INTRODUCTION = """\
Errors are against truths that the methods did not see; times are medians of the processor time on one core and count
as ratios within one table."""


def write_page(chapters: list[Chapter], folder: Path, drawn_anew: Collection[str]) -> Path:
    """Write ``accuracy.md`` into ``folder``, and a figure of each chapter ``drawn_anew``; returns the page."""
    parts = [
        "# Speed against error",
        f"{INTRODUCTION} Made chapter by chapter (`make accuracy`):",
        "",
        *_makers(chapters),
        "",
        *_target_section([row for chapter in chapters for row in chapter.rows]),
    ]
    for chapter in chapters:
        name, rows = chapter.name, chapter.rows
        parts += [f"## {TITLES.get(name, name)}", *([NOTES[name], ""] if name in NOTES else [""])]
        if name == "smoothers" and (limits := explain(rows)):
            parts += [limits, ""]
        if len({row.method for row in rows}) > 1 and name not in {"ball", "pinch_off", "extremes"}:
            picture = folder / f"accuracy_{name}.svg"
            if name in drawn_anew:
                draw_chapter(name, rows, picture)
            seen = "error by choice of λ" if name == "delta_u" else "time against error"
            parts += [f"![{seen}]({picture.name})", ""]
        parts += _tables(name, rows)
        parts += [f"All numbers: [accuracy_{name}.csv](accuracy_{name}.csv).", ""]
    page = folder / "accuracy.md"
    write_text(page, "\n".join(parts).rstrip() + "\n")
    return page


def _makers(chapters: list[Chapter]) -> list[str]:
    """One line a command: the chapters that it measured, and on what."""
    made: dict[Maker, list[str]] = {}
    for chapter in chapters:
        made.setdefault(chapter.maker, []).append(TITLES.get(chapter.name, chapter.name))
    return [
        f"- {', '.join(titles)}: {f'`{command}`' if command.startswith('wentry') else command}, {versions}"
        for (command, versions), titles in made.items()
    ]


def _target_section(rows: list[BenchRow]) -> list[str]:
    targets = list_targets(rows)
    if not targets:
        return []
    missed = sum(not target.met for target in targets)
    body = [[target.what, target.asked, target.measured, "yes" if target.met else "**no**"] for target in targets]
    told = f"{len(targets) - missed} of {len(targets)} targets are met; of each the worst case counts."
    return ["## Asked and reached", told, "", *markdown(["what", "asked", "measured", "met"], body), ""]


def _tables(chapter: str, rows: list[BenchRow]) -> list[str]:
    if chapter == "contours":
        return _contours(rows)
    if chapter == "ball":
        return _ball(rows)
    if chapter == "sequences":
        return _sequences(rows)
    if chapter == "extremes":
        return _extremes(rows)
    if chapter in {"separation", "pinch_off", "top_clips"}:
        return _plain(rows)
    if chapter == "throughput":
        return speed_tables(rows)
    parts: list[str] = []
    for quantity in dict.fromkeys(row.quantity for row in rows):
        part = [row for row in rows if row.quantity == quantity]
        parts += [f"RMSE of {quantity} ({part[0].unit}) and µs per item:", ""]
        parts += [*pivot(part, lambda row: f"{figure(row.rmse, 2)} · {figure(row.time_us, 2)}"), ""]
    return parts


def _contours(rows: list[BenchRow]) -> list[str]:
    parts: list[str] = []
    groups = {case.name: case.group for case in CASES}
    parts += ["### Ours: RMSE / bound (pull) of the accurate level", "", *_ours(rows), "", *_what_is_left(rows)]
    for quantity in ("bottom_y", "stretch"):
        parts += [f"### All methods: RMSE / bound of {SHORT[quantity]}", ""]
        parts += ["Over 5 % failures in brackets; a dash: nothing but failures.", ""]
        for group in GROUPS:
            part = [row for row in rows if row.quantity == quantity and groups.get(row.case) == group]
            if part:
                parts += [f"*{group}*", "", *pivot(part, _ratio), ""]
    times = [row for row in rows if row.quantity == "x" and row.case in {"noise 1 %", "R 125", "droplets on 42 %"}]
    return [*parts, "### Time per frame, µs", "", *pivot(times, lambda row: figure(row.time_us)), ""]


def _ratio(row: BenchRow) -> str:
    text = figure(row.ratio_to_bound, 3 if row.ratio_to_bound >= 10.0 else 2)
    return f"{text} ({row.failures:.0%})" if row.failures > 0.05 and math.isfinite(row.ratio_to_bound) else text


def _ours(rows: list[BenchRow]) -> list[str]:
    found = {(row.case, row.quantity): row for row in rows if row.method == OURS}
    body = []
    for case in dict.fromkeys(row.case for row in rows):
        line = [case]
        for quantity in SHORT:
            row = found.get((case, quantity))
            numbers = row is not None and math.isfinite(row.ratio_to_bound)
            line.append(f"{row.ratio_to_bound:.2f} ({row.pull:.2f})" if row is not None and numbers else "–")
        row = found[case, "y"]
        body.append([*line, share(row.measured), share(row.failures), share(row.false_ok), figure(row.time_us)])
    return markdown(["case", *SHORT.values(), "ok", "failures", "false ok", "µs"], body)


def _what_is_left(rows: list[BenchRow]) -> list[str]:
    """The table of the cases in which the bound of what is left is known; nothing where there is none."""
    told = {(row.case, row.quantity): row for row in rows if row.method == TOLD}
    body = []
    for row in rows:
        if row.method != OURS or not math.isfinite(row.limit):
            continue
        other = told.get((row.case, row.quantity))
        body.append([
            f"{row.case}, {SHORT[row.quantity]}", f"{row.limit:.2f}", f"{row.limit_known:.2f}",
            f"{row.ratio_to_bound:.2f}", f"{row.ratio_to_left:.2f} ({row.ratio_to_left_median:.2f})",
            f"{other.ratio_to_left:.2f} ({other.ratio_to_left_median:.2f})" if other else DASH,
            share(other.measured) if other else DASH,
        ])  # fmt: skip
    if not body:
        return []
    head = ["case, quantity", "limit", "limit, droplets known", "ours: RMSE / bound"]
    head += ["ours: error / bound of what is left", "told what is hidden", "ok"]
    told_of = "Root mean square of the errors over the bounds of their frames, their median over that of a normal"
    return ["### Droplets: the bound of what is left", "", f"{told_of} distribution in brackets.", "",
            *markdown(head, body), ""]  # fmt: skip


def _plain(rows: list[BenchRow]) -> list[str]:
    body = [
        [
            f"{row.case}, {row.method}", figure(row.bias), figure(row.rmse), figure(row.pull, 2), share(row.measured),
            share(row.false_ok), str(row.items), figure(row.time_us),
        ]
        for row in rows
    ]  # fmt: skip
    head = ["case, method", f"bias, {rows[0].unit}", "RMSE", "pull", "measured", "false ok", "items", "µs"]
    return [*markdown(head, body), ""]


def _sequences(rows: list[BenchRow]) -> list[str]:
    body = []
    for case, group in groupby(rows, key=lambda row: row.case):
        found = {row.quantity: row for row in group}
        y_b, bottom, stretch = (found.get(name) for name in ("y_b", "bottom_y", "stretch"))
        first = next(iter(found.values()))
        told = [row for row in (bottom, stretch) if row is not None]
        body.append([
            case, str(first.in_view), str(first.items), share(first.measured), share(first.unmeasurable_ok),
            *(figure(row.rmse, 2) if row else DASH for row in (y_b, bottom, stretch)),
            *(figure(row.pull, 2) if row else DASH for row in (bottom, stretch)),
            figure(max(row.worst for row in told), 2), share(max(row.false_ok for row in told)), first.note,
        ])  # fmt: skip
    head = ["sequence", "in view", "measurable", "of these ok", "ok of the others", "RMSE y_b, px", "RMSE bottom, px"]
    head += ["RMSE λ", "pull bottom", "pull λ", "worst", "false ok", "said"]
    return [*markdown(head, body), ""]


def _extremes(rows: list[BenchRow]) -> list[str]:
    body = []
    for row in rows:
        numbers, _, said = (f"; {row.note}" if row.failures else row.note).partition("; ")
        found = numbers.replace("energy ", "").replace(" steps", "").replace("largest error ", "").split(", ")
        energy, steps, largest = found if len(found) == 3 else (DASH, DASH, DASH)
        asked = row.method.rpartition(" ")[2]
        times = figure(row.time_us, 2)
        body.append([row.case, asked, figure(row.rmse, 2), largest, energy, steps, times, said or "nothing"])
    head = ["case", "tolerance", "RMSE of λ", "largest error", "energy", "steps", "µs", "says"]
    return [*markdown(head, body), ""]


def _ball(rows: list[BenchRow]) -> list[str]:
    body = [[row.method, row.quantity, figure(row.rmse, 2), figure(row.pull, 2), row.note] for row in rows]
    return [*markdown(["method", "quantity", "scatter, px", "√(χ²/ν)", "note"], body), ""]
