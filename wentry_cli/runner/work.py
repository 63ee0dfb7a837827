"""What every worker of a campaign is told, whether a process of this machine or one of a cluster."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path

from wentry_cli.pipeline import Stage
from wentry_cli.runner.plan import Choice

ONE_THREAD = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMBA_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)


@dataclass(frozen=True)
class Work:
    """What to run for every drop."""

    results: Path
    stages: list[Stage]
    choice: Choice = field(default_factory=Choice)


def single_threaded() -> None:
    """One thread inside each process: the tables must not depend on the number of cores."""
    for name in ONE_THREAD:
        os.environ[name] = "1"
    try:
        import cv2
    except ImportError:
        return
    cv2.setNumThreads(1)
