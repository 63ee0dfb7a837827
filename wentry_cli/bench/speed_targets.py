"""What was asked of the speed on whole recordings and what was reached, from the rows of the benchmark."""

from __future__ import annotations

from contextlib import suppress

from wentry_cli.bench.row import BenchRow
from wentry_cli.bench.speed_page import Found, by_method, frames_per_second, slower
from wentry_cli.bench.target import Target
from wentry_cli.bench.throughput import CASES, DECODING, PROCESSING, RECIPE, TRACKING

ACCURATE, FAST = f"{TRACKING}accurate", f"{TRACKING}fast"
RAW = [case for case in CASES if not case.copy and case.bits in {8, 12}]
PNG = next(case.name for case in CASES if case.copy == "png")
LEAST_OF_DECODING = 0.9


def list_speed(rows: list[BenchRow]) -> list[Target]:
    """The targets of the chapter throughput where it was run in full; of each the slowest case counts."""
    found = by_method([row for row in rows if row.chapter == "throughput"])
    small, large = ([case.name for case in RAW if case.radius_px == radius] for radius in (60.0, 125.0))
    with suppress(KeyError):  # a case was not run
        return [
            _at_least(found, "track, accurate, R 60", 3000.0, small, ACCURATE),
            _at_least(found, "track, accurate, R 125", 1800.0, large, ACCURATE),
            _at_least(found, "track, fast", 8000.0, small + large, FAST),
            _at_least(found, "all of process", 1200.0, small + large, PROCESSING),
            *(_beside_decoding(found, method) for method in (ACCURATE, PROCESSING)),
        ]
    return []


def _at_least(found: Found, what: str, least: float, cases: list[str], method: str) -> Target:
    row = max((found[case, method] for case in cases), key=lambda row: row.time_us)
    rate = frames_per_second(row)
    decoding, recipe = (found[row.case, other].time_us / row.time_us for other in (DECODING, RECIPE))
    text = f"{rate:.0f} ({row.case}), {decoding:.2f} × decoding, {recipe:.2f} × {RECIPE}"
    if (ratio := slower(found)) > 0.0:
        text += f"; {ratio * rate:.0f} if all else scales with the unpacking of a frame"
    return Target(f"raw, one core, frames/s: {what}", f"≥ {least:.0f}", text, rate >= least)


def _beside_decoding(found: Found, method: str) -> Target:
    share = found[PNG, DECODING].time_us / found[PNG, method].time_us
    text = f"{share:.0%}, {found[PNG, RECIPE].time_us / found[PNG, method].time_us:.2f} × {RECIPE}"
    return Target(
        f"PNG, frames/s of decoding alone: {method}", f"≥ {LEAST_OF_DECODING:.0%}", text, share >= LEAST_OF_DECODING
    )
