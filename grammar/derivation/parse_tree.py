"""One derivation of a grammar: what is in the room and how large, before anything has its place."""

from __future__ import annotations

from dataclasses import dataclass

from grammar.derivation.fixed import Pinned
from grammar.spec.rules import ObjectRule
from scene_description import ParseNode, Room


@dataclass(frozen=True, slots=True, kw_only=True)
class Thing:
    """A regular terminal with its size and address terminals.

    ``id`` is its object id; ``core`` the id of the object or opening that it is grouped with; ``supporters`` the ids of the things that it
    may
    stand on and ``supporter_log_probability`` theirs; ``bottom_m`` the height of its underside unless it stands on something.
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
    """Index of the address terminal that the layout fills in, for things that stand on things."""
    pinned: Pinned | None = None
    """Where it stays, if a request says so."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ParseTree:
    """A derivation: the shell of the room with its openings (ids 1, 2, ...), the things (ids after them), the choices in depth-first order.

    The openings have no parts yet.  The addresses that point to supporters are still empty: the layout chooses among them.
    """

    room: Room
    things: tuple[Thing, ...]
    nodes: tuple[ParseNode, ...]
    corners: tuple[tuple[float, float, float], ...] = ()
    """x, y and yaw of the room's corners that things belong to; as core objects they have the ids after those of the things."""
