"""What sources of rooms teach: rooms and objects, what is left out, what learning costs, and how near the learned rooms come.

python -m benchmarks.sources_bench LAYOUTS.jsonl [MORE.jsonl ...] --room TYPE [--rooms N] [--corrections N]

Each source teaches a grammar of its own from all of its rooms of the type; the table has a column for each.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from grammar import Categories, Grammar, RequestError, SceneRequest, read_categories, read_room_type
from grammar.learning import LearnOptions, ObservedRoom, TruncationOptions, learn, read_category_map, read_layouts, room_sampler
from grammar.learning.geometry import fitting_wall
from grammar.learning.truncation import category_kl, frequencies
from grammar.learning.write_layouts import layout_from_objects
from grammar.sampled_room import sample_room_with_cost
from scene_description.polygons import signed_area_m2
from scene_description.share import config_path

Column = dict[str, str]


def column(path: Path, room_type: str, rooms: int, corrections: int) -> Column:
    """Learn from one source, sample, and return the figures by name."""
    categories = read_categories(config_path("categories.yaml"))
    names = replace(read_category_map(config_path("learning/category_map.yaml")), catalogue=frozenset(categories))
    file = read_layouts(path, names, room_type)
    left_out = sum(count for reason, count in file.reasons().items() if reason.startswith("object:"))
    objects = sum(len(room.objects) for room in file.rooms)
    began = time.process_time()
    options = LearnOptions(truncation=TruncationOptions(iterations=corrections, rooms=rooms))
    base, rng = read_room_type(room_type, categories), np.random.default_rng(1)
    learned = learn(base, categories, file.rooms, options, rng, room_sampler(categories, 1))
    spent = time.process_time() - began
    drawn, attempts, seconds = _sampled(learned.grammar, categories, rooms)
    wanted, have = (Counter(item.category for room in found for item in room.objects) for found in (file.rooms, drawn))
    return {
        "rooms": f"{len(file.rooms)}",
        "objects": f"{objects}",
        "objects left out": f"{left_out / max(left_out + objects, 1):.0%}",
        "symbols that the base lacks": f"{len(learned.added)}",
        "seconds of learning, one core": f"{spent:.0f}",
        "layouts for a room, median": f"{np.median(attempts):g}",
        "seconds for a room, p50 / p99": f"{np.median(seconds):.2f} / {np.quantile(seconds, 0.99):.2f}",
        "KL over everything observed, nat": f"{category_kl(frequencies(wanted, wanted), frequencies(have, wanted)):.3f}",
        "area, m2: source / sampled": _pair(file.rooms, drawn, lambda room: signed_area_m2(room.polygon_m)),
        "objects a room: source / sampled": _pair(file.rooms, drawn, lambda room: sum(item.category in wanted for item in room.objects)),
        "gap to the wall, m: source / sampled": _pair(file.rooms, drawn, _wall_gap),
    }


def _sampled(grammar: Grammar, categories: Categories, count: int) -> tuple[list[ObservedRoom], list[int], list[float]]:
    rooms, attempts, seconds = [], [], []
    for index in range(count):
        began = time.process_time()
        try:
            request = SceneRequest(room_type=grammar.room_type)
            room, cost = sample_room_with_cost(grammar, categories, request, np.random.default_rng([7, index]))
        except RequestError:
            continue
        seconds.append(time.process_time() - began)
        attempts.append(cost.attempts)
        rooms.append(layout_from_objects(str(index), grammar.room_type, room.room, room.objects))
    return rooms, attempts, seconds


def _wall_gap(room: ObservedRoom) -> float:
    """Return the median gap to walls of what stands on the floor."""
    poses = [fitting_wall(room.polygon_m, item) for item in room.objects if item.position_m[2] < 0.1]
    return float(np.median([max(pose.gap_m, 0.0) for pose in poses if pose is not None] or [np.nan]))


def _pair(source, drawn, measure) -> str:  # type: ignore[no-untyped-def]
    return " / ".join(f"{np.nanmedian([measure(room) for room in rooms]):.3g}" for rooms in (source, drawn))


def markdown(columns: Sequence[tuple[str, Column]]) -> str:
    """Return the columns as a table in Markdown."""
    lines = [f"| | {' | '.join(name for name, _ in columns)} |", f"|---|{'---|' * len(columns)}"]
    lines += [f"| {row} | {' | '.join(found[row] for _, found in columns)} |" for row in columns[0][1]]
    return "\n".join(lines)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m benchmarks.sources_bench")
    parser.add_argument("layouts", type=Path, nargs="+")
    parser.add_argument("--room", default="bedroom")
    parser.add_argument("--rooms", type=int, default=100)
    parser.add_argument("--corrections", type=int, default=2)
    given = parser.parse_args()
    table = [(path.stem, column(path, given.room, given.rooms, given.corrections)) for path in given.layouts]
    sys.stdout.write(markdown(table) + "\n")
