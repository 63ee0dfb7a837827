"""The side view: an ellipse of revolution fitted to the wetted arc of the silhouette."""

from __future__ import annotations

from wentry_cli.contours.ellipse import EllipseShape, SilhouetteFit
from wentry_cli.contours.fitting import FitRequest, fit_shape, parse_free
from wentry_cli.imaging.patch import Patch


def fit_silhouette(
    patch: Patch,
    guess: EllipseShape,
    *,
    free: str = "x y stretch",
    top_y_px: float = float("-inf"),
    motion_px: tuple[float, float] = (0.0, 0.0),
    level: str = "accurate",
    departure: tuple[float, ...] = (),
    tilt_unc_deg: float = 0.0,
) -> SilhouetteFit:
    """Fit the ellipse of revolution to the edge of a dark silhouette.

    ``guess`` may be off by several pixels; what is not in ``free`` (a subset of x y R stretch tilt with the centre)
    is held at its value. Only the outline below row ``top_y_px`` (full frame) is used. ``motion_px`` is the
    displacement during the exposure, (x, y). ``level`` is "fast" (edges along normals) or "accurate" (likelihood of
    the pixels in a band about the edge). ``departure`` is how the outline is known to differ from the ellipse (see
    `departure`); the result is that of the ellipse below it. A tilt that is held is known to ``tilt_unc_deg``. Raises
    ValueError on an unknown level or parameter.
    """
    request = FitRequest(parse_free(free), top_y_px, motion_px, level, departure=departure, tilt_unc_deg=tilt_unc_deg)
    return fit_shape(patch, guess, request)
