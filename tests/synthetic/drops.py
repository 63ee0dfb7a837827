"""The small drops on which the renderer is tested."""

from __future__ import annotations

from typing import Any

from wentry_cli.synthetic.scene import Scene

SOFT = {"g_inf_pa": 6900.0, "g_t_pa": 6900.0, "n": -0.1902, "eps0_dot_1_s": 0.021}
VERY_SOFT = {"g_inf_pa": 1235.0, "g_t_pa": 1235.0, "n": -0.5, "eps0_dot_1_s": 0.0066}


def make_scene(**keys: Any) -> Scene:
    base: dict[str, Any] = {
        "name": "drop",
        "seed": 5,
        "sphere": {"diameter_m": 0.051, "law": SOFT, "material": "soft"},
        "height_m": 1.53,
        "side": {"width": 200, "height": 320, "scale_px_per_m": 800.0, "surface_y_px": 80.3},
    }
    if keys.get("kind") == "free_flight":
        base.pop("height_m")
    return Scene.model_validate({**base, **keys})
