"""What identifies a recording without reading all of it: names, sizes, times of change, and a hash of samples."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path

from wentry_cli.errors import InputError

BLOCK = 1 << 16
SAMPLES = 8  # blocks hashed of each large file, the first and the last among them


def recording_files(path: Path) -> list[Path]:
    """Return the files that make the recording at ``path``, in a fixed order; InputError where there is none."""
    if path.is_dir() or (not path.exists() and any(sign in path.name for sign in "*?[")):
        from wentry_cli.frames.image_folder import camera_headers, image_names

        folder, pattern = (path, "*") if path.is_dir() else (path.parent, path.name)
        names = [*image_names(folder, pattern), *(path.name for path in camera_headers(folder))]
        return [folder / name for name in sorted(names)]
    if path.suffix.lower() in (".cihx", ".cih", ".mraw"):
        from wentry_cli.frames.photron import photron_files

        return list(photron_files(path))
    return [path]


def recording_identity(path: Path) -> str:
    """Return a word that changes when the recording changes, at little cost.

    It is a hash of the names, sizes and times of change of its files and of sampled blocks of them: of a long series
    of images those of the first, the middle and the last. Raises InputError where a file cannot be read.
    """
    files = recording_files(Path(path))
    sampled = set(files) if len(files) <= 2 else {files[0], files[len(files) // 2], files[-1]}

    def look(digest: hashlib._Hash, file: Path) -> None:
        status = file.stat()
        digest.update(f"{status.st_mtime_ns}\0".encode())
        if file in sampled:
            _hash_samples(digest, file, status.st_size)

    return f"sampled:{_digest(files, look)}"


def recording_content(path: Path) -> str:
    """Return a word that stays when only times change, as in a copy: names, sizes and samples of every file.

    Raises InputError where a file cannot be read.
    """
    word = _digest(recording_files(Path(path)), lambda digest, file: _hash_samples(digest, file, file.stat().st_size))
    return f"content:{word[:32]}"


def recording_bytes(path: Path) -> str:
    """Return a hash of names, sizes and every byte of a recording; raises InputError where a file cannot be read."""

    def look(digest: hashlib._Hash, file: Path) -> None:
        with file.open("rb") as stream:
            digest.update(hashlib.file_digest(stream, "sha256").digest())

    return f"full:{_digest(recording_files(Path(path)), look)}"


def _digest(files: list[Path], look: Callable[[hashlib._Hash, Path], None]) -> str:
    """Hash of the names and sizes of ``files`` and of what ``look`` adds of each."""
    digest = hashlib.sha256()
    for file in files:
        try:
            digest.update(f"{file.name}\0{file.stat().st_size}\0".encode("utf-8", "surrogateescape"))
            look(digest, file)
        except OSError as error:
            raise InputError(f"{file}: cannot be read ({error.strerror}); check the source") from error
    return digest.hexdigest()


def _hash_samples(digest: hashlib._Hash, file: Path, size: int) -> None:
    last = max(0, size - BLOCK)
    places = sorted({last * i // (SAMPLES - 1) for i in range(SAMPLES)})
    with file.open("rb") as stream:
        for place in places:
            stream.seek(place)
            digest.update(stream.read(BLOCK))
