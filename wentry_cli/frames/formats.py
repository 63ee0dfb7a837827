"""Which reader opens which source: one line a format. Readers are imported when they are needed."""

from __future__ import annotations

from collections.abc import Callable
from difflib import get_close_matches
from importlib import import_module
from pathlib import Path
from typing import cast

from wentry_cli.errors import InputError
from wentry_cli.frames.decoded import shared
from wentry_cli.frames.reader import Recording

PACKAGE = "wentry_cli.frames"

# suffix: module and function that open it, and whether it can accept a file that was cut off behind the frames used
FORMATS: dict[str, tuple[str, str, bool]] = {
    ".cihx": ("photron", "open_photron", True),
    ".cih": ("photron", "open_photron", True),
    ".mraw": ("photron", "open_photron", True),
    ".cine": ("phantom", "open_phantom", True),
    ".tif": ("tiff_stack", "open_tiff_stack", True),
    ".tiff": ("tiff_stack", "open_tiff_stack", True),
    ".avi": ("video", "open_video", True),
    ".mp4": ("video", "open_video", True),
    ".mov": ("video", "open_video", True),
    ".mkv": ("video", "open_video", True),
}
STILLS = (".png", ".jpg", ".jpeg", ".bmp")
SUPPORTED = f"a folder of numbered images (png tif jpg bmp), or a file: {' '.join(FORMATS)}"


def open_recording(path: Path, *, fps: float | None = None, frames: tuple[int, int] | None = None) -> Recording:
    """Open ``path``: a folder of numbered images, a pattern of their names (``side/img_*.png``), or a recording.

    ``fps`` is the camera's rate where the user gives it: it wins over the file's. ``frames`` (first, last) is the part
    that will be used: a recording that was cut off behind it is accepted; the frames themselves are selected by
    ``orient``. Inside of ``decoded_once`` each of its frames is decoded once.

    Raises InputError, one sentence, where the source is missing, unreadable or inconsistent.
    """
    recording = shared((Path(path), frames), lambda: _open(Path(path), frames))
    if fps is None:
        return recording
    from wentry_cli.frames.given_rate import GivenRate

    return GivenRate(recording, fps)


def _open(path: Path, frames: tuple[int, int] | None) -> Recording:
    try:
        folder, there, plain = path.is_dir(), path.exists(), path.is_file()
    except OSError as error:
        raise InputError(f"{path}: cannot be opened ({error.strerror}); check the source") from error
    if folder:
        return _images(path, "*")
    if there and not plain:
        raise InputError(f"{path}: is a device or a pipe, not a file; check the source")
    if not there:
        if any(sign in path.name for sign in "*?[") and path.parent.is_dir():
            return _images(path.parent, path.name)
        raise InputError(f"{path}: no such file or folder{_nearest(path)}; check the source")
    suffix = path.suffix.lower()
    if suffix not in FORMATS:
        raise InputError(f"{path}: {_unknown(path, suffix)}")
    module, name, cut = FORMATS[suffix]
    opener = cast("Callable[..., Recording]", getattr(import_module(f"{PACKAGE}.{module}"), name))
    return opener(path, frames) if cut else opener(path)


def _images(folder: Path, pattern: str) -> Recording:
    from wentry_cli.frames.image_folder import open_image_folder

    return open_image_folder(folder, pattern)


def _nearest(path: Path) -> str:
    if not path.parent.is_dir():
        return f" (nor its folder {path.parent})"
    close = get_close_matches(path.name, [entry.name for entry in path.parent.iterdir()], n=1, cutoff=0.6)
    return f"; did you mean '{close[0]}'?" if close else ""


def _unknown(path: Path, suffix: str) -> str:
    if suffix in STILLS:
        return "a single image; give its folder as the source"
    close = get_close_matches(suffix, list(FORMATS), cutoff=0.75)
    there = [path.with_suffix(ending).name for ending in close if path.with_suffix(ending).exists()]
    guess = f"; did you mean '{there[0]}'?" if there else f"; rename it if it is a {close[0]} file;" if close else ""
    kind = f"files of kind '{suffix}'" if suffix else "files without an ending"
    return f"{kind} are not read{guess or ';'} supported: {SUPPORTED}"
