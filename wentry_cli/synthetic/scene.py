"""What a scenes file says: the physics of each drop, how it is filmed, and what spoils the pictures."""

from __future__ import annotations

import re
from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

Positive = Annotated[float, Field(gt=0)]
Share = Annotated[float, Field(ge=0, le=1)]
Count = Annotated[int, Field(ge=0, le=100_000)]
Speed = Annotated[float, Field(ge=1e-3, le=1000)]
Length = Annotated[float, Field(ge=1e-5, le=1000)]
Density = Annotated[float, Field(ge=1, le=25_000)]
NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*")
Factor = Annotated[float, Field(gt=0, le=100)]  # in units of the scene, R and U0


def _is_name(text: str) -> str:
    if not NAME.fullmatch(text):
        raise ValueError(f"is that of a folder: letters, digits and _, then . and - too, not {text!r}")
    return text


FolderName = Annotated[str, AfterValidator(_is_name)]


class Part(BaseModel):
    """A frozen part of a scene; unknown keys are errors."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Material(Part):
    """Bergström-Boyce material: two neo-Hookean networks and the flow rule of the second."""

    g_inf_pa: Positive
    g_t_pa: Annotated[float, Field(ge=0)]
    xi: Positive = 0.0866
    tau0_pa: Positive = 1.0
    m: Positive = 1.0
    n: float
    eps0_dot_1_s: Annotated[float, Field(ge=0)]


class Ball(Part):
    """The sphere; ``law`` is empty for a rigid one."""

    diameter_m: Annotated[float, Field(ge=1e-5, le=10)]
    density_kg_m3: Density = 1070.0
    material: str = "rigid"
    law: Material | None = None
    id: str | None = None


class Physics(Part):
    """What the equations of the drop need beyond the material. Lengths and times are scaled by R and U0.

    ``period_factor`` stretches the time of the oscillation (water that moves along); ``loading_rate`` is the rate of
    stretch that the impact leaves behind, times R/U0, delivered within ``loading_time`` R/U0; ``shallow_valleys``
    makes every excursion below 1 smaller by that share; ``period_growth`` lengthens the period by that share over ten
    diameters of depth. Both are off the model of the material on purpose. ``dome_suction`` is the pressure by which the
    air under the dome falls short, over rho U0^2: it closes the cavity below the surface from the dome-over on, and
    pulls it away (a surface seal, if that is before a neck closes). ``contact_patch`` flattens a sphere on a plate.
    """

    gravity_m_s2: Annotated[float, Field(gt=0, le=1000)] = 9.81
    water_kg_m3: Density = 998.2
    drag: Factor = 0.3
    drag_stretch_exponent: float = 2.0
    added_mass: Share = 0.25
    period_factor: Factor = 1.4
    loading_rate: Annotated[float, Field(ge=0, le=100)] = 0.42
    loading_time: Factor = 0.2
    shallow_valleys: Share = 0.0
    period_growth: Annotated[float, Field(ge=0)] = 0.0
    wall_speed: Factor = 0.33
    wall_stretch_speed: Share = 0.25
    contact_angle_deg: Annotated[float, Field(ge=-30, le=60)] = 10.0
    crown_speed: Factor = 0.35
    crown_lean: Factor = 0.35
    dome_over_time: Factor = 3.5
    dome_suction: Annotated[float, Field(ge=0)] = 0.0
    contact_patch: Annotated[float, Field(ge=0, le=0.5)] = 0.0


class Lamp(Part):
    """Light and sensor of a view. ``lamp_half_angle_deg`` bounds the bright core of the cavity."""

    level: Annotated[float, Field(gt=0, le=10)] = 0.75
    gradient: tuple[float, float] = (0.08, -0.05)
    vignette: Annotated[float, Field(ge=0)] = 0.1
    noise: Annotated[float, Field(ge=0, le=1)] = 0.01
    shot_share: Share = 0.6
    psf_px: Annotated[float, Field(ge=0.3, le=4)] = 1.0
    dark: Share = 0.06
    lamp_half_angle_deg: Annotated[float, Field(gt=0, le=90)] = 45.0


class Camera(Part):
    """One view: size, scale, rate, format. ``surface_y_px`` and ``center_x_px`` place the scene in the frame."""

    width: Annotated[int, Field(ge=32, le=8192)]
    height: Annotated[int, Field(ge=32, le=8192)]
    scale_px_per_m: Positive
    center_x_px: float | None = None
    surface_y_px: float | None = None
    fps: Annotated[float, Field(ge=0.01, le=1e7)] = 2000.0
    exposure_s: Annotated[float, Field(ge=0)] = 1.0e-4
    bits: Literal[8, 12, 16] = 8
    format: Literal["png", "tiff", "mraw"] = "png"
    lamp: Lamp = Lamp()
    camera_distance_m: Positive | None = None
    polarity: Literal["dark", "bright"] = "dark"
    empty_frames: Count = 0


class Switches(Part):
    """What a fit does not model and real frames show; all off by default."""

    misfit: tuple[float, float] = (0.0, 0.0)
    droplets: Count = 0
    bubbles: Count = 0
    wet_scale: Annotated[float, Field(ge=1, le=1.3)] = 1.0
    optical_axis_below_m: float = 0.06
    tell_optical_axis: bool = True
    tell_camera_distance: bool = True
    mirror_image: bool = False
    surface_band_px: Annotated[float, Field(ge=0, le=60)] = 3.0
    surface_band_uneven: Share = 0.0
    opaque_crown: bool = False
    ragged_crown: Share = 0.0
    translucent_sphere: bool = False
    tilt_deg: float = 0.0
    drift_m_s: float = 0.0
    flicker: Share = 0.0
    dropped_frames: tuple[int, ...] = ()
    duplicated_frames: tuple[int, ...] = ()
    hot_pixels: Count = 0
    second_object: bool = False
    lamp_image: bool = False
    jets: bool = False
    wet_highlights: Count = 0
    crown_shadow: bool = False


class Clip(Part):
    """When the clip starts and ends, in seconds: before impact, after pinch-off, and at most altogether."""

    before_s: Annotated[float, Field(ge=0)] = 0.008
    after_pinch_off_s: float = 0.008
    longest_s: Annotated[float, Field(gt=0, le=1000)] = 0.2
    impact_phase: Share | None = None


class Scene(Part):
    """One drop."""

    name: FolderName
    kind: Literal["water_entry", "surface_impact", "free_flight"] = "water_entry"
    condition: str | None = None
    seed: int
    sphere: Ball
    impact_speed_m_s: Speed | None = None
    height_m: Length | None = None
    physics: Physics = Physics()
    side: Camera | None = None
    top: Camera | None = None
    switches: Switches = Switches()
    clip: Clip = Clip()

    @model_validator(mode="after")
    def _one_speed(self) -> Scene:
        if self.kind != "free_flight" and (self.impact_speed_m_s is None) == (self.height_m is None):
            raise ValueError("give either impact_speed_m_s or height_m")
        if self.side is None and self.top is None:
            raise ValueError("give at least one view, side or top")
        return self

    @property
    def speed_m_s(self) -> float:
        """Impact speed; for a free flight the speed at the first frame (0 unless given)."""
        if self.impact_speed_m_s is not None:
            return self.impact_speed_m_s
        return float((2.0 * self.physics.gravity_m_s2 * (self.height_m or 0.0)) ** 0.5)
