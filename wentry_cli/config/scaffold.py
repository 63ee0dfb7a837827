"""A first ``experiment.yaml``: the keys a lab needs, with what lies in the folder already named."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from wentry_cli.config.campaign import EXPERIMENT
from wentry_cli.errors import InputError
from wentry_cli.tables import write_text

RECORDINGS = (".cihx", ".cih", ".cine", ".avi", ".mp4", ".tif", ".tiff")
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
    """What was written: the file, whether a view asks for its frame rate, recordings there that it does not name."""

    path: Path
    asks_fps: bool
    not_named: tuple[str, ...]


def write_scaffold(folder: Path, kind: str = "water_entry") -> Scaffold:
    """Write ``experiment.yaml`` for a drop of ``kind`` into ``folder``.

    Raises ``InputError`` if there is one already, or where ``folder`` is a file or cannot be made.
    """
    for part in (folder, *folder.parents):
        if part.exists() and not part.is_dir():
            raise InputError(f"{part}: is a file; give the folder that holds the recording, or one to make")
    path = folder / EXPERIMENT
    if path.exists():
        raise InputError(f"{path}: stands already; edit it, or remove it to start anew")
    found = _recordings(folder)
    sources = _sources(found)
    views = "".join(
        VIEW.format(name=name, source=source, fps="from_header" if _knows_rate(source) else "")
        + (TOP if name == "top" and kind != "free_flight" else "")
        for name, source in sources.items()
    )
    falls = "" if kind == "free_flight" else FALLS
    write_text(path, TEMPLATE.format(kind=kind, falls=falls, views=views))
    left = tuple(name for name in found if name not in sources.values())
    return Scaffold(path, not all(map(_knows_rate, sources.values())), left)


def _recordings(folder: Path) -> list[str]:
    """Names of the files and folders in ``folder`` that may be recordings; of a Photron pair of headers the newer."""
    if not folder.is_dir():
        return []
    shown = [item for item in folder.iterdir() if not item.name.startswith(".")]
    newer = {item.stem for item in shown if item.suffix.lower() == ".cihx"}
    return sorted(
        item.name
        for item in shown
        if item.is_dir()
        or (item.suffix.lower() in RECORDINGS and not (item.suffix.lower() == ".cih" and item.stem in newer))
    )


def _sources(found: list[str]) -> dict[str, str]:
    """Which recording is the side view and which the top view, by their names."""
    top = next((name for name in found if "top" in name.lower()), None)
    side = next((name for name in found if name != top), "side")
    return {"side": side} if top is None else {"side": side, "top": top}


def _knows_rate(source: str) -> bool:
    return Path(source).suffix.lower() in (".cihx", ".cih", ".cine")
