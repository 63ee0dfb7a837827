"""What made a table: version, configuration, and hashes of everything that was read."""

from __future__ import annotations

import hashlib
import json
import platform
import sys
from pathlib import Path
from typing import Any

from wentry_cli import __version__


def digest_of(value: Any) -> str:
    """A short hash of plain data (dictionaries, lists, numbers, text)."""
    text = json.dumps(value, sort_keys=True, ensure_ascii=True, allow_nan=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def digest_of_file(path: Path) -> str | None:
    """A short hash of a file's bytes, ``None`` where there is no such file."""
    if not path.is_file():
        return None
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()[:16]


def peak_memory_mb() -> float | None:
    """Greatest resident memory of this process so far in MB; ``None`` where the system does not tell."""
    try:
        import resource
    except ImportError:
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1024**2 if sys.platform == "darwin" else 1024)


def environment() -> dict[str, str]:
    """Versions of wentry, Python, the system and the libraries whose numbers reach the tables."""
    from importlib.metadata import PackageNotFoundError, version

    system = f"{platform.system()} {platform.machine()}"
    found = {"wentry": __version__, "python": platform.python_version(), "system": system}
    for name in ("numpy", "scipy", "pandas", "numba", "opencv-python-headless"):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "missing"
    return found
