"""One frozen model per part of ``experiment.yaml``; every dimensional key carries its unit."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from wentry_cli.config.values import (
    Delay,
    Distance,
    Exposure,
    FewestFrames,
    FrameRate,
    Gravity,
    Height,
    Index,
    Label,
    LiquidDensity,
    Positive,
    Repeat,
    Row,
    RowUncertainty,
    Speed,
    SurfaceTension,
    Text,
    Uncertainty,
    Viscosity,
)


class Part(BaseModel):
    """A part of the configuration: unknown keys are errors, nothing changes after reading."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Sphere(Part):
    """The sphere: undeformed diameter, density or mass, material."""

    id: Label | None = None
    diameter_m: Annotated[float, Field(strict=True, ge=1e-5, le=1, allow_inf_nan=False)]
    diameter_m_unc: Uncertainty = 0.0
    density_kg_m3: Annotated[float, Field(strict=True, ge=10, le=25_000, allow_inf_nan=False)] | None = None
    density_kg_m3_unc: Uncertainty = 0.0
    mass_kg: Positive | None = None
    mass_kg_unc: Uncertainty = 0.0
    material: Label | None = None

    @property
    def radius_m(self) -> float:
        """Half the undeformed diameter."""
        return self.diameter_m / 2

    @property
    def volume_m3(self) -> float:
        """Volume of the undeformed sphere."""
        return math.pi / 6 * self.diameter_m**3

    @property
    def rigid(self) -> bool:
        """Whether the material is declared rigid."""
        return self.material == "rigid"

    @property
    def density(self) -> float | None:
        """Density in kg/m³, given or from the mass; ``None`` where neither was given."""
        if self.density_kg_m3 is not None:
            return self.density_kg_m3
        return None if self.mass_kg is None else self.mass_kg / self.volume_m3

    @property
    def group(self) -> str:
        """What makes two drops drops of one sphere: the id, else material and diameter."""
        return self.id or f"{self.material or 'sphere'}_{self.diameter_m:g}"

    @model_validator(mode="after")
    def _density_agrees_with_mass(self) -> Sphere:
        if self.density_kg_m3 is not None and self.mass_kg is not None:
            from_mass = self.mass_kg / self.volume_m3
            if abs(from_mass / self.density_kg_m3 - 1) > 0.05:
                raise ValueError(
                    f"density_kg_m3 {self.density_kg_m3:g} and mass_kg {self.mass_kg:g} disagree: "
                    f"mass and diameter give {from_mass:.4g} kg/m³; correct one of the three"
                )
        return self


class Liquid(Part):
    """The liquid; from ``temperature_c`` the properties of pure water follow."""

    density_kg_m3: LiquidDensity = 998.2
    density_kg_m3_unc: Uncertainty = 0.0
    viscosity_pa_s: Viscosity = 1.0e-3
    viscosity_pa_s_unc: Uncertainty = 0.0
    surface_tension_n_m: SurfaceTension = 0.0728
    surface_tension_n_m_unc: Uncertainty = 0.0
    temperature_c: Annotated[float, Field(strict=True, ge=0, le=100)] | None = None

    @model_validator(mode="before")
    @classmethod
    def _water_at_temperature(cls, given: Any) -> Any:
        temperature = given.get("temperature_c") if isinstance(given, dict) else None
        if not isinstance(temperature, int | float) or isinstance(temperature, bool) or not 0 <= temperature <= 100:
            return given
        return {**water_properties(float(temperature)), **given}


def water_properties(temperature_c: float) -> dict[str, float]:
    """Density, viscosity and surface tension of pure water between 0 and 100 °C.

    Kell (1975) for the density (1e-4), the Vogel form for the viscosity (1 %), IAPWS (1994) for the surface tension.
    """
    t = temperature_c
    mass = 999.83952 + 16.945176 * t - 7.9870401e-3 * t**2 - 46.170461e-6 * t**3
    mass += 105.56302e-9 * t**4 - 280.54253e-12 * t**5
    reduced = 1 - (t + 273.15) / 647.096
    return {
        "density_kg_m3": mass / (1 + 16.879850e-3 * t),
        "viscosity_pa_s": 2.414e-5 * 10 ** (247.8 / (t + 133.15)),
        "surface_tension_n_m": 0.2358 * reduced**1.256 * (1 - 0.625 * reduced),
    }


class Release(Part):
    """How the sphere was dropped: a cross-check, since the speed is measured."""

    height_m: Height | None = None
    height_m_unc: Uncertainty = 0.0
    impact_speed_m_s: Speed | None = None
    impact_speed_m_s_unc: Uncertainty = 0.0


