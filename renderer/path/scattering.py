"""How the paths of a packet go on: the next rays, drawn from the surfaces' scattering models."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.bsdf import draw_directions, evaluate
from renderer.bsdf.closure import make_closures
from renderer.core.embree import DIR_X, DIR_Y, DIR_Z, LANES
from renderer.core.kernel import inlined, kernel
from renderer.core.lanes import (
    COAT,
    DENSITY,
    DRAW_END,
    FOLLOWS,
    FRAME_UX,
    FRAME_UY,
    FRAME_UZ,
    FRAME_VX,
    FRAME_VY,
    FRAME_VZ,
    GOES_ON,
    METALLIC,
    NEAR,
    NEXT_X,
    NEXT_Y,
    NEXT_Z,
    OUT_B,
    OUT_G,
    OUT_R,
    POINT_X,
    POINT_Y,
    POINT_Z,
    REFLECTS,
    ROUGHNESS,
    SHADE_X,
    SHADE_Y,
    SHADE_Z,
    SIDE_X,
    SIDE_Y,
    SIDE_Z,
    SPREAD,
    THIN,
    TOTAL,
    TRANSMISSION,
    WAY_X,
    WAY_Y,
    WAY_Z,
    WEIGHT_B,
    WEIGHT_G,
    WEIGHT_R,
    WIDTH,
    WO_X,
    WO_Y,
    WO_Z,
    count_chosen,
)
from renderer.core.packing import pack, pack_slots
from renderer.core.sampling import frame_about
from renderer.path.records import (
    AT_CHANCE,
    AT_DIR_X,
    AT_FROM_X,
    AT_IMPORTANCE,
    AT_ORG_X,
    AT_SPREAD,
    AT_WEIGHT_R,
    AT_WIDTH,
    ROW,
    Queue,
    Scratch,
    Surfaces,
)
from renderer.path.surfaces import lift_height

_ZERO, _ONE, _TWO, _TINY = np.float32(0.0), np.float32(1.0), np.float32(2.0), np.float32(1e-30)
_INFINITE = np.float32(np.inf)
_LEAST_SURVIVAL = np.float32(0.05)
_MATT = np.float32(0.6)


@inlined
def begin_scattering(surfaces: Surfaces, all_follow: bool, scratch: Scratch) -> int:
    """Fill frames, closures and FOLLOWS of a packet; return its kinds (:mod:`renderer.bsdf.closure`)."""
    lanes = scratch.lanes
    _turn_to_viewer(scratch.rays.real, lanes)
    _choose_who_follows(lanes, all_follow)
    return make_closures(lanes, surfaces.albedos)


@inlined
def go_on(surfaces: Surfaces, kinds: int, roulette: bool, queued: int, ahead: Queue, scratch: Scratch) -> int:
    """Draw the next rays of a packet and put them behind the ``queued`` ones; return how many are queued then."""
    lanes = scratch.lanes
    draw_directions(lanes, kinds)
    evaluate(lanes, kinds, surfaces.albedos.reflected)
    _weigh_ways(lanes, _LEAST_SURVIVAL if roulette else _ONE)
    _finish_ways(lanes)
    _enqueue(lanes, scratch.lane_slot, ahead, queued)
    return queued + count_chosen(lanes, GOES_ON)


@kernel
def _turn_to_viewer(real: NDArray[np.float32], lanes: NDArray[np.float32]) -> None:
    """Fill the local frames, and WO with the ways back."""
    for k in range(LANES):
        nx, ny, nz = lanes[SHADE_X + k], lanes[SHADE_Y + k], lanes[SHADE_Z + k]
        ux, uy, uz, vx, vy, vz = frame_about(nx, ny, nz)
        dx, dy, dz = -real[DIR_X + k], -real[DIR_Y + k], -real[DIR_Z + k]
        height = dx * nx + dy * ny + dz * nz
        lanes[WO_X + k] = dx * ux + dy * uy + dz * uz
        lanes[WO_Y + k] = dx * vx + dy * vy + dz * vz
        lanes[WO_Z + k] = height if height > _TINY else _TINY
        lanes[FRAME_UX + k], lanes[FRAME_UY + k], lanes[FRAME_UZ + k] = ux, uy, uz
        lanes[FRAME_VX + k], lanes[FRAME_VY + k], lanes[FRAME_VZ + k] = vx, vy, vz


@kernel
def _choose_who_follows(lanes: NDArray[np.float32], all_follow: bool) -> None:
    """Fill FOLLOWS; at the last hit only where drawing lights alone would be noisy: near lights and on gloss."""
    every = _ONE if all_follow else _ZERO
    for k in range(LANES):
        layered = lanes[THIN + k] + lanes[TRANSMISSION + k] + lanes[COAT + k] > _ZERO
        metallic = (lanes[METALLIC + k] > _ZERO) & (lanes[ROUGHNESS + k] < _ONE)
        noisy = layered | metallic | (lanes[ROUGHNESS + k] < _MATT) | (lanes[NEAR + k] > _ZERO)
        lanes[FOLLOWS + k] = _ONE if noisy else every


@kernel
def _weigh_ways(lanes: NDArray[np.float32], least_survival: np.float32) -> None:
    """Fill NEXT and GOES_ON, and OUT with the throughput that goes on along WAY."""
    for k in range(LANES):
        x, y, z, density = lanes[WAY_X + k], lanes[WAY_Y + k], lanes[WAY_Z + k], lanes[DENSITY + k]
        nx, ny, nz = lanes[SHADE_X + k], lanes[SHADE_Y + k], lanes[SHADE_Z + k]
        dx = x * lanes[FRAME_UX + k] + y * lanes[FRAME_VX + k] + z * nx
        dy = x * lanes[FRAME_UY + k] + y * lanes[FRAME_VY + k] + z * ny
        dz = x * lanes[FRAME_UZ + k] + y * lanes[FRAME_VZ + k] + z * nz
        above = dx * lanes[SIDE_X + k] + dy * lanes[SIDE_Y + k] + dz * lanes[SIDE_Z + k]
        scale = _ONE / (density if density > _TINY else _TINY)
        r = lanes[OUT_R + k] * scale * lanes[WEIGHT_R + k]
        g = lanes[OUT_G + k] * scale * lanes[WEIGHT_G + k]
        b = lanes[OUT_B + k] * scale * lanes[WEIGHT_B + k]
        most = r if r > g else g
        most = most if most > b else b
        survival = most if most > least_survival else least_survival
        survival = survival if survival < _ONE else _ONE
        lucky = (lanes[FOLLOWS + k] > _ZERO) & (lanes[REFLECTS + k] > _ZERO) & (lanes[DRAW_END + k] < survival)
        goes_on = lucky & (density > _ZERO) & (above * z > _ZERO) & (most > _ZERO)
        scale = _ONE / survival
        lanes[OUT_R + k], lanes[OUT_G + k], lanes[OUT_B + k] = r * scale, g * scale, b * scale
        lanes[NEXT_X + k], lanes[NEXT_Y + k], lanes[NEXT_Z + k] = dx, dy, dz
        lanes[GOES_ON + k] = _ONE if goes_on else _ZERO


@kernel
def _finish_ways(lanes: NDArray[np.float32]) -> None:
    """Turn POINT, DENSITY, TOTAL and SPREAD into what the queue keeps: ray origins, CHANCE, IMPORTANCE, and SPREAD behind the hit."""
    for k in range(LANES):
        px, py, pz = lanes[POINT_X + k], lanes[POINT_Y + k], lanes[POINT_Z + k]
        up, density, total = lanes[WAY_Z + k] > _ZERO, lanes[DENSITY + k], lanes[TOTAL + k]
        down = _ZERO if up else -_TWO * lift_height(px, py, pz)
        lanes[POINT_X + k] = px + down * lanes[SIDE_X + k]
        lanes[POINT_Y + k] = py + down * lanes[SIDE_Y + k]
        lanes[POINT_Z + k] = pz + down * lanes[SIDE_Z + k]
        lanes[DENSITY + k] = density if up & (total > _ZERO) else _INFINITE
        lanes[TOTAL + k] = total if total > _TINY else _TINY
        lanes[SPREAD + k] += _ONE / (_ONE + np.sqrt(density))


@kernel
def _enqueue(lanes: NDArray[np.float32], slots: NDArray[np.int32], ahead: Queue, queued: int) -> None:
    """Write the next rays of the lanes that go on into the queue behind the ``queued``."""
    state = ahead.state
    for axis in range(3):
        pack(lanes, POINT_X + LANES * axis, lanes, GOES_ON, state, AT_ORG_X + ROW * axis + queued)
        pack(lanes, NEXT_X + LANES * axis, lanes, GOES_ON, state, AT_DIR_X + ROW * axis + queued)
        pack(lanes, OUT_R + LANES * axis, lanes, GOES_ON, state, AT_WEIGHT_R + ROW * axis + queued)
        pack(lanes, SHADE_X + LANES * axis, lanes, GOES_ON, state, AT_FROM_X + ROW * axis + queued)
    pack(lanes, DENSITY, lanes, GOES_ON, state, AT_CHANCE + queued)
    pack(lanes, TOTAL, lanes, GOES_ON, state, AT_IMPORTANCE + queued)
    pack(lanes, WIDTH, lanes, GOES_ON, state, AT_WIDTH + queued)
    pack(lanes, SPREAD, lanes, GOES_ON, state, AT_SPREAD + queued)
    pack_slots(slots, lanes, GOES_ON, ahead.slot, queued)
