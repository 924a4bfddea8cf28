"""How well numbers of a known grammar come back from rooms that were sampled from it.

python -m benchmarks.recovery_bench [--rooms N]
"""

from __future__ import annotations

import argparse
import sys

from recovery import recover

from benchmarks.table import Row, render_table

ROOMS = 2000


def measure(rooms: int = ROOMS) -> list[Row]:
    """Sample, learn and compare."""
    return [
        Row(f"{name}: {truth:g} came back within {error:.3f}", value, "", f"+- {error:.3f}", abs(value - truth) <= error)
        for name, truth, value, error in recover(rooms)
    ]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m benchmarks.recovery_bench")
    parser.add_argument("--rooms", type=int, default=ROOMS)
    sys.stdout.write(render_table("Recovered parameters", measure(parser.parse_args().rooms)) + "\n")
