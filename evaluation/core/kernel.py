"""How kernels are compiled: cached on disk, IEEE arithmetic throughout, one thread."""

from collections.abc import Callable
from typing import Any

from kernel_cache.compiling import compiled


def entry(function: Callable[..., Any]) -> Any:
    """Compile a function that Python calls."""
    return compiled(function, error_model="numpy")
