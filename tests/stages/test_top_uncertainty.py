"""Rendered drops of several seeds from above and from the side: errors are as large as the tables say."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from tests.stages.rendered import measure, render
from wentry_cli.tables import read_table

SIDE = {"width": 160, "height": 260, "scale_px_per_m": 1000, "surface_y_px": 108.4, "fps": 1000}
TOP = {"width": 112, "height": 112, "scale_px_per_m": 1000, "fps": 1000, "camera_distance_m": 1.5}
QUIET = {"lamp": {"noise": 0.0025}}
SPEEDS = (4.6, 5.0, 5.4, 5.8)
EDGE_PX = 0.001  # what a model of an edge leaves out


@pytest.fixture(scope="module")
def drops(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[pd.DataFrame]]:
    """Of every drop the tables top, side, geometry and the truths of both views."""
    found: dict[str, list[pd.DataFrame]] = {name: [] for name in ("top", "side", "geometry", "of_top", "of_side")}
    for number, speed in enumerate(SPEEDS):
        out = tmp_path_factory.mktemp("drop")
        clip = {"before_s": 0.010, "longest_s": 0.03}
        views = {"side": SIDE | QUIET, "top": TOP | QUIET}
        folder = render(out / "drop", seed=60 + number, impact_speed_m_s=speed, height_m=None, clip=clip, **views)
        assert measure(folder, out)[1] is None
        for name in ("top", "side", "geometry"):
            found[name].append(read_table(out, name))
        for name, table in (("of_top", "top"), ("of_side", "truth")):
            found[name].append(pd.read_csv(folder / "truth" / f"{table}.csv"))
    return found


def seen_from_above(drops: dict[str, list[pd.DataFrame]]) -> pd.DataFrame:
    """The frames of all drops that the top view measured, beside their truth."""
    pairs = zip(drops["top"], drops["of_top"], strict=True)
    each = [
        top.iloc[: len(truth)].join(truth.add_prefix("true_")).assign(drop=number)
        for number, (top, truth) in enumerate(pairs)
    ]
    joined = pd.concat(each, ignore_index=True)
    return joined[(joined["status"] == "ok") & (joined["true_measurable"] == 1)]


def rms(values: pd.Series | np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def test_the_circle_from_above_is_unbiased(drops: dict[str, list[pd.DataFrame]]) -> None:
    """The ground under the sphere is seen in no frame, and the lamp is uneven."""
    frames = seen_from_above(drops)
    off = frames["radius_px"] - frames["true_radius_px"]
    for air in (True, False):
        assert abs(off[(frames["t_s"] < 0.0) == air].mean()) < EDGE_PX
    assert 0.4 < rms(off / frames["radius_px_unc"]) < 1.3
    apart = off[frames["t_s"] < 0.0] - off[frames["t_s"] < 0.0].groupby(frames["drop"]).transform("mean")
    assert 0.7 < rms(apart / frames["radius_px_unc_random"]) < 1.3


def test_the_stretch_from_above_is_as_uncertain_as_it_is_wrong(drops: dict[str, list[pd.DataFrame]]) -> None:
    """The row of the surface, which is not well known, moves all heights alike, and λ is 1 in air."""
    frames = seen_from_above(drops)
    pull = (frames["stretch"] - frames["true_stretch"]) / frames["stretch_unc"]
    assert 0.5 < rms(pull[frames["t_s"] < 0.0]) < 1.5
    assert 0.5 < rms(pull[frames["t_s"] >= 0.0]) < 1.9
    assert (frames["stretch_unc_random"] < frames["stretch_unc"]).all()


def test_heights_are_known_against_each_other(drops: dict[str, list[pd.DataFrame]]) -> None:
    """A hundred times as well as from zero, which lies somewhere in the dark band of the surface."""
    pulls = []
    for table, truth in zip(drops["side"], drops["of_side"], strict=True):
        side = table.iloc[: len(truth)]
        good = (side["status"] == "ok") & (side["t_s"] < 0.0) & (side["y_b_source"] == "local")
        off = (side["y_b_m"] - truth["y_b_m"])[good]
        pulls.append((off - off.mean()) / side["y_b_m_unc_random"][good])
        assert side["y_b_m_unc"][good].min() > 50.0 * side["y_b_m_unc_random"][good].min()
    assert 0.6 < rms(np.concatenate(pulls)) < 1.6


def test_impacts_are_known_against_each_other(drops: dict[str, list[pd.DataFrame]]) -> None:
    """One surface and one camera: what is wrong of the row of the surface is the same in every drop."""
    geometry = pd.concat(table[table["view"] == "side"] for table in drops["geometry"])
    true = np.array([-truth["t_s"].iloc[0] for truth in drops["of_side"]])
    off = geometry["impact_time_s"].to_numpy() - true
    random = geometry["impact_time_s_unc_random"].to_numpy()
    assert (random < 0.05 * geometry["impact_time_s_unc"]).all()
    assert rms((off - off.mean()) / random) < 3.0
