"""Loops that Numba compiles, kept on disk where there is a place for it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


def jit(function: Callable[..., Any], **options: Any) -> Any:
    """The function compiled when it is first called, with options of ``numba.njit``.

    Numba is imported here, for it costs more to import than most of what uses it.
    """
    import numba

    try:
        return numba.njit(cache=True, **options)(function)
    except RuntimeError:  # nowhere to write the cache
        return numba.njit(**options)(function)
