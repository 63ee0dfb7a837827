"""Peak resident memory of `wentry process` and its children on a 12-bit clip of 2000 frames of 1024 x 1024.

`python benchmarks/memory.py [FRAMES]` renders a drop, runs the command, repeats the last frame up to FRAMES, runs it
again, and once more on the finished results; it prints the peak in MB and the time of each. Linux and macOS.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

LIMIT_MB = 400
# in a process of its own: what this one holds would count as the peak of the processes that it starts
RENDER = """
import sys
from pathlib import Path
from wentry_cli.bench.throughput import bench_scene
from wentry_cli.synthetic.campaign import render_drop
render_drop(bench_scene("mraw", 12, 7, quick=False), Path(sys.argv[1]))
"""


def lengthen(folder: Path, frames: int) -> None:
    """Repeat the last frame of the MRAW in ``folder`` until it has ``frames``."""
    header = next(folder.rglob("*.cihx"))
    raw = header.with_suffix(".mraw")
    text = header.read_bytes()
    found = re.search(rb"<totalFrame>(\d+)</totalFrame>", text)
    assert found
    count = int(found[1])
    size = raw.stat().st_size // count
    with raw.open("r+b") as stream:
        stream.seek((count - 1) * size)
        last = stream.read(size)
        for _ in range(frames - count):
            stream.write(last)
    longer = str(frames).encode().rjust(len(found[1]), b"0")
    header.write_bytes(text.replace(found[0], b"<totalFrame>" + longer + b"</totalFrame>"))


def run_process(folder: Path, results: Path) -> tuple[int, float, float]:
    """Run `wentry process`; exit code, peak resident memory of it and of its children in MB, and wall time in s."""
    started = time.perf_counter()
    words = [sys.executable, "-m", "wentry_cli.cli.main", "process", str(folder), "-o", str(results), "-q"]
    child = subprocess.Popen(words)
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    peak = usage.ru_maxrss / (1024**2 if sys.platform == "darwin" else 1024)
    return child.returncode, peak, time.perf_counter() - started


def main() -> None:
    frames = int(sys.argv[1]) if len(sys.argv) > 1 else 2000
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "drop"
        subprocess.run([sys.executable, "-c", RENDER, str(folder)], check=True)
        path = folder / "experiment.yaml"
        path.write_text(path.read_text().replace("material: bench", "material: dragonskin_6p70_small"))
        runs = {"short clip (compiles, if that was not done before)": run_process(folder, Path(name) / "short")}
        lengthen(folder, frames)
        runs[f"{frames} frames"] = run_process(folder, Path(name) / "results")
        runs["again, on finished results"] = run_process(folder, Path(name) / "results")
    for what, (code, peak, seconds) in runs.items():
        print(f"{what}: exit {code}, peak {peak:.0f} MB (limit {LIMIT_MB}), {seconds:.1f} s")
    sys.exit(0 if all(peak < LIMIT_MB and code in (0, 5) for code, peak, _ in runs.values()) else 1)


if __name__ == "__main__":
    main()
