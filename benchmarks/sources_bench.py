"""What sources of rooms teach: rooms and objects, what is left out, what learning costs, and how near the learned rooms come.

python -m benchmarks.sources_bench LAYOUTS.jsonl[:WEIGHT] [MORE.jsonl[:WEIGHT] ...] [--types TYPE ...] [--rooms N] [--corrections N]
                                   [--mixed] [--shipped] [--workers N] [--write]

Each source teaches a grammar of its own from all of its rooms of each type, with the defaults of ``scene_synth learn``, and N rooms are
sampled from it.  A table for each type has a column for each source that has at least five such rooms; ``--mixed`` adds the sources
together, with their weights, ``--shipped`` the grammar of ``config/learned``.  The last lines say what all the learning took.
"""

import argparse
import multiprocessing
import sys
import time
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.table import DOCS, write_section
from grammar import Categories, Grammar, RequestError, SceneRequest, read_categories, read_room_type, room_types
from grammar.learning import LearnOptions, ObservedRoom, TruncationOptions, learn, mixed, read_category_map, read_layouts, room_sampler
from grammar.learning.observed import fitting_wall
from grammar.learning.truncation import category_kl, frequencies
from grammar.learning.write_layouts import layout_from_objects
from grammar.sampled_room import sample_room_with_cost
from grammar.spec.grammar_file import learned_types
from scene_description.polygons import signed_area_m2
from scene_description.share import config_path

SECTION = "sources"
"""Name of the part of docs/learning.md that ``--write`` renews."""
SHIPPED = "shipped"
LEAST_ROOMS = 5
ROWS = (
    "rooms",
    "objects",
    "objects left out",
    "symbols that the base lacks",
    "processor seconds: graph",
    "processor seconds: numbers",
    "processor seconds: weights",
    "processor seconds: corrections",
    "layouts for a room, median / p90",
    "rooms not to be had",
    "processor seconds for a room, p50 / p99",
    "KL over everything observed, nat",
    "area, m2: source / sampled",
    "objects a room: source / sampled",
    "gap to the wall, m: source / sampled",
)


class Source(NamedTuple):
    """Layout files with their weights under one name; none: the shipped grammars."""

    name: str
    files: tuple[tuple[Path, float], ...]


class Column(NamedTuple):
    """The figures of a source and a room type by row, the rooms it learned from, and processor seconds of learning."""

    source: str
    room_type: str
    rows: dict[str, str]
    rooms: int
    seconds: float


class Drawn(NamedTuple):
    """Sampled rooms with the layouts tried and the processor seconds of each, and how many were not to be had."""

    rooms: list[ObservedRoom]
    attempts: list[int]
    seconds: list[float]
    failed: int


def column(source: Source, room_type: str, rooms: int, options: LearnOptions) -> Column | None:
    """Learn from a source, sample, and return the figures; None if it has too few rooms of the type."""
    categories = read_categories(config_path("categories.yaml"))
    if not source.files:
        return Column(
            source.name, room_type, _sampled_rows(_sampled(read_room_type(room_type, categories, "learned"), categories, rooms)), 0, 0.0
        )
    names = replace(read_category_map(config_path("learning/category_map.yaml")), catalogue=frozenset(categories))
    files = [read_layouts(path, names, room_type) for path, _ in source.files]
    weights = [weight for _, weight in source.files]
    taught = mixed([(file.rooms, weight) for file, weight in zip(files, weights, strict=True)])
    if len(taught) < LEAST_ROOMS:
        return None
    others = [name for name in room_types() if name != room_type]
    elsewhere = [room for name in others for room in mixed([(read_layouts(path, names, name).rooms, w) for path, w in source.files])]
    left_out = sum(count for file in files for reason, count in file.reasons().items() if reason.startswith("object:"))
    stages: list[tuple[str, float]] = []
    base, rng = read_room_type(room_type, categories), np.random.default_rng(np.random.SeedSequence(1))
    sample_room_with_cost(base, categories, SceneRequest(room_type=room_type), np.random.default_rng(0))  # loads the kernels
    learned = learn(
        base,
        categories,
        taught,
        options,
        rng,
        room_sampler(categories, 1),
        elsewhere,
        lambda name: stages.append((name, time.process_time())),
    )
    ends = [*(began for _, began in stages[1:]), time.process_time()]
    spent = {name: end - began for (name, began), end in zip(stages, ends, strict=True)}
    drawn = _sampled(learned.grammar, categories, rooms)
    wanted, have = (Counter(item.category for room in found for item in room.objects) for found in (taught, drawn.rooms))
    objects = sum(len(room.objects) for file in files for room in file.rooms)
    rows = {
        "rooms": f"{len(taught)}",
        "objects": f"{sum(wanted.values())}",
        "objects left out": f"{left_out / max(left_out + objects, 1):.0%}",
        "symbols that the base lacks": f"{len(learned.added)}",
        **{f"processor seconds: {name}": f"{seconds:.1f}" for name, seconds in spent.items()},
        **_sampled_rows(drawn),
        "KL over everything observed, nat": f"{category_kl(frequencies(wanted, wanted), frequencies(have, wanted)):.3f}",
        "area, m2: source / sampled": _pair(taught, drawn.rooms, lambda room: signed_area_m2(room.polygon_m)),
        "objects a room: source / sampled": _pair(taught, drawn.rooms, lambda room: sum(item.category in wanted for item in room.objects)),
        "gap to the wall, m: source / sampled": _pair(taught, drawn.rooms, _wall_gap),
    }
    return Column(source.name, room_type, rows, len(taught), sum(spent.values()))


