"""Table 1's six spheres on a plate, three heights each, from rendered frames to ε̇₀ and n. Run by `make accuracy`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from wentry_cli.cli.main import run
from wentry_cli.config.materials import packaged_config, read_materials
from wentry_cli.mechanics.calibration import REFERENCE_HARDENING
from wentry_cli.tables import read_table

pytestmark = pytest.mark.slow

SCENES = Path(__file__).resolve().parents[2] / "configs" / "calibration.yaml"


@pytest.fixture(scope="module")
def spheres(tmp_path_factory: pytest.TempPathFactory) -> pd.DataFrame:
    """A row a sphere: what was found, and beside it what was put in."""
    folder = tmp_path_factory.mktemp("plate")
    videos, results = str(folder / "videos"), str(folder / "results")
    assert run(["render", str(SCENES), "-o", videos, "-j", "2", "-q"]) == 0
    assert run(["process", videos, "-o", results, "-j", "2", "-q"]) == 0
    assert run(["calibrate", "impact", results, "-q"]) == 0
    known = read_materials(packaged_config("materials.yaml"))
    found = read_table(folder / "results", "materials")
    put_in = [known[name] for name in found["material"]]
    found = found.assign(true_n=[m.n for m in put_in], true_eps0_dot=[m.eps0_dot_1_s for m in put_in])
    print(found[["material", "n", "n_unc", "true_n", "eps0_dot_1_s", "eps0_dot_1_s_unc", "true_eps0_dot"]].to_string())
    return found


def test_every_sphere_is_identified(spheres: pd.DataFrame) -> None:
    assert spheres["status"].tolist() == ["ok"] * 6
    assert spheres["source"].tolist() == ["impact"] * 6


def test_what_was_put_in_lies_within_the_intervals(spheres: pd.DataFrame) -> None:
    assert ((spheres["n_low"] < spheres["true_n"]) & (spheres["true_n"] < spheres["n_high"])).all()
    low, high = spheres["eps0_dot_low_1_s"], spheres["eps0_dot_high_1_s"]
    assert ((low < spheres["true_eps0_dot"]) & (spheres["true_eps0_dot"] < high)).all()


def test_the_numbers_are_near_what_was_put_in(spheres: pd.DataFrame) -> None:
    """Bounds of 1.5 times what was measured: the stiffest spheres, which stretch by .05 to .11, are the worst."""
    assert (spheres["n"] - spheres["true_n"]).abs().max() < 0.009
    assert np.log(spheres["eps0_dot_1_s"] / spheres["true_eps0_dot"]).abs().max() < 0.022
    flow = spheres["true_eps0_dot"] * REFERENCE_HARDENING ** spheres["true_n"]
    assert np.log(spheres["flow_1_s"] / flow).abs().max() < 0.0028
