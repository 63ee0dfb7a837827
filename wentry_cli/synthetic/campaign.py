"""Render drops: frames, experiment.yaml and truth of each."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from wentry_cli.errors import InputError
from wentry_cli.synthetic.camera_view import place_side
from wentry_cli.synthetic.course import Course, plan_course
from wentry_cli.synthetic.drop_folder import clear_folder, write_whole
from wentry_cli.synthetic.film import Film
from wentry_cli.synthetic.frame_writers import open_writer
from wentry_cli.synthetic.materials_file import plan_materials, put_materials
from wentry_cli.synthetic.nuisance import draw_static
from wentry_cli.synthetic.scene import Camera, Scene
from wentry_cli.synthetic.scenes_file import load_scenes
from wentry_cli.synthetic.side_view import draw_side_instant
from wentry_cli.synthetic.top_view import draw_top_instant
from wentry_cli.synthetic.truth import write_truth

Progress = Callable[[int, int], None]
FIRST_NUMBER = 1


def _film(course: Course, camera: Camera, view: str) -> Film:
    scene = course.scene
    if view == "side":
        return Film(course, camera, draw_side_instant, draw_static(scene, place_side(scene)), scene.seed * 2 + 1)
    return Film(course, camera, draw_top_instant, [], scene.seed * 2 + 2)


def _write_view(film: Film, view: str, folder: Path, times: NDArray[np.float64], done: Callable[[], None]) -> str:
    """Write the frames of one view; returns the source for experiment.yaml."""
    switches, camera = film.course.scene.switches, film.camera
    writer = open_writer(folder, view, camera)
    number = FIRST_NUMBER
    try:
        last = None
        for k, t in enumerate(times):
            if last is None or k not in switches.duplicated_frames:
                last = film.expose(number, float(t) if k >= camera.empty_frames else float("nan"))
            if k not in switches.dropped_frames:
                writer.write(number, last)
            number += 1
            done()
    finally:
        writer.close()
    return writer.source


def describe_view(camera: Camera, source: str) -> dict[str, Any]:
    """The keys of a view that a lab would write."""
    keys: dict[str, Any] = {"source": source}
    if camera.format != "mraw":
        keys["fps"] = camera.fps
        keys["exposure_s"] = camera.exposure_s
    if camera.polarity == "bright":
        keys["polarity"] = "bright"
    if camera.empty_frames:
        keys["background"] = [0, camera.empty_frames - 1]
    return keys


def describe_experiment(scene: Scene, sources: dict[str, str], offset_s: float = 0.0) -> dict[str, Any]:
    """experiment.yaml of a rendered drop: what a lab knows, nothing that is to be measured."""
    ball = scene.sphere
    sphere: dict[str, Any] = {"diameter_m": ball.diameter_m, "density_kg_m3": ball.density_kg_m3}
    if scene.kind != "free_flight":
        sphere["material"] = ball.material
    if ball.id is not None:
        sphere = {"id": ball.id, **sphere}
    experiment: dict[str, Any] = {"kind": scene.kind, "sphere": sphere}
    if scene.condition is not None:
        experiment["condition"] = scene.condition
    if scene.kind == "water_entry":
        experiment["liquid"] = {"density_kg_m3": scene.physics.water_kg_m3}
    experiment["gravity_m_s2"] = scene.physics.gravity_m_s2
    if scene.kind != "free_flight":
        experiment["drop"] = {"height_m": float(f"{scene.speed_m_s**2 / (2 * scene.physics.gravity_m_s2):.4g}")}
    views: dict[str, Any] = {}
    if scene.side is not None:
        views["side"] = describe_view(scene.side, sources["side"])
        if scene.switches.wet_scale != 1.0 and scene.switches.tell_optical_axis:
            views["side"]["optical_axis_y_px"] = round(place_side(scene).axis_y_px, 3)
    if scene.top is not None:
        views["top"] = describe_view(scene.top, sources["top"])
        views["top"]["scale_px_per_m"] = scene.top.scale_px_per_m
        if scene.top.camera_distance_m is not None and scene.switches.tell_camera_distance:
            views["top"]["camera_distance_m"] = scene.top.camera_distance_m
        if offset_s:
            views["top"]["offset_s"] = offset_s
    experiment["views"] = views
    return experiment


def plan_scene(scene: Scene) -> tuple[Course, dict[str, NDArray[np.float64]]]:
    """Course of a scene and the mid-exposure times of each view's frames (after impact)."""
    rng = np.random.default_rng([scene.seed, 7])
    phase = float(rng.uniform(0.1, 0.9)) if scene.clip.impact_phase is None else scene.clip.impact_phase
    course = plan_course(scene, phase)
    times = {
        v: course.times(c.fps, c.empty_frames) for v, c in (("side", scene.side), ("top", scene.top)) if c is not None
    }
    return course, times


