"""The one way in which numerics are compiled: cached, without the interpreter lock, IEEE arithmetic.

No ``fastmath`` and no parallel reductions, so that the same input gives the same bytes with one process or
many.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import ParamSpec, TypeVar, cast

import numba

P = ParamSpec("P")
T = TypeVar("T")


def compiled(function: Callable[P, T]) -> Callable[P, T]:
    """Compile ``function`` with numba on its first call and keep its type for the type checker."""
    jit = numba.njit(cache=True, nogil=True, fastmath=False, error_model="numpy")
    return cast("Callable[P, T]", jit(function))
