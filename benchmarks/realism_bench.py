"""Realism: statistics of rooms sampled from the hand-written and from the learned grammar against real rooms that were held out.

python -m benchmarks.realism_bench LAYOUTS.jsonl [--rooms N]

Five-fold cross-validation by house: each fold's grammar is learned from four fifths of the houses and judged by the rest; figures are means
over the folds.  The real rooms that were learned from stand beside them: what a perfect learner could be expected to reach.
"""

from __future__ import annotations

import argparse
import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.stats import wasserstein_distance

from benchmarks.table import Row, render_table
from grammar import Categories, Grammar, SceneRequest, read_categories, read_room_type, sample_room
from grammar.learning import LearnOptions, ObservedRoom, learn, read_category_map, read_layouts, split_houses
from grammar.learning.assign import assign
from grammar.learning.geometry import fitting_wall, in_frame, nearest_wall
from grammar.learning.write_layouts import layout_from_objects
from scene_description.share import config_path

ROOM_TYPE = "bedroom"
ROOMS = 100
FOLDS = 5
SHARE = 0.2
LEAST = 3


class Figures(NamedTuple):
    """How far rooms are from the held-out ones; metres and radians are 1-Wasserstein distances."""

    category_kl: float
    wall_distance_m: float
    wall_orientation_rad: float
    pair_gap_m: float
    pair_along_m: float
    pair_orientation_rad: float


UNITS = {
    "category_kl": ("category KL", "nat"),
    "wall_distance_m": ("distance to the nearest wall, W1", "m"),
    "wall_orientation_rad": ("orientation to the wall that fits best, W1", "rad"),
    "pair_gap_m": ("nightstand beside bed: gap, W1", "m"),
    "pair_along_m": ("nightstand beside bed: backs apart, W1", "m"),
    "pair_orientation_rad": ("nightstand beside bed: orientation, W1", "rad"),
}


def measure(layouts: Path | None = None, rooms: int = ROOMS) -> list[Row]:
    """Compare; without layouts, which do not come with the program, one row says that nothing was compared."""
    if layouts is None:
        return [Row("not measured: give a file, python -m benchmarks.realism_bench LAYOUTS.jsonl", 0.0, "rooms")]
    categories = read_categories(config_path("categories.yaml"))
    base = read_room_type(ROOM_TYPE, categories)
    seen = read_layouts(layouts, read_category_map(config_path("learning/category_map.yaml")), ROOM_TYPE).rooms
    unlearned = _sampled(base, categories, rooms, 0)
    sums: dict[str, list[Figures]] = {"unlearned": [], "learned": [], "real, learned from": []}
    for fold in range(FOLDS):
        taught, held = split_houses(seen, SHARE, fold)
        learned = learn(base, categories, taught, LearnOptions(), np.random.default_rng([1, fold])).grammar
        known = {name for name, count in Counter(thing.category for room in taught for thing in room.objects).items() if count >= LEAST}
        known &= {rule.category for rule in base.objects.values()}
        for name, drawn in (
            ("unlearned", unlearned),
            ("learned", _sampled(learned, categories, rooms, fold + 1)),
            ("real, learned from", taught),
        ):
            sums[name].append(compare(base, known, held, drawn))
    rows = [Row(f"{ROOM_TYPE}s in the file, of which a fifth is held out", float(len(seen)), "rooms")]
    for index, (label, unit) in enumerate(UNITS.values()):
        rows.extend(Row(f"{label}; {name}", float(np.nanmean([f[index] for f in figures])), unit) for name, figures in sums.items())
    return rows


def _sampled(grammar: Grammar, categories: Categories, count: int, stream: int) -> list[ObservedRoom]:
    found = []
    for index in range(count):
        room = sample_room(grammar, categories, SceneRequest(room_type=ROOM_TYPE), np.random.default_rng([7, stream, index]))
        found.append(layout_from_objects(f"{stream}-{index}", ROOM_TYPE, room.room, room.objects))
    return found


