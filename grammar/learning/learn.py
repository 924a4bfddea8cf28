"""Observed rooms and a base grammar -> a learned grammar: structure, sizes, relations, then the weights of the energy."""

import hashlib
import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from grammar.derivation.openings import COUNT
from grammar.learning.assign import AssignedRoom, assign
from grammar.learning.beside import with_neighbours
from grammar.learning.branching import learn_branching
from grammar.learning.choices import SampledCounts, count_room
from grammar.learning.contrastive import ContrastiveOptions, CurveRow, learn_weights
from grammar.learning.graph import completed
from grammar.learning.observed import ObservedRoom
from grammar.learning.openings import fitted_to_openings, learn_openings
from grammar.learning.relations import LearnShares, is_sound, learn_object
from grammar.learning.sizes import learn_room
from grammar.learning.truncation import RoomSampler, TruncationOptions, TruncationRow, correct_truncation
from grammar.learning.unit_rows import learn_unit_rows, with_even_heights
from grammar.spec.categories import Categories
from grammar.spec.rules import Budget, Grammar, GrammarError

Part = Literal["sizes", "relations", "openings", "room", "weights"]
PARTS: tuple[Part, ...] = ("sizes", "relations", "openings", "room", "weights")

_LEAST_ROOMS = 5
_STRUCTURES, _LAYOUTS, _ROUNDS, _DERIVATIONS = 160, 1, 1, 20_000
_STARTS = 60
"""Poses tried for an object that comes in: real rooms leave little space for it."""

