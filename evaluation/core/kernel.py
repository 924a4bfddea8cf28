"""How kernels are compiled: cached on disk, IEEE arithmetic throughout, one thread."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from foundation.kernels import compiled


def entry(function: Callable[..., Any]) -> Any:
    """Compile a function that Python calls."""
    return compiled(function, error_model="numpy")
