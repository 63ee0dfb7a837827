"""A recording described for a person or a program: what ``wentry info`` shows."""

from __future__ import annotations

import hashlib
from pathlib import Path

from wentry_cli.errors import FrameUnreadableError
from wentry_cli.frames.formats import open_recording
from wentry_cli.frames.identity import recording_files
from wentry_cli.frames.reader import RATE_GIVEN, RATE_UNKNOWN, Recording


def describe(
    path: Path,
    *,
    count_duplicates: bool = False,
    fps: float | None = None,
    exposure_s: float | None = None,
    frames: tuple[int, int] | None = None,
) -> dict[str, object]:
    """Return format, size, depth, rate and where it came from, exposure, gaps and duplicates of ``path``.

    All values are JSON-able; None means that the recording does not say. With ``count_duplicates`` every frame is read
    to find those that equal the one before (``duplicate_frames``). A given ``exposure_s`` stands over the header's.
    ``fps``, ``frames`` and what is raised are those of ``open_recording``.
    """
    recording = open_recording(path, fps=fps, frames=frames)
    try:
        info = recording.info
        numbers = recording.camera_frames()
        times = recording.times_s()
        files = recording_files(Path(path))
        duration = float(times[-1]) if times is not None else None
        if duration is None and info.fps and info.rate_trusted:
            duration = (info.frame_count - 1) / info.fps
        return {
            "path": str(path),
            "format": info.format,
            "frame_count": info.frame_count,
            "width": info.width,
            "height": info.height,
            "bit_depth": info.bit_depth,
            "fps": info.fps,
            "fps_source": info.fps_source,
            "fps_trusted": info.rate_trusted,
            "exposure_s": info.exposure_s if exposure_s is None else exposure_s,
            "exposure_source": RATE_GIVEN if exposure_s is not None else "header" if info.exposure_s else RATE_UNKNOWN,
            "duration_s": duration,
            "first_camera_frame": int(numbers[0]),
            "last_camera_frame": int(numbers[-1]),
            "time_stamps": times is not None,
            "gaps": info.gaps,
            "duplicates": info.duplicates,
            "duplicate_frames": count_duplicate_frames(recording) if count_duplicates else None,
            "files": len(files),
            "bytes": sum(file.stat().st_size for file in files),
            "notes": list(info.notes),
        }
    finally:
        recording.close()


def count_duplicate_frames(recording: Recording) -> int:
    """Return how many readable frames equal the readable frame before them, bit by bit: a camera repeats none."""
    last = b""
    count = 0
    for index in range(recording.info.frame_count):
        try:
            digest = hashlib.blake2b(recording.read(index).tobytes(), digest_size=16).digest()
        except FrameUnreadableError:
            continue
        count += digest == last
        last = digest
    return count
