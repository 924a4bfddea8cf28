"""Which split a room belongs to: in even shares of every room type, and without regard to what other rooms there are.

A room is the triple of its type, the seed of its run and its index in the run: the same triple is the same room, wherever it is found.  In
a run the types go in turn, so the rooms of one type stand at even distances, and a room's number among them is its index over that
distance.  Room ``k`` of a type and run takes the point ``frac(phase + k a)`` of the additive recurrence with the golden ratio ``a``
(Niederreiter, *Random Number Generation and Quasi-Monte Carlo Methods*, 1992, chapter 3), whose points fill [0, 1) more evenly than
random ones, and the splits are intervals of [0, 1).  The phase is a hash of type, run and the split's own seed.  The distance is the
number of types in the run, or what the indices of its rooms of one type tell together, where that is no multiple of it; so adding rooms, at
the end or in between, moves none once a room of every type is there.
"""

import hashlib
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import NamedTuple

from scene_description import SceneSynthError
from scene_description.strict import whole_number

STEP = 0.618_033_988_749_894_9
"""The golden ratio's fractional part: of all numbers the worst to approximate by fractions."""
_NAME_CHARACTERS = frozenset("abcdefghijklmnopqrstuvwxyz0123456789_-")


class SplitError(SceneSynthError):
    """Words of a split, or a source, that cannot be used; one line."""


@dataclass(frozen=True, order=True, slots=True)
class RoomKey:
    """What makes a room the room it is: type, seed of the run, index in the run."""

    room_type: str
    seed: int
    index: int

    @property
    def run(self) -> tuple[str, int]:
        """The rooms of its type in its run."""
        return self.room_type, self.seed


class Shares(NamedTuple):
    """Split -> share of the rooms, and the seed that draws another assignment."""

    of: Mapping[str, float]
    seed: int = 0


class Ranges(NamedTuple):
    """Split -> indices of rooms in their run, first and one past the last; rooms in none are left out."""

    of: Mapping[str, tuple[int, int]]


def assign(keys: Iterable[RoomKey], rule: Shares | Ranges) -> dict[RoomKey, str | None]:
    """Return the split of each room; None where no range holds it."""
    rooms = sorted(set(keys))
    types: dict[int, set[str]] = {}
    apart: dict[int, int] = {}
    for key in rooms:
        types.setdefault(key.seed, set()).add(key.room_type)
    for before, after in pairwise(rooms):
        if before.run == after.run:
            apart[after.seed] = math.gcd(apart.get(after.seed, 0), after.index - before.index)
    distance = {seed: len(names) if apart.get(seed, 0) % len(names) == 0 else apart[seed] for seed, names in types.items()}
    if isinstance(rule, Ranges):
        return {key: _in_range(key.index, rule) for key in rooms}
    numbers = {key: key.index // distance[key.seed] for key in rooms}
    return {key: _in_share(room_point(key, numbers[key], rule.seed), rule) for key in rooms}


def room_point(key: RoomKey, number: int, seed: int) -> float:
    """Return the point in [0, 1) of a room, the ``number``-th of its type and run."""
    digest = hashlib.sha256(f"{seed}/{key.room_type}/{key.seed}".encode()).digest()
    phase = int.from_bytes(digest[:8], "big") / 2**64
    return math.fmod(phase + math.fmod(number * STEP, 1.0), 1.0)


def _in_share(point: float, rule: Shares) -> str:
    bound = 0.0
    for name, share in rule.of.items():
        bound += share
        if point < bound:
            return name
    return list(rule.of)[-1]


def _in_range(index: int, rule: Ranges) -> str | None:
    return next((name for name, (first, end) in rule.of.items() if first <= index < end), None)


def read_shares(words: str, seed: int = 0) -> Shares:
    """Read ``train=0.8,val=0.1,test=0.1``.

    Raises:
        SplitError: a name or a number does not fit, or the shares do not add up to 1.
    """
    shares: dict[str, Fraction] = {}
    for name, value in _pairs("--shares", words).items():
        try:
            share = Fraction(value)
        except (ValueError, ZeroDivisionError):
            raise SplitError(f"--shares {words}: {name}: expected a number above 0, got '{value}'") from None
        if not 0 < share <= 1:
            raise SplitError(f"--shares {words}: {name}: expected a number above 0 and at most 1, got {value}")
        shares[name] = share
    total = sum(shares.values(), Fraction(0))
    if abs(total - 1) > Fraction(1, 1000):
        raise SplitError(f"--shares {words}: expected shares that add up to 1, got {float(total):g}; change one of them")
    return Shares({name: float(share) for name, share in shares.items()}, seed)


def read_ranges(words: str) -> Ranges:
    """Read ``train=0:800,val=800:900``.

    Raises:
        SplitError: a name or a range does not fit, or two ranges share a room.
    """
    ranges = {}
    for name, value in _pairs("--ranges", words).items():
        first, last = (whole_number(end) for end in value.partition(":")[::2])
        if first is None or last is None or first >= last:
            raise SplitError(f"--ranges {words}: {name}: expected FIRST:END, indices of rooms with FIRST before END, got '{value}'")
        ranges[name] = (first, last)
    ordered = sorted(ranges.items(), key=lambda item: item[1])
    for (one, (_, end)), (other, (next_first, _)) in pairwise(ordered):
        if next_first < end:
            raise SplitError(f"--ranges {words}: expected a room in one split, got room {next_first} in {one} and {other}")
    return Ranges(ranges)


def _pairs(option: str, words: str) -> dict[str, str]:
    pairs: dict[str, str] = {}
    for word in words.split(","):
        name, equals, value = word.partition("=")
        if not equals or not name or not set(name) <= _NAME_CHARACTERS or name in pairs:
            raise SplitError(f"{option} {words}: expected NAME=VALUE with names of their own (a-z 0-9 _ -), got '{word}'")
        pairs[name] = value
    return pairs
