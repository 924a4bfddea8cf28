"""How kernels are compiled: cached on disk, IEEE arithmetic throughout.

Unless told otherwise numba counts the references to every array that a function takes out of a tuple or slices, each time with an atomic
addition; in the layout chain that was two thirds of the time.  What a kernel without this counting is given belongs to its caller.
"""

from collections.abc import Callable
from typing import Any

from kernel_cache.compiling import LinkedCompiler, compiled

_COUNTING: dict[str, Any] = {"error_model": "numpy"}
_SETTINGS: dict[str, Any] = {**_COUNTING, "_nrt": False, "no_cfunc_wrapper": True}
_INNER: dict[str, Any] = {**_SETTINGS, "no_cpython_wrapper": True, "pipeline_class": LinkedCompiler}
"""Of kernels that only kernels call: a wrapper that unpacks the tables takes longer to compile than most kernels."""


def making_arrays(function: Callable[..., Any]) -> Any:
    """Compile a function that Python calls and that makes arrays."""
    return compiled(function, **_COUNTING)


def entry(function: Callable[..., Any]) -> Any:
    """Compile a function that Python calls."""
    return compiled(function, **_SETTINGS)


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function that only kernels call."""
    return compiled(function, **_INNER)


def inlined(function: Callable[..., Any]) -> Any:
    """Compile a function into its callers: every array that a call passes on is up to ten numbers on the stack.

    Without this on its small kernels the layout chain made a quarter fewer proposals per second.
    """
    return compiled(function, forceinline=True, **_INNER)
