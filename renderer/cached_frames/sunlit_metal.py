"""The sun on rough metal that gloss rays meet: slats of a blind show it by one another."""

import numpy as np

from renderer.bsdf.microfacet import schlick_weight
from renderer.cached_frames import records as rec
from renderer.cached_frames.gloss_rays import base_fresnel, pixel_noise
from renderer.cached_frames.lobe_shares import ggx_reflected
from renderer.cached_frames.records import ShadeScratch
from renderer.core import lanes as ln
from renderer.core import ray_packet as ray
from renderer.core.kernel import inlined, kernel
from renderer.core.ray_packet import LANES
from renderer.irradiance_cache.specular import Lobe, facing_normal, pass_glass
from renderer.path.light_sampling import sample_sun
from renderer.path.records import LitScene
from renderer.path.surfaces import lift_height

_ZERO, _ONE, _TINY = np.float32(0.0), np.float32(1.0), np.float32(1e-20)
_INVERSE_PI = np.float32(1.0 / np.pi)
_KEY = np.uint32(29)


@inlined
def stand_on_metal(scene: LitScene, lobe: Lobe, k: int, memory: ShadeScratch) -> None:
    """Fill lane k with where its ray has met metal with this lobe, and F_COS with what its light has left of it: BETA so far."""
    rays, lanes = memory.trace.rays, memory.trace.lanes
    real, t = rays.real, rays.real[ray.TFAR + k]
    normal = facing_normal(scene.surfaces, k, rays)
    flat = real[ray.NG_X + k], real[ray.NG_Y + k], real[ray.NG_Z + k]
    along = real[ray.DIR_X + k] * flat[0] + real[ray.DIR_Y + k] * flat[1] + real[ray.DIR_Z + k] * flat[2]
    scale = (-_ONE if along > _ZERO else _ONE) / max(np.sqrt(flat[0] * flat[0] + flat[1] * flat[1] + flat[2] * flat[2]), _TINY)
    for axis in range(3):
        at = LANES * axis + k
        lanes[ln.P_X + at] = real[ray.ORG_X + at] + t * real[ray.DIR_X + at]
        lanes[ln.NS_X + at], lanes[ln.NG_X + at] = normal[axis], scale * flat[axis]
        lanes[ln.WO_X + at] = -real[ray.DIR_X + at]
        lanes[ln.F_COS_R + at] = lanes[ln.BETA_R + at]
    lift = lift_height(lanes[ln.P_X + k], lanes[ln.P_Y + k], lanes[ln.P_Z + k])
    for axis in range(0, 3 * LANES, LANES):
        lanes[ln.P_X + axis + k] += lift * lanes[ln.NG_X + axis + k]
    lanes[ln.ALPHA + k], lanes[ln.SPECULAR_F90 + k] = lobe.alpha, lobe.f90
    lanes[ln.SPECULAR_R + k], lanes[ln.SPECULAR_G + k], lanes[ln.SPECULAR_B + k] = lobe.r, lobe.g, lobe.b
    lanes[ln.HIT + k], lanes[ln.IMPORTANCE + k], lanes[ln.OUTSIDE + k] = _ONE, _ONE, memory.primary[rec.LEFT, k]


@kernel
def add_sun_on_metal(scene: LitScene, memory: ShadeScratch) -> None:
    """Add to SUNLIGHT what the metal on which lanes stand mirrors of the sun, sampled once."""
    scratch, lanes, primary = memory.trace, memory.trace.lanes, memory.primary
    for k in range(LANES):
        u, v = pixel_noise(memory.pixels[0, k], memory.pixels[1, k], _KEY)
        lanes[ln.U_INFINITE_0 + k], lanes[ln.U_INFINITE_1 + k] = u, v
    sample_sun(scene.surfaces, scene.lights, scratch)
    pass_glass(scene, scratch)
    for k in range(LANES):
        if lanes[ln.LIGHT_PDF + k] <= _ZERO:
            continue
        lx, ly, lz = lanes[ln.TO_LIGHT_X + k], lanes[ln.TO_LIGHT_Y + k], lanes[ln.TO_LIGHT_Z + k]
        nx, ny, nz = lanes[ln.NS_X + k], lanes[ln.NS_Y + k], lanes[ln.NS_Z + k]
        hx, hy, hz = lx + lanes[ln.WO_X + k], ly + lanes[ln.WO_Y + k], lz + lanes[ln.WO_Z + k]
        scale = _ONE / np.sqrt(max(hx * hx + hy * hy + hz * hz, _TINY))
        facet, half = scale * (hx * nx + hy * ny + hz * nz), scale * (hx * lx + hy * ly + hz * lz)
        height = lanes[ln.WO_X + k] * nx + lanes[ln.WO_Y + k] * ny + lanes[ln.WO_Z + k] * nz
        if height <= _ZERO:
            continue
        reflected = ggx_reflected(facet, lx * nx + ly * ny + lz * nz, height, lanes[ln.ALPHA + k])
        gain = _INVERSE_PI * reflected / lanes[ln.LIGHT_PDF + k]
        fresnel = base_fresnel(schlick_weight(half), k, lanes)
        for channel in range(3):
            at = LANES * channel + k
            primary[rec.SUNLIGHT + channel, k] += gain * fresnel[channel] * lanes[ln.F_COS_R + at] * lanes[ln.LI_R + at]
