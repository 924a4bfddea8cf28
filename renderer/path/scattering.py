"""Scattering: the BSDFs of a packet's hits, and the next rays, sampled from them."""

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.bsdf import evaluate_bsdf, sample_bsdf
from renderer.bsdf.layers import build_lobes
from renderer.core import lanes as ln
from renderer.core import ray_packet as ray
from renderer.core.kernel import inlined, kernel
from renderer.core.lanes import count_chosen
from renderer.core.packing import pack, pack_slots
from renderer.core.ray_packet import LANES
from renderer.core.sampling import coordinate_system
from renderer.path import queues as qu
from renderer.path.guide import least_survival, mix_guide_pdf, sample_guide
from renderer.path.queues import ROW, Queue
from renderer.path.records import LitScene, Scratch
from renderer.path.sun_patches import mix_patch_pdf, sample_patches
from renderer.path.surface_tables import Surfaces
from renderer.path.surfaces import lift_height

_ZERO, _ONE, _TWO, _TINY = np.float32(0.0), np.float32(1.0), np.float32(2.0), np.float32(1e-30)
_INFINITE = np.float32(np.inf)
_LEAST_SURVIVAL = np.float32(0.05)
_ROUGH = np.float32(0.6)


@inlined
def regularize(blur: np.float32, scratch: Scratch) -> None:
    """Give hits at least the roughness that the scattering of their rays allows; glass stays clear, no shadow ray passes it anyway.

    ``blur``: least roughness of what fully scattered rays hit; 0 leaves all as it is.
    """
    if blur <= _ZERO:
        return
    lanes = scratch.lanes
    for k in range(LANES):
        if lanes[ln.TRANSMISSION + k] == _ZERO or lanes[ln.THIN + k] > _ZERO:
            least = blur * min(lanes[ln.SPREAD + k], _ONE)
            lanes[ln.ROUGHNESS + k] = max(lanes[ln.ROUGHNESS + k], least)
            lanes[ln.COAT_ROUGHNESS + k] = max(lanes[ln.COAT_ROUGHNESS + k], least)


@inlined
def build_bsdfs(surfaces: Surfaces, all_continue: bool, scratch: Scratch) -> int:
    """Fill shading frames, WO, CONTINUES and BSDFs of a packet; return its kinds (:mod:`renderer.bsdf.layers`)."""
    lanes = scratch.lanes
    _build_frames(scratch.rays.real, lanes)
    _choose_continuing(lanes, all_continue)
    return build_lobes(lanes, surfaces.albedos)


@inlined
def spawn_rays(scene: LitScene, kinds: int, roulette: bool, deep: bool, queued: int, ahead: Queue, scratch: Scratch) -> int:
    """Sample the next rays of a packet and put them behind the ``queued`` ones; return how many are queued then.

    ``roulette``: dim paths end at random, those that survive count for more.  ``deep``: guided ones too where no cell tells of them.
    """
    lanes, lights, guide = scratch.lanes, scene.lights, scene.guide
    guided = len(guide.light) > 0
    sample_bsdf(lanes, kinds)
    if len(lights.patches) > 0:
        sample_patches(lights.patches, scratch)
    if guided:
        sample_guide(guide, lanes)
    evaluate_bsdf(lanes, kinds, scene.surfaces.albedos.reflected)
    _spread_cones(lanes)
    if len(lights.patches) > 0:
        mix_patch_pdf(lights.patches, scratch.patch_weights, lanes)
    if guided:
        mix_guide_pdf(guide, lanes)
    _update_beta(lanes, _LEAST_SURVIVAL if roulette else _ONE, guided, deep)
    _update_path_state(lanes)
    _push_paths(lanes, scratch.lane_slot, ahead, queued)
    return queued + count_chosen(lanes, ln.SPAWNED)


