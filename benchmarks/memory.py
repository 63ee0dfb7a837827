"""Peak resident memory of `wentry process` and its children on a 12-bit clip of 2000 frames of 1024 x 1024.

`python benchmarks/memory.py [FRAMES]` renders a drop, repeats its last frame up to FRAMES, runs the command and prints
the peak in MB and the time. Linux and macOS.
"""

from __future__ import annotations

import re
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from wentry_cli.bench.throughput import bench_scene
from wentry_cli.synthetic.campaign import render_drop

LIMIT_MB = 400


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


def main() -> None:
    frames = int(sys.argv[1]) if len(sys.argv) > 1 else 2000
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "drop"
        render_drop(bench_scene("mraw", 12, 7, quick=False), folder)
        lengthen(folder, frames)
        path = folder / "experiment.yaml"
        path.write_text(path.read_text().replace("material: bench", "material: dragonskin_6p70_small"))
        started = time.perf_counter()
        command = [sys.executable, "-m", "wentry_cli.cli.main", "process", str(folder), "-o", f"{name}/results", "-q"]
        code = subprocess.run(command, check=False).returncode
        seconds = time.perf_counter() - started
        unit = 1024**2 if sys.platform == "darwin" else 1024
        peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / unit
    print(f"{frames} frames: exit {code}, peak {peak:.0f} MB (limit {LIMIT_MB}), {seconds:.1f} s")
    sys.exit(0 if peak < LIMIT_MB and code in (0, 5) else 1)


if __name__ == "__main__":
    main()