def _find_offset(times: dict[str, NDArray[np.float64]]) -> float:
    """Start of the top view after that of the side view, s."""
    return float(f"{times['top'][0] - times['side'][0]:.9g}") if len(times) == 2 else 0.0


def render_drop(scene: Scene, folder: Path, *, progress: Progress | None = None) -> None:
    """Draw both views of ``scene`` into ``folder`` with experiment.yaml and truth/.

    ``progress`` is called with (frames done, frames in all). The same scene gives the same bytes. Files of an earlier
    rendering are removed; raises InputError if ``folder`` holds others and no rendering, or cannot be written.
    """
    with _written_whole(folder, "this drop"):
        _draw_drop(scene, folder, progress)


@contextmanager
def _written_whole(folder: Path, what: str) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise InputError(
            f"{folder}: cannot be written ({error.strerror or error}); {what} is incomplete: make room or choose "
            f"another folder with -o, and render again"
        ) from error


def _draw_drop(scene: Scene, folder: Path, progress: Progress | None) -> None:
    course, times = plan_scene(scene)
    total, count = sum(t.size for t in times.values()), 0

    def done() -> None:
        nonlocal count
        count += 1
        if progress is not None:
            progress(count, total)

    clear_folder(folder)
    write_truth(course, folder / "truth", times.get("side"), times.get("top"))
    sources = {}
    for view, camera in (("side", scene.side), ("top", scene.top)):
        if camera is not None:
            sources[view] = _write_view(_film(course, camera, view), view, folder, times[view], done)
    # Last, so that a drop whose rendering was cut short is not taken for one.
    text = yaml.safe_dump(describe_experiment(scene, sources, _find_offset(times)), sort_keys=False)
    write_whole(folder / "experiment.yaml", text)


def render_campaign(
    path: Path, folder: Path, jobs: int = 1, *, only: Sequence[str] = (), progress: Progress | None = None
) -> list[Path]:
    """Render every drop of the scenes file ``path`` into its own folder below ``folder``; returns those folders.

    Where it has materials that wentry does not know, ``materials.yaml`` lies beside them, those of all drops in it.
    ``only`` names the drops to render (all if empty); ``progress`` is called with (drops done, drops in all). Raises
    as :func:`scenes_file.load_scenes`, and InputError if ``only`` names a drop that is not there.
    """
    scenes = load_scenes(path)
    missing = sorted(set(only) - {scene.name for scene in scenes})
    if missing:
        raise InputError(f"{path}: has no drop {missing[0]}; its drops are {', '.join(scene.name for scene in scenes)}")
    materials = plan_materials(scenes, folder)
    scenes = [scene for scene in scenes if not only or scene.name in only]
    folders = [folder / scene.name for scene in scenes]
    _render_all(scenes, folders, jobs, progress)
    # Last: a folder that is refused keeps its drops as they were, and what is said of them.
    with _written_whole(folder, "materials.yaml"):
        put_materials(materials, folder)
    return folders


def _render_all(scenes: list[Scene], folders: list[Path], jobs: int, progress: Progress | None) -> None:
    if jobs <= 1:
        for k, (scene, place) in enumerate(zip(scenes, folders, strict=True)):
            render_drop(scene, place)
            if progress is not None:
                progress(k + 1, len(scenes))
        return
    with ProcessPoolExecutor(jobs) as pool:
        for k, _ in enumerate(pool.map(render_drop, scenes, folders)):
            if progress is not None:
                progress(k + 1, len(scenes))