@kernel
def _build_frames(real: NDArray[np.float32], lanes: NDArray[np.float32]) -> None:
    """Fill the shading frames, and WO with the directions back, those of hits that are taken from behind mirrored by their sheet."""
    for k in range(LANES):
        nx, ny, nz = lanes[ln.NS_X + k], lanes[ln.NS_Y + k], lanes[ln.NS_Z + k]
        ux, uy, uz, vx, vy, vz = coordinate_system(nx, ny, nz)
        dx, dy, dz = -real[ray.DIR_X + k], -real[ray.DIR_Y + k], -real[ray.DIR_Z + k]
        height = (dx * nx + dy * ny + dz * nz) * (_ONE - _TWO * lanes[ln.BEHIND + k])
        lanes[ln.WO_X + k] = dx * ux + dy * uy + dz * uz
        lanes[ln.WO_Y + k] = dx * vx + dy * vy + dz * vz
        lanes[ln.WO_Z + k] = height if height > _TINY else _TINY
        lanes[ln.TANGENT_X + k], lanes[ln.TANGENT_Y + k], lanes[ln.TANGENT_Z + k] = ux, uy, uz
        lanes[ln.BITANGENT_X + k], lanes[ln.BITANGENT_Y + k], lanes[ln.BITANGENT_Z + k] = vx, vy, vz


@kernel
def _choose_continuing(lanes: NDArray[np.float32], all_continue: bool) -> None:
    """Fill CONTINUES; at the last hit only where sampling lights alone would be noisy: near lights and on glossy surfaces.

    It would find nothing of the sky that lights what is outside.
    """
    every = _ONE if all_continue else _ZERO
    for k in range(LANES):
        layered = lanes[ln.THIN + k] + lanes[ln.TRANSMISSION + k] + lanes[ln.COAT + k] > _ZERO
        metallic = (lanes[ln.METALLIC + k] > _ZERO) & (lanes[ln.ROUGHNESS + k] < _ONE)
        noisy = (lanes[ln.OUTSIDE + k] > _ZERO) | layered | metallic | (lanes[ln.ROUGHNESS + k] < _ROUGH) | (lanes[ln.NEAR + k] > _ZERO)
        lanes[ln.CONTINUES + k] = _ONE if noisy else every


@kernel
def _update_beta(lanes: NDArray[np.float32], least: np.float32, guided: bool, deep: bool) -> None:
    """Fill NEXT and SPAWNED, and turn F_COS into the next beta."""
    for k in range(LANES):
        x, y, z, pdf = lanes[ln.WI_X + k], lanes[ln.WI_Y + k], lanes[ln.WI_Z + k], lanes[ln.PDF + k]
        # The direction in the world, and on which side of the surface it leaves.
        nx, ny, nz = lanes[ln.NS_X + k], lanes[ln.NS_Y + k], lanes[ln.NS_Z + k]
        dx = x * lanes[ln.TANGENT_X + k] + y * lanes[ln.BITANGENT_X + k] + z * nx
        dy = x * lanes[ln.TANGENT_Y + k] + y * lanes[ln.BITANGENT_Y + k] + z * ny
        dz = x * lanes[ln.TANGENT_Z + k] + y * lanes[ln.BITANGENT_Z + k] + z * nz
        above = dx * lanes[ln.NG_X + k] + dy * lanes[ln.NG_Y + k] + dz * lanes[ln.NG_Z + k]
        # The throughput: beta f_cos / pdf.
        scale = _ONE / (pdf if pdf > _TINY else _TINY)
        r = lanes[ln.F_COS_R + k] * scale * lanes[ln.BETA_R + k]
        g = lanes[ln.F_COS_G + k] * scale * lanes[ln.BETA_G + k]
        b = lanes[ln.F_COS_B + k] * scale * lanes[ln.BETA_B + k]
        most = r if r > g else g
        most = most if most > b else b
        # Russian roulette: the brightest channel of the throughput is the probability to survive.
        survival = most if most > least else least
        told = least_survival(lanes[ln.EXPECTED + k], lanes[ln.FIRST_EXPECTED + k], deep) if guided else _ZERO
        survival = told if told > survival else survival
        survival = survival if survival < _ONE else _ONE
        survives = (lanes[ln.CONTINUES + k] > _ZERO) & (lanes[ln.HIT + k] > _ZERO) & (lanes[ln.U_ROULETTE + k] < survival)
        spawned = survives & (pdf > _ZERO) & (above * z > _ZERO) & (most > _ZERO)
        scale = _ONE / survival
        lanes[ln.F_COS_R + k], lanes[ln.F_COS_G + k], lanes[ln.F_COS_B + k] = r * scale, g * scale, b * scale
        lanes[ln.NEXT_X + k], lanes[ln.NEXT_Y + k], lanes[ln.NEXT_Z + k] = dx, dy, dz
        lanes[ln.SPAWNED + k] = _ONE if spawned else _ZERO


