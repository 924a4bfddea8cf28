"""How kernels are compiled: the options of those that make no arrays.

Unless told otherwise numba counts the references to every array that a function takes out of a tuple or slices, each time with an atomic
addition; in the layout chain that was two thirds of the time.  What a kernel without this counting is given belongs to its caller.
"""

from __future__ import annotations

from typing import Any

LEAN: dict[str, Any] = {"cache": True, "error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True}
"""Options of kernels that make no arrays."""

INNER: dict[str, Any] = {**LEAN, "no_cpython_wrapper": True}
"""And that only other kernels call: a wrapper that unpacks the tables takes longer to compile than most kernels."""

INLINED: dict[str, Any] = {**INNER, "forceinline": True}
"""And whose call would cost more than it does, since every array that is passed on is up to ten numbers on the stack.

Without this option on its small kernels the layout chain made a quarter fewer proposals per second.
"""
