"""A table that was measured by hand: by frame or by time, and told where it cannot be compared."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from wentry_cli.comparison.campaign import compare
from wentry_cli.errors import InputError
from wentry_cli.tables import new_table, write_table

TIMES = (np.arange(20) - 5) * 1e-3


@pytest.fixture
def results(tmp_path: Path) -> Path:
    folder = tmp_path / "results" / "d"
    folder.mkdir(parents=True)
    (folder / "drop.json").write_text("{}")
    columns = {"frame": np.arange(20), "t_s": TIMES, "y_b_m": -TIMES, "y_b_m_unc": [1e-4] * 20, "status": ["ok"] * 20}
    write_table(folder, "side", new_table("side", columns))
    return folder.parent


def _table(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "hand.csv"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    "text",
    [
        "frame,y_b_m\n7,-0.001\n9,-0.003\n",
        "frame,y_b_m\n7,-0.001,\n9,-0.003, \n",
        "\ufefft_s,y_b_m,who\n0.00206,-0.001\n0.0039,-0.003,me\n3,0,\n",
    ],
)
def test_rows_are_found_by_frame_or_by_the_nearest_time(results: Path, tmp_path: Path, text: str) -> None:
    (line,) = compare(results, _table(tmp_path, text))
    assert (line.quantity, line.errors.measured, line.errors.measurable) == ("y_b_m", 2, 2)
    assert line.errors.bias == pytest.approx(-0.001)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            "frame,bottom\n7,-0.001\n",
            "its columns are frame, bottom; needed are .* or more of stretch, y_b_m",
        ),
        ("y_b_m\n7\n", "needed are frame"),
        ("frame,y_b_m\n70,-0.001\n", "not one of its rows belongs to a frame of d, which are 0 to 19, -0.005 to"),
        ("t_s,y_b_m\n0.0146,-0.001\n", "not one of its rows"),
        ("t_s,y_b_m\nlate,-0.001\n", "column t_s holds what is no number"),
        ("frame,y_b_m\n7,-0.001,7,8\n8,-0.002\n", "hand.csv: line 2 has 4 cells, the header 2$"),
        ("frame,y_b_m\n0,7,-0.001\n0,8,-0.002\n", "line 2 has 3 cells, the header 2$"),
        ("frame,y_b_m\n7,-0.001\n8,-0.002,9\n", "line 3 has 3 cells, the header 2$"),
        ("frame,y_b_m\n", "hand.csv: has no rows"),
        ("frame,y_b_m\n7,1e308\n", "column y_b_m holds 1e\\+308, which nobody measured"),
        ("frame,y_b_m\n7,-0.001\n7,-0.002\n7,-0.003\n", "3 of its rows have frame 7; keep one"),
        ("t_s,y_b_m\n0.002,-0.001\n0.002,-0.002\n", "2 of its rows have t_s 0.002; keep one"),
        ('frame,y_b_m\n7,"-0.001\n', "not a readable CSV table .unexpected end of data"),
        ("", "not a readable CSV table"),
    ],
)
def test_what_cannot_be_compared_is_told(results: Path, tmp_path: Path, text: str, told: str) -> None:
    with pytest.raises(InputError, match=told):
        compare(results, _table(tmp_path, text))
