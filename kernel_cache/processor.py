"""For which processors kernels are compiled: where this one has AVX2 and FMA, for all that have (x86-64-v3), else for this one.

So one cache serves all of them, and they compute the same.  Neither is Intel's vector library used, which numba takes where it is installed
and which has other code for other processors.
"""

import os
from contextlib import suppress

os.environ.setdefault("NUMBA_DISABLE_INTEL_SVML", "1")  # read when numba is imported

from numba import config
from numba.core.codegen import get_host_cpu_features

_NAME, _FEATURES = "x86-64-v3", set(get_host_cpu_features().split(","))

COMMON = {"+avx2", "+fma", "+bmi2"} <= _FEATURES and config.CPU_NAME in (None, _NAME)
"""Whether kernels are compiled for all processors with AVX2."""
AVX512 = {"+avx512f", "+avx512dq", "+avx512cd", "+avx512bw", "+avx512vl"} <= _FEATURES
"""Whether this processor has of AVX-512 what Embree's code for it needs."""


def maker() -> str:
    """Return the name by which the processor's maker calls itself, empty where the system does not tell: GenuineIntel, say."""
    with suppress(OSError), open("/proc/cpuinfo") as lines:
        return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("vendor_id")), "")
    return ""


def compile_for_all() -> None:
    """Have numba do so, before it compiles anything: by its variables, which it reads again whenever one has changed."""
    if COMMON:
        os.environ.update(NUMBA_CPU_NAME=_NAME, NUMBA_CPU_FEATURES="")
        config.reload_config()
