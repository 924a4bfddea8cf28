"""The same seed gives the same bytes on every processor with AVX2: rooms, layers, poses and scans."""

import json
import os
import subprocess
import sys
from pathlib import Path

import golden_rooms
import pytest
from numpy._core import _multiarray_umath

OPTIONAL = [name for name in _multiarray_umath.__cpu_dispatch__ if _multiarray_umath.__cpu_features__[name]]
WIDE = [name for name in OPTIONAL if name.startswith(("AVX512", "X86_V4"))]
"""What numpy has code for that this processor can do, and the part of it that needs AVX-512."""
PROCESSORS = {
    "Haswell": {"OPENBLAS_CORETYPE": "Haswell", "NPY_DISABLE_CPU_FEATURES": " ".join(WIDE)},
    "Nehalem": {"OPENBLAS_CORETYPE": "Nehalem", "NPY_DISABLE_CPU_FEATURES": " ".join(OPTIONAL)},
}
ROOMS = ("bathroom", "living_room")
"""One in which light is cached, one in which it is traced."""


@pytest.mark.parametrize("room", golden_rooms.ROOMS)
def test_a_room_is_as_it_was(room: str) -> None:
    golden = json.loads(golden_rooms.GOLDEN.read_text())
    told = golden_rooms.changes({room: golden[room]}, {room: golden_rooms.digests_of(room)})
    assert not told, f"{told[0]}; if this is meant: python test/helpers/golden_rooms.py --renew"


@pytest.mark.parametrize("processor", PROCESSORS)
def test_rooms_do_not_depend_on_the_kernels_that_numpy_and_blas_choose(processor: str) -> None:
    environment = os.environ | PROCESSORS[processor] | {"PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, str(Path(golden_rooms.__file__)), *ROOMS]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=600, check=True)
    golden = json.loads(golden_rooms.GOLDEN.read_text())
    assert not golden_rooms.changes({room: golden[room] for room in ROOMS}, json.loads(done.stdout))