def _sampled(grammar: Grammar, categories: Categories, count: int) -> Drawn:
    drawn = Drawn([], [], [], 0)
    for index in range(count):
        began = time.process_time()
        try:
            request = SceneRequest(room_type=grammar.room_type)
            room, cost = sample_room_with_cost(grammar, categories, request, np.random.default_rng([7, index]))
        except RequestError:
            drawn = drawn._replace(failed=drawn.failed + 1)
            continue
        drawn.seconds.append(time.process_time() - began)
        drawn.attempts.append(cost.attempts)
        drawn.rooms.append(layout_from_objects(str(index), grammar.room_type, room.room, room.objects))
    return drawn


def _sampled_rows(drawn: Drawn) -> dict[str, str]:
    attempts, seconds = drawn.attempts or [0], drawn.seconds or [0.0]
    return {
        "layouts for a room, median / p90": f"{np.median(attempts):g} / {np.quantile(attempts, 0.9):.3g}",
        "rooms not to be had": f"{drawn.failed}",
        "processor seconds for a room, p50 / p99": f"{np.median(seconds):.2f} / {np.quantile(seconds, 0.99):.2f}",
    }


def _wall_gap(room: ObservedRoom) -> float:
    """Return the median gap to walls of what stands on the floor."""
    poses = [fitting_wall(room.polygon_m, item) for item in room.objects if item.position_m[2] < 0.1]
    return float(np.median([max(pose.gap_m, 0.0) for pose in poses if pose is not None] or [np.nan]))


def _pair(source, drawn, measure) -> str:  # type: ignore[no-untyped-def]
    return " / ".join(f"{np.nanmedian([measure(room) for room in rooms]):.3g}" for rooms in (source, drawn) if rooms)


def markdown(columns: Sequence[Column]) -> str:
    """Return the columns of one room type as a table in Markdown."""
    lines = [f"| {columns[0].room_type} | {' | '.join(found.source for found in columns)} |", f"|---|{'---|' * len(columns)}"]
    lines += [f"| {row} | {' | '.join(found.rows.get(row, '') for found in columns)} |" for row in ROWS]
    return "\n".join(lines)


def _source(text: str) -> tuple[Path, float]:
    """Return file and weight of ``FILE`` or ``FILE:WEIGHT``."""
    path, colon, weight = text.rpartition(":")
    return (Path(path), float(weight)) if colon and not Path(text).exists() else (Path(text), 1.0)


def main() -> None:
    """Print the tables, and what the learning took."""
    options = LearnOptions()
    parser = argparse.ArgumentParser(prog="python -m benchmarks.sources_bench")
    parser.add_argument("layouts", nargs="+", metavar="LAYOUTS.jsonl[:WEIGHT]")
    parser.add_argument("--types", nargs="+", default=["bedroom"], choices=room_types(), metavar="TYPE")
    parser.add_argument("--rooms", type=int, default=60, help="rooms sampled from each grammar (default: %(default)s)")
    parser.add_argument("--iterations", type=int, default=options.contrastive.iterations)
    parser.add_argument("--corrections", type=int, default=3)
    parser.add_argument("--correction-rooms", type=int, default=options.truncation.rooms)
    parser.add_argument("--mixed", action="store_true", help="add all sources together, with their weights")
    parser.add_argument("--shipped", action="store_true", help="add the learned grammars of config/")
    parser.add_argument("--workers", type=int, default=1, help="processes, each of which learns one grammar after the other")
    parser.add_argument("--write", action="store_true", help="renew the tables of docs/learning.md")
    given = parser.parse_args()
    files = [_source(text) for text in given.layouts]
    sources = [Source(path.stem, ((path, 1.0),)) for path, _ in files]
    if given.mixed:
        sources.append(Source(" + ".join(f"{weight:g} {path.stem}" for path, weight in files), tuple(files)))
    options = replace(
        options,
        contrastive=replace(options.contrastive, iterations=given.iterations),
        truncation=TruncationOptions(iterations=given.corrections, rooms=given.correction_rooms),
    )
    began = time.perf_counter()
    with ProcessPoolExecutor(given.workers, multiprocessing.get_context("spawn")) as pool:
        jobs = [
            pool.submit(column, source, room_type, given.rooms, options)
            for room_type in given.types
            for source in (*sources, *([Source(SHIPPED, ())] if given.shipped and room_type in learned_types() else []))
        ]
        found = [job.result() for job in jobs]
    wall = time.perf_counter() - began
    by_type = [[item for item in found if item is not None and item.room_type == name] for name in given.types]
    tables = "\n\n".join(markdown(columns) for columns in by_type if columns)
    taught = [item for item in found if item is not None and item.rooms]
    spent = sum(item.seconds for item in taught)
    total = f"{sum(item.rooms for item in taught)} rooms taught {len(taught)} grammars in {spent:.0f} processor seconds"
    sys.stdout.write(f"{tables}\n\n{total}; {wall:.0f} s by the clock in {given.workers} processes, sampling and starting included\n")
    if given.write:
        write_section(DOCS / "learning.md", SECTION, f"{tables}\n\n{total}.")


if __name__ == "__main__":
    main()
