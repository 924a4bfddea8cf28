"""How far sampled rooms are from real ones: categories, gaps and turns at walls, and poses of things that belong together."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.stats import wasserstein_distance

from grammar import Grammar
from grammar.geometry.arrays import Floats
from grammar.learning import ObservedRoom
from grammar.learning.observed import box_gap, fitting_wall, half_extents, nearest_wall, relative_pose
from grammar.learning.truncation import category_kl, frequencies
from grammar.spec.energy_terms import ENERGY_TERMS
from grammar.spec.rules import MOVES

LEAST = 3
"""Fewer objects or pairs have no distance."""

PAIRS: Mapping[str, tuple[tuple[str, str], ...]] = {
    "bedroom": (("nightstand", "bed"), ("desk_chair", "desk"), ("television", "bed")),
    "living_room": (
        ("coffee_table", "sofa"),
        ("tv_stand", "sofa"),
        ("television", "sofa"),
        ("armchair", "coffee_table"),
        ("dining_chair", "dining_table"),
    ),
    "kitchen": (("dining_chair", "dining_table"), ("bar_stool", "dining_table"), ("sink_counter", "stove"), ("refrigerator", "stove")),
    "bathroom": (("toilet", "washbasin"), ("wall_mirror", "washbasin")),
    "hallway": (("wall_mirror", "shoe_rack"),),
}
"""Room type -> pairs of categories; the first is looked at in the frame of the nearest of the second."""


class Figures(NamedTuple):
    """Divergence of the categories in nats; 1-Wasserstein distances in metres and radians, means weighted by the real objects."""

    category_kl: float
    wall_distance_m: float
    wall_orientation_rad: float
    pair_gap_m: float
    pair_along_m: float
    pair_orientation_rad: float


UNITS = {
    "category_kl": ("category KL", "nat"),
    "wall_distance_m": ("gap to the nearest wall, W1", "m"),
    "wall_orientation_rad": ("turn to the wall that fits best, W1", "rad"),
    "pair_gap_m": ("pairs: gap, W1", "m"),
    "pair_along_m": ("pairs: place along the side, W1", "m"),
    "pair_orientation_rad": ("pairs: turn, W1", "rad"),
}


def compare(grammar: Grammar, known: Collection[str], real: Sequence[ObservedRoom], drawn: Sequence[ObservedRoom]) -> Figures:
    """Return how far ``drawn`` rooms are from ``real`` ones in the ``known`` categories; NaN where there is too little."""
    names = set(known)
    shares = [frequencies(Counter(thing.category for room in rooms for thing in room.objects), names) for rooms in (real, drawn)]
    walls = _distances(_walls(grammar, names, real), _walls(grammar, names, drawn), 2)
    pairs = _distances(*(pair_poses(PAIRS.get(grammar.room_type, ()), rooms) for rooms in (real, drawn)), 3)
    return Figures(category_kl(shares[0], shares[1]), *walls, *pairs)


def _walls(grammar: Grammar, names: Collection[str], rooms: Sequence[ObservedRoom]) -> dict[str, Floats]:
    """Return category -> (n, 2) gap to the nearest wall, absolute turn to the one that fits best, of what stands and has a front."""
    rules = [rule for rule in grammar.objects.values() if rule.mount == "floor"]
    standing = {rule.category for rule in rules if any(mode.orientation_rad is not None for mode in (*rule.wall, *rule.around))}
    found: dict[str, list[tuple[float, float]]] = {name: [] for name in sorted(standing & set(names))}
    for room in rooms:
        for thing in room.objects:
            if thing.category in found:
                nearest, fitting = nearest_wall(room.polygon_m, thing), fitting_wall(room.polygon_m, thing)
                if nearest is not None and fitting is not None:
                    found[thing.category].append((nearest.gap_m, abs(fitting.turn_rad)))
    return {name: np.array(items, np.float64).reshape(-1, 2) for name, items in found.items()}


def pair_poses(pairs: Sequence[tuple[str, str]], rooms: Sequence[ObservedRoom]) -> dict[str, Floats]:
    """Return pair -> (n, 3): gap at the side where the first is, its place along that side, absolute relative yaw.

    The gap is below zero where one reaches under or into the other.  At the front and back the place is the distance from the middle, at
    the other sides that between the planes of both backs.
    """
    found: dict[str, list[tuple[float, float, float]]] = {f"{a}-{b}": [] for a, b in pairs}
    for room in rooms:
        for a, b in pairs:
            others = [thing for thing in room.objects if thing.category == b]
            for thing in room.objects:
                if thing.category == a and others:
                    core = min(others, key=lambda other: box_gap(thing, other))
                    place = relative_pose(thing, core)
                    half_d, half_w = half_extents(thing.size_m, place.turn_rad)
                    ahead, aside = abs(place.x_m) - half_d - 0.5 * core.size_m[0], abs(place.y_m) - half_w - 0.5 * core.size_m[1]
                    along = abs(place.y_m) if ahead >= aside else place.x_m - half_d + 0.5 * core.size_m[0]
                    found[f"{a}-{b}"].append((max(ahead, aside), along, abs(place.turn_rad)))
    return {name: np.array(items, np.float64).reshape(-1, 3) for name, items in found.items()}


def _distances(real: Mapping[str, Floats], drawn: Mapping[str, Floats], columns: int) -> tuple[float, ...]:
    """Return the mean over kinds, weighted by the real items, of the distance of each column."""
    total, sums = 0, np.zeros(columns)
    for name, items in real.items():
        if min(len(items), len(drawn[name])) >= LEAST:
            total += len(items)
            sums += len(items) * np.array([wasserstein_distance(items[:, k], drawn[name][:, k]) for k in range(columns)])
    return tuple((sums / total).tolist()) if total else (math.nan,) * columns


def by_chance(grammar: Grammar) -> Grammar:
    """Return a grammar whose rooms have the same objects at uniform places that are valid; nobody has to be able to use them."""
    weights = replace(grammar.weights, **{name: 0.0 for name, term in ENERGY_TERMS.items() if term.kind != "hard"})
    still = dict.fromkeys(MOVES, 0.0) | {"translate": 0.25, "rotate": 0.15, "repoint": 0.1, "relocate": 0.5}
    moves = replace(grammar.moves, relocate_uniform=1.0, relocate_wall=0.0, relocate_around=0.0, **still)
    objects = {symbol: replace(rule, access=(), reach_any=(), view_depth_m=0.0) for symbol, rule in grammar.objects.items()}
    budget = replace(grammar.budget, structures=200)
    return replace(
        grammar, weights=weights, moves=moves, objects=objects, budget=budget, validity=replace(grammar.validity, walkable_share=0.0)
    )
