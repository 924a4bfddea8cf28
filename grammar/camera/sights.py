"""What a camera looks at in a room: its things as solids, its windows and doors as slabs, and which of them are bright."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from grammar.geometry.arrays import Boxes, Ints
from grammar.geometry.boxes import NO_BOXES, box_rows
from grammar.geometry.zones import opening_frame
from scene_description import Light, Opening, Room

_SLAB_M = 0.02
NOT_BRIGHT = np.zeros(0, np.bool_)


class Sights(NamedTuple):
    """What there is to see beside the solids: slabs of windows (w, 8) and doors (d, 8); ``bright`` (b + w,): which solids, windows are."""

    windows: Boxes = NO_BOXES
    bright: NDArray[np.bool_] = NOT_BRIGHT
    doors: Boxes = NO_BOXES


def find_sights(room: Room, owners: Ints, lights: Sequence[Light]) -> Sights:
    """Return the sights of a room: windows are bright, and solids of objects that hold a lamp that is on; ``owners`` (b,): ids of those."""
    shining = [light.object for light in lights if light.on]
    windows = box_rows(_slab(room, opening) for opening in room.openings if opening.category == "window")
    doors = box_rows(_slab(room, opening) for opening in room.openings if opening.category == "door")
    return Sights(windows, np.concatenate([np.isin(owners, shining), np.ones(len(windows), np.bool_)]), doors)


def _slab(room: Room, opening: Opening) -> Boxes:
    x, y, yaw = opening_frame(room, opening)
    low, high = opening.sill_m, opening.sill_m + opening.height_m
    return np.array([x, y, low, high, _SLAB_M, 0.5 * opening.width_m, math.cos(yaw), math.sin(yaw)])
