"""Records that cross stages of the path tracer: what it is asked for, the memory of a thread, and the sums it adds to."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core.embree import SceneHandle
from renderer.core.lanes import LANES_SIZE
from renderer.core.ray_packet import LANES, Packet, aligned_floats, make_packet
from renderer.path.guide import NO_GUIDE, Guide
from renderer.path.light_nodes import NOTHING_KNOWN, KnownLight
from renderer.path.lights import Lights
from renderer.path.queues import WAVE, Queue, make_queue
from renderer.path.shadow_rays import ShadowRays, make_shadow_rays
from renderer.path.surface_tables import Surfaces


class LitScene(NamedTuple):
    """A scene as kernels trace light in it: triangles, what they are made of, what shines, where paths look for light, what is known."""

    tree: SceneHandle
    surfaces: Surfaces
    lights: Lights
    guide: Guide = NO_GUIDE
    known: KnownLight = NOTHING_KNOWN


class Work(NamedTuple):
    """A piece of an image: waves' tiles [first_tile, end_tile), row by row, and samples [first_sample, end_sample) of their pixels."""

    first_tile: int
    end_tile: int
    first_sample: int
    end_sample: int


class Transport(NamedTuple):
    """How paths are traced.

    frame_key: of the frame's random numbers; max_depth: most segments of a path; clamp: most that one stroke of indirect light brings to
    its own pixel, cd/m2, what is beyond is clipped (:mod:`renderer.path.film_sums`); caustic_blur: least roughness of what fully scattered
    rays hit, 0 leaves surfaces as they are; widest: most that the ray cone, by which textures are filtered, grows per metre.
    """

    frame_key: np.uint32
    max_depth: int
    clamp: np.float32
    caustic_blur: np.float32
    widest: np.float32


class Film(NamedTuple):
    """Sums over samples, float32: light (height, width, 3), cd/m2; squares (height, width, 3), of each sample's light.

    albedo: (height, width, 3), of first hits.  aov: (height, width, 6), albedo and world normal of the first hits that are neither mirrors
    nor clear glass, for denoising.  direct: (height, width, 3), the part of the light that is scattered once at most, cd/m2.  arriving:
    (height, width, 2), illuminance in lux at first hits by the samples of lights, as if nothing stood between, and what of it is blocked.
    clipped: (height, width, 3), what strokes of indirect light have beyond the limit, cd/m2.  What is not asked for has a height of 0.
    """

    light: NDArray[np.float32]
    albedo: NDArray[np.float32]
    aov: NDArray[np.float32]
    squares: NDArray[np.float32]
    direct: NDArray[np.float32]
    arriving: NDArray[np.float32]
    clipped: NDArray[np.float32]


class Scratch(NamedTuple):
    """Memory of one thread.

    rays: the packet of 16 rays; lanes: (LANES_SIZE,) float32, see :mod:`renderer.core.lanes`; lane_slot: (16,) int32, the lanes' pixel
    slots; here, ahead: the paths of this segment and of the next; importances: (g * 16,) float32, of g groups of lights for each lane;
    patch_weights: (p * 16,) float32, the same of p sun patches; sampled: (16,) int32, the group, then the emitter or portal that each lane
    has sampled; parts: (16,) int32, what the lanes hit, -1 for nothing; light: (9 * WAVE,) float32, red, green and blue of the sample by
    the wave's pixel slots, cd/m2, then those of its direct part, if that is asked for, then those of what is clipped; aov_done: (WAVE,)
    int32, by slot, 1 where AOVs have been added; seeds: (WAVE,) uint32, by slot; lane_seeds: (16,) uint32; nodes: (4,) int32, weights: (4,)
    float32, nodes of light around a hit; traced: (1,) int64, how many rays this thread has traced for colour, shadow rays among them.
    """

    rays: Packet
    lanes: NDArray[np.float32]
    lane_slot: NDArray[np.int32]
    shadow_rays: ShadowRays
    here: Queue
    ahead: Queue
    importances: NDArray[np.float32]
    patch_weights: NDArray[np.float32]
    sampled: NDArray[np.int32]
    parts: NDArray[np.int32]
    light: NDArray[np.float32]
    aov_done: NDArray[np.int32]
    seeds: NDArray[np.uint32]
    lane_seeds: NDArray[np.uint32]
    nodes: NDArray[np.int32]
    weights: NDArray[np.float32]
    traced: NDArray[np.int64]


def make_scratch(group_count: int, patch_count: int = 0) -> Scratch:
    """Return the memory that one thread needs in a scene with so many groups of lights and sun patches."""
    return Scratch(
        rays=make_packet(),
        lanes=aligned_floats(LANES_SIZE),
        lane_slot=np.zeros(LANES, np.int32),
        shadow_rays=make_shadow_rays(),
        here=make_queue(),
        ahead=make_queue(),
        importances=aligned_floats(group_count * LANES),
        patch_weights=aligned_floats(patch_count * LANES),
        sampled=np.zeros(LANES, np.int32),
        parts=np.zeros(LANES, np.int32),
        light=aligned_floats(9 * WAVE),
        aov_done=np.zeros(WAVE, np.int32),
        seeds=np.zeros(WAVE, np.uint32),
        lane_seeds=np.zeros(LANES, np.uint32),
        nodes=np.zeros(4, np.int32),
        weights=np.zeros(4, np.float32),
        traced=np.zeros(1, np.int64),
    )
