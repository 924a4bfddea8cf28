"""How kernels are compiled: cached on disk, free of the GIL, IEEE arithmetic throughout.

Divisions by zero give infinities as in numpy: Python's exception would put a branch into every loop over lanes and keep LLVM from
vectorising it.
"""

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit

from kernel_cache.compiling import LinkedCompiler, OptimizedLibrary, compiled

Function = TypeVar("Function", bound=Callable[..., object])

_SETTINGS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True}


class _Apart(LinkedCompiler):
    """Promises LLVM that arrays given to a function share no memory: loops with tables are vectorised then."""

    library = OptimizedLibrary

    def define_pipelines(self) -> list[Any]:
        """Return the pipeline with that promise."""
        self.state.flags.noalias = True
        return super().define_pipelines()


_INNER: dict[str, Any] = {**_SETTINGS, "no_cpython_wrapper": True, "pipeline_class": _Apart}
"""Of kernels that only kernels call: a wrapper that unpacks records of 40 arrays takes longer to compile than most kernels."""


def entry(function: Function) -> Function:
    """Compile a function that Python calls; to its callers it keeps its type.  Its arrays may share memory, as those of packets do."""
    return cast(Function, compiled(function, **_SETTINGS))


def kernel(function: Function) -> Function:
    """Compile a function that kernels call, with arrays that are apart."""
    return cast(Function, compiled(function, **_INNER))


def inlined(function: Function) -> Function:
    """Compile a function into its callers: passing records of many arrays by value would cost more than the work."""
    return cast(Function, compiled(function, forceinline=True, **_INNER))


def from_python(function: Function) -> Function:
    """Return a function by which Python calls a kernel that is made for kernels, as tests do; calling such a kernel itself would crash."""

    @njit
    def call(*arguments):  # type: ignore[no-untyped-def]
        return function(*arguments)

    return cast(Function, call)
