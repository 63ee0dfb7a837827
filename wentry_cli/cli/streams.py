"""Standard streams that the caller closed, or that take no more."""

from __future__ import annotations

import contextlib
import errno
import os
import sys

UNWRITABLE = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EBADF}


def open_missing_streams() -> None:
    """Open nothing in the place of a closed standard stream: else the next file took its number, and its words."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            handle = os.open(os.devnull, os.O_RDWR)
            os.set_inheritable(handle, True)  # for the processes of drops side by side
            setattr(sys, name, os.fdopen(handle, mode, encoding="utf-8"))


def why_unwritable(error: OSError) -> str | None:
    """The sentence on ``error`` where a standard stream raised it, which has no name of a file; else ``None``."""
    if error.filename is not None or error.errno not in UNWRITABLE:
        return None
    return f"what there is to print cannot be written ({error.strerror}); free space or print elsewhere"


def give_up_output() -> None:
    """Close stdout, which takes no more: at its end Python would try once again, and complain."""
    with contextlib.suppress(OSError):
        sys.stdout.close()
