"""How kernels are compiled: cached on disk, IEEE arithmetic throughout, one thread."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import njit

from scene_description.kernels import KernelCache


def entry(function: Callable[..., Any]) -> Any:
    """Compile a function that Python calls."""
    dispatcher = njit(error_model="numpy")(function)
    dispatcher._cache = KernelCache(function)
    return dispatcher
