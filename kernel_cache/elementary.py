"""Elementary functions of arrays with the same bytes on every processor.

numpy has other code for them for other processors, with other last digits.  These ask the C library for one number after the other, as
kernels and :mod:`math` do: its code differs between processors with and without AVX2 and FMA only.  Of float32 the result is that of
float64, rounded.
"""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

_EXP, _EXPM1, _LOG, _LOG2, _LOG1P, _SIN, _COS, _TAN, _ARCCOS = range(9)


def _of_one(which: int, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    for i in range(x.size):
        if which == _SIN:
            out[i] = np.sin(x[i])
        elif which == _COS:
            out[i] = np.cos(x[i])
        elif which == _EXP:
            out[i] = np.exp(x[i])
        elif which == _LOG:
            out[i] = np.log(x[i])
        elif which == _ARCCOS:
            out[i] = np.arccos(x[i])
        elif which == _TAN:
            out[i] = np.tan(x[i])
        elif which == _LOG2:
            out[i] = np.log2(x[i])
        elif which == _LOG1P:
            out[i] = np.log1p(x[i])
        else:
            out[i] = np.expm1(x[i])


def _of_two(is_power: bool, x: NDArray[np.float64], y: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    for i in range(x.size):
        out[i] = x[i] ** y[i] if is_power else np.arctan2(x[i], y[i])


@cache
def _compiled(function: Callable[..., None]) -> Callable[..., None]:
    """Return one of these as a kernel; programs that never call it start without the compiler."""
    from kernel_cache.compiling import compiled

    kernel: Callable[..., None] = compiled(function, nogil=True, error_model="numpy", _nrt=False, no_cfunc_wrapper=True)
    return kernel


def exp(x: ArrayLike) -> Any:
    """Return e to the power of x."""
    return _mapped(_EXP, x)


def expm1(x: ArrayLike) -> Any:
    """Return e to the power of x, less 1."""
    return _mapped(_EXPM1, x)


def log(x: ArrayLike) -> Any:
    """Return the natural logarithm."""
    return _mapped(_LOG, x)


def log2(x: ArrayLike) -> Any:
    """Return the logarithm to base 2."""
    return _mapped(_LOG2, x)


def log1p(x: ArrayLike) -> Any:
    """Return the natural logarithm of 1 + x."""
    return _mapped(_LOG1P, x)


def sin(x: ArrayLike) -> Any:
    """Return the sine of an angle in radians."""
    return _mapped(_SIN, x)


def cos(x: ArrayLike) -> Any:
    """Return the cosine of an angle in radians."""
    return _mapped(_COS, x)


def tan(x: ArrayLike) -> Any:
    """Return the tangent of an angle in radians."""
    return _mapped(_TAN, x)


def arccos(x: ArrayLike) -> Any:
    """Return the angle in radians whose cosine is x."""
    return _mapped(_ARCCOS, x)


def arctan2(y: ArrayLike, x: ArrayLike) -> Any:
    """Return the angle in radians from the x axis to (x, y)."""
    return _mapped_two(False, y, x)


def power(x: ArrayLike, exponent: ArrayLike) -> Any:
    """Return x to the power of an exponent."""
    return _mapped_two(True, x, exponent)


def _precision(kind: np.dtype[Any]) -> type[np.floating]:
    return np.float32 if kind == np.float32 else np.float64


def _mapped(which: int, x: ArrayLike) -> Any:
    given = np.asarray(x)
    flat = np.ascontiguousarray(given, np.float64).reshape(-1)
    out = np.empty(flat.size)
    _compiled(_of_one)(which, flat, out)
    return out.reshape(given.shape).astype(_precision(given.dtype), copy=False)[()]


def _mapped_two(is_power: bool, x: ArrayLike, y: ArrayLike) -> Any:
    precision = _precision(np.result_type(*(item if np.isscalar(item) else np.asarray(item) for item in (x, y))))
    a, b = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(y, np.float64))
    out = np.empty(a.size)
    _compiled(_of_two)(is_power, np.ascontiguousarray(a).reshape(-1), np.ascontiguousarray(b).reshape(-1), out)
    return out.reshape(a.shape).astype(precision, copy=False)[()]
