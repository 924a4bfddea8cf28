"""Direct light: a point on a light is sampled at a hit, and a shadow ray tells whether it is seen.

The ray that continues the path may find the same light; both estimate it, so they share it by the balance heuristic (Veach 1997, section
9.2).  Shadow rays wait until 16 are together.  Glass blocks them: light behind glass is found by the paths that go through it.
"""

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.bsdf import evaluate_bsdf
from renderer.core import lanes as ln
from renderer.core.embree import SceneHandle
from renderer.core.kernel import inlined, kernel
from renderer.core.lanes import count_chosen
from renderer.core.ray_packet import LANES
from renderer.path.film_sums import CLIPPED_REACH
from renderer.path.guide import mix_guide_pdf
from renderer.path.light_sampling import sample_emitters, sample_infinite_light
from renderer.path.lights import Lights, importance, load_bounds
from renderer.path.records import Film, LitScene, Scratch
from renderer.path.shadow_rays import add_blocked_light, pop_shadow_rays, push_shadow_rays, trace_shadow_rays
from renderer.path.sun_patches import mix_patch_pdf

_ZERO, _ONE, _TINY = np.float32(0.0), np.float32(1.0), np.float32(1e-30)
_NEAR = np.float32(2.25)
"""A hit is near to a group of lights within the square root of this times the radius of its bounding sphere."""


@inlined
def weigh_lights(lights: Lights, scratch: Scratch) -> None:
    """Fill the importance of every group of lights for every lane, IMPORTANCE with their sums, and NEAR."""
    lanes, importances = scratch.lanes, scratch.importances
    for k in range(LANES):
        lanes[ln.IMPORTANCE + k] = _ZERO
        lanes[ln.NEAR + k] = _ZERO
    for g in range(len(lights.groups.area)):
        bounds = load_bounds(lights.groups, g)
        reach = _NEAR * bounds[3] * bounds[3]
        row = importances[g * LANES : (g + 1) * LANES]
        for k in range(LANES):
            x, y, z = lanes[ln.P_X + k], lanes[ln.P_Y + k], lanes[ln.P_Z + k]
            value = importance(bounds, x, y, z, lanes[ln.NS_X + k], lanes[ln.NS_Y + k], lanes[ln.NS_Z + k])
            cx, cy, cz = x - bounds[0], y - bounds[1], z - bounds[2]
            near = (cx * cx + cy * cy + cz * cz < reach) & (value > _ZERO)
            lanes[ln.NEAR + k] += _ONE if near else _ZERO
            row[k] = value
            lanes[ln.IMPORTANCE + k] += value


@inlined
def sample_lights(
    scene: LitScene, kinds: int, depth: int, limit: np.float32, waiting: int, begin: tuple[int, int], scratch: Scratch, film: Film
) -> int:
    """Sample the emitters, and the infinite light if there is one; return how many shadow rays wait when ``waiting`` did before.

    ``kinds``: of the packet (:mod:`renderer.bsdf.layers`).  ``limit``: most that each channel of one light may bring to its own
    pixel.  ``begin``: column and row where the wave's tile begins in ``film``, which takes what it asks for of the light at first hits.
    """
    surfaces, lights, lanes, shadow_rays = scene.surfaces, scene.lights, scratch.lanes, scratch.shadow_rays
    direct, arriving = depth == 0 and film.direct.shape[0] > 0, depth == 0 and film.arriving.shape[0] > 0
    for source in range(2 if len(lights.infinite.part) > 0 else 1):
        # A point on a light, its luminance and light_pdf.
        if source == 0:
            sample_emitters(surfaces, lights, scratch)
        else:
            sample_infinite_light(surfaces, lights.infinite, scratch)
        # What it adds to the pixel if nothing blocks it.
        wi_to_lights(lanes)
        if arriving:
            add_blocked_light(scene.tree, lanes, scratch.lane_slot, shadow_rays.packet, begin[0], begin[1], film.arriving)
            scratch.traced[0] += count_chosen(lanes, ln.LIGHT_PDF)
        evaluate_bsdf(lanes, kinds, surfaces.albedos.reflected)
        if len(lights.patches) > 0:
            mix_patch_pdf(lights.patches, scratch.patch_weights, lanes)
        if len(scene.guide.light) > 0:
            mix_guide_pdf(scene.guide, lanes)
        _weigh_li(lanes, limit)
        # A shadow ray; 16 of them are traced.
        push_shadow_rays(lanes, scratch.lane_slot, direct, shadow_rays, waiting)
        waiting += count_chosen(lanes, ln.LIGHT_PDF)
        if waiting >= LANES:
            trace_shadow_rays(scene.tree, shadow_rays, LANES, scratch.light)
            scratch.traced[0] += LANES
            pop_shadow_rays(shadow_rays)
            waiting -= LANES
    return waiting


