"""Colour: a path tracer that works through an image in waves of 256 paths (see :mod:`renderer.path.records`), which stay in the cache.

At every hit one point on a light is drawn (next event) and one direction from the surface's scattering model; light that either finds is
weighed by the balance heuristic.  At the last hit a ray follows only near lights and on glossy surfaces; elsewhere the drawn point counts
in full, as drawing lights alone is good enough there.  So ``max_depth`` segments give the Neumann series cut there, in the mean exactly.

Gloss that is lit by way of matt surfaces makes caustics, which paths from the camera find by rare bright strokes of luck.  *Caustic blur*
roughens, for that light only, what a ray hits by how far the surfaces before have scattered it, so that drawn lights find such paths too;
energy is kept, caustics lose their edges (path space regularisation, Kaplanyan and Dachsbacher 2013).  At 0 transport is exact.

Paths that carry little end early by chance and those that survive count for more (Russian roulette), from the third hit on.

What a wave computes depends on its tile and sample only, and each random number on its key: bytes depend on neither threads nor order.
"""

from __future__ import annotations

import numpy as np

from renderer.camera.camera_rays import aim_tile
from renderer.camera.cameras import PosedCamera
from renderer.camera.shutter import move_rays
from renderer.camera.thin_lens import open_lens
from renderer.core.embree import (
    DIR_X,
    DIR_Y,
    DIR_Z,
    GEOM_ID,
    INVALID_ID,
    LANES,
    NG_X,
    NG_Y,
    NG_Z,
    ORG_X,
    ORG_Y,
    ORG_Z,
    TFAR,
    TNEAR,
    SceneHandle,
    intersect16,
)
from renderer.core.kernel import entry, inlined
from renderer.core.lanes import (
    CHANCE,
    COAT_ROUGHNESS,
    DRAW_LIGHT_U,
    DRAW_SUN_U,
    GLOW_CHANCE,
    GLOW_R,
    GOES_ON,
    ROUGHNESS,
    SPREAD,
    THIN,
    TRANSMISSION,
    WEIGHT_B,
    WEIGHT_G,
    WEIGHT_R,
    WIDTH,
    count_chosen,
)
from renderer.core.packing import pack, pack_slots
from renderer.core.random_numbers import draw_pairs, mix
from renderer.path.direct_light import cast_shadows, send_shadows, weigh_lights
from renderer.path.guides import note_albedo, note_guides
from renderer.path.light_points import aim_at_lights, aim_outside
from renderer.path.lights import Lights
from renderer.path.records import (
    AT_CHANCE,
    AT_DIR_X,
    AT_DIR_Y,
    AT_DIR_Z,
    AT_IMPORTANCE,
    AT_ORG_X,
    AT_ORG_Y,
    AT_ORG_Z,
    AT_SPREAD,
    AT_WEIGHT_B,
    AT_WEIGHT_G,
    AT_WEIGHT_R,
    AT_WIDTH,
    CARRIED,
    ROW,
    WAVE,
    WAVE_EDGE,
    Film,
    Queue,
    Scratch,
    Surfaces,
    Transport,
    Work,
    slot_pixel,
)
from renderer.path.scattering import begin_scattering, go_on
from renderer.path.surfaces import find_surfaces

_ZERO, _ONE, _HALF, _TINY = np.float32(0.0), np.float32(1.0), np.float32(0.5), np.float32(1e-30)
_INFINITE = np.float32(np.inf)
_PAIRS_PER_HIT = 3
_ROULETTE_FROM = 2
_DIRECTION_PAIRS, _LENS_PAIR, _TIME_PAIR = 1 << 16, 1 << 17, 3 << 16