class ScalePair(Part):
    """Scales in air and through the water, each a number or ``auto``."""

    air: Positive | Literal["auto"] = "auto"
    water: Positive | Literal["auto"] = "auto"


class View(Part):
    """One camera: where its recording is and what is known about it."""

    source: Text
    fps: FrameRate | Literal["from_header"] = "from_header"
    exposure_s: Exposure | None = None
    frames: tuple[Index, Index] | None = None
    rotate: Literal[0, 90, 180, 270] = 0
    flip: Literal["none", "h", "v"] = "none"
    roi_px: tuple[Index, Index, Index, Index] | None = None
    polarity: Literal["dark", "bright"] = "dark"
    background: tuple[Index, Index] | Text = "auto"
    scale_px_per_m: Positive | Literal["auto"] | ScalePair = "auto"
    scale_px_per_m_unc: Uncertainty = 0.0
    surface_y_px: Row | Literal["auto"] = "auto"
    surface_y_px_unc: RowUncertainty = 0.0
    optical_axis_y_px: Row | Literal["auto"] = "auto"
    camera_distance_m: Distance | None = None
    camera_distance_m_unc: Uncertainty = 0.0
    offset_s: Delay = 0.0

    @property
    def scale_pair(self) -> ScalePair:
        """The scale as a pair, whichever way it was written."""
        if isinstance(self.scale_px_per_m, ScalePair):
            return self.scale_px_per_m
        return ScalePair(air=self.scale_px_per_m, water=self.scale_px_per_m)

    @model_validator(mode="after")
    def _ranges_are_ordered(self) -> View:
        if self.frames is not None and self.frames[0] > self.frames[1]:
            raise ValueError(f"frames: the first frame {self.frames[0]} lies after the last {self.frames[1]}")
        if isinstance(self.background, tuple) and self.background[0] > self.background[1]:
            raise ValueError(f"background: the first frame {self.background[0]} lies after the last")
        if self.roi_px is not None and (self.roi_px[0] >= self.roi_px[2] or self.roi_px[1] >= self.roi_px[3]):
            raise ValueError("roi_px: is [left, top, right, bottom] with right > left and bottom > top")
        return self


TOP_ONLY = ("camera_distance_m", "camera_distance_m_unc", "offset_s")
SIDE_ONLY = ("surface_y_px", "surface_y_px_unc", "optical_axis_y_px")


class Views(Part):
    """The two cameras; at least one has a recording."""

    side: View | None = None
    top: View | None = None

    @model_validator(mode="after")
    def _one_at_least(self) -> Views:
        if self.side is None and self.top is None:
            raise ValueError("at least one of side and top is needed, with its source")
        return self

    @model_validator(mode="after")
    def _each_has_its_keys(self) -> Views:
        """A key that a view cannot use is a mistake, not a remark."""
        for name, foreign, other in (("side", TOP_ONLY, "top"), ("top", SIDE_ONLY, "side")):
            view: View | None = getattr(self, name)
            default = View.model_fields
            given = [key for key in foreign if view is not None and getattr(view, key) != default[key].default]
            if given:
                raise ValueError(f"{name}.{given[0]} has no effect: it is a key of the {other} view; move or remove it")
        return self


class Analysis(Part):
    """Choices of method."""

    tracking: Literal["accurate", "fast"] = "accurate"
    smoother: Literal["impact_aware", "gcv", "epps"] = "impact_aware"
    stretch: Literal["measured", "model"] = "measured"
    min_frames: FewestFrames = 12


class Experiment(Part):
    """One drop as its ``experiment.yaml`` and ``campaign.yaml`` describe it."""

    kind: Literal["water_entry", "surface_impact", "free_flight"]
    condition: Label | None = None
    repeat: Repeat | None = None
    sphere: Sphere
    liquid: Liquid = Liquid()
    gravity_m_s2: Gravity = 9.81
    gravity_m_s2_unc: Uncertainty = 0.0
    drop: Release = Release()
    views: Views
    analysis: Analysis = Analysis()

    @property
    def deformable(self) -> bool:
        """Whether the stretch is measured: not rigid and not a free flight, where it is but a check."""
        return self.kind != "free_flight" and not self.sphere.rigid

    @property
    def sides(self) -> list[str]:
        """The views that were filmed, side first."""
        return [name for name in ("side", "top") if getattr(self.views, name) is not None]