_POOLED = 5.0
_BESIDE = 0.5
"""Learned places are as tight as those of the data, and what has some around a core and at walls is proposed where both hold."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LearnOptions:
    """How to learn.

    ``alpha``: pseudo-counts with which the base grammar smooths every count, size and address; ``least``: a size or relation that was seen
    fewer times than this stays as in the base; numbers are learned of every category that the source records in any room type.  ``pooled``:
    pseudo-counts with which other room types of the source speak about sizes and places of an object, so that they decide where there are
    few observations.  ``keep``: parts that stay as in the base altogether.
    """

    alpha: float = 2.0
    least: int = 3
    pooled: float = _POOLED
    keep: frozenset[Part] = frozenset()
    contrastive: ContrastiveOptions = field(default_factory=ContrastiveOptions)
    truncation: TruncationOptions = field(default_factory=TruncationOptions)


@dataclass(frozen=True, slots=True, kw_only=True)
class LearnedGrammar:
    """A learned grammar, and the data behind it.

    ``counts``: path of a learned part -> number of observations behind it (for nodes: expected); every other number is the base's.
    ``unmatched``: categories in the rooms that match no object of the grammar, or none of nearly that size, with their numbers.
    """

    grammar: Grammar
    rooms: int
    objects: int
    counts: Mapping[str, float]
    unmatched: Mapping[str, int]
    unsound: Mapping[str, int]
    """Category -> number of objects whose size was left out, under half or beyond twice of what its symbol may have."""
    added: Mapping[str, int]
    """Symbols that the base lacks -> number of objects that asked for them."""
    weight_rooms: int
    curve: tuple[CurveRow, ...]
    wanted: Mapping[str, float]
    """Category -> mean number in a room of the data, over everything that was observed."""
    truncation_curve: tuple[TruncationRow, ...]


def split_houses(rooms: Sequence[ObservedRoom], share: float, fold: int = 0) -> tuple[tuple[ObservedRoom, ...], tuple[ObservedRoom, ...]]:
    """Return rooms to learn from and rooms held out.

    Held out are all rooms of a ``share`` of the houses, which are taken in the order of the hashes of their names.

    Folds 0, 1, ... hold out one such share after the other, for cross-validation.
    """
    houses = sorted({room.house for room in rooms}, key=lambda house: hashlib.sha256(house.encode(errors="surrogatepass")).hexdigest())
    count = math.ceil(share * len(houses) - 1e-9)
    held = set(houses[fold * count : (fold + 1) * count])
    return tuple(room for room in rooms if room.house not in held), tuple(room for room in rooms if room.house in held)


def learn(
    grammar: Grammar,
    categories: Categories,
    rooms: Sequence[ObservedRoom],
    options: LearnOptions,
    rng: np.random.Generator,
    sampler: RoomSampler | None = None,
    elsewhere: Sequence[ObservedRoom] = (),
    told: Callable[[str], None] = lambda _: None,
) -> LearnedGrammar:
    """Learn from rooms of one type; equal inputs and an equal state of ``rng`` give an equal grammar.

    ``sampler`` samples the rooms that correct for truncation, by default one after the other with :func:`room_sampler`; ``elsewhere`` are
    rooms of other types that share their sizes and places; ``told`` hears what is learned next: graph, numbers, weights, corrections.

    Raises:
        GrammarError: there are fewer than five rooms with objects that the grammar knows.
    """
    # give the graph what it lacks, and match the observed objects with the grammar's
    told("graph")
    grammar, added = completed(grammar, categories, rooms, options.least, "sizes" in options.keep)
    assigned = [assign(grammar, room, "sizes" in options.keep) for room in rooms]
    _check_furnished(grammar.room_type, assigned)
    recorded = {item.category for room in (*rooms, *elsewhere) for item in room.objects}
    covered = {symbol for symbol, rule in grammar.objects.items() if rule.category in recorded}
    # learn structure, sizes and relations
    told("numbers")
    others = [assign(grammar, room, True) for room in elsewhere] if options.pooled > 0.0 else []
    related, counts = _learn_rules(grammar, categories, assigned, others, covered, options)
    # learn the weights of the energy
    told("weights")
    contrastive = replace(options.contrastive, iterations=0) if "weights" in options.keep else options.contrastive
    weights = learn_weights(related, categories, assigned, contrastive, rng)
    counts.update({f"weights.{name}": weights.rooms for name in weights.learned})
    # correct the structure for rooms that find no valid layout
    told("corrections")
    wanted = _wanted(grammar, rooms, covered)
    seed = int(rng.integers(2**62))
    numbers = {f"{kind}{COUNT}" for kind in related.openings if f"openings.{kind}.multiplicity" in counts}
    if options.truncation.iterations:
        counts.update({f"room.{kind}_share_max": options.truncation.rooms for kind in ("used", "wall")})
    final, truncation = correct_truncation(
        replace(related, weights=weights.weights), wanted, covered | numbers, options.truncation, sampler or room_sampler(categories, seed)
    )
    return LearnedGrammar(
        grammar=final,
        rooms=len(assigned),
        objects=sum(len(room.objects) for room in assigned),
        counts=counts,
        unmatched=Counter(item.category for room in assigned for item, _ in room.left_over),
        unsound=_unsound(grammar, assigned),
        added=added,
        weight_rooms=weights.rooms,
        curve=weights.curve,
        wanted=wanted,
        truncation_curve=truncation,
    )


def _unsound(grammar: Grammar, rooms: Sequence[AssignedRoom]) -> Mapping[str, int]:
    items = (item for room in rooms for item in room.objects)
    return Counter(item.seen.category for item in items if not is_sound(grammar.objects[item.symbol], item.seen.size_m))


def _check_furnished(room_type: str, assigned: Sequence[AssignedRoom]) -> None:
    furnished = sum(bool(room.objects) for room in assigned)
    if furnished < _LEAST_ROOMS:
        raise GrammarError(
            f"layouts: expected at least {_LEAST_ROOMS} rooms of type '{room_type}' with objects that the grammar knows, "
            f"got {furnished} of {len(assigned)}; give more files, or check room types and categories in the category map"
        )


def _wanted(grammar: Grammar, rooms: Sequence[ObservedRoom], covered: AbstractSet[str]) -> dict[str, float]:
    """Return the mean number of each category in a room, of those observed and those that the data records."""
    everything = Counter(item.category for room in rooms for item in room.objects)
    known = {grammar.objects[symbol].category for symbol in covered}
    return {name: everything[name] / len(rooms) for name in sorted(known | set(everything))}


def _learn_rules(
    grammar: Grammar,
    categories: Categories,
    assigned: Sequence[AssignedRoom],
    others: Sequence[AssignedRoom],
    covered: AbstractSet[str],
    options: LearnOptions,
) -> tuple[Grammar, dict[str, float]]:
    """Return the grammar with learned branching, objects, openings and room, and for each learned path the observations behind it."""
    counts: dict[str, float] = {}
    branching = learn_branching(grammar, [[item.symbol for item in room.objects] for room in assigned], covered, options.alpha)
    counts.update({f"nodes.{name}": count for name, count in branching.counts.items()})
    objects = dict(grammar.objects)
    for symbol in grammar.objects:
        objects[symbol], found = learn_object(
            grammar, categories, symbol, assigned, others, LearnShares(options.alpha, options.pooled, options.least), options.keep
        )
        counts.update({f"objects.{symbol}.{name}": count for name, count in found.items()})
    nodes = dict(branching.nodes)
    if "sizes" not in options.keep:
        objects = with_even_heights(grammar.objects, objects)
        related = learn_unit_rows(replace(grammar, nodes=nodes, objects=objects), assigned, counts, options.alpha)
        nodes, objects = dict(related.nodes), dict(related.objects)
    openings = dict(grammar.openings)
    if "openings" not in options.keep:
        openings, found = learn_openings(grammar.openings, [room.room for room in assigned], options.alpha, _LEAST_ROOMS)
        counts.update({f"openings.{name}": count for name, count in found.items()})
        objects = fitted_to_openings(objects, openings)
    shape = grammar.room
    if "room" not in options.keep:
        shape = learn_room(
            grammar.room, [room.room for room in assigned], [_covered_floor(grammar, categories, room) for room in assigned], options.alpha
        )
        names = ("width_m", "depth_m", "height_m", "area_low_m2", "area_high_m2", "floor_share_max", "shapes", "sizes")
        counts.update({f"room.{name}": len(assigned) for name in names})
    budget = _patient(grammar.budget)
    moves = replace(grammar.moves, relocate_beside=max(grammar.moves.relocate_beside, _BESIDE))
    schedule = replace(grammar.schedule, starts=max(grammar.schedule.starts, _STARTS))
    learned = replace(grammar, room=shape, openings=openings, nodes=nodes, objects=objects, moves=moves, schedule=schedule, budget=budget)
    if "relations" not in options.keep:
        learned, found = with_neighbours(learned, categories, assigned, options.alpha)
        counts.update(found)
    return learned, counts


def room_sampler(categories: Categories, seed: int) -> RoomSampler:
    """Return a sampler whose rooms depend on the seed, the stream and the index of the room only."""

    def sample(grammar: Grammar, stream: int, indices: Sequence[int]) -> list[SampledCounts]:
        return [count_room(grammar, categories, np.random.default_rng([seed, stream, index])) for index in indices]

    return sample


def _patient(budget: Budget) -> Budget:
    """Return a budget of more structures with fewer layouts of each.

    Real rooms are small and full, many structures fit into none, and probabilities are corrected for those that are rejected.
    """
    return replace(
        budget,
        structures=max(budget.structures, _STRUCTURES),
        layouts=_LAYOUTS,
        rounds=_ROUNDS,
        derivations=max(budget.derivations, _DERIVATIONS),
    )


def _covered_floor(grammar: Grammar, categories: Categories, room: AssignedRoom) -> float:
    """Return the area in square metres that furniture stands on, counted as derivations count it."""
    rules = ((item, grammar.objects[item.symbol]) for item in room.objects)
    return sum(t.seen.size_m[0] * t.seen.size_m[1] for t, rule in rules if rule.mount == "floor" and not categories[rule.category].underlay)
