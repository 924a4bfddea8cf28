"""What clutter does to rooms: how many objects they have, by type, whether they stay valid, what is odd in them, and what it costs.

python -m benchmarks.clutter_bench [--rooms N] [--types TYPE ...] [--clutter C ...] [--seed S]

N rooms of each type, the same ones at each clutter.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

import numpy as np

from benchmarks.rooms_bench import SEED, Judged, judge
from grammar import room_types

CLUTTER = (0.0, 0.5, 1.0, 2.0, 3.0)


def table(found: Sequence[tuple[str, Sequence[Sequence[Judged]]]], clutter: Sequence[float]) -> str:
    """Return the table as markdown, of each type with its rooms at each level of clutter."""
    lines = [f"| room type | {' | '.join(f'{level:g}' for level in clutter)} |", f"|---|{'---|' * len(clutter)}"]
    for name, levels in found:
        counts = [np.median([room.measures.objects for room in rooms if room.measures]) for rooms in levels]
        lines.append(f"| {name} | {' | '.join(f'{count:g}' for count in counts)} |")
    by_level = [[room for _, levels in found for room in levels[k]] for k in range(len(clutter))]
    rows = {
        "not valid, of all rooms": [f"{sum(not room.valid for room in rooms)} of {len(rooms)}" for rooms in by_level],
        "with a fault of use, share": [f"{np.mean([bool(room.faults) for room in rooms]):.2f}" for rooms in by_level],
        "processor seconds, p50": [f"{np.median([room.seconds for room in rooms]):.2f}" for rooms in by_level],
        "processor seconds, p99": [f"{np.quantile([room.seconds for room in rooms], 0.99):.2f}" for rooms in by_level],
    }
    lines.extend(f"| {name} | {' | '.join(values)} |" for name, values in rows.items())
    return "\n".join(lines) + "\n"


def main() -> None:
    """Sample, judge and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.clutter_bench")
    parser.add_argument("--types", nargs="+", choices=room_types(), default=room_types())
    parser.add_argument("--clutter", nargs="+", type=float, default=CLUTTER)
    parser.add_argument("--rooms", type=int, default=20)
    parser.add_argument("--seed", type=int, default=SEED)
    arguments = parser.parse_args()
    indices = range(arguments.rooms)
    found = [(name, [judge(name, arguments.seed, indices, level) for level in arguments.clutter]) for name in arguments.types]
    sys.stdout.write(table(found, arguments.clutter))


if __name__ == "__main__":
    main()
