from __future__ import annotations

import numpy as np
import pytest

from wentry_cli.imaging.detection import faint_levels, find_bottom, find_lowest_cap, find_spheres, shrink


def picture(x: float, y: float, radius: float, shape: tuple[int, int] = (200, 240)) -> np.ndarray:
    rows, columns = np.mgrid[: shape[0], : shape[1]]
    inside = np.clip(radius - np.hypot(columns - x, rows - y) + 0.5, 0.0, 1.0)
    return (1.0 - 0.9 * inside).astype(np.float32)


@pytest.mark.parametrize(("x", "y", "radius"), [(60.3, 70.8, 20.0), (150.0, 100.0, 55.5), (30.0, 30.0, 9.0)])
def test_a_sphere_is_found_to_a_pixel(x: float, y: float, radius: float) -> None:
    (found,) = find_spheres(picture(x, y, radius))
    assert found.x == pytest.approx(x, abs=1.0)
    assert found.y == pytest.approx(y, abs=1.0)
    assert found.radius == pytest.approx(radius, abs=1.0)


def test_the_coarse_look_at_a_large_image_gives_full_pixels() -> None:
    (found,) = find_spheres(*shrink(picture(400.0, 300.0, 90.0, (900, 1000))))
    assert (found.x, found.y, found.radius) == pytest.approx((400.0, 300.0, 90.0), abs=2.0)


@pytest.mark.parametrize(("rows", "columns", "factor"), [(500, 722, 3), (721, 300, 3), (400, 500, 2), (1801, 200, 6)])
def test_the_coarse_look_is_made_of_means(rows: int, columns: int, factor: int) -> None:
    image = np.random.default_rng(4).integers(0, 4096, (rows, columns)).astype(np.uint16)
    coarse, shrunk = shrink(image)
    whole = image[: rows // factor * factor, : columns // factor * factor].astype(float)
    means = whole.reshape(rows // factor, factor, columns // factor, factor).mean(axis=(1, 3))
    assert shrunk == factor
    np.testing.assert_allclose(coarse, means, rtol=1e-6)


def test_a_bright_spot_inside_does_not_matter() -> None:
    image = np.maximum(picture(100, 100, 40), 1.0 - picture(105, 110, 12))
    (found,) = find_spheres(image)
    assert (found.x, found.y, found.radius) == pytest.approx((100, 100, 40), abs=1.0)


def test_a_sphere_cut_by_the_edge_is_found_where_enough_is_seen() -> None:
    (found,) = find_spheres(picture(100, 5, 40))
    assert found.span_deg < 200
    assert (found.x, found.y, found.radius) == pytest.approx((100, 5, 40), abs=2.0)
    assert find_spheres(picture(100, -25, 40)) == []


def test_bars_bands_and_blocks_are_no_spheres() -> None:
    image = np.ones((200, 240), np.float32)
    image[180:] = 0.1
    image[60:70] = 0.2
    image[100:140, 50:90] = 0.1
    assert find_spheres(image) == []


def test_the_size_range_is_kept() -> None:
    assert find_spheres(picture(100, 100, 30), radius_range=(40.0, 60.0)) == []


def test_the_bottom_of_a_silhouette() -> None:
    image = picture(100, 90, 30)
    image[:90, 80:120] = 0.1
    assert find_bottom(image, 0, 0, 100.0, 8.0) == pytest.approx(120.0, abs=1.5)
    assert np.isnan(find_bottom(np.ones((50, 50), np.float32), 0, 0, 25.0, 5.0))


def test_the_lowest_cap_below_a_cavity() -> None:
    image = picture(100, 140, 30)
    image[20:140, 85:115] = 0.1
    cap = find_lowest_cap(image, 30.0, top_y=30.0)
    assert cap is not None
    assert (cap.x, cap.y) == pytest.approx((100, 140), abs=2.0)
    assert find_lowest_cap(np.ones((60, 60), np.float32), 10.0) is None


@pytest.mark.parametrize("contrast", [0.38, 0.25, 0.18])
def test_a_faint_sphere_is_found_at_a_level_that_the_noise_allows(contrast: float) -> None:
    image = 1.0 - contrast / 0.9 * (1.0 - picture(100, 90, 30))
    image += 0.012 * np.random.default_rng(3).normal(size=image.shape)
    assert find_spheres(image) == []
    found = [item for level in faint_levels(0.012, 1.0) for item in find_spheres(image, level=level)]
    assert (found[0].x, found[0].y, found[0].radius) == pytest.approx((100, 90, 30), abs=1.5)
    assert find_bottom(image, 0, 0, 100.0, 8.0, level=0.9) == pytest.approx(120.0, abs=1.5)
    assert faint_levels(0.03, 1.0) == [0.8]
    assert faint_levels(0.05, 1.0) == []