@inlined
def flush_shadow_rays(scene: SceneHandle, waiting: int, scratch: Scratch) -> None:
    """Trace the shadow rays that still wait."""
    if waiting > 0:
        trace_shadow_rays(scene, scratch.shadow_rays, waiting, scratch.light)
        scratch.traced[0] += waiting


@kernel
def wi_to_lights(lanes: NDArray[np.float32]) -> None:
    """Fill WI with the directions of TO_LIGHT."""
    for k in range(LANES):
        x, y, z = lanes[ln.TO_LIGHT_X + k], lanes[ln.TO_LIGHT_Y + k], lanes[ln.TO_LIGHT_Z + k]
        squared = x * x + y * y + z * z
        scale = _ONE / np.sqrt(squared if squared > _TINY else _TINY)
        x, y, z = x * scale, y * scale, z * scale
        lanes[ln.WI_X + k] = x * lanes[ln.TANGENT_X + k] + y * lanes[ln.TANGENT_Y + k] + z * lanes[ln.TANGENT_Z + k]
        lanes[ln.WI_Y + k] = x * lanes[ln.BITANGENT_X + k] + y * lanes[ln.BITANGENT_Y + k] + z * lanes[ln.BITANGENT_Z + k]
        lanes[ln.WI_Z + k] = x * lanes[ln.NS_X + k] + y * lanes[ln.NS_Y + k] + z * lanes[ln.NS_Z + k]


@kernel
def _weigh_li(lanes: NDArray[np.float32], limit: np.float32) -> None:
    """Turn LI into what it brings: beta f_cos li / light_pdf, times the mis weight where a ray that continues can find it too; fill KEPT.

    Where it brings nothing LIGHT_PDF becomes 0.
    """
    for k in range(LANES):
        # The balance heuristic: light_pdf / (light_pdf + pdf) / light_pdf.
        gain = _ONE / (lanes[ln.LIGHT_PDF + k] + lanes[ln.CONTINUES + k] * lanes[ln.PDF + k])
        r = gain * lanes[ln.LI_R + k] * lanes[ln.F_COS_R + k] * lanes[ln.BETA_R + k]
        g = gain * lanes[ln.LI_G + k] * lanes[ln.F_COS_G + k] * lanes[ln.BETA_G + k]
        b = gain * lanes[ln.LI_B + k] * lanes[ln.F_COS_B + k] * lanes[ln.BETA_B + k]
        most = r if r > g else g
        most = most if most > b else b
        reach = CLIPPED_REACH * limit
        scale = reach / most if most > reach else _ONE
        most = scale * most
        lanes[ln.KEPT + k] = limit / most if most > limit else _ONE
        lanes[ln.LI_R + k], lanes[ln.LI_G + k], lanes[ln.LI_B + k] = r * scale, g * scale, b * scale
        lanes[ln.LIGHT_PDF + k] = lanes[ln.LIGHT_PDF + k] if most > _ZERO else _ZERO
