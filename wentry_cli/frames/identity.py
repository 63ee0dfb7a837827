"""What identifies a recording without reading all of it: names, sizes, times of change, and a hash of samples."""

from __future__ import annotations

import hashlib
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


def recording_identity(path: Path, *, verify: bool = False) -> str:
    """Return a word that changes when the recording changes.

    By default it is a hash of the names, sizes and times of change of its files and of sampled blocks of them: of a
    long series of images those of the first, the middle and the last. With ``verify`` it is a hash of every byte and
    of no time: equal for a copy. Raises InputError where a file cannot be read.
    """
    digest = hashlib.sha256()
    files = recording_files(Path(path))
    sampled = set(files) if len(files) <= 2 else {files[0], files[len(files) // 2], files[-1]}
    for file in files:
        try:
            status = file.stat()
            digest.update(f"{file.name}\0{status.st_size}\0".encode("utf-8", "surrogateescape"))
            if verify:
                with file.open("rb") as stream:
                    digest.update(hashlib.file_digest(stream, "sha256").digest())
            else:
                digest.update(f"{status.st_mtime_ns}\0".encode())
                if file in sampled:
                    _hash_samples(digest, file, status.st_size)
        except OSError as error:
            raise InputError(f"{file}: cannot be read ({error.strerror}); check the source") from error
    return f"{'full' if verify else 'sampled'}:{digest.hexdigest()}"


def recording_content(path: Path) -> str:
    """Return a word that stays when only times change, as in a copy: names, sizes and samples of every file.

    Raises InputError where a file cannot be read.
    """
    digest = hashlib.sha256()
    for file in recording_files(Path(path)):
        try:
            size = file.stat().st_size
            digest.update(f"{file.name}\0{size}\0".encode("utf-8", "surrogateescape"))
            _hash_samples(digest, file, size)
        except OSError as error:
            raise InputError(f"{file}: cannot be read ({error.strerror}); check the source") from error
    return f"content:{digest.hexdigest()[:32]}"


def _hash_samples(digest: hashlib._Hash, file: Path, size: int) -> None:
    last = max(0, size - BLOCK)
    places = sorted({last * i // (SAMPLES - 1) for i in range(SAMPLES)})
    with file.open("rb") as stream:
        for place in places:
            stream.seek(place)
            digest.update(stream.read(BLOCK))
