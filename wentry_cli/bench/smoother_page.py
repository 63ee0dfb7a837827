"""What the page says of velocity and acceleration at impact: how far they can be known, by the numbers of the rows."""

from __future__ import annotations

from wentry_cli.bench.row import BenchRow
from wentry_cli.bench.smoother_bounds import FALLS_KNOWN
from wentry_cli.bench.smoother_peers import ORACLE_AT_IMPACT
from wentry_cli.bench.smoothers import OURS, PLACES

_, STRIKE, FIRST, REST = (f"0.1 px, {place}" for place in PLACES)


def explain(rows: list[BenchRow]) -> str:
    """Return the paragraph before the tables; empty after a quick run, which has no oracles."""
    found = {(row.case, row.method, row.quantity): row for row in rows}
    if (STRIKE, FALLS_KNOWN, "acceleration") not in found:
        return ""

    def rmse(method: str, case: str = STRIKE) -> str:
        v, a = (found[case, method, quantity].rmse for quantity in ("velocity", "acceleration"))
        return f"{1e3 * v:.1f} mm/s and {a:.3g} m/s²"

    ours = found[STRIKE, OURS, "velocity"]
    return f"""\
At impact the acceleration rises and falls again: {found[STRIKE, FALLS_KNOWN, "acceleration"].note}.
At 0.1 px ours is off by {rmse(OURS, FIRST)} in the first millisecond and by {rmse(OURS, REST)} in the three after it;
the same smoother with hyperparameters that were fitted to the true fall there by {rmse(ORACLE_AT_IMPACT)} over all four
(ours: {rmse(OURS)}), so that no other choice of how much to smooth goes much further. Who knew besides the noise and
the instant of impact what such falls are like on the mean and how they vary would be off by {rmse(FALLS_KNOWN)}: what
lies between is the law of the fall, which a measurement of it must not take for granted. For velocity there the
{ours.note}."""
