"""What the user says against what the frames show: a deformable sphere called rigid, a top view at the wrong time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from tests.stages.rendered import change, measure, render
from tests.synthetic.drops import SOFT
from wentry_cli.config.campaign import read_drop
from wentry_cli.stages import stretch
from wentry_cli.tables import read_table

TOP = {"width": 160, "height": 160, "scale_px_per_m": 1100.0, "camera_distance_m": 1.5}


@pytest.fixture(scope="module")
def soft(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("soft") / "drop"
    return render(folder, top=TOP, clip={"before_s": 0.008, "longest_s": 0.05})


def test_a_sphere_that_deforms_is_not_rigid(soft: Path, tmp_path: Path) -> None:
    path = soft / "experiment.yaml"
    text = path.read_text(encoding="utf-8")
    said = yaml.safe_load(text)
    said["sphere"]["material"] = "rigid"
    path.write_text(yaml.safe_dump(said), encoding="utf-8")
    try:
        _, error = measure(soft, tmp_path)
    finally:
        path.write_text(text, encoding="utf-8")
    assert error is not None
    assert "sphere.material is rigid, but below the surface its stretch reaches 1." in str(error)


@pytest.mark.parametrize(
    ("deforms", "switches"), [(True, {}), (False, {"misfit": [0.01, -0.005], "wet_scale": 1.05, "droplets": 60})]
)
def test_a_sphere_that_deforms_a_little_is_told_and_a_rigid_one_is_not(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, deforms: bool, switches: dict[str, Any]
) -> None:
    """Of the small stretch most frames pass for those of a rigid sphere of another size."""
    sphere: dict[str, Any] = {"diameter_m": 0.051, "material": "dragonskin_6p70_small", "law": SOFT}
    if not deforms:
        sphere = {"diameter_m": 0.051, "material": "rigid"}
    clip = {"before_s": 0.008, "longest_s": 0.07}
    drop = render(tmp_path / "drop", sphere=sphere, height_m=0.2, clip=clip, switches=switches)
    path = drop / "experiment.yaml"
    said = yaml.safe_load(path.read_text(encoding="utf-8"))
    said["sphere"]["material"] = "rigid"
    path.write_text(yaml.safe_dump(said), encoding="utf-8")
    _, error = measure(drop, tmp_path / "out")
    assert error is None
    told = [text for text in caplog.messages if "sphere.material is rigid, but below the surface its stretch" in text]
    assert len(told) == deforms
    assert all(text.startswith("drop: ") and "name its material" in text for text in told)


def test_a_top_view_at_the_wrong_time_is_told(soft: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    for offset, told in ((0.0, False), (0.004, True)):
        change(soft, "top", offset_s=offset)
        caplog.clear()
        measure(soft, tmp_path / str(told))
        stretch.run(tmp_path / str(told), read_drop("drop", soft))
        assert ("check views.top: offset_s" in caplog.text) is told
    change(soft, "top", offset_s=0.0)


def test_a_sphere_that_spreads_long_after_its_impact_is_told(
    soft: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """The offset of a camera that was started by hand is not given."""
    for offset, told in ((0.0, False), (0.009, True), (-0.006, True)):
        change(soft, "top", offset_s=offset)
        caplog.clear()
        measure(soft, tmp_path / f"{offset}")
        assert ("seen from above the sphere spreads" in caplog.text) is told, offset
    change(soft, "top", offset_s=0.0)


@pytest.mark.parametrize(
    ("scale", "told"),
    [
        (1100.0, ""),
        (990.0, "drop: top view: its scale is 11 % off what the side view says"),
        (550.0, "drop: no frame of the top view could be measured: no sphere was found: check scale_px_per_m, source"),
    ],
)
def test_a_top_view_of_another_scale_is_told(
    soft: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture, scale: float, told: str
) -> None:
    change(soft, "top", scale_px_per_m=scale)
    try:
        measure(soft, tmp_path)
        stretch.run(tmp_path, read_drop("drop", soft))
    finally:
        change(soft, "top", scale_px_per_m=TOP["scale_px_per_m"])
    assert told in caplog.text
    assert ("view" in caplog.text) is bool(told)


def test_a_scale_that_the_sphere_contradicts_is_told(
    soft: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    for scale, told in ((900.0, False), (918.0, True)):
        change(soft, "side", scale_px_per_m=scale)
        caplog.clear()
        measure(soft, tmp_path / str(told))
        assert ("views.side.scale_px_per_m is 918, but the sphere of 51 mm measures " in caplog.text) is told
        assert ("check the scale or sphere.diameter_m" in caplog.text) is told
    change(soft, "side", scale_px_per_m="auto")


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_a_wrong_scale_spoils_no_outline(
    soft: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture, share: float
) -> None:
    """Heights and speeds are wrong by its factor, nothing else: no step where the radius is held, the stretch as is."""
    measure(soft, tmp_path / "right")
    right = read_table(tmp_path / "right", "side")
    change(soft, "side", scale_px_per_m=share * 900.0)
    try:
        _, error = measure(soft, tmp_path / "wrong")
    finally:
        change(soft, "side", scale_px_per_m="auto")
    assert error is None
    assert "missing" not in caplog.text
    wrong = read_table(tmp_path / "wrong", "side")
    assert (wrong.status == right.status).all()
    ok = right.status == "ok"
    assert np.allclose(wrong.y_b_m[ok] * share, right.y_b_m[ok], atol=2e-5)
    assert np.allclose(wrong.stretch[ok], right.stretch[ok], atol=2e-3)


@pytest.mark.parametrize("given", [{}, {"background": [0, 2], "scale_px_per_m": 900.0, "surface_y_px": 90.25}])
def test_a_clip_that_starts_below_the_surface_is_told_not_to(
    soft: Path, tmp_path: Path, given: dict[str, object]
) -> None:
    path = soft / "experiment.yaml"
    text = path.read_text(encoding="utf-8")
    change(soft, "side", frames=[40, 80], **given)
    said = yaml.safe_load(path.read_text(encoding="utf-8"))
    del said["views"]["top"]
    path.write_text(yaml.safe_dump(said), encoding="utf-8")
    try:
        _, error = measure(soft, tmp_path)
    finally:
        path.write_text(text, encoding="utf-8")
    assert "is seen whole in air: correct " in str(error)
    assert "or take the clip from where it is" in str(error)


def test_a_scale_by_which_no_sphere_is_found_is_told(soft: Path, tmp_path: Path) -> None:
    """Spheres of a third more than the size that the user gives are not looked for."""
    change(soft, "side", scale_px_per_m=1250.0)
    try:
        _, error = measure(soft, tmp_path)
    finally:
        change(soft, "side", scale_px_per_m="auto")
    assert "no sphere of about 32 px radius is seen whole in air: correct scale_px_per_m and sphere." in str(error)
