"""Drafts: the objects of a derivation while their address terminals are drawn, and what an address can point to.

An address terminal draws its target among what this room holds; ``within`` narrows that to one copy of a unit.  A corner of the room is a
target like a door or a window.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from grammar.derivation.parse_tree import Attribute, Pinned, attribute_node
from grammar.derivation.structure import Vertex
from grammar.geometry.walls import ALONG_X, ALONG_Y, REFLEX, START_X, START_Y, WALL_YAW, wall_lengths, wall_rows
from grammar.spec.categories import Categories
from grammar.spec.object_rules import CORNER, NONE, ObjectRule
from grammar.spec.room_rules import OPENINGS
from scene_description import Opening, ParseNode, Room

Size = tuple[float, float, float]

_SQUARE = 0.5
"""Greatest cosine of the angle between two walls that make a corner something can stand in."""

_CORNER_MARGIN_M = 0.15
_STRAIGHT_RAD = 0.1


class Corner(NamedTuple):
    """A corner of the room that points outwards: number of its vertex, place, yaw of the wall that begins there."""

    vertex: int
    x_m: float
    y_m: float
    yaw_rad: float


@dataclass(slots=True, kw_only=True)
class Draft:
    """One object while its addresses are drawn.

    ``behind_m`` is how far its back stands off the line of its row.
    ``units`` maps the symbols of the nodes above it to the nearest vertex of each.  ``core`` is what its address points to.
    ``mode`` is the number of the mode around the core that is its own.  ``carries`` is whether something may hang in line above it,
    ``beside`` the units beside it in its row.  ``drawn_axes`` are the axes whose size was drawn from the rule's mixture.  ``below`` are the
    nodes of the parse tree below its terminal.  ``loaded_m`` is how high it may be with what stands on it, 0 below a flat ceiling.
    """

    id: int
    symbol: str
    rule: ObjectRule
    size_m: Size
    units: Mapping[str, int]
    pinned: Pinned | None = None
    bottom_m: float = 0.0
    loaded_m: float = 0.0
    behind_m: float = 0.0
    core: int | None = None
    mode: int | None = None
    drawn_axes: tuple[int, ...] = (0, 1, 2)
    ties_resolved: bool = False
    carries: bool = False
    beside: tuple[int, ...] = ()
    below: list[ParseNode] = field(default_factory=list)

    def note(self, name: str, value: str, log_probability: float) -> None:
        """Write down an attribute that was drawn."""
        self.below.append(attribute_node(Attribute(name, value, log_probability), self.id))


class Context(NamedTuple):
    """What addresses can point to: objects and openings by id, and corners, whose ids count on from ``first_corner``."""

    categories: Categories
    room: Room
    drafts: Mapping[int, Draft]
    openings: Mapping[int, Opening]
    corners: tuple[Corner, ...]
    first_corner: int

    def symbol_of(self, target: int) -> str:
        """Return the symbol under which a rule names a target."""
        if target >= self.first_corner:
            return CORNER
        return self.openings[target].category if target in self.openings else self.drafts[target].symbol


def units_above(structure: Sequence[Vertex], index: int) -> dict[str, int]:
    """Return the symbols of the nodes above a vertex and the nearest vertex of each."""
    found: dict[str, int] = {}
    parent = structure[index].parent
    while parent >= 0:
        found.setdefault(structure[parent].symbol, parent)
        parent = structure[parent].parent
    return found


def corners_of(room: Room) -> tuple[Corner, ...]:
    """Return the corners in which something can stand: those that point outwards and are nearly square."""
    wall = wall_rows(room.polygon_m)
    before = np.roll(wall, 1, 0)
    turn = before[:, ALONG_X] * wall[:, ALONG_X] + before[:, ALONG_Y] * wall[:, ALONG_Y]
    return tuple(
        Corner(w, float(wall[w, START_X]), float(wall[w, START_Y]), float(wall[w, WALL_YAW]))
        for w in range(len(wall))
        if not wall[w, REFLEX] and abs(turn[w]) < _SQUARE
    )


def targets_of(symbol: str, draft: Draft, context: Context) -> list[int | None]:
    """Return the ids of what an address of an object can point to under one symbol; None stands for no target."""
    if symbol == NONE:
        return [None]
    if symbol in OPENINGS:
        least = draft.rule.low_m[1] if draft.rule.mount == "wall" else 0.0
        lengths = wall_lengths(context.room.polygon_m)
        return [key for key, opening in context.openings.items() if opening.category == symbol and lengths[opening.wall] > least]
    if symbol == CORNER:
        return [context.first_corner + k for k, corner in enumerate(context.corners) if _is_free(corner, draft, context)]
    found = [key for key, other in context.drafts.items() if other.symbol == symbol]
    unit = draft.rule.within
    if unit is not None:
        own = [key for key in found if context.drafts[key].units.get(unit) == draft.units.get(unit)]
        return list(own or found)
    return list(found)


def _is_free(corner: Corner, draft: Draft, context: Context) -> bool:
    """Return whether a corner is no other object's and no opening is too close: a door, or a window that the object would cover."""
    if any(other.core == context.first_corner + context.corners.index(corner) for other in context.drafts.values()):
        return False
    lengths = wall_lengths(context.room.polygon_m)
    turns = {mode.orientation_rad for mode in draft.rule.around if not mode.of or CORNER in mode.of}
    straight = any(turn is not None and abs(turn) < _STRAIGHT_RAD for turn in turns)
    ways = (draft.size_m[1::-1], draft.size_m[:2]) if straight and None not in turns else ((max(draft.size_m[:2]),) * 2,)
    return any(_fits_corner(corner, draft, context.room.openings, lengths, way) for way in ways)


def _fits_corner(corner: Corner, draft: Draft, openings: Sequence[Opening], lengths: Sequence[float], reaches: Sequence[float]) -> bool:
    """Return whether an object that reaches so far along the wall that begins at a corner, and along that before, keeps openings free."""
    for opening in openings:
        if opening.category == "window" and draft.size_m[2] <= opening.sill_m:
            continue
        end = lengths[opening.wall] - opening.offset_m - opening.width_m
        following = (opening.wall + 1) % len(lengths)
        if (opening.wall == corner.vertex and opening.offset_m < reaches[0] + _CORNER_MARGIN_M) or (
            following == corner.vertex and end < reaches[1] + _CORNER_MARGIN_M
        ):
            return False
    return True


def target_probabilities(
    weights: Mapping[str, float], draft: Draft, context: Context, allowed: Sequence[int] | None = None
) -> tuple[list[int | None], list[float]]:
    """Return the targets of an address in this room and their probabilities.

    The weight of a symbol is shared evenly by its objects, and the sum is normalised over what the room holds.

    ``allowed``: ids that count; None: all.
    """
    targets: list[int | None] = []
    shares: list[float] = []
    for symbol, weight in weights.items():
        found = [key for key in targets_of(symbol, draft, context) if allowed is None or key in allowed]
        if weight > 0.0:
            targets.extend(found)
            shares.extend(weight / len(found) for _ in found)
    return targets, [share / sum(shares) for share in shares]
