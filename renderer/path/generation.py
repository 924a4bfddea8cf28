"""Where waves begin and go on: random numbers of pixels, camera rays through them, from the queue to hits, random numbers of these."""

import numpy as np

from renderer.camera.camera_rays import aim_tile
from renderer.camera.cameras import PosedCamera
from renderer.camera.shutter import move_rays
from renderer.camera.thin_lens import sample_lens
from renderer.core import lanes as ln
from renderer.core import ray_packet as ray
from renderer.core.embree import SceneHandle, intersect16
from renderer.core.kernel import inlined
from renderer.core.lanes import CARRIED, count_chosen
from renderer.core.packing import pack, pack_slots
from renderer.core.random_numbers import mix_bits, sample_2d
from renderer.core.ray_packet import INVALID_ID, LANES
from renderer.path import queues as qu
from renderer.path.lights import Lights
from renderer.path.queues import ROW, WAVE, Queue, slot_pixel
from renderer.path.records import Scratch

_ZERO, _ONE, _HALF = np.float32(0.0), np.float32(1.0), np.float32(0.5)
_INFINITE = np.float32(np.inf)
_PIXEL_PAIR, _PAIRS_PER_HIT = 0, 3
_INFINITE_PAIRS, _LENS_PAIR, _TIME_PAIR, _GUIDE_PAIRS = 1 << 16, 1 << 17, 3 << 16, 1 << 18


@inlined
def seed_pixels(camera: PosedCamera, column: int, row: int, frame_key: np.uint32, scratch: Scratch) -> None:
    """Give the pixels of a wave's tile their seeds."""
    for slot in range(WAVE):
        x, y = slot_pixel(slot)
        pixel = np.uint32((row + y) * camera.width + column + x)
        scratch.seeds[slot] = mix_bits(np.uint32(mix_bits(pixel) ^ frame_key))


@inlined
def generate_camera_rays(camera: PosedCamera, column: int, row: int, sample: np.uint32, scratch: Scratch) -> int:
    """Queue a camera ray through each pixel of a tile that lies in the image; return how many there are.

    Paths begin with a beta of 1 and no light.
    """
    rays, lanes, state = scratch.rays, scratch.lanes, scratch.here.state
    spread = _ONE / camera.focal_px
    count = 0
    for slot in range(9 * WAVE):
        scratch.light[slot] = _ZERO
    for slot in range(WAVE):
        scratch.aov_done[slot] = 0
    for block in range(0, WAVE, LANES):
        # Sample the pixel, then the lens and the time where the camera has them.
        x, y = slot_pixel(block)
        for k in range(LANES):
            scratch.lane_seeds[k] = scratch.seeds[block + k]
        sample_2d(scratch.lane_seeds, sample, np.uint32(_PIXEL_PAIR), lanes[ln.U_LIGHT_0 :])
        for k in range(2 * LANES):
            lanes[ln.U_LIGHT_0 + k] -= _HALF
        aim_tile(camera, column + x, row + y, lanes[ln.U_LIGHT_0 :], rays)
        if camera.lens_radius_m > _ZERO:
            sample_2d(scratch.lane_seeds, sample, np.uint32(_LENS_PAIR), lanes[ln.U_LIGHT_0 :])
            sample_lens(camera, lanes[ln.U_LIGHT_0 :], rays)
        if len(camera.motion) > 0:
            sample_2d(scratch.lane_seeds, sample, np.uint32(_TIME_PAIR), lanes[ln.U_LIGHT_0 :])
            move_rays(camera, row + y, lanes[ln.U_LIGHT_0 :], rays)
        # Queue the rays that lie in the image.
        for k in range(LANES):
            inside = (rays.alive[k] != 0) & (column + x + (k & 3) < camera.width) & (row + y + (k >> 2) < camera.height)
            lanes[ln.SPAWNED + k] = _ONE if inside else _ZERO
            scratch.lane_slot[k] = block + k
            state[qu.BETA_R + count + k] = state[qu.BETA_G + count + k] = state[qu.BETA_B + count + k] = _ONE
            state[qu.WIDTH + count + k], state[qu.SPREAD + count + k] = _ZERO, spread
            state[qu.FIRST_EXPECTED + count + k], state[qu.OUTSIDE + count + k] = _ZERO, _ZERO
            state[qu.RAY_PDF + count + k], state[qu.PREV_IMPORTANCE + count + k] = _INFINITE, _ONE
        for axis in range(3):
            pack(rays.real, ray.ORG_X + LANES * axis, lanes, ln.SPAWNED, state, qu.ORG_X + ROW * axis + count)
            pack(rays.real, ray.DIR_X + LANES * axis, lanes, ln.SPAWNED, state, qu.DIR_X + ROW * axis + count)
        pack_slots(scratch.lane_slot, lanes, ln.SPAWNED, scratch.here.slot, count)
        count += count_chosen(lanes, ln.SPAWNED)
    return count


@inlined
def generate_ray_samples(lights: Lights, depth: int, sample: np.uint32, choices: bool, guided: bool, scratch: Scratch) -> None:
    """Fill U_LIGHT and U_BSDF for the hits at this depth, with ``choices`` U_LOBE and U_ROULETTE too; U_INFINITE if used.

    U_PATCH and U_GUIDE where there are sun patches, or with ``guided``.
    """
    for pair in range(0, _PAIRS_PER_HIT, 1 if choices else 2):
        number = np.uint32(1 + _PAIRS_PER_HIT * depth + pair)
        sample_2d(scratch.lane_seeds, sample, number, scratch.lanes[ln.U_LIGHT_0 + 2 * LANES * pair :])
    if len(lights.infinite.part) > 0:
        sample_2d(scratch.lane_seeds, sample, np.uint32(_INFINITE_PAIRS + depth), scratch.lanes[ln.U_INFINITE_0 :])
    if guided or len(lights.patches) > 0:
        sample_2d(scratch.lane_seeds, sample, np.uint32(_GUIDE_PAIRS + depth), scratch.lanes[ln.U_PATCH :])


@inlined
def intersect_closest(scene: SceneHandle, here: Queue, first: int, count: int, primary: bool, scratch: Scratch) -> None:
    """Take paths ``first`` to ``first`` + 15 of ``count`` from the queue into packet and lanes, and find what their rays hit first."""
    rays, lanes, state = scratch.rays, scratch.lanes, here.state
    real, integer = rays.real, rays.integer
    for k in range(LANES):
        i = first + k
        real[ray.ORG_X + k], real[ray.ORG_Y + k], real[ray.ORG_Z + k] = state[qu.ORG_X + i], state[qu.ORG_Y + i], state[qu.ORG_Z + i]
        real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k] = state[qu.DIR_X + i], state[qu.DIR_Y + i], state[qu.DIR_Z + i]
        real[ray.TNEAR + k], real[ray.TFAR + k] = _ZERO, _INFINITE
        real[ray.NG_X + k], real[ray.NG_Y + k], real[ray.NG_Z + k] = _ZERO, _ZERO, _ZERO
        integer[ray.GEOM_ID + k] = INVALID_ID
        rays.alive[k] = -1 if i < count else 0
        lanes[ln.WIDTH + k] = state[qu.WIDTH + i]
        for field in range(CARRIED):
            lanes[ln.BETA_R + LANES * field + k] = state[qu.BETA_R + ROW * field + i]
        slot = here.slot[i]
        scratch.lane_slot[k] = slot
        scratch.lane_seeds[k] = scratch.seeds[slot]
    flags = scene.coherent if primary else scene.incoherent
    intersect16(rays.alive.ctypes.data, scene.address, real.ctypes.data, flags)
