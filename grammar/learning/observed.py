"""Rooms as they were seen: what a grammar is learned from, in the program's own conventions.

Metres, radians, right-handed, z up, floor at z = 0.  An object's origin is the centre of its box's bottom face; at yaw 0 it looks along +x;
its size is (depth along its front, width, height).
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from scene_description.types import Point2


@dataclass(frozen=True, slots=True, kw_only=True)
class ObservedObject:
    """One object.

    ``category`` is one of ours; ``on`` the index of the object of the same room that it stands on, where that is known; ``name`` what the
    source calls it, where no category of ours is like it and ``category`` only says that it is furniture or a thing.
    """

    category: str
    size_m: tuple[float, float, float]
    position_m: tuple[float, float, float]
    yaw_rad: float
    on: int | None = None
    name: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class ObservedOpening:
    """A door or window: number of the wall that it is in, distance of its first end from that wall's start, size, height of its sill."""

    wall: int
    offset_m: float
    width_m: float
    height_m: float
    sill_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ObservedRoom:
    """One room with its counter-clockwise inner outline; ``house`` names what must not be split between learning and judging.

    ``openings``: by kind, "door" or "window"; a kind that is missing was not recorded.
    """

    id: str
    house: str
    room_type: str
    polygon_m: tuple[Point2, ...]
    height_m: float
    objects: tuple[ObservedObject, ...]
    openings: Mapping[str, tuple[ObservedOpening, ...]] = field(default_factory=dict)


def mixed(sources: Sequence[tuple[Sequence[ObservedRoom], float]]) -> list[ObservedRoom]:
    """Return the rooms of all sources such that a room of each counts in proportion to its weight.

    Of the source of greatest weight all rooms are taken, of the others the share that their weight is of that, in the order of the hashes
    of the rooms' names: which rooms these are depends on nothing else.
    """
    most = max((weight for _, weight in sources), default=1.0)
    kept: list[ObservedRoom] = []
    for rooms, weight in sources:
        count = round(len(rooms) * weight / most)
        digests = [hashlib.sha256(room.id.encode(errors="surrogatepass")).hexdigest() for room in rooms]
        order = sorted(zip(digests, range(len(rooms)), strict=True))
        chosen = [i for _, i in order[:count]]
        kept.extend(rooms[i] for i in sorted(chosen))
    return kept
