"""How kernels are compiled: cached on disk, free of the GIL, IEEE arithmetic throughout.

Divisions by zero give infinities as in numpy: Python's exception would put a branch into every loop over lanes and keep LLVM from
vectorising it.
"""

from numba import njit

kernel = njit(cache=True, nogil=True, error_model="numpy")
"""Decorator of every function that runs inside a render."""
