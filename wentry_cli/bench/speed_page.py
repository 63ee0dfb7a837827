"""Speed of whole recordings as tables: frames per second by format, against the number of frames and of processes."""

from __future__ import annotations

import math

import numpy as np

from wentry_cli.bench.row import BenchRow
from wentry_cli.bench.table import DASH, figure, markdown, pivot
from wentry_cli.bench.throughput import CAMPAIGN, DECODING, FIRST_FRAMES, FRAME_PX, RECIPE, UNPACKING, YARDSTICK

CAMERA_FPS = 2000.0  # what the camera of the experiments delivers
UNPACKING_US = 132.0  # the same on the machine for which the targets of speed were set
Found = dict[tuple[str, str], BenchRow]


def frames_per_second(row: BenchRow) -> float:
    """How many frames a second of the row's time takes care of."""
    return 1e6 / row.time_us


def by_method(rows: list[BenchRow]) -> Found:
    """The rows by case and method."""
    return {(row.case, row.method): row for row in rows}


def slower(found: Found) -> float:
    """How many times as long as the machine of the targets this one takes to unpack a frame; NaN if not measured."""
    row = found.get((YARDSTICK, UNPACKING))
    return row.time_us / UNPACKING_US if row is not None else float("nan")


def speed_tables(rows: list[BenchRow]) -> list[str]:
    """All tables of the chapter."""
    found = by_method(rows)
    cases = [case for case, method in found if method == DECODING]
    whole = [row for row in rows if row.case in cases]
    return [
        f"### Frames/s (× decoding alone, × {RECIPE})", "",
        f"Bold: at least the {CAMERA_FPS:.0f} frames/s of the camera.", "",
        *_rates(found, cases), "", *_machine(found),
        "### RMSE of y_b, µm (failures)", "",
        *pivot([row for row in whole if row.method != DECODING], _error), "",
        *_by_frames(rows, found), *_by_processes([row for row in rows if row.case.endswith(CAMPAIGN)]),
    ]  # fmt: skip


def _machine(found: Found) -> list[str]:
    ratio = slower(found)
    if math.isnan(ratio):
        return []
    return [
        f"This machine unpacks a frame of {FRAME_PX} × {FRAME_PX} pixels of 12 bits, in memory, in "
        f"{ratio * UNPACKING_US:.0f} µs; that for which the targets were set needs {UNPACKING_US:.0f} µs, "
        f"{1.0 / ratio:.2f} of it.",
        "",
    ]


def _rates(found: Found, cases: list[str]) -> list[str]:
    methods = list(dict.fromkeys(method for case, method in found if case in cases))
    body = []
    for case in cases:
        line = [case, str(found[case, DECODING].items or DASH)]
        for method in methods:
            row = found.get((case, method))
            line.append(_rate(row, found[case, DECODING], found.get((case, RECIPE))) if row is not None else DASH)
        body.append(line)
    return markdown(["case", "frames", *methods], body)


def _rate(row: BenchRow, decoding: BenchRow, recipe: BenchRow | None) -> str:
    rate = frames_per_second(row)
    text = f"**{rate:.0f}**" if rate >= CAMERA_FPS else f"{rate:.0f}"
    beside = [other for other in (decoding, recipe) if other is not None]
    ratios = [figure(other.time_us / row.time_us, 2) if other is not row else DASH for other in beside]
    return f"{text} ({', '.join(ratios)})"


def _error(row: BenchRow) -> str:
    return f"{figure(1e3 * row.rmse, 2)} ({row.failures:.0%})"


def _by_frames(rows: list[BenchRow], found: Found) -> list[str]:
    """Seconds against the number of frames, and the straight line through them."""
    parts = [row for row in rows if FIRST_FRAMES in row.case]
    if not parts:
        return []
    case = parts[0].case.partition(FIRST_FRAMES)[0]
    methods = list(dict.fromkeys(row.method for row in parts))
    series = {
        method: [row for row in parts if row.method == method] + [found[case, method]] for method in methods
    }  # fmt: skip
    lines = [
        [str(one[0].items), *(f"{1e-6 * row.items * row.time_us:.3f}" for row in one)]
        for one in zip(*series.values(), strict=True)
    ]
    told = [f"{method}: {_line(of_method)}." for method, of_method in series.items()]
    return [
        f"### Seconds against the number of frames, {case}", "",
        *markdown(["frames", *methods], lines), "", " ".join(told), "",
    ]  # fmt: skip


def _line(rows: list[BenchRow]) -> str:
    frames = np.array([float(row.items) for row in rows])
    seconds = 1e-6 * frames * np.array([row.time_us for row in rows])
    slope, fixed = np.polyfit(frames, seconds, 1)
    off = float(np.max(np.abs(fixed + slope * frames - seconds) / seconds))
    return f"{1e3 * fixed:.0f} ms and {1e3 * slope:.3f} ms a frame, at most {off:.0%} off that line"


def _by_processes(rows: list[BenchRow]) -> list[str]:
    if not rows:
        return []
    body = [
        [
            row.method,
            f"{frames_per_second(row):.0f}",
            f"{1e-6 * row.items * row.time_us:.2f}",
            figure(rows[0].time_us / row.time_us),
        ]
        for row in rows
    ]
    return [
        f"### {rows[0].case}, {rows[0].items} frames: the whole command, its start included", "",
        f"{rows[0].note.partition(': ')[2].capitalize()}.", "",
        *markdown(["command", "frames/s", "s", "× one process"], body), "",
    ]  # fmt: skip
