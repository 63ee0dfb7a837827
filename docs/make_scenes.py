"""Write docs/scenes.md from the models of a scene; ``make tables`` runs it and a test checks that it is current."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from wentry_cli.config.units import unit_of
from wentry_cli.synthetic.scene import Ball, Camera, Clip, Lamp, Material, Physics, Scene, Switches

PAGE = Path(__file__).parent / "scenes.md"
OF_RANDOM = "the file's `seed` · 1000 + the drop's place in the list"

HEAD = """# Scene files
Made from `wentry_cli/synthetic/scene.py` by `make tables`. `wentry render SCENES.yaml -o FOLDER` draws each drop of a
scene file into FOLDER/NAME: the frames of its views, the `experiment.yaml` that a laboratory would write, and `truth/`,
which `wentry compare RESULTS FOLDER` holds the results against. `--drop NAME` draws that one alone. The same file gives
the same frames; a folder that holds something else than a rendering is never cleared. Materials that the packaged
`configs/materials.yaml` does not have are written into FOLDER/materials.yaml, where `wentry run FOLDER` finds them.

A scene of one's own:
```yaml
seed: 7
materials: {soft: {g_inf_pa: 6700, g_t_pa: 8000, n: -0.19, eps0_dot_1_s: 0.02}}
drops:
  - name: first
    sphere: {diameter_m: 0.051, density_kg_m3: 1070, material: soft}     # or material: rigid
    height_m: 1.5
    side: {width: 320, height: 560, scale_px_per_m: 1800, surface_y_px: 170.4, fps: 2000}
    top: {width: 224, height: 224, scale_px_per_m: 2000, fps: 2000, camera_distance_m: 1.5}
  - name: second_blurred
    sphere: {diameter_m: 0.051, material: rigid}
    impact_speed_m_s: 3.0
    side: {width: 320, height: 560, scale_px_per_m: 1800, fps: 2000, lamp: {psf_px: 2.0}}
    switches: {droplets: 40, wet_scale: 1.05}
```
More of them: [configs/demo.yaml](../configs/demo.yaml), [configs/paper.yaml](../configs/paper.yaml),
[configs/calibration.yaml](../configs/calibration.yaml).