@kernel
def _update_path_state(lanes: NDArray[np.float32]) -> None:
    """Turn P, PDF and IMPORTANCE into ray origins, RAY_PDF and PREV_IMPORTANCE of the queue; bring OUTSIDE behind the hit."""
    for k in range(LANES):
        px, py, pz = lanes[ln.P_X + k], lanes[ln.P_Y + k], lanes[ln.P_Z + k]
        up, pdf, total = lanes[ln.WI_Z + k] > _ZERO, lanes[ln.PDF + k], lanes[ln.IMPORTANCE + k]
        down = _ZERO if up else -_TWO * lift_height(px, py, pz)
        lanes[ln.P_X + k] = px + down * lanes[ln.NG_X + k]
        lanes[ln.P_Y + k] = py + down * lanes[ln.NG_Y + k]
        lanes[ln.P_Z + k] = pz + down * lanes[ln.NG_Z + k]
        lanes[ln.PDF + k] = pdf if up & (total + lanes[ln.OUTSIDE + k] > _ZERO) else _INFINITE
        lanes[ln.IMPORTANCE + k] = total if total > _TINY else _TINY
        passes = (lanes[ln.THIN + k] > _ZERO) & (lanes[ln.DIFFUSE_TRANSMISSION + k] == _ZERO) & (not up)
        leaves = _ONE if lanes[ln.COS_FRONT + k] > _ZERO else _ZERO
        lanes[ln.OUTSIDE + k] = leaves if passes else lanes[ln.OUTSIDE + k]


@kernel
def _spread_cones(lanes: NDArray[np.float32]) -> None:
    """Add what the BSDF spreads to SPREAD."""
    for k in range(LANES):
        lanes[ln.SPREAD + k] += _ONE / (_ONE + np.sqrt(lanes[ln.PDF + k]))


@kernel
def _push_paths(lanes: NDArray[np.float32], slots: NDArray[np.int32], ahead: Queue, queued: int) -> None:
    """Write the paths of the lanes with a next ray into the queue behind the ``queued``."""
    state = ahead.state
    for axis in range(3):
        pack(lanes, ln.P_X + LANES * axis, lanes, ln.SPAWNED, state, qu.ORG_X + ROW * axis + queued)
        pack(lanes, ln.NEXT_X + LANES * axis, lanes, ln.SPAWNED, state, qu.DIR_X + ROW * axis + queued)
        pack(lanes, ln.F_COS_R + LANES * axis, lanes, ln.SPAWNED, state, qu.BETA_R + ROW * axis + queued)
        pack(lanes, ln.NS_X + LANES * axis, lanes, ln.SPAWNED, state, qu.PREV_NS_X + ROW * axis + queued)
    pack(lanes, ln.PDF, lanes, ln.SPAWNED, state, qu.RAY_PDF + queued)
    pack(lanes, ln.IMPORTANCE, lanes, ln.SPAWNED, state, qu.PREV_IMPORTANCE + queued)
    pack(lanes, ln.WIDTH, lanes, ln.SPAWNED, state, qu.WIDTH + queued)
    pack(lanes, ln.SPREAD, lanes, ln.SPAWNED, state, qu.SPREAD + queued)
    pack(lanes, ln.FIRST_EXPECTED, lanes, ln.SPAWNED, state, qu.FIRST_EXPECTED + queued)
    pack(lanes, ln.OUTSIDE, lanes, ln.SPAWNED, state, qu.OUTSIDE + queued)
    pack_slots(slots, lanes, ln.SPAWNED, ahead.slot, queued)
