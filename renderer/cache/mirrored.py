"""What hits mirror and what is seen through glass: one ray each, shaded by the light of the coarse nodes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.microfacet import sample_ggx_wm
from renderer.cache.atlas import find_nodes
from renderer.cache.hemisphere import outside_light
from renderer.cache.records import AHEAD, ALPHA, BASE, KIND, LIGHT, PANE, POINT, SEEN, SHARE, SHARP, Around, Cache
from renderer.cache.reflectance import rough_albedo
from renderer.cache.specular import go_on, is_clear, is_mirror
from renderer.camera.camera_rays import CENTRE
from renderer.camera.cameras import PosedCamera
from renderer.camera.shutter import aim_exposed_tile
from renderer.core import embree as ray
from renderer.core import lanes as ln
from renderer.core.embree import INVALID_ID, LANES, MEET_ALL, PASS_PANES, SceneHandle, intersect16
from renderer.core.kernel import inlined
from renderer.core.random_numbers import mix_bits
from renderer.path import surface_tables as st
from renderer.path.lights import Lights
from renderer.path.records import Scratch
from renderer.path.surface_tables import Surfaces
from renderer.path.surfaces import evaluate_surfaces

_ZERO, _ONE, _TWO = np.float32(0.0), np.float32(1.0), np.float32(2.0)
_INFINITE = np.float32(np.inf)
_DEEPEST = 8


@inlined
def pixel_noise(camera: PosedCamera, x: int, y: int, key: np.uint32) -> tuple[np.float32, np.float32]:
    """Return two numbers in [0, 1) for a pixel, far from those of its neighbours."""
    a = (
        np.float32(mix_bits(key) >> np.uint32(8)) * np.float32(2.0**-24)
        + np.float32(0.7548777) * np.float32(x)
        + np.float32(0.5698403) * np.float32(y)
    )
    b = (
        np.float32(mix_bits(np.uint32(key + np.uint32(1))) >> np.uint32(8)) * np.float32(2.0**-24)
        + np.float32(0.4301597) * np.float32(x)
        + np.float32(0.7548777) * np.float32(y)
    )
    return a - np.floor(a), b - np.floor(b)


@inlined
def aim_gloss(camera: PosedCamera, x: int, y: int, key: np.uint32, k: int, kept: NDArray[np.float32], lanes: NDArray[np.float32]) -> None:
    """Keep the direction of lane k's mirrored ray, world: sampled among the microfacets that are seen."""
    u, v = pixel_noise(camera, x, y, key)
    wo_x, wo_y, wo_z = lanes[ln.WO_X + k], lanes[ln.WO_Y + k], lanes[ln.WO_Z + k]
    wm_x, wm_y, wm_z = sample_ggx_wm(wo_x, wo_y, wo_z, kept[ALPHA, k], u, v)
    twice = _TWO * (wo_x * wm_x + wo_y * wm_y + wo_z * wm_z)
    a, b, c = twice * wm_x - wo_x, twice * wm_y - wo_y, max(twice * wm_z - wo_z, np.float32(1e-3))
    kept[AHEAD, k] = a * lanes[ln.TANGENT_X + k] + b * lanes[ln.BITANGENT_X + k] + c * lanes[ln.NS_X + k]
    kept[AHEAD + 1, k] = a * lanes[ln.TANGENT_Y + k] + b * lanes[ln.BITANGENT_Y + k] + c * lanes[ln.NS_Y + k]
    kept[AHEAD + 2, k] = a * lanes[ln.TANGENT_Z + k] + b * lanes[ln.BITANGENT_Z + k] + c * lanes[ln.NS_Z + k]


