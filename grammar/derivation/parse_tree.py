"""The parse tree: what is in the room and how large, before anything has a pose.

Prose says *object*; code says ``item``, since ``object`` is a name of Python's own.
"""

from dataclasses import dataclass
from typing import NamedTuple

from grammar.geometry.run_slots import Slot
from grammar.spec.object_rules import ObjectRule
from scene_description import ParseNode, Room


def attribute_node(attribute: "Attribute", identifier: int | None) -> ParseNode:
    """Return a drawn attribute as a node of the parse tree; ``identifier`` is the id of its object or opening, None for the room's."""
    return ParseNode(
        symbol=attribute.name, kind="attribute", choice=attribute.value, log_probability=attribute.log_probability, object=identifier
    )


class Pinned(NamedTuple):
    """Where an object stays.

    x_m, y_m, z_m: centre of its underside in the world; yaw_rad; wall: number of the wall that it hangs on; on: what it stands on; sized:
    whether the request gives its size.
    """

    x_m: float
    y_m: float
    z_m: float
    yaw_rad: float
    wall: int | None = None
    on: int | None = None
    sized: bool = False


class Attribute(NamedTuple):
    """A drawn attribute: name, value as text, log-probability or log-density."""

    name: str
    value: str
    log_probability: float


class RejectedError(Exception):
    """The derivation breaks the constraint that the text names; another one is drawn in its place."""


class UnfitFurnitureError(RejectedError):
    """The furniture covers another share of the floor than in rooms of the size drawn before it, or leaves too little of floor or walls."""


class BelowSlopesError(RejectedError):
    """A derivation is rejected for a sloped ceiling: none that was drawn for it has room for its doors, windows and furniture."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Item:
    """One object: a regular terminal of the And-Or graph with its size and its address terminals.

    ``id`` is its object id.  ``core`` is the id of the object, opening or corner that it is grouped with.  ``supporters`` are the ids of
    the objects that it may stand on, with ``supporter_log_probability``.  ``bottom_m`` is the height of its underside unless it stands on
    an object.
    """

    id: int
    symbol: str
    rule: ObjectRule
    size_m: tuple[float, float, float]
    core: int | None
    supporters: tuple[int, ...]
    supporter_log_probability: tuple[float, ...]
    bottom_m: float
    node: int
    """Index of its terminal in the parse tree's nodes."""
    supporter_node: int | None
    """Index of the address terminal that the layout fills in, for objects that stand on objects."""
    pinned: Pinned | None = None
    """Where it stays, if a request or a row says so."""
    behind_m: float = 0.0
    """How far its back stands off the line of its row."""


@dataclass(frozen=True, slots=True, kw_only=True)
class UnitRowPlan:
    """A unit row: its units' ids in the order of the walk, how many of them stand in each leg, and where it can stand.

    ``slot`` is the number of the slot, and ``slide_m`` the shift along it, in which it begins.
    """

    units: tuple[int, ...]
    legs: tuple[int, ...]
    wall_gap_m: float
    joint_m: float
    line_cost: float
    slots: tuple[Slot, ...]
    slot: int
    slide_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ParseTree:
    """A derivation: the shell of the room with its openings, the objects, and the choices in depth-first order.

    Openings have the ids 1, 2, ... and objects the ids after them.  The openings have no parts yet.  The addresses that point to supporters
    are still empty: the layout chooses among them.
    """

    room: Room
    items: tuple[Item, ...]
    nodes: tuple[ParseNode, ...]
    corners: tuple[tuple[float, float, float], ...] = ()
    """x, y and yaw of the room's corners that are cores of objects; their ids follow those of the objects."""
    unit_rows: tuple[UnitRowPlan, ...] = ()
    """Objects that stand in rows; no object is in two of them."""
