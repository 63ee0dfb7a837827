"""Start-up: `wentry --help`, and what `wentry process` imports before its first frame.

`python benchmarks/start_up.py` prints the median wall time of the help text over nine runs, the processor time of the
imports of all stages, and packages among them that have no place there. Exit 1 beyond the limit or with such a package.
"""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
import time

LIMIT_S = 0.2
RUNS = 9
NEEDLESS = ("matplotlib", "scipy.optimize", "scipy.signal", "scipy.stats", "jinja2", "PIL")
IMPORTS = f"""
import importlib, json, sys, time
started = time.process_time()
for stage in ("ingest", "track", "cavity", "stretch", "kinematics"):
    importlib.import_module("wentry_cli.stages." + stage)
needless = [name for name in {NEEDLESS!r} if name in sys.modules]
print(json.dumps([time.process_time() - started, needless]))
"""


def help_time_s() -> float:
    """Median wall time of `wentry --help` in seconds."""
    taken = []
    for _ in range(RUNS):
        started = time.perf_counter()
        subprocess.run([sys.executable, "-m", "wentry_cli.cli.main", "--help"], check=True, stdout=subprocess.DEVNULL)
        taken.append(time.perf_counter() - started)
    return statistics.median(taken)


def main() -> None:
    subprocess.run([sys.executable, "-c", IMPORTS], check=True, stdout=subprocess.DEVNULL)  # fills the page cache
    seconds = help_time_s()
    told = subprocess.run([sys.executable, "-c", IMPORTS], check=True, capture_output=True, text=True).stdout
    imports, needless = json.loads(told)
    print(f"wentry --help: {seconds:.2f} s (limit {LIMIT_S})")
    print(f"imports of wentry process: {imports:.2f} s of processor time; needless: {', '.join(needless) or 'none'}")
    sys.exit(0 if seconds <= LIMIT_S and not needless else 1)


if __name__ == "__main__":
    main()
