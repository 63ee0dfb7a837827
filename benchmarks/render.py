"""Processor time that a rendered frame of 1024 x 1024 takes, beside the 50 ms that it may: exit 1 beyond them."""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

from wentry_cli.bench.throughput import bench_scene
from wentry_cli.synthetic.campaign import render_drop

LIMIT_MS = 50.0
SEED = 5


def per_frame_ms(radius_px: float) -> float:
    """Of a drop of this radius in 12-bit raw frames; the kernels are compiled before."""
    with tempfile.TemporaryDirectory() as folder:
        render_drop(bench_scene("mraw", 12, SEED, True, radius_px), Path(folder) / "warm")
        started = time.process_time()
        render_drop(bench_scene("mraw", 12, SEED, False, radius_px), Path(folder) / "drop")
        taken = time.process_time() - started
        table = Path(folder) / "drop" / "truth" / "truth.csv"
        frames = len(table.read_text(encoding="utf-8").splitlines()) - 1
    return 1e3 * taken / frames


def main() -> int:
    """Print both sizes; 1 where one takes longer than it may."""
    found = {radius: per_frame_ms(radius) for radius in (60.0, 102.0)}
    for radius, taken in found.items():
        print(f"a frame with a sphere of R {radius:.0f} px: {taken:.0f} ms (limit {LIMIT_MS:.0f})")
    return int(max(found.values()) > LIMIT_MS)


if __name__ == "__main__":
    sys.exit(main())