@inlined
def add_gloss(
    scene: SceneHandle,
    surfaces: Surfaces,
    lights: Lights,
    cache: Cache,
    spread: np.float32,
    camera: PosedCamera,
    column: int,
    row: int,
    key: np.uint32,
    scratch: Scratch,
    around: Around,
) -> None:
    """Trace the kept rays, on by mirrors and through glass, and add what they see by light of the coarse nodes."""
    rays, lanes, kept = scratch.rays, scratch.lanes, around.kept
    real, integer, alive = rays.real, rays.integer, rays.alive
    for side in range(2):
        chosen = 0
        for k in range(LANES):
            kind = kept[KIND, k]
            use = (kind > _ZERO) if side == 0 else (kind > np.float32(1.5))
            alive[k] = -1 if use else 0
            chosen += use
            integer[ray.GEOM_ID + k] = INVALID_ID
            real[ray.TNEAR + k], real[ray.TFAR + k] = _ZERO, np.inf
            real[ray.NG_X + k], real[ray.NG_Y + k], real[ray.NG_Z + k] = _ZERO, _ZERO, _ZERO
            if not use:
                continue
            real[ray.ORG_X + k], real[ray.ORG_Y + k], real[ray.ORG_Z + k] = kept[POINT, k], kept[POINT + 1, k], kept[POINT + 2, k]
            if side == 0:
                real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k] = kept[AHEAD, k], kept[AHEAD + 1, k], kept[AHEAD + 2, k]
        if side == 1:
            if chosen == 0:
                return
            # Through glass: straight on, as if it were thin.
            aim_exposed_tile(camera, column, row, CENTRE, rays)
            for k in range(LANES):
                alive[k] = -1 if kept[KIND, k] > np.float32(1.5) else 0
                if kept[PANE, k] > _ZERO:
                    integer[ray.MASK + k] = PASS_PANES
                    real[ray.ORG_X + k], real[ray.ORG_Y + k], real[ray.ORG_Z + k] = kept[POINT, k], kept[POINT + 1, k], kept[POINT + 2, k]
        if chosen == 0:
            continue
        waiting = chosen
        for k in range(LANES):
            lanes[ln.BETA_R + k] = lanes[ln.BETA_G + k] = lanes[ln.BETA_B + k] = _ONE
        for depth in range(_DEEPEST):
            if waiting == 0:
                break
            intersect16(alive.ctypes.data, scene.address, real.ctypes.data, scene.incoherent)
            scratch.traced[0] += waiting
            waiting = 0
            for k in range(LANES):
                if alive[k] == 0 or integer[ray.GEOM_ID + k] == INVALID_ID:
                    alive[k] = 0
                    continue
                alive[k] = 0
                table, at = surfaces.materials, surfaces.face_part[integer[ray.PRIM_ID + k]] * st.ROW_SIZE
                clear, mirror = is_clear(table, at), is_mirror(table, at)
                if (clear or mirror) and depth + 1 < _DEEPEST:
                    # Rays through glass begin at the camera: what the face that it sees lets through is in BASE already.
                    if side == 0 or depth > 0 or kept[PANE, k] > _ZERO:
                        for channel in range(3):
                            base = table[at + st.BASE + channel]
                            lanes[ln.BETA_R + LANES * channel + k] *= np.sqrt(base) * np.float32(0.96) if clear else base
                    go_on(rays, k, mirror)
                    waiting += 1
        for k in range(LANES):
            use = (kept[KIND, k] > _ZERO) if side == 0 else (kept[KIND, k] > np.float32(1.5))
            alive[k] = -1 if use else 0
            integer[ray.MASK + k] = MEET_ALL
            lanes[ln.WIDTH + k], lanes[ln.SPREAD + k] = _ZERO, spread
            lanes[ln.OUTSIDE + k] = kept[PANE, k] if side == 1 else _ZERO
            lanes[ln.RAY_PDF + k], lanes[ln.PREV_IMPORTANCE + k] = np.float32(1e-20), _ONE
            if not use:
                integer[ray.GEOM_ID + k] = INVALID_ID
        evaluate_surfaces(scene, surfaces, lights, True, _INFINITE, scratch)
        for k in range(LANES):
            if alive[k] == 0 or lanes[ln.HIT + k] == _ZERO:
                continue
            r, g, b = lanes[ln.LE_R + k], lanes[ln.LE_G + k], lanes[ln.LE_B + k]
            at = surfaces.face_part[integer[ray.PRIM_ID + k]] * st.ROW_SIZE
            if side == 0 and kept[ALPHA, k] >= SHARP and surfaces.materials[at + st.EMISSION + 1] > _ZERO:
                r = g = b = _ZERO
            dr, dg, db = rough_albedo(lanes, k)
            count = 0
            if lanes[ln.OUTSIDE + k] > _ZERO:
                # What is outside is lit by all of the sky.
                sky_r, sky_g, sky_b = outside_light(surfaces.sky, lanes[ln.NS_X + k], lanes[ln.NS_Y + k], lanes[ln.NS_Z + k])
                r, g, b = r + dr * sky_r, g + dg * sky_g, b + db * sky_b
            else:
                count = find_nodes(
                    cache.coarse,
                    integer[ray.PRIM_ID + k],
                    real[ray.BARY_U + k],
                    real[ray.BARY_V + k],
                    lanes[ln.COS_FRONT + k] > _ZERO,
                    around.nodes,
                    around.weights,
                )
            total = _ZERO
            for i in range(count):
                around.weights[i] *= cache.worth[around.nodes[i]]
                total += around.weights[i]
            for i in range(count):
                node, weight = around.nodes[i], around.weights[i] / total if total > _ZERO else _ONE / np.float32(count)
                r += weight * dr * cache.even[node, 0]
                g += weight * dg * cache.even[node, 1]
                b += weight * db * cache.even[node, 2]
            r, g, b = r * lanes[ln.BETA_R + k], g * lanes[ln.BETA_G + k], b * lanes[ln.BETA_B + k]
            if side == 0:
                kept[SEEN, k], kept[SEEN + 1, k], kept[SEEN + 2, k] = r, g, b
            else:
                kept[LIGHT, k] += (_ONE - kept[SHARE, k]) * kept[BASE, k] * r
                kept[LIGHT + 1, k] += (_ONE - kept[SHARE + 1, k]) * kept[BASE + 1, k] * g
                kept[LIGHT + 2, k] += (_ONE - kept[SHARE + 2, k]) * kept[BASE + 2, k] * b
