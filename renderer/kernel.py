"""How kernels are compiled: cached on disk, free of the GIL, IEEE arithmetic throughout.

Divisions by zero give infinities as in numpy: Python's exception would put a branch into every loop over lanes and keep LLVM from
vectorising it.
"""

from collections.abc import Callable
from typing import TypeVar, cast

from numba import njit

Function = TypeVar("Function", bound=Callable[..., object])


def kernel(function: Function) -> Function:
    """Compile a function that runs inside a render; to its callers it keeps its type."""
    return cast(Function, njit(cache=True, nogil=True, error_model="numpy", _nrt=False)(function))


def inlined(function: Function) -> Function:
    """Compile a small function into its callers: passing records of many fields by value would cost more than the work."""
    return cast(Function, njit(cache=True, nogil=True, error_model="numpy", _nrt=False, forceinline=True)(function))
