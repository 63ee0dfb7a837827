"""A first ``experiment.yaml``: the keys a lab needs, with what lies in the folder already named."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from wentry_cli.config.campaign import EXPERIMENT
from wentry_cli.errors import InputError
from wentry_cli.tables import write_text

RECORDINGS = (".cihx", ".cih", ".cine", ".avi", ".mp4", ".tif", ".tiff")
IMAGES = (".png", ".tif", ".tiff", ".jpg", ".jpeg", ".bmp")
FEWEST_IMAGES = 3  # of one series: two TIFF stacks may be numbered as well
HERE = "."  # the source whose images lie beside experiment.yaml
TEMPLATE = """\
# One drop. Every key carries its unit; docs/configuration.md lists them all. Keys left empty: campaign.yaml holds.
kind: {kind:22} # water_entry | surface_impact (rigid surface) | free_flight
sphere:
  diameter_m:                # undeformed, e.g. 0.051; it gives the scale
# diameter_m_unc: 0.0002     # standard uncertainty
{falls}views:
{views}"""
FALLS = """\
  density_kg_m3:             # e.g. 1070
  material:                  # rigid, or a key of materials.yaml such as dragonskin_6p70_small; empty: unknown
# drop:
#   height_m: 1.53           # from the bottom of the sphere to the surface: a cross-check of the speed
"""
VIEW = """\
  {name}:
    source: {source}
    fps: {fps:21} # frames/s; from_header where the recording knows it
"""
TOP = """\
#   scale_px_per_m: 4000     # in the plane of the surface; without it from the sphere's approach
#   camera_distance_m: 1.5   # from the lens to the surface
"""


@dataclass(frozen=True)
class Scaffold:
    """What was written: the file, the source of each view, whether one asks for its frame rate.

    ``not_named`` are the recordings there that the file does not name; ``made`` tells whether the folder is new.
    """

    path: Path
    sources: dict[str, str]
    asks_fps: bool
    not_named: tuple[str, ...]
    made: bool


def write_scaffold(folder: Path, kind: str = "water_entry") -> Scaffold:
    """Write ``experiment.yaml`` for a drop of ``kind`` into ``folder``.

    A folder that does not exist is made beside what does. Raises ``InputError`` if there is such a file already, or
    where ``folder`` is a file or cannot be made.
    """
    for part in (folder, *folder.parents):
        if part.exists() and not part.is_dir():
            raise InputError(f"{part}: is a file; give the folder that holds the recording, or one to make")
    if not folder.absolute().parent.exists():
        raise InputError(f"{folder.parent}: no such folder; check the name, or make it first")
    made = not folder.exists()
    path = folder / EXPERIMENT
    if path.exists():
        raise InputError(f"{path}: stands already; edit it, or remove it to start anew")
    found = _recordings(folder)
    named = _sources(found)
    sources = {view: _as_source(folder, name) for view, name in named.items()}
    views = "".join(
        VIEW.format(
            name=name,
            source=f'"{source}"' if "*" in source else source,
            fps="from_header" if _knows_rate(source) else "",
        )
        + (TOP if name == "top" and kind != "free_flight" else "")
        for name, source in sources.items()
    )
    falls = "" if kind == "free_flight" else FALLS
    write_text(path, TEMPLATE.format(kind=kind, falls=falls, views=views))
    left = tuple(name for name in found if name not in named.values())
    return Scaffold(path, sources, not all(map(_knows_rate, sources.values())), left, made)


def _recordings(folder: Path) -> list[str]:
    """Names of what may be recordings in ``folder``: files, series of images (as ``side_*.png``), folders.

    Of a Photron pair of headers it is the newer; a header without raw data beside images is theirs.
    """
    if not folder.is_dir():
        return []
    shown = [item for item in folder.iterdir() if not item.name.startswith(".")]
    files = sorted(item.name for item in shown if not item.is_dir())
    series = _image_series(files)
    recordings = [name for name in files if _is_recording(name, files, series)]
    below = sorted(item.name for item in shown if item.is_dir())
    return [*recordings, *series, *below] if series else sorted([*recordings, *below])


def _is_recording(name: str, files: list[str], series: list[str]) -> bool:
    path = Path(name)
    if path.suffix.lower() not in RECORDINGS or _pattern(name) in series:
        return False
    alike = {other.suffix.lower() for other in map(Path, files) if other.stem == path.stem}
    if path.suffix.lower() == ".cih" and ".cihx" in alike:
        return False
    return path.suffix.lower() not in (".cihx", ".cih") or ".mraw" in alike or not series


def _image_series(files: Iterable[str]) -> list[str]:
    """The series of images among ``files``, each as the pattern of its names."""
    counts = Counter(_pattern(name) for name in files if Path(name).suffix.lower() in IMAGES)
    return sorted(pattern for pattern, count in counts.items() if "*" in pattern and count >= FEWEST_IMAGES)


def _pattern(name: str) -> str:
    """``name`` with a star for its number, the last run of digits of the stem."""
    path = Path(name)
    return re.sub(r"\d+(?=\D*$)", "*", path.stem) + path.suffix


def _sources(found: list[str]) -> dict[str, str]:
    """Which recording is the side view and which the top view, by their names."""
    top = next((name for name in found if "top" in name.lower()), None)
    side = next((name for name in found if name != top), "side")
    return {"side": side} if top is None else {"side": side, "top": top}


def _as_source(folder: Path, name: str) -> str:
    """``name`` as a view names it: the folder itself for a series of images with no other image beside it."""
    if "*" not in name:
        return name
    images = [item.name for item in folder.iterdir() if item.suffix.lower() in IMAGES and not item.name.startswith(".")]
    return HERE if all(_pattern(image) == name for image in images) else name


def _knows_rate(source: str) -> bool:
    return Path(source).suffix.lower() in (".cihx", ".cih", ".cine")
