"""The first peak as ``periods.csv`` has it, against what a sphere can do: the table may have been edited."""

from __future__ import annotations

from pathlib import Path

from wentry_cli.errors import InputError
from wentry_cli.mechanics.solver import STRETCH_RANGE
from wentry_cli.stages.model import first_peak
from wentry_cli.tables import read_table, table_path


def check_first_peak(folder: Path) -> None:
    """Raise ``InputError`` where the model would start from a stretch that it is not for."""
    first, (low, high) = first_peak(read_table(folder, "periods")), STRETCH_RANGE
    if first.found and not low <= first.stretch.value <= high:
        raise InputError(
            f"{table_path(folder, 'periods')}: stretch_peak of period 1 is {first.stretch.value:g}, and no sphere "
            f"stretches beyond {high:g}; run the stage stretch again"
        )