@entry
def trace_paths(
    scene: SceneHandle,
    surfaces: Surfaces,
    lights: Lights,
    camera: PosedCamera,
    transport: Transport,
    work: Work,
    scratch: Scratch,
    film: Film,
) -> None:
    """Add a piece's samples to ``film``."""
    rays, sources = scratch.rays, 2 if len(lights.outside.part) > 0 else 1
    tiles_across = (camera.width + WAVE_EDGE - 1) // WAVE_EDGE
    for tile in range(work.first_tile, work.end_tile):
        column, row = WAVE_EDGE * (tile % tiles_across), WAVE_EDGE * (tile // tiles_across)
        for slot in range(WAVE):
            x, y = slot_pixel(slot)
            pixel = np.uint32((row + y) * camera.width + column + x)
            scratch.seeds[slot] = mix(np.uint32(mix(pixel) ^ transport.frame_key))
        for sample in range(work.first_sample, work.end_sample):
            count = _start_wave(camera, column, row, np.uint32(sample), scratch)
            here, ahead, waiting = scratch.here, scratch.ahead, 0
            for depth in range(transport.max_depth):
                scratch.traced[0] += count
                queued = 0
                for first in range(0, count, LANES):
                    _load_packet(here, first, count, scratch)
                    flags = scene.coherent if depth == 0 else scene.incoherent
                    intersect16(rays.alive.ctypes.data, scene.address, rays.real.ctypes.data, flags)
                    find_surfaces(surfaces, lights, depth == 0, transport.widest, scratch)
                    if depth == 0 and film.albedo.shape[0] > 0:
                        note_albedo(column, row, scratch, film.albedo)
                    if film.guides.shape[0] > 0:
                        note_guides(column, row, depth, scratch, film.guides)
                    if depth > 0 and transport.caustic_blur > _ZERO:
                        _roughen(transport.caustic_blur, scratch)
                    _gather_glow(scratch, transport.clamp if depth > 0 else _INFINITE)
                    if depth + 1 == transport.max_depth:
                        continue
                    weigh_lights(lights, scratch)
                    kinds = begin_scattering(surfaces, depth + 2 < transport.max_depth, scratch)
                    _draw_numbers(depth, np.uint32(sample), kinds > 0 or depth >= _ROULETTE_FROM, sources == 2, scratch)
                    for source in range(sources):
                        if source == 0:
                            aim_at_lights(surfaces, lights, scratch)
                        else:
                            aim_outside(surfaces, lights.outside, scratch)
                        waiting = send_shadows(scene, surfaces, kinds, transport.clamp if depth > 0 else _INFINITE, waiting, scratch)
                    queued = go_on(surfaces, kinds, depth >= _ROULETTE_FROM, queued, ahead, scratch)
                count = queued
                if count == 0:
                    break
                here, ahead = ahead, here
            if waiting > 0:
                cast_shadows(scene, scratch.shadows, waiting, scratch.light)
                scratch.traced[0] += waiting
            for slot in range(WAVE):
                x, y = slot_pixel(slot)
                if column + x < camera.width and row + y < camera.height:
                    for channel in range(3):
                        value = scratch.light[channel * WAVE + slot]
                        film.light[row + y, column + x, channel] += value
                        if film.squares.shape[0] > 0:
                            film.squares[row + y, column + x, channel] += value * value


@inlined
def _start_wave(camera: PosedCamera, column: int, row: int, sample: np.uint32, scratch: Scratch) -> int:
    """Queue a camera ray through each pixel of a tile that lies in the image; paths start with full weight and no light."""
    rays, lanes, state = scratch.rays, scratch.lanes, scratch.here.state
    spread = _ONE / camera.focal_px
    count = 0
    for slot in range(3 * WAVE):
        scratch.light[slot] = _ZERO
    for slot in range(WAVE):
        scratch.guided[slot] = 0
    for block in range(0, WAVE, LANES):
        x, y = slot_pixel(block)
        for k in range(LANES):
            scratch.lane_seeds[k] = scratch.seeds[block + k]
        draw_pairs(scratch.lane_seeds, sample, np.uint32(0), lanes[DRAW_LIGHT_U:])
        for k in range(2 * LANES):
            lanes[DRAW_LIGHT_U + k] -= _HALF
        aim_tile(camera, column + x, row + y, lanes[DRAW_LIGHT_U:], rays)
        if camera.lens_radius_m > _ZERO:
            draw_pairs(scratch.lane_seeds, sample, np.uint32(_LENS_PAIR), lanes[DRAW_LIGHT_U:])
            open_lens(camera, lanes[DRAW_LIGHT_U:], rays)
        if len(camera.motion) > 0:
            draw_pairs(scratch.lane_seeds, sample, np.uint32(_TIME_PAIR), lanes[DRAW_LIGHT_U:])
            move_rays(camera, row + y, lanes[DRAW_LIGHT_U:], rays)
        for k in range(LANES):
            inside = (rays.alive[k] != 0) & (column + x + (k & 3) < camera.width) & (row + y + (k >> 2) < camera.height)
            lanes[GOES_ON + k] = _ONE if inside else _ZERO
            scratch.lane_slot[k] = block + k
            state[AT_WEIGHT_R + count + k] = state[AT_WEIGHT_G + count + k] = state[AT_WEIGHT_B + count + k] = _ONE
            state[AT_WIDTH + count + k], state[AT_SPREAD + count + k] = _ZERO, spread
            state[AT_CHANCE + count + k], state[AT_IMPORTANCE + count + k] = _INFINITE, _ONE
        for axis in range(3):
            pack(rays.real, ORG_X + LANES * axis, lanes, GOES_ON, state, AT_ORG_X + ROW * axis + count)
            pack(rays.real, DIR_X + LANES * axis, lanes, GOES_ON, state, AT_DIR_X + ROW * axis + count)
        pack_slots(scratch.lane_slot, lanes, GOES_ON, scratch.here.slot, count)
        count += count_chosen(lanes, GOES_ON)
    return count


@inlined
def _draw_numbers(depth: int, sample: np.uint32, choices: bool, outside: bool, scratch: Scratch) -> None:
    """Fill DRAW_LIGHT and DRAW_WAY for the hits at this depth, with ``choices`` DRAW_LOBE and DRAW_END, and what is drawn ``outside``."""
    for pair in range(0, _PAIRS_PER_HIT, 1 if choices else 2):
        number = np.uint32(1 + _PAIRS_PER_HIT * depth + pair)
        draw_pairs(scratch.lane_seeds, sample, number, scratch.lanes[DRAW_LIGHT_U + 2 * LANES * pair :])
    if outside:
        draw_pairs(scratch.lane_seeds, sample, np.uint32(_DIRECTION_PAIRS + depth), scratch.lanes[DRAW_SUN_U:])


@inlined
def _load_packet(here: Queue, first: int, count: int, scratch: Scratch) -> None:
    """Take 16 paths from the queue into rays and lanes."""
    rays, lanes, state = scratch.rays, scratch.lanes, here.state
    real, integer = rays.real, rays.integer
    for k in range(LANES):
        i = first + k
        real[ORG_X + k], real[ORG_Y + k], real[ORG_Z + k] = state[AT_ORG_X + i], state[AT_ORG_Y + i], state[AT_ORG_Z + i]
        real[DIR_X + k], real[DIR_Y + k], real[DIR_Z + k] = state[AT_DIR_X + i], state[AT_DIR_Y + i], state[AT_DIR_Z + i]
        real[TNEAR + k], real[TFAR + k] = _ZERO, _INFINITE
        real[NG_X + k], real[NG_Y + k], real[NG_Z + k] = _ZERO, _ZERO, _ZERO
        integer[GEOM_ID + k] = INVALID_ID
        rays.alive[k] = -1 if i < count else 0
        lanes[WIDTH + k] = state[AT_WIDTH + i]
        for field in range(CARRIED):
            lanes[WEIGHT_R + LANES * field + k] = state[AT_WEIGHT_R + ROW * field + i]
        slot = here.slot[i]
        scratch.lane_slot[k] = slot
        scratch.lane_seeds[k] = scratch.seeds[slot]


@inlined
def _roughen(blur: np.float32, scratch: Scratch) -> None:
    """Give hits at least the roughness that the scattering of their rays allows; glass stays clear, no drawn light passes it anyway."""
    lanes = scratch.lanes
    for k in range(LANES):
        if lanes[TRANSMISSION + k] == _ZERO or lanes[THIN + k] > _ZERO:
            least = blur * min(lanes[SPREAD + k], _ONE)
            lanes[ROUGHNESS + k] = max(lanes[ROUGHNESS + k], least)
            lanes[COAT_ROUGHNESS + k] = max(lanes[COAT_ROUGHNESS + k], least)


@inlined
def _gather_glow(scratch: Scratch, limit: np.float32) -> None:
    """Add the light that the hit surfaces send by themselves, with the weight of the balance heuristic."""
    lanes, light = scratch.lanes, scratch.light
    for k in range(LANES):
        r, g, b = lanes[GLOW_R + k], lanes[GLOW_R + LANES + k], lanes[GLOW_R + 2 * LANES + k]
        if r + g + b > _ZERO:
            share = _ONE / (_ONE + lanes[GLOW_CHANCE + k] / lanes[CHANCE + k])
            r, g, b = r * lanes[WEIGHT_R + k] * share, g * lanes[WEIGHT_G + k] * share, b * lanes[WEIGHT_B + k] * share
            keep = min(_ONE, limit / max(r, g, b, _TINY))
            slot = scratch.lane_slot[k]
            light[slot] += r * keep
            light[WAVE + slot] += g * keep
            light[2 * WAVE + slot] += b * keep
