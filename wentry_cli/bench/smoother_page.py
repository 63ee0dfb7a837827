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
At 0.1 px ours is off by {rmse(OURS)} over the 4 ms after impact: by {rmse(OURS, FIRST)} in the first of them, which is
two frames, and by {rmse(OURS, REST)} after it. The same smoother with hyperparameters fitted to the true fall there
reaches {rmse(ORACLE_AT_IMPACT)}, and the best linear estimator that knows how such falls differ {rmse(FALLS_KNOWN)}:
so much is to be had by who knows the slam beforehand, and two frames do not tell how long it rises. The error bar says
so: for velocity there the {ours.note}."""