## The file
| key | default | meaning |
|---|---|---|
| `drops` | required | list of scenes, with the keys below |
| `defaults` | none | keys that every drop has unless it gives its own; `top: null` in a drop takes the view away |
| `materials` | none | laws by name, or the name of a file that has them under `materials:`, relative to this one |
| `seed` | 0 | start of all that is random |
"""

PARTS: tuple[tuple[str, type[BaseModel], str, dict[str, str]], ...] = (
    ("A drop", Scene, "One of `impact_speed_m_s` and `height_m`, and at least one view.", {
        "name": "its folder: letters, digits and `_`, then `.` and `-` too",
        "kind": "an entry into water, a drop on a plate, or a flight without either",
        "condition": "groups repeated drops",
        "seed": "start of what is random in this drop",
        "sphere": "see below",
        "impact_speed_m_s": "speed at impact; of a free flight at its first frame",
        "height_m": "of the fall that gives this speed, without drag",
        "physics": "see below", "side": "a camera, see below", "top": "a camera, see below",
        "switches": "see below", "clip": "see below",
    }),
    ("sphere", Ball, "", {
        "diameter_m": "undeformed",
        "density_kg_m3": "of the sphere",
        "material": "`rigid`, or a name under `materials`",
        "law": "the keys of a material, in place of a name under `materials`",
        "id": "groups the drops of one sphere",
    }),
    ("A material", Material, "Two neo-Hookean networks and the flow rule of the second: "
     "[theory.md](theory.md).", {
        "g_inf_pa": "shear modulus of the first network", "g_t_pa": "shear modulus of the second",
        "xi": "keeps the flow rule finite at rest", "tau0_pa": "stress of the flow rule", "m": "exponent of the stress",
        "n": "exponent of the stretch", "eps0_dot_1_s": "rate of flow",
    }),
    ("clip", Clip, "", {
        "before_s": "frames before impact",
        "after_pinch_off_s": "frames after the pinch-off",
        "longest_s": "the whole clip at most; a free flight and a drop on a plate last that long",
        "impact_phase": "where the impact lies between two frames; by default drawn from `seed`",
    }),
    ("side and top", Camera, "", {
        "width": "of the picture, px", "height": "of the picture, px",
        "scale_px_per_m": "in air, of the top view in the plane of the surface",
        "center_x_px": "column of the sphere; by default the middle",
        "surface_y_px": "row of the surface, side view; by default a fifth down",
        "fps": "frames per second", "exposure_s": "the sphere moves while the shutter is open",
        "bits": "grey levels; 12 in a file of 16", "format": "`mraw`: Photron header and raw data",
        "lamp": "light and sensor, see below",
        "camera_distance_m": "top view: what is nearer looks larger; without it nothing does",
        "polarity": "`bright`: a bright sphere on dark ground",
        "empty_frames": "frames without a sphere at the start, named as `background`",
    }),
    ("lamp", Lamp, "", {
        "level": "the bright ground, share of full scale",
        "gradient": "change of light across the width and down the height, share",
        "vignette": "fall of the light towards the corners, share",
        "noise": "standard deviation on the bright ground, share of its level",
        "shot_share": "share of its variance that grows with the light",
        "psf_px": "blur of the lens", "dark": "light that the sphere lets through, share",
        "lamp_half_angle_deg": "bounds the bright core of the cavity",
    }),
    ("switches", Switches, "What a fit does not model and real frames show.", {
        "misfit": "departures of the outline from an ellipse, shares of the radius",
        "droplets": "droplets thrown up by the impact", "bubbles": "bubbles that cling to the wetted sphere",
        "wet_scale": "magnification below the surface over that in air",
        "optical_axis_below_m": "how far below the surface the side camera looks straight",
        "tell_optical_axis": "whether experiment.yaml has that row (where `wet_scale` is not 1)",
        "tell_camera_distance": "whether experiment.yaml has `camera_distance_m`",
        "mirror_image": "what is above the surface shows below it again",
        "surface_band_px": "thickness of the dark line of the surface", "surface_band_uneven": "how uneven it is",
        "opaque_crown": "the crown hides what is behind it", "ragged_crown": "how uneven its rim is, with jets",
        "translucent_sphere": "a sphere that lets light through", "tilt_deg": "of the sphere's axis",
        "drift_m_s": "sideways", "flicker": "of the light from frame to frame, share",
        "dropped_frames": "frames that are not written", "duplicated_frames": "frames that show the one before again",
        "hot_pixels": "pixels at full scale", "second_object": "a bar that stands in the picture",
        "lamp_image": "the lamp's image on the cavity", "jets": "two thin jets from the pinch-off",
        "wet_highlights": "top view: bright spots on the sphere", "crown_shadow": "top view: of a lamp from the left",
    }),
    ("physics", Physics, "Times in units of R/U₀, speeds of U₀ and pressures of ρU₀² where no unit is given.", {
        "gravity_m_s2": "of the fall", "water_kg_m3": "density of the water",
        "drag": "coefficient", "drag_stretch_exponent": "of the stretch, with which the drag grows",
        "added_mass": "coefficient", "period_factor": "stretches the time of the oscillation: water moves along",
        "loading_rate": "rate of stretch that the impact leaves behind, times R/U₀",
        "loading_time": "within which it does",
        "shallow_valleys": "share by which each excursion below 1 is smaller, off the model of the material",
        "period_growth": "share by which the period grows over ten diameters of depth, off that model too",
        "wall_speed": "of the cavity's wall where the sphere leaves it, in its own speed there",
        "wall_stretch_speed": "what a growing stretch adds to it",
        "contact_angle_deg": "where the wall leaves the sphere, above its middle",
        "crown_speed": "of the splash", "crown_lean": "how far it leans outwards, per height",
        "dome_over_time": "when the crown closes, in diameters over U₀",
        "dome_suction": "pressure by which the air under the dome falls short; a large one closes at the surface",
        "contact_patch": "how far a plate flattens the sphere, share of R",
    }),
)  # fmt: skip


def page() -> str:
    """The page as markdown; raises ``KeyError`` for a key that has no meaning here, or a meaning without a key."""
    parts = [HEAD.rstrip()]
    for title, model, sentence, meanings in PARTS:
        if set(meanings) != set(model.model_fields):
            raise KeyError(f"{title}: {sorted(set(meanings) ^ set(model.model_fields))}")
        parts += ["", f"## {title}", *([sentence, ""] if sentence else [])]
        parts += ["| key | unit | default | allowed | meaning |", "|---|---|---|---|---|"]
        for name, info in model.model_fields.items():
            default = OF_RANDOM if (model, name) == (Scene, "seed") else _default(info)
            parts.append(f"| `{name}` | {unit_of(name).strip()} | {default} | {_allowed(info)} | {meanings[name]} |")
    return "\n".join([*parts, ""])


def _default(info: FieldInfo) -> str:
    if info.is_required():
        return "required"
    value: Any = info.default
    if isinstance(value, BaseModel):
        return "its defaults"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return f"[{', '.join(f'{item:g}' for item in value)}]"
    return "none" if value is None else f"{value:g}" if isinstance(value, float | int) else f"`{value}`"


def _allowed(info: FieldInfo) -> str:
    """Bounds and words of a key, those of a value that may also be left out too."""
    found: list[Any] = [*info.metadata]
    words: list[str] = []
    for one in (info.annotation, *get_args(info.annotation)):
        found += [item for field in getattr(one, "__metadata__", ()) for item in getattr(field, "metadata", [field])]
        if get_origin(one) is Literal:
            words = [f"`{word}`" for word in get_args(one)]
    bounds = {sign: getattr(item, key) for item in found for key, sign in SIGNS.items() if hasattr(item, key)}
    return ", ".join(words or [f"{sign} {bound:g}" for sign, bound in bounds.items()])


SIGNS = {"gt": ">", "ge": "≥", "lt": "<", "le": "≤"}


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8", newline="\n")