def compare(grammar: Grammar, known: Iterable[str], real: Sequence[ObservedRoom], drawn: Sequence[ObservedRoom]) -> Figures:
    """Return how far ``drawn`` rooms are from ``real`` ones in the ``known`` categories; NaN where there are too few pairs."""
    names = set(known)
    walls_real, walls_drawn = _walls(grammar, names, real), _walls(grammar, names, drawn)
    pairs_real, pairs_drawn = _pairs(grammar, real), _pairs(grammar, drawn)
    pairs = (
        [wasserstein_distance(a, b) for a, b in zip(pairs_real.T, pairs_drawn.T, strict=True)]
        if min(len(pairs_real), len(pairs_drawn)) >= LEAST
        else [math.nan] * 3
    )
    return Figures(
        category_kl(_frequencies(names, real), _frequencies(names, drawn)), *_mean_distances(walls_real, walls_drawn), *map(float, pairs)
    )


def category_kl(p: Mapping[str, float], q: Mapping[str, float]) -> float:
    """Return ``sum p (log(p + 1e-6) - log(q + 1e-6))`` (ATISS, Paschalidou et al., NeurIPS 2021)."""
    return sum(value * (math.log(value + 1e-6) - math.log(q.get(name, 0.0) + 1e-6)) for name, value in p.items())


def _frequencies(names: set[str], rooms: Sequence[ObservedRoom]) -> dict[str, float]:
    counts = Counter(thing.category for room in rooms for thing in room.objects if thing.category in names)
    return {name: counts[name] / sum(counts.values()) for name in sorted(names)}


def _walls(grammar: Grammar, names: set[str], rooms: Sequence[ObservedRoom]) -> dict[str, list[tuple[float, float]]]:
    """Return category -> (gap to the nearest wall, absolute turn to the one that fits best) of what stands and has a front."""
    rules = [rule for rule in grammar.objects.values() if rule.mount == "floor"]
    standing = {rule.category for rule in rules if any(mode.orientation_rad is not None for mode in (*rule.wall, *rule.around))} & names
    found: dict[str, list[tuple[float, float]]] = {name: [] for name in sorted(standing)}
    for room in rooms:
        for thing in room.objects:
            if thing.category in standing:
                nearest, fitting = nearest_wall(room.polygon_m, thing), fitting_wall(room.polygon_m, thing)
                if nearest is not None and fitting is not None:
                    found[thing.category].append((nearest.gap_m, abs(fitting.turn_rad)))
    return found


def _mean_distances(
    real: Mapping[str, Sequence[tuple[float, float]]], drawn: Mapping[str, Sequence[tuple[float, float]]]
) -> tuple[float, float]:
    """Return the mean over categories, weighted by the real objects, of the distances of gaps and turns."""
    total, gap, turn = 0, 0.0, 0.0
    for name, items in real.items():
        if min(len(items), len(drawn[name])) >= LEAST:
            a, b = np.array(items), np.array(drawn[name])
            total += len(items)
            gap += len(items) * float(wasserstein_distance(a[:, 0], b[:, 0]))
            turn += len(items) * float(wasserstein_distance(a[:, 1], b[:, 1]))
    return (gap / total, turn / total) if total else (math.nan, math.nan)


def _pairs(grammar: Grammar, rooms: Sequence[ObservedRoom]) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """Return (n, 3) of nightstands beside beds: gap at the side, distance between the planes of their backs, absolute relative yaw."""
    rows = []
    for room in rooms:
        assigned = assign(grammar, room)
        for thing in assigned.objects:
            if thing.seen.category == "nightstand" and thing.core is not None:
                bed = assigned.objects[thing.core].seen
                place = in_frame(thing.seen, bed)
                gap = abs(place.y_m) - 0.5 * bed.size_m[1] - 0.5 * thing.seen.size_m[1]
                backs = (place.x_m - 0.5 * thing.seen.size_m[0]) - (-0.5 * bed.size_m[0])
                rows.append((gap, backs, abs(place.turn_rad)))
    return np.array(rows, np.float64).reshape(-1, 3)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m benchmarks.realism_bench")
    parser.add_argument("layouts", type=Path, nargs="?")
    parser.add_argument("--rooms", type=int, default=ROOMS)
    arguments = parser.parse_args()
    print(render_table("Realism", measure(arguments.layouts, arguments.rooms)))
