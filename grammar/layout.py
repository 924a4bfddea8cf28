"""A layout problem and its state as arrays that compiled code can take: what the chain moves, and what it moves it in.

Objects are numbered from 0 over openings and things alike, object id minus 1; openings are fixed.  World frame, metres, radians.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]

FLOOR, WALL, CEILING, OBJECT, FIXED = range(5)
"""What holds an object: values of ``Problem.mount``."""

ACCESS, VIEW, SWING, FACE = range(4)
"""Kinds of zones.  ACCESS: space that people need (soft); VIEW: kept free of what stands on the floor; SWING: kept free of everything;
FACE:
kept free of what hangs on walls.
"""


class Problem(NamedTuple):
    """Everything about a room that its chain leaves alone.  n objects, lists per object as slices ``first[i]:first[i + 1]``.

    half: (n, 2) half depth and half width; radius: (n, 2) of circles about the origin around the solids and around solids and zones;
    bottom: (n,) height of the underside of what does not stand on an object; mount: (n,) codes above; core: (n,) index of the core object
    or -1; box: (m, 6) solids in their objects' frames (x, y, z_low, z_high, half_depth, half_width); zone: (q, 6) likewise, with zone_kind
    (q,)
    and zone_depth (q,); wall_mode: (k, 2) gap and relative yaw (NaN: any); around: (k, 3) x, y and yaw in the core's frame (NaN: any);
    slot: (s, 5)
    tops that carry things: x, y, z, half depth, half width in the owner's frame, slot_owner (s,); candidate: slots an object may stand
    on, with candidate_cost = -log of the address's probability; place: (k, 3) depth fraction, width fraction, relative yaw (NaN: any);
    centre: (n,) 1 where an object is drawn to the middle of the room; wall: (w, 7) start x, y, unit direction x, y, length, unit normal
    into
    the room x, y; wall_yaw: (w,) yaw of that normal; reflex: (r, 2) vertices that stick into the room; bounds: x_low, y_low, x_high,
    y_high; middle: (2,) the polygon's centroid; weight: (t,) lambda of the energy terms.
    """

    half: Floats
    radius: Floats
    bottom: Floats
    mount: Ints
    core: Ints
    box_first: Ints
    box: Floats
    zone_first: Ints
    zone: Floats
    zone_kind: Ints
    zone_depth: Floats
    wall_mode_first: Ints
    wall_mode: Floats
    around_first: Ints
    around: Floats
    slot: Floats
    slot_owner: Ints
    candidate_first: Ints
    candidate: Ints
    candidate_cost: Floats
    place_first: Ints
    place: Floats
    centre: Floats
    wall: Floats
    wall_yaw: Floats
    reflex: Floats
    bounds: Floats
    middle: Floats
    weight: Floats


class State(NamedTuple):
    """Where everything is; the chain writes these arrays in place.

    pose: (n, 3) x, y, yaw; z: (n,) height of the underside; slot: (n,) the top that an object stands on, else -1; on_wall: (n,) the wall
    that it
    hangs on, else -1; active: (n,) whether it takes part yet; solid: (m, 8) the problem's boxes in the world; zone: (q, 8) its zones.
    """

    pose: Floats
    z: Floats
    slot: Ints
    on_wall: Ints
    active: Flags
    solid: Floats
    zone: Floats


def empty_state(problem: Problem) -> State:
    """Return a state in which only the fixed objects will take part; poses are zero."""
    n = len(problem.mount)
    return State(
        pose=np.zeros((n, 3)),
        z=problem.bottom.copy(),
        slot=np.full(n, -1, np.int64),
        on_wall=np.full(n, -1, np.int64),
        active=np.zeros(n, np.bool_),
        solid=np.zeros((len(problem.box), 8)),
        zone=np.zeros((len(problem.zone), 8)),
    )


def copy_state(state: State) -> State:
    """Return a state with arrays of its own."""
    return State(**{name: array.copy() for name, array in state._asdict().items()})
