"""Rooms in MuJoCo: how many of their free objects stay where they are for two seconds.

python -m benchmarks.physics [--rooms N] [--types TYPE ...] [--seed S] [--clutter C] [--all]

``--rooms`` of each type; the seed is drawn from the clock unless it is given.  Free is what stands on the floor or on something, but rugs
and mats; walls and what hangs on them or on the ceiling, hung toilets too, are fixed.  Cloth is as stiff as all else.  ``--all`` tells
every object that moved, not only how many of each category.  Needs the extra ``bench-physics``.
"""

import argparse
import importlib
import sys
import time
from collections import Counter
from collections.abc import Sequence

import numpy as np

from benchmarks.seeds import add_seed
from benchmarks.table import Row, at_least, render_table
from grammar import SceneRequest, room_types
from grammar.synthesize import CameraTimes, SceneSynthesizer

SHARE = 0.99
TIMES = CameraTimes(frames=1, start_ns=0, rate_hz=1.0)


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--rooms", type=int, default=1)
    parser.add_argument("--types", nargs="*", default=list(room_types()))
    add_seed(parser)
    parser.add_argument("--clutter", type=float, default=1.0)
    parser.add_argument("--all", action="store_true")
    given = parser.parse_args(arguments)
    engine = importlib.import_module("benchmarks.physics.engine")  # MuJoCo, which reading the command line does without
    synthesizer = SceneSynthesizer.from_config()
    found = []
    for name in given.types:
        for index in range(given.rooms):
            scene = synthesizer.synthesize(SceneRequest(room_type=name, clutter=given.clutter), given.seed, index, TIMES)
            began = time.perf_counter()
            room = list(engine.simulate(scene, synthesizer.categories))
            found += room
            moved = sum(not one.stays for one in room)
            sys.stdout.write(f"{name} {index}: {moved} of {len(room)} free objects moved ({time.perf_counter() - began:.0f} s)\n")
            if given.all:
                for pair, depth in sorted(engine.deepest_contacts(scene, synthesizer.categories).items(), key=lambda one: -one[1]):
                    sys.stdout.write(f"    {1e3 * depth:.1f} mm in each other: {pair[0]}, {pair[1]}\n")
                for one in (one for one in room if not one.stays):
                    far = f"{100 * one.moved_m:.1f} cm, {np.degrees(one.turned_rad):.0f} deg"
                    sys.stdout.write(f"    {one.category} {one.object_id} on {one.support}: {far}\n")
            sys.stdout.flush()
    stays = np.array([one.stays for one in found])
    rows = [at_least(f"free objects at rest, seed {given.seed}", 100.0 * float(stays.mean()), "%", 100.0 * SHARE)]
    counts = Counter(one.category for one in found)
    for category, number in Counter(one.category for one in found if not one.stays).most_common():
        rows.append(Row(f"moved: {category}, of {counts[category]}", number, ""))
    sys.stdout.write(render_table(f"Physics, {len(found)} free objects", rows) + "\n")


if __name__ == "__main__":
    main()
