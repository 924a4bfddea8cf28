"""How kernels are compiled: cached on disk, free of the GIL, IEEE arithmetic throughout.

Divisions by zero give infinities as in numpy: Python's exception would put a branch into every loop over lanes and keep LLVM from
vectorising it.
"""

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit
from numba.core.compiler import CompilerBase, DefaultPassBuilder

Function = TypeVar("Function", bound=Callable[..., object])

_SETTINGS: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy", "_nrt": False}


class _Apart(CompilerBase):  # type: ignore[misc]
    """Numba's compiler, which promises LLVM that arrays given to a function share no memory: loops with tables are vectorised then."""

    def define_pipelines(self) -> list[Any]:
        self.state.flags.noalias = True
        return [DefaultPassBuilder.define_nopython_pipeline(self.state)]


def kernel(function: Function) -> Function:
    """Compile a function that runs inside a render; to its callers it keeps its type."""
    return cast(Function, njit(pipeline_class=_Apart, **_SETTINGS)(function))


def tracing(function: Function) -> Function:
    """Compile a function that calls Embree, which writes the memory that two of its arrays share."""
    return cast(Function, njit(**_SETTINGS)(function))


def inlined(function: Function) -> Function:
    """Compile a small function into its callers: passing records of many fields by value would cost more than the work."""
    return cast(Function, njit(pipeline_class=_Apart, forceinline=True, **_SETTINGS)(function))
