"""Free memory between blocks that stay goes back to the system."""

import platform

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
