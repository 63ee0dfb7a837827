"""Speed and acceleration of a free flight with both parts of their uncertainty: of the frames and of the scale."""

from __future__ import annotations

import math
from dataclasses import dataclass

from wentry_cli.report.campaign import DropResults, as_number
from wentry_cli.report.curves import measured
from wentry_cli.report.numbers import with_uncertainty


@dataclass(frozen=True)
class Measured:
    """A value, the standard uncertainty that the scatter of the frames gives it and the one of the scale."""

    value: float
    random: float
    scale: float

    @property
    def unc(self) -> float:
        """Both parts in quadrature."""
        return math.hypot(self.random, self.scale)

    def in_words(self, unit: str) -> str:
        """Write the value, its uncertainty and the parts of this."""
        parts = f"random {with_uncertainty(self.random, digits=2)}, scale {with_uncertainty(self.scale, digits=2)}"
        return f"{with_uncertainty(self.value, self.unc)} {unit} ({parts})"


def flight_velocity(drop: DropResults) -> Measured:
    """The velocity of the centre in the middle of the clip, m/s, up positive; NaN where it was not measured."""
    return _middle(drop, "v_c_m_s")


def flight_acceleration(drop: DropResults) -> Measured:
    """The constant acceleration, m/s², up positive; NaN where it was not measured."""
    return _middle(drop, "a_c_m_s2")


def _middle(drop: DropResults, column: str) -> Measured:
    rows = measured(drop.table("kinematics"), ["t_s", column, f"{column}_unc"])
    if rows.empty:
        return Measured(math.nan, math.nan, math.nan)
    row = rows.iloc[len(rows) // 2]
    value = float(row[column])
    return Measured(value, float(row[f"{column}_unc"]), abs(value) * _scale(drop))


def _scale(drop: DropResults) -> float:
    """Relative standard uncertainty of the scale; 0 where none is known."""
    table = drop.table("geometry")
    if table.empty:
        return 0.0
    relative = as_number(table["scale_px_per_m_unc"].iloc[0]) / as_number(table["scale_px_per_m"].iloc[0])
    return relative if math.isfinite(relative) else 0.0
