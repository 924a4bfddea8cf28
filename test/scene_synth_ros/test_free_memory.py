"""Free memory goes back to the system."""

import platform
import subprocess
import sys

import pytest

from scene_synth_ros.diagnostics import resident_bytes
from scene_synth_ros.free_memory import give_back_memory

BLOCKS, SIZE = 1000, 65536


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="malloc_trim is glibc's")
def test_free_blocks_below_one_that_stays_are_given_back() -> None:
    blocks = [bytes([1]) * SIZE for _ in range(BLOCKS)]
    kept = blocks[-1]
    full = resident_bytes()
    blocks.clear()
    give_back_memory()
    assert full - resident_bytes() > 0.8 * BLOCKS * SIZE
    assert kept == bytes([1]) * SIZE


LARGE = """
import ctypes, sys
from scene_synth_ros.diagnostics import resident_bytes
from scene_synth_ros.free_memory import keep_memory_even
if sys.argv[1] == "even":
    keep_memory_even()
bytes(24 << 20)  # freed: the heap's bound for blocks of their own grows to this
libc = ctypes.CDLL(None)
libc.malloc.restype, libc.free.argtypes = ctypes.c_void_p, [ctypes.c_void_p]
blocks = [libc.malloc(4 << 20) for _ in range(20)]
for block in blocks:
    ctypes.memset(ctypes.c_void_p(block), 1, 4 << 20)
full = resident_bytes()
for block in blocks[:-1]:
    libc.free(block)
print(full - resident_bytes())
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="mallopt is glibc's")
def test_large_blocks_go_back_when_they_are_freed() -> None:
    given_back = {
        how: int(subprocess.run([sys.executable, "-c", LARGE, how], capture_output=True, text=True, check=True).stdout)
        for how in ("even", "by itself")
    }
    assert given_back["even"] > 0.9 * 19 * (4 << 20)
    assert given_back["by itself"] < 0.1 * 19 * (4 << 20), "or there is nothing to mend"
