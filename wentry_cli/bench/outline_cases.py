"""The scenes of the contours chapter: what is drawn, what is told to every method, and which panel they belong to."""

from __future__ import annotations

from dataclasses import dataclass

GROUPS = ("noise and light", "shape and arc", "blur", "occlusion", "model errors", "top view")


@dataclass(frozen=True)
class Case:
    """A scene of one frame and its variations.

    ``visible`` is the share of the outline below the row that every method is told; ``told_radius`` multiplies the
    radius that they are told (refraction: the wet scale); ``free`` is what our fit leaves free; ``scenery`` names what
    else is drawn (see `outline_frames`). ``flat`` says whether the light is divided out. ``bound_holds`` is False
    where the Cramér–Rao bound is that of a scene without the trouble, so that the ratio says what the trouble costs.
    """

    name: str
    group: str
    radius: float = 60.0
    stretch: float = 1.2
    visible: float = 0.5
    noise: float = 0.01
    bits: int = 12
    dark: float = 0.08
    level: float = 0.75
    psf: float = 1.0
    gradient: float = 0.0
    flat: bool = True
    motion_px: tuple[float, float] = (0.0, 0.0)
    droplets: float = 0.0
    bright_spots: int = 0
    ring: float = 0.0
    crop: float = 0.0
    misfit: float = 0.0
    tilt_deg: float = 0.0
    told_radius: float = 1.0
    free: str = "x y stretch"
    scenery: str = ""
    bright: bool = False
    bound_holds: bool = True

    @property
    def top_view(self) -> bool:
        """Whether the scene is a whole circle whose radius is wanted."""
        return self.group == "top view"


def _noise_and_light() -> list[Case]:
    group = GROUPS[0]
    return [
        Case("noise 0.5 %", group, noise=0.005),
        Case("noise 1 %", group),
        Case("noise 2 %, 8 bit", group, noise=0.02, bits=8),
        Case("noise 5 %", group, noise=0.05),
        Case("noise 10 %", group, noise=0.1),
        Case("contrast 15 %", group, dark=0.85),
        Case("light falls by 30 %, divided out", group, gradient=0.3),
        Case("light falls by 5 %, not divided out", group, gradient=0.05, flat=False),
        Case("saturated ground", group, level=1.1, bound_holds=False),
    ]


def _shape_and_arc() -> list[Case]:
    group = GROUPS[1]
    return [
        Case("λ 0.85", group, stretch=0.85),
        Case("λ 1.0", group, stretch=1.0),
        Case("λ 1.5", group, stretch=1.5),
        Case("λ 1.8", group, stretch=1.8),
        Case("λ 1.8, R 90", group, stretch=1.8, radius=90.0),
        Case("70 % of the arc", group, visible=0.7),
        Case("35 % of the arc", group, visible=0.35),
        Case("20 % of the arc", group, visible=0.2),
        Case("R 30", group, radius=30.0),
        Case("R 90", group, radius=90.0),
        Case("R 125", group, radius=125.0),
        Case("30 % out of the frame", group, visible=1.0, crop=0.3),
    ]


def _blur() -> list[Case]:
    group = GROUPS[2]
    return [
        Case("motion 3.6 px", group, motion_px=(0.0, 3.6)),
        Case("PSF wrong by 10 %", group, psf=1.1),
        Case("PSF wrong by 50 %", group, psf=1.5),
    ]


def _occlusion() -> list[Case]:
    group = GROUPS[3]
    return [
        Case("droplets on 20 %", group, droplets=0.2, bound_holds=False),
        Case("droplets on 32 %", group, droplets=0.32, bound_holds=False),
        Case("droplets on 42 %", group, droplets=0.42, bound_holds=False),
        Case("bright spots inside", group, bright_spots=6, bound_holds=False),
        Case("translucent sphere", group, scenery="translucent", bound_holds=False),
        Case("mirror image below", group, visible=0.7, scenery="mirror", bound_holds=False),
        Case("thick surface band", group, visible=0.45, scenery="band", bound_holds=False),
        Case("small lamp, dark cavity", group, visible=0.4, scenery="cavity", bound_holds=False),
    ]


def _model_errors() -> list[Case]:
    group = GROUPS[4]
    return [
        Case("shape misfit 0.2 %", group, misfit=0.002, bound_holds=False),
        Case("shape misfit 0.5 %", group, misfit=0.005, bound_holds=False),
        Case("shape misfit 1 %", group, misfit=0.01, bound_holds=False),
        Case("tilt 5°, not fitted", group, tilt_deg=5.0, bound_holds=False),
        Case("tilt 5°, fitted", group, tilt_deg=5.0, free="x y stretch tilt"),
        Case("wet scale 3 % off, held", group, told_radius=1 / 1.03, bound_holds=False),
        Case("wet scale 8 % off, held", group, told_radius=1 / 1.08, bound_holds=False),
        Case("wet scale 8 % off, fitted", group, visible=0.7, told_radius=1 / 1.08, free="x y R stretch"),
    ]


def _top_view() -> list[Case]:
    group, circle = GROUPS[5], {"radius": 72.0, "stretch": 1.0, "visible": 1.0, "free": "x y R"}
    rows: list[tuple[str, dict[str, float | str | bool]]] = [
        ("circle", {}),
        ("circle, noise 10 %", {"noise": 0.1}),
        ("splash ring on 20 %", {"ring": 0.2, "bound_holds": False}),
        ("splash ring on 40 %", {"ring": 0.4, "bound_holds": False}),
        ("circle, droplets on 20 %", {"droplets": 0.2, "bound_holds": False}),
        ("bright on dark", {"bright": True}),
    ]
    return [Case(name, group, **{**circle, **more}) for name, more in rows]  # type: ignore[arg-type]


CASES = (*_noise_and_light(), *_shape_and_arc(), *_blur(), *_occlusion(), *_model_errors(), *_top_view())
QUICK = ("noise 1 %", "noise 10 %", "droplets on 20 %", "circle")


def find_case(name: str) -> Case:
    """The case of that name."""
    return next(case for case in CASES if case.name == name)
