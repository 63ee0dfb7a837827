"""An outline of which little is left is believed less than its own residual says."""

import numpy as np
import pytest

from tests.contours.scenes import draw
from wentry_cli.contours.silhouette import fit_silhouette
from wentry_cli.tracking.mostly_hidden import doubted_where_hidden
from wentry_cli.tracking.sighting import Sighting


def test_uncertainties_grow_with_what_is_hidden_beyond_most():
    s = draw(1)
    fit = fit_silhouette(s.patch, s.shape, top_y_px=s.top_y)
    half, most = (Sighting(3, "ok", fit._replace(gated_fraction=share)) for share in (0.5, 0.8))
    assert doubted_where_hidden(half) is half
    doubted = doubted_where_hidden(most).fit
    assert doubted is not None
    assert doubted.covariance == pytest.approx(5.0 * fit.covariance)
    for name in ("center_x_unc_px", "center_y_unc_px", "stretch_unc", "bottom_y_unc_px"):
        assert getattr(doubted, name) == pytest.approx(np.sqrt(5.0) * getattr(fit, name))
    assert doubted.stretch == fit.stretch


def test_a_sighting_without_a_fit_stays_as_it_is():
    nothing = Sighting(4, "no_edge")
    assert doubted_where_hidden(nothing) is nothing
