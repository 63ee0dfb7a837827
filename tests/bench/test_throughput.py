"""Rows of whole recordings: every method on the same frames, the process with its stages."""

from __future__ import annotations

import math

import pytest

from wentry_cli.bench.throughput import run


@pytest.mark.slow
def test_rows_of_a_short_recording() -> None:
    rows = {row.method: row for row in run(quick=True, seed=7)}
    assert "threshold + cv2.fitEllipse" in rows
    for method in ("wentry track, accurate", "wentry track, fast", "wentry process"):
        assert rows[method].failures < 0.02
        assert rows[method].rmse < 0.02  # mm: a tenth of a pixel
    assert rows["wentry process"].time_us > rows["wentry track, accurate"].time_us > rows["decoding alone"].time_us
    assert all(stage in rows["wentry process"].note for stage in ("ingest", "track", "cavity", "stretch", "kinematics"))
    assert math.isnan(rows["decoding alone"].rmse)
