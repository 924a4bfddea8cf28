"""The queue: what is kept of the paths of a wave between one hit and the next."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.camera.camera_rays import TILE
from renderer.core.kernel import kernel
from renderer.core.layout import Layout
from renderer.core.ray_packet import LANES, aligned_floats

WAVE_EDGE = 16
"""Edge of the pixel tile of one wave."""
WAVE = WAVE_EDGE * WAVE_EDGE
ROW = WAVE + LANES
"""From one field of a queue to the next: paths are appended 16 at a time, of which the last may be none."""
_BLOCKS_ACROSS = WAVE_EDGE // TILE

# Written by generate_camera_rays and spawn_rays, read by intersect_closest.  The first fields are those of the lanes, in their order.
_QUEUE = Layout(ROW)
BETA_R, BETA_G, BETA_B = _QUEUE.vector()
RAY_PDF = _QUEUE.field()
PREV_IMPORTANCE = _QUEUE.field()
PREV_NS_X, PREV_NS_Y, PREV_NS_Z = _QUEUE.vector()
SPREAD = _QUEUE.field()
FIRST_EXPECTED = _QUEUE.field()
OUTSIDE = _QUEUE.field()
WIDTH = _QUEUE.field()  # of the ray cone at the origin, metres
ORG_X, ORG_Y, ORG_Z = _QUEUE.vector()  # the next ray, metres, world
DIR_X, DIR_Y, DIR_Z = _QUEUE.vector()


class Queue(NamedTuple):
    """The paths of a wave between segments.

    state: float32 by field, path i at ``state[FIELD + i]``; slot: (ROW,) int32, the pixel slot of each.
    """

    state: NDArray[np.float32]
    slot: NDArray[np.int32]


def make_queue() -> Queue:
    """Return an empty queue."""
    return Queue(aligned_floats(_QUEUE.size), np.zeros(ROW, np.int32))


@kernel
def slot_pixel(slot: int) -> tuple[int, int]:
    """Return column and row in its tile of a wave's slot: 4 x 4 blocks of 4 x 4 pixels, as camera packets go."""
    block, k = slot // LANES, slot % LANES
    return TILE * (block % _BLOCKS_ACROSS) + (k & 3), TILE * (block // _BLOCKS_ACROSS) + (k >> 2)
