"""The crown is looked at in every few frames, and in every one of them while it may be closing."""

import numpy as np
import pytest

from wentry_cli.cavity.crown import Rim
from wentry_cli.cavity.dome_over import find_rim_closure
from wentry_cli.stages.cavity import crown

T = 0.0005 * np.arange(400)


def rim_width(closed_s: float) -> np.ndarray:
    """Open at first, falls ever faster to a tip of 20 px at ``closed_s``, and broadens as the dome sinks."""
    left = closed_s - T
    opening = 110.0 * np.clip(1.0 - np.maximum(1.0 - left / 0.012, 0.0) ** 4, 0.0, 1.0)
    return opening + 0.1 * left + 20.0 + np.clip(2000.0 * (-left - 0.004), 0.0, 60.0)


def looked_at(width: np.ndarray, frames: list[int]) -> dict[int, Rim]:
    return {k: Rim(float(width[k]), 50.0, "ok", 50) for k in frames}


@pytest.mark.parametrize("closed_s", [0.0213, 0.0508, 0.1001])
def test_the_closure_is_that_of_a_look_at_every_frame(closed_s: float) -> None:
    width, frames = rim_width(closed_s), list(range(T.size))
    rims = looked_at(width, frames[:: crown.COARSE])
    closing = crown._while_closing(rims, frames)
    rims |= looked_at(width, closing)
    assert len(rims) < 0.8 * len(frames)
    expected = find_rim_closure(T, width)
    found = find_rim_closure(T, crown._widths(rims, T.size))
    assert expected.status == found.status == "ok"
    assert found.t_s == pytest.approx(expected.t_s, abs=1e-9)


def test_a_crown_that_stays_open_or_is_not_seen_costs_no_second_look() -> None:
    frames = list(range(T.size))
    assert crown._while_closing(looked_at(np.full(T.size, 80.0), frames[:: crown.COARSE]), frames) == []
    assert crown._while_closing({}, frames) == []
    assert crown._while_closing({}, []) == []
