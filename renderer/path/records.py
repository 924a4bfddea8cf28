"""Every record that crosses stages of the path tracer.

A *wave* is one sample of 16 x 16 pixels: up to 256 paths that advance together, one segment at a time.  Their state between segments is
a *queue* without gaps; 16 neighbours of it are traced and shaded at a time, as a ray packet and its *lanes*, and paths that go on are
appended to the next queue.  Queues and lanes are flat float32 arrays by field: field ``POINT_X`` of lane k is ``lanes[POINT_X + k]``, field
``AT_WIDTH`` of path i is ``state[AT_WIDTH + i]``.  (Flat with constant offsets, because LLVM then knows that fields never overlap.)

    camera -> queue -> packet + lanes (hit) -> lanes (look, lights) -> shadow packet + pending light
                ^                                    |
                +---------- next queue <-------------+
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.albedo import Albedos
from renderer.camera.camera_rays import TILE
from renderer.core.embree import LANES, Packet, aligned_floats, make_packet
from renderer.core.kernel import kernel
from renderer.core.lanes import LANES_SIZE
from renderer.scene.flat_scene import Sky
from renderer.textures.look_up import Textures

WAVE_EDGE = 16
"""Edge of the pixel tile of one wave."""
WAVE = WAVE_EDGE * WAVE_EDGE
ROW = WAVE + LANES
"""From one field of a queue to the next: paths are appended 16 at a time, of which the last may be none."""
STAGED = 2 * LANES
"""From one field of waiting shadow rays to the next: fewer than 16, and up to 16 that come."""
_BLOCKS_ACROSS = WAVE_EDGE // TILE


(
    AT_ORG_X,  # the next ray
    AT_ORG_Y,
    AT_ORG_Z,
    AT_DIR_X,
    AT_DIR_Y,
    AT_DIR_Z,
    AT_WIDTH,  # of its footprint at the origin
    AT_WEIGHT_R,  # from here on as the lanes from WEIGHT_R on
    AT_WEIGHT_G,
    AT_WEIGHT_B,
    AT_CHANCE,
    AT_IMPORTANCE,
    AT_FROM_X,
    AT_FROM_Y,
    AT_FROM_Z,
    AT_SPREAD,
) = range(0, 16 * ROW, ROW)
STATE_SIZE = 16 * ROW
CARRIED = 9
"""How many fields, from ``AT_WEIGHT_R`` and ``WEIGHT_R`` on, pass from queue to lanes as they are."""


@kernel
def slot_pixel(slot: int) -> tuple[int, int]:
    """Return column and row in its tile of a wave's slot: 4 x 4 blocks of 4 x 4 pixels, as camera packets go."""
    block, k = slot // LANES, slot % LANES
    return TILE * (block % _BLOCKS_ACROSS) + (k & 3), TILE * (block // _BLOCKS_ACROSS) + (k >> 2)


STAGED_ORG, STAGED_WAY, STAGED_LIGHT = range(0, 9 * STAGED, 3 * STAGED)
STAGED_SIZE = 9 * STAGED


class Queue(NamedTuple):
    """State of the paths of a wave between segments: (STATE_SIZE,) float32 by field, and the pixel slot of each, (ROW,) int32."""

    state: NDArray[np.float32]
    slot: NDArray[np.int32]


class Shadows(NamedTuple):
    """Shadow rays that wait until 16 are together, and the packet in which they are traced.

    staged: (STAGED_SIZE,) float32 by field: origin, way to the light, and what it brings; slot: (STAGED,) int32.
    """

    packet: Packet
    staged: NDArray[np.float32]
    slot: NDArray[np.int32]


class Scratch(NamedTuple):
    """Memory of one thread.

    shares: (g * 16,) float32, importance of g light groups; drawn: (16,) int32, the group, then the emitter or pane of each lane; parts:
    (16,) int32, what the lanes hit, -1 for nothing; light: (3 * WAVE,) float32, gathered by the wave's pixel slots; guided: (WAVE,)
    int32, by slot, 1 where guides are noted; seeds: (WAVE,) uint32, by slot; lane_seeds: (16,) uint32; traced: (1,) int64, rays that this
    thread has traced for colour, shadow rays among them.
    """

    rays: Packet
    lanes: NDArray[np.float32]
    lane_slot: NDArray[np.int32]
    shadows: Shadows
    here: Queue
    ahead: Queue
    shares: NDArray[np.float32]
    drawn: NDArray[np.int32]
    parts: NDArray[np.int32]
    light: NDArray[np.float32]
    guided: NDArray[np.int32]
    seeds: NDArray[np.uint32]
    lane_seeds: NDArray[np.uint32]
    traced: NDArray[np.int64]


class Work(NamedTuple):
    """A piece of an image: waves' tiles [first_tile, end_tile), row by row, and samples [first_sample, end_sample) of their pixels."""

    first_tile: int
    end_tile: int
    first_sample: int
    end_sample: int


class Transport(NamedTuple):
    """How paths are traced.

    frame_key: of the frame's random numbers; max_depth: most segments of a path; clamp: most luminance of an indirect contribution, cd/m2;
    caustic_blur: least roughness of what fully scattered rays hit, 0 leaves surfaces as they are; widest: most that the footprint of a ray,
    by which textures are filtered, grows per metre.
    """

    frame_key: np.uint32
    max_depth: int
    clamp: np.float32
    caustic_blur: np.float32
    widest: np.float32


class Film(NamedTuple):
    """Sums over samples, float32: light (height, width, 3), cd/m2; squares (height, width, 3), of each sample's light.

    albedo: (height, width, 3), of first hits.  guides: (height, width, 6), albedo and world normal of the first hits that are neither
    mirrors nor clear glass, for denoising.  What is not asked for has a height of 0.
    """

    light: NDArray[np.float32]
    albedo: NDArray[np.float32]
    guides: NDArray[np.float32]
    squares: NDArray[np.float32]


(
    LOOK_BASE,  # three channels
    LOOK_EMISSION,  # three channels
    LOOK_ROUGHNESS,
    LOOK_METALLIC,
    LOOK_TRANSMISSION,
    LOOK_IOR,
    LOOK_COAT,
    LOOK_COAT_ROUGHNESS,
    LOOK_SHEEN,
    LOOK_PORTAL,
    LOOK_GLASS,
    LOOK_PROFILE,  # 1 + row of the profiles, 0 for none
    LOOK_GLOW,  # luminance of its own where the colour is white, cd/m2
    LOOK_MORE,  # 1 where the look is more than this row: textures, light
) = (0, 3, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17)
LOOK_SIZE = 18


class Surfaces(NamedTuple):
    """Triangles and parts of a scene, for kernels.

    normals: (m * 9,) float32, of the corners of each triangle; face_part: (m,) int32; look: (p * LOOK_SIZE,) float32, one row per part
    (flat, because LLVM turns look-ups at constant offsets into vector code).
    """

    normals: NDArray[np.float32]
    face_part: NDArray[np.int32]
    look: NDArray[np.float32]
    albedos: Albedos
    textures: Textures
    sky: Sky
    profiles: NDArray[np.float32]


def make_queue() -> Queue:
    """Return an empty queue."""
    return Queue(aligned_floats(STATE_SIZE), np.zeros(ROW, np.int32))


def make_scratch(group_count: int) -> Scratch:
    """Return the memory that one thread needs in a scene with ``group_count`` groups of lights."""
    return Scratch(
        make_packet(),
        aligned_floats(LANES_SIZE),
        np.zeros(LANES, np.int32),
        Shadows(make_packet(), aligned_floats(STAGED_SIZE), np.zeros(STAGED, np.int32)),
        make_queue(),
        make_queue(),
        aligned_floats(group_count * LANES),
        np.zeros(LANES, np.int32),
        np.zeros(LANES, np.int32),
        aligned_floats(3 * WAVE),
        np.zeros(WAVE, np.int32),
        np.zeros(WAVE, np.uint32),
        np.zeros(LANES, np.uint32),
        np.zeros(1, np.int64),
    )
