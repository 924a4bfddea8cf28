"""The parse tree: what is in the room and how large, before anything has a pose.

Prose says *object*; code says ``item``, since ``object`` is a name of Python's own.
"""

from __future__ import annotations

from dataclasses import dataclass

from grammar.derivation.pinning import Pinned
from grammar.geometry.run_slots import Slot
from grammar.spec.object_rules import ObjectRule
from scene_description import ParseNode, Room


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
    """How far its back stands off the line of its run."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunPlan:
    """A run: its units' ids in the order of the walk, how many of them stand in each leg, and where it can stand.

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
    runs: tuple[RunPlan, ...] = ()
    """Objects that stand in rows; no object is in two of them."""
