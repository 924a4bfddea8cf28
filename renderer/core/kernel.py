"""How kernels are compiled: cached on disk, free of the GIL, IEEE arithmetic throughout.

Divisions by zero give infinities as in numpy: Python's exception would put a branch into every loop over lanes and keep LLVM from
vectorising it.
"""

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit
from numba.core.compiler import CompilerBase, DefaultPassBuilder

Function = TypeVar("Function", bound=Callable[..., object])

_SETTINGS: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True}


class _Apart(CompilerBase):  # type: ignore[misc]
    """Numba's compiler, which promises LLVM that arrays given to a function share no memory: loops with tables are vectorised then."""

    def define_pipelines(self) -> list[Any]:
        self.state.flags.noalias = True
        return [DefaultPassBuilder.define_nopython_pipeline(self.state)]


_INNER: dict[str, Any] = {**_SETTINGS, "no_cpython_wrapper": True, "pipeline_class": _Apart}
"""Of kernels that only kernels call: a wrapper that unpacks records of 40 arrays takes longer to compile than most kernels."""


def entry(function: Function) -> Function:
    """Compile a function that Python calls; to its callers it keeps its type.  Its arrays may share memory, as those of packets do."""
    return cast(Function, njit(**_SETTINGS)(function))


def kernel(function: Function) -> Function:
    """Compile a function that kernels call, with arrays that are apart."""
    return cast(Function, njit(**_INNER)(function))


def inlined(function: Function) -> Function:
    """Compile a function into its callers: passing records of many arrays by value would cost more than the work."""
    return cast(Function, njit(forceinline=True, **_INNER)(function))


def from_python(function: Function) -> Function:
    """Return a function by which Python calls a kernel that is made for kernels, as tests do; calling such a kernel itself would crash."""

    @njit
    def call(*arguments):  # type: ignore[no-untyped-def]
        return function(*arguments)

    return cast(Function, call)
