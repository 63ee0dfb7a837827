"""C_F(t) of a rigid sphere from rendered frames, many times over: its scatter and its error against its error bar."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from wentry_cli.cli.main import run
from wentry_cli.synthetic.campaign import render_drop
from wentry_cli.synthetic.scenes_file import load_scenes
from wentry_cli.tables import read_table

pytestmark = pytest.mark.slow

DEMO = Path(__file__).resolve().parents[2] / "configs" / "demo.yaml"
DRAWS = 12
DIAMETER, DENSITY, WATER, G = 0.051, 1070.0, 998.2, 9.81


@pytest.fixture(scope="module")
def draws(tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, np.ndarray]]:
    """Twelve clips of one entry that differ in their noise alone: time, both coefficients, error bars and truths."""
    scene = next(s for s in load_scenes(DEMO) if s.sphere.material == "rigid")
    assert scene.side is not None
    small = scene.side.model_copy(update={"width": 256, "height": 400, "surface_y_px": 110.3, "scale_px_per_m": 1400.0})
    clip = scene.clip.model_copy(update={"longest_s": 0.045, "impact_phase": 0.37})
    folder = tmp_path_factory.mktemp("rigid")
    for k in range(DRAWS):
        drop = scene.model_copy(update={"name": f"r{k}", "seed": 7000 + k, "side": small, "clip": clip})
        render_drop(drop, folder / "videos" / drop.name)
    videos, results = str(folder / "videos"), str(folder / "results")
    assert run(["process", videos, "-o", results, "-j", "2", "-q"]) == 0
    assert run(["fit", results, "-q"]) in (0, 6)
    return [_against_truth(folder, f"r{k}") for k in range(DRAWS)]


def _against_truth(folder: Path, name: str) -> dict[str, np.ndarray]:
    found = read_table(folder / "results" / name, "forces")
    kinematics = read_table(folder / "results" / name, "kinematics")
    truth = np.genfromtxt(folder / "videos" / name / "truth" / "truth.csv", delimiter=",", names=True)
    frames = kinematics["frame"].to_numpy()[kinematics["t_s"].to_numpy() >= 0.0]
    v, a = truth["v_c_m_s"][frames], truth["a_c_m_s2"][frames]
    area = 0.5 * WATER * v**2 * np.pi * DIAMETER**2 / 4.0
    mass, lift = DENSITY * np.pi / 6.0 * DIAMETER**3, WATER * np.pi / 6.0 * DIAMETER**3 * G
    out = {"t": truth["t_s"][frames], "net": mass * a / area, "hydro": (mass * (a + G) - lift) / area}
    for name_, column in (("net", "force_coefficient"), ("hydro", "force_coefficient_hydro")):
        out[f"{name_}_found"] = found[column].to_numpy(dtype=float)
        out[f"{name_}_unc"] = found[f"{column}_unc"].to_numpy(dtype=float)
    return out


@pytest.mark.parametrize("which", ["net", "hydro"])
def test_the_error_bar_of_the_force_coefficient_is_that_of_a_monte_carlo(
    draws: list[dict[str, np.ndarray]], which: str
) -> None:
    found = np.array([d[f"{which}_found"] for d in draws])
    unc = np.array([d[f"{which}_unc"] for d in draws])
    off = found - np.array([d[which] for d in draws])
    inside = (draws[0]["t"] > 0.004) & np.isfinite(off).all(axis=0)
    assert inside.sum() > 60
    stated = float(np.sqrt(np.mean(unc[:, inside] ** 2)))
    scatter = float(np.sqrt(np.mean(np.var(found[:, inside], axis=0, ddof=1))))
    error = float(np.sqrt(np.mean(off[:, inside] ** 2)))
    held = float(np.mean(np.abs(off[:, inside]) < 1.96 * unc[:, inside]))
    print(f"\n{which}: C_F {np.mean(found[:, inside]):.4f}, stated {stated:.5f}, scatter {scatter:.5f}, "
          f"error {error:.5f}, held {held:.3f}")  # fmt: skip
    assert 0.3 * stated < scatter < stated
    assert error < stated
    assert held > 0.93


def test_at_impact_the_band_holds(draws: list[dict[str, np.ndarray]]) -> None:
    held = []
    for d in draws:
        early = (d["t"] <= 0.004) & np.isfinite(d["net_found"])
        held.append(np.abs(d["net_found"] - d["net"])[early] < 1.96 * d["net_unc"][early])
    print(f"\nat impact held {np.mean(np.concatenate(held)):.3f} of {np.concatenate(held).size}")
    assert np.mean(np.concatenate(held)) > 0.9
