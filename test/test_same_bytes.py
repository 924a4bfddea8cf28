"""The same seed gives the same bytes whatever numpy and OpenBLAS choose for a processor: rooms, layers, poses and scans.

Half of the rooms are made with what these have for processors without AVX-512, half with what they have for those without AVX2, and some
with what they choose for the one at hand.  A file has the digests of all, which are those of processors of every maker.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import golden_rooms
import pytest
from numpy._core import _multiarray_umath

OPTIONAL = [name for name in _multiarray_umath.__cpu_dispatch__ if _multiarray_umath.__cpu_features__[name]]
"""What numpy has code for, beside the least, that this processor can do."""
WIDE = [name for name in OPTIONAL if name.startswith(("AVX512", "X86_V4"))]
ALL = list(golden_rooms.ROOMS)
PROCESSORS = {
    "of 2013": ({"OPENBLAS_CORETYPE": "Haswell", "NPY_DISABLE_CPU_FEATURES": " ".join(WIDE)}, ALL[::2]),
    "of 2008": ({"OPENBLAS_CORETYPE": "Nehalem", "NPY_DISABLE_CPU_FEATURES": " ".join(OPTIONAL)}, ALL[1::2]),
    "at hand": ({}, ["bathroom", "bedroom"]),
}
"""Variables that choose kernels, and rooms; those at hand are one in which light is cached and one in which it is traced."""


@pytest.mark.parametrize("processor", PROCESSORS)
def test_rooms_and_all_that_they_publish_are_as_they_were(processor: str) -> None:
    variables, rooms = PROCESSORS[processor]
    kept = {name: value for name, value in os.environ.items() if name not in ("OPENBLAS_CORETYPE", "NPY_DISABLE_CPU_FEATURES")}
    environment = {**kept, **variables, "PYTHONPATH": os.pathsep.join(sys.path)}
    golden = json.loads(Path(golden_rooms.GOLDEN).read_text())
    told = golden_rooms.changes({room: golden[room] for room in rooms}, digests_made(rooms, environment))
    assert not told, "\n".join([*told, "if this is meant: python test/helpers/golden_rooms.py --renew"])


def digests_made(rooms: list[str], environment: dict[str, str]) -> golden_rooms.Digests:
    """Return the digests of rooms that a process with these variables makes."""
    command = [sys.executable, golden_rooms.__file__, *rooms]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=900, check=False)
    assert done.returncode == 0, done.stderr
    made: golden_rooms.Digests = json.loads(done.stdout)
    return made
