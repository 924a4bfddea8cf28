"""A layout problem and its state as a few tables that compiled code can take: what the chain moves, and what it moves it in.

Objects are numbered from 0 over openings and placed objects alike, object id minus 1; openings are fixed.  World frame, metres, radians.
Few tables with named columns (:mod:`grammar.layout.columns`) rather than one array for each quantity: every array that a kernel takes costs
compile time in its callers.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from grammar.geometry.arrays import Bools, Boxes, Floats, Ints
from grammar.layout import columns as col


class Problem(NamedTuple):
    """Everything about a room that its chain leaves alone; n objects, whose rows of ``box`` and ``mode`` follow each other.

    object: (n, 9) half depth, half width, radius of the circle about the origin around the solids, radius around solids and zones, height
    of the underside of what does not stand on an object, 1 where it is drawn to the centroid of the floor, greatest gap between its back
    and a wall and between one of its sides and a wall (infinite where it may stand anywhere), how far its back stands off the line of its
    run.
    link: (n, 25) mount; index of the core object or -1; 1 where something may stand on it or be grouped around it; 1 where it takes floor
    from a robot; first row in ``box`` of its solids, of its zones and of the strips by which it is reached, and the end of these; first row
    in ``mode`` of its wall modes, of its modes around the core, of its placements, of the targets of its support address and of its wishes
    in a run, and the end of these; 1 where it stays put.  Of units: run or -1, number of a leg, 1 where it turns, kind, 1 where it likes
    the end, 1 where it carries something in line or stands as high; then 1 where it hangs in line, and moves only with its unit; 1 where
    it juts out; 1 where it stands end-on.  Legs belong to places: the k-th unit of a run, by index, has that of place k.  Of screens: index
    of the seat that they are watched from; of all else -1.
    box: (m, 8) in the object's frame the first six columns of a box, then the kind and the depth of a zone.
    mode: (k, 7) wall modes: gap, 0, yaw against the wall; around the core: x, y, yaw in the core's frame; placements: depth fraction, width
    fraction, yaw against the surface (NaN: any).  Then of all these: -log of the density at the mode's middle over that of the object's
    densest mode, divided by the inverse temperature; probability; factors of the distance and of the angle, 1 over the mode's spreads.
    Targets of a support address: index of a support surface, -log of its probability divided by the inverse temperature, 0.  Wishes: kind
    of unit or a code, 1 for near and -1 for apart, cost (nat) divided by the inverse temperature.
    surface: (s, 6) support surfaces: x, y, z of the middle, half depth, half width in the owner's frame, index of the owner.
    wall: (w, 9) rows of :func:`grammar.geometry.walls.wall_rows`.
    slope: (c, 4) rows of :func:`grammar.geometry.slopes.slope_rows`, planes of the ceiling.
    run: (r, 4) runs: index of the head, the unit that stands for all of them in moves; number of units; first row in ``slot`` and the end.
    slot: (q, 13) places of runs, see :class:`grammar.geometry.run_slots.Slot`, the gap between units and walls, and that between units.
    weight: (t,) lambda of the energy terms.
    x_low, y_low, x_high, y_high: bounding box of the floor; x_centre, y_centre: its centroid.
    """

    object: Floats
    link: Ints
    box: Boxes
    mode: Floats
    surface: Floats
    wall: Floats
    slope: Floats
    run: Ints
    slot: Floats
    weight: Floats
    x_low: float
    y_low: float
    x_high: float
    y_high: float
    x_centre: float
    y_centre: float

    @property
    def mount(self) -> Ints:
        """What holds each object, (n,)."""
        return self.link[:, col.MOUNT]

    @property
    def core(self) -> Ints:
        """Index of each object's core object or -1, (n,)."""
        return self.link[:, col.CORE]

    @property
    def pinned(self) -> Bools:
        """Whether each object stays where it is, (n,)."""
        return self.link[:, col.PINNED] > 0

    @property
    def surface_owner(self) -> Ints:
        """Index of each support surface's owner, (s,)."""
        return self.surface[:, col.SURFACE_OWNER].astype(np.int64)

    def modes(self, i: int, kind: int) -> Floats:
        """Return the rows of ``mode`` of object ``i``; ``kind``: column WALL_MODES, AROUND_MODES, PLACEMENTS or TARGETS."""
        return self.mode[self.link[i, kind] : self.link[i, kind + 1]]

    def targets(self, i: int) -> Ints:
        """Return the support surfaces that object ``i`` may stand on."""
        return self.modes(i, col.TARGETS)[:, col.TARGET].astype(np.int64)


class State(NamedTuple):
    """Where everything is; the chain writes these arrays in place.

    where: (n, 4) x, y, yaw, height of the underside; hold: (n, 5) the support surface that an object stands on, else -1; the wall that it
    hangs on, else -1; 1 once it takes part; the place of a unit in its run and the slot of that run, else -1; placed: (m, 8) the problem's
    boxes in the world.  How far a run is shifted along its slot follows from the pose of the unit in place 0.
    """

    where: Floats
    hold: Ints
    placed: Boxes

    @property
    def pose(self) -> Floats:
        """View of x, y, yaw, (n, 3)."""
        return self.where[:, : col.Z]

    @property
    def z(self) -> Floats:
        """View of the undersides' heights, (n,)."""
        return self.where[:, col.Z]

    @property
    def surface(self) -> Ints:
        """View of the support surfaces, (n,)."""
        return self.hold[:, col.SURFACE]

    @property
    def on_wall(self) -> Ints:
        """View of the walls, (n,)."""
        return self.hold[:, col.ON_WALL]

    @property
    def active(self) -> Ints:
        """View of who takes part, (n,) 0 or 1."""
        return self.hold[:, col.ACTIVE]


def zero_state(problem: Problem) -> State:
    """Return a state in which nothing takes part yet; x, y, yaw and boxes are zero, and nothing stands on an object or hangs on a wall."""
    n = len(problem.object)
    where, hold = np.zeros((n, 4)), np.full((n, 5), -1, np.int64)
    where[:, col.Z], hold[:, col.ACTIVE] = problem.object[:, col.BOTTOM], 0
    return State(where, hold, np.zeros((len(problem.box), 8)))


def copy_state(state: State) -> State:
    """Return a state with arrays of its own."""
    return State(state.where.copy(), state.hold.copy(), state.placed.copy())
