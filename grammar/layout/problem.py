"""A layout problem and its state as a few tables that compiled code can take: what the chain moves, and what it moves it in.

Objects are numbered from 0 over openings and things alike, object id minus 1; openings are fixed.  World frame, metres, radians.  Few
tables with named columns rather than one array for each quantity: every array that a kernel takes costs compile time in its callers.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from grammar.geometry.arrays import Floats, Ints
from grammar.spec.rules import TERMS

FLOOR, WALL, CEILING, OBJECT, FIXED = range(5)
"""What holds an object: values of column ``MOUNT``."""


HALF_DEPTH, HALF_WIDTH, INNER_RADIUS, OUTER_RADIUS, BOTTOM, CENTRE = range(6)
"""Columns of ``Problem.object``."""

MOUNT, CORE, LEADS, BLOCKS, BOX, ZONE, REACH, BOX_END, WALL_MODE, AROUND, PLACE, CANDIDATE, MODE_END, PINNED = range(14)
"""Columns of ``Problem.link``."""

BOUNDS = len(TERMS)
MIDDLE = BOUNDS + 4
"""Places in ``Problem.number``, after the weights of the energy terms."""

COST, SHARE, NEAR, STRAIGHT = range(3, 7)
"""Columns of ``Problem.mode`` after the place that a mode means."""

SLOT_HALF_DEPTH, SLOT_HALF_WIDTH, SLOT_OWNER = 3, 4, 5
"""Columns of ``Problem.slot`` after x, y, z."""

SLOT, ON_WALL, ACTIVE = range(3)
"""Columns of ``State.hold``."""


class Problem(NamedTuple):
    """Everything about a room that its chain leaves alone.  n objects; an object's rows of ``box`` and ``mode`` follow each other.

    object: (n, 6) half depth, half width, radius of the circle about the origin around the solids, and around solids and zones, height of
    the underside of what does not stand on an object, 1 where it is drawn to the middle of the room.
    link: (n, 14) mount (codes above); index of the core object or -1; 1 where something may stand on it or be grouped around it; 1 where it
    takes floor from a walker; first rows in ``box`` of its solids, its zones and its strips to be reached, and their end; first rows in
    ``mode`` of its wall modes, modes around its core, placements and candidate tops, and their end; 1 where it stays put.
    box: (m, 8) in the object's frame x, y, z_low, z_high, half_depth, half_width, and for zones their kind and depth.
    mode: (k, 7) wall modes: gap, relative yaw, 0; around: x, y, yaw in the core's frame; placements: depth fraction, width fraction,
    relative yaw (NaN: any); then of all these -log of the density at the mode's middle over that of the object's densest mode, divided by
    the tidiness; probability; factors of the distance and of the angle, 1 over the mode's spreads.  Candidates: number of a top, -log of
    the address's probability divided by the tidiness.
    slot: (s, 6) tops that carry things: x, y, z, half depth, half width in the owner's frame, owner.
    wall: (w, 9) rows of :func:`grammar.geometry.walls.wall_rows`.
    number: (t + 6,) lambda of the energy terms; x_low, y_low, x_high, y_high of the room; x and y of the polygon's centroid.
    """

    object: Floats
    link: Ints
    box: Floats
    mode: Floats
    slot: Floats
    wall: Floats
    number: Floats

    @property
    def mount(self) -> Ints:
        """What holds each object, (n,)."""
        return self.link[:, MOUNT]

    @property
    def core(self) -> Ints:
        """Index of each object's core object or -1, (n,)."""
        return self.link[:, CORE]

    @property
    def pinned(self) -> NDArray[np.bool_]:
        """Whether each object stays where it is, (n,)."""
        return self.link[:, PINNED] > 0

    @property
    def slot_owner(self) -> Ints:
        """Index of each top's owner, (s,)."""
        return self.slot[:, SLOT_OWNER].astype(np.int64)

    @property
    def weight(self) -> Floats:
        """Weights of the energy terms, (t,)."""
        return self.number[:BOUNDS]

    def modes(self, i: int, kind: int) -> Floats:
        """Return the rows of ``mode`` of object ``i``; ``kind``: WALL_MODE, AROUND, PLACE or CANDIDATE."""
        return self.mode[self.link[i, kind] : self.link[i, kind + 1]]


class State(NamedTuple):
    """Where everything is; the chain writes these arrays in place.

    where: (n, 4) x, y, yaw, height of the underside; hold: (n, 3) the top that an object stands on, else -1; the wall that it hangs on,
    else -1; 1 once it takes part; placed: (m, 8) the problem's boxes in the world.
    """

    where: Floats
    hold: Ints
    placed: Floats

    @property
    def pose(self) -> Floats:
        """View of x, y, yaw, (n, 3)."""
        return self.where[:, :3]

    @property
    def z(self) -> Floats:
        """View of the undersides' heights, (n,)."""
        return self.where[:, 3]

    @property
    def slot(self) -> Ints:
        """View of the tops, (n,)."""
        return self.hold[:, SLOT]

    @property
    def on_wall(self) -> Ints:
        """View of the walls, (n,)."""
        return self.hold[:, ON_WALL]

    @property
    def active(self) -> Ints:
        """View of who takes part, (n,) 0 or 1."""
        return self.hold[:, ACTIVE]


def empty_state(problem: Problem) -> State:
    """Return a state in which only the fixed objects will take part; poses are zero."""
    n = len(problem.object)
    where, hold = np.zeros((n, 4)), np.full((n, 3), -1, np.int64)
    where[:, 3], hold[:, ACTIVE] = problem.object[:, BOTTOM], 0
    return State(where, hold, np.zeros((len(problem.box), 8)))


def copy_state(state: State) -> State:
    """Return a state with arrays of its own."""
    return State(state.where.copy(), state.hold.copy(), state.placed.copy())
