"""Free memory goes back to the system."""

import platform
import subprocess
import sys

import pytest

from scene_synth_ros.suite.diagnostics import resident_bytes
from scene_synth_ros.suite.heap import trim_heap

BLOCKS, SIZE = 1000, 65536


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="malloc_trim is glibc's")
def test_free_blocks_below_one_that_stays_are_given_back() -> None:
    blocks = [bytes([1]) * SIZE for _ in range(BLOCKS)]
    kept = blocks[-1]
    full = resident_bytes()
    blocks.clear()
    trim_heap()
    assert full - resident_bytes() > 0.8 * BLOCKS * SIZE
    assert kept == bytes([1]) * SIZE


HEAPS = """
import ctypes, sys, threading
from pathlib import Path
from scene_synth_ros.suite.heap import limit_arenas
if sys.argv[1] == "few":
    limit_arenas()
libc = ctypes.CDLL(None)
libc.malloc.restype = ctypes.c_void_p
hold = threading.Barrier(7)
threads = [threading.Thread(target=lambda: (libc.malloc(50_000), hold.wait(), hold.wait())) for _ in range(6)]
for thread in threads:
    thread.start()
hold.wait()
libc.malloc_info(0, ctypes.c_void_p.in_dll(libc, "stdout"))
libc.fflush(None)
hold.wait()
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="mallopt is glibc's")
def test_threads_share_two_heaps() -> None:
    heaps = {
        how: subprocess.run([sys.executable, "-c", HEAPS, how], capture_output=True, text=True, check=True).stdout.count("<heap nr=")
        for how in ("few", "many")
    }
    assert heaps["few"] == 2 < heaps["many"]
