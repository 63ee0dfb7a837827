"""File names made from names that strangers chose."""

from __future__ import annotations

import hashlib
import re

LONGEST = 80


def file_stem(name: str) -> str:
    """Turn any name into a safe file name; names that had to change end in a short hash, so that they stay distinct."""
    safe = re.sub(r"[^A-Za-z0-9._-]+", "_", name).strip("._-")[:LONGEST]
    if safe and safe == name:
        return safe
    return f"{safe or 'drop'}-{hashlib.sha256(name.encode('utf-8', 'surrogatepass')).hexdigest()[:6]}"
