"""What can go wrong with an installation."""

from __future__ import annotations

import os
import shutil
from importlib.metadata import distributions

from wentry_cli.provenance import environment

OPENCV_BUILDS = (
    "opencv-python",
    "opencv-python-headless",
    "opencv-contrib-python",
    "opencv-contrib-python-headless",
)
BROKEN_OPENCV = "4.13.0.90"


def examine() -> tuple[dict[str, str], list[str]]:
    """Facts about the installation, and its problems with what to do about each."""
    facts = environment()
    facts["processors"] = str(os.cpu_count())
    facts["free disk here"] = f"{shutil.disk_usage('.').free / 1e9:.1f} GB"
    builds = _opencv_builds()
    problems: list[str] = []
    if len(builds) > 1:
        named = ", ".join(f"{name} {version}" for name, version in builds.items())
        problems.append(
            f"two builds of OpenCV are installed ({named}) and overwrite each other: "
            f"pip uninstall {' '.join(builds)} and then pip install opencv-python-headless"
        )
    if BROKEN_OPENCV in builds.values():
        problems.append(f"OpenCV {BROKEN_OPENCV} is broken: pip install --upgrade opencv-python-headless")
    facts |= _codecs(problems)
    return facts, problems


def _opencv_builds() -> dict[str, str]:
    found = {str(item.metadata["Name"]).lower(): item.version for item in distributions() if item.metadata["Name"]}
    return {name: version for name, version in found.items() if name in OPENCV_BUILDS}


def _codecs(problems: list[str]) -> dict[str, str]:
    try:
        import cv2
    except ImportError as error:
        problems.append(f"OpenCV cannot be imported ({error}): pip install --force-reinstall opencv-python-headless")
        return {}
    backends = [cv2.videoio_registry.getBackendName(backend) for backend in cv2.videoio_registry.getBackends()]
    backends = list(dict.fromkeys(backends))
    if "FFMPEG" not in backends:
        problems.append("OpenCV was built without FFmpeg: AVI and MP4 cannot be read; raw formats and images can")
    return {"video backends": ", ".join(backends)}
