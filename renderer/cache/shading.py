"""Frames by the irradiance cache: hits that are known are shaded with light that is known, and one ray where they mirror."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.bsdf import evaluate_bsdf
from renderer.bsdf.microfacet import fresnel_dielectric, fresnel_thin_dielectric, ggx_g1_root, sample_ggx_wm
from renderer.cache.atlas import Atlas, find_nodes
from renderer.cache.node_light import NodeLight, pass_glass
from renderer.cache.reflectance import coat_albedo, diffuse_albedo, specular_albedo, total_albedo
from renderer.camera.camera_rays import CENTRE, MIDDLE, TILE, aim_tile
from renderer.camera.cameras import PosedCamera
from renderer.camera.shutter import move_rays
from renderer.core import embree as ray
from renderer.core import lanes as ln
from renderer.core.color import LUMINANCE
from renderer.core.embree import INVALID_ID, LANES, SceneHandle, intersect16
from renderer.core.layout import Layout
from renderer.scene.flat_scene import FlatScene
from renderer.scene.spot_lights import profile_toward
from renderer.core.kernel import entry, inlined, kernel
from renderer.core.random_numbers import mix_bits
from renderer.ground_truth.surface_images import _restore_hits as restore_hits
from renderer.path import surface_tables as st
from renderer.path.direct_light import _wi_to_lights as wi_to_lights
from renderer.path.ground_truth import Hits
from renderer.path.light_sampling import sample_infinite_light
from renderer.path.lights import Lights
from renderer.path.records import Scratch
from renderer.path.scattering import build_bsdfs
from renderer.path.surface_tables import Surfaces
from renderer.path.surfaces import evaluate_surfaces, lift_height

_ZERO, _HALF, _ONE, _TWO, _TINY = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(2.0), np.float32(1e-20)
_INVERSE_PI = np.float32(1.0 / np.pi)
_INFINITE = np.float32(np.inf)
_STEEPEST = np.float32(2.5)
_FIRST_ORDER = np.float32(1.0)
_DEEPEST = 8
_SHARP = np.float32(0.01)


_KEPT = Layout()
SHARE = _KEPT.field(3)  # of the light from the gloss ray that leaves towards the camera
POINT = _KEPT.field(3)  # where it begins
AHEAD = _KEPT.field(3)  # its direction
LIGHT = _KEPT.field(3)  # luminance of the pixel so far
BASE = _KEPT.field(3)  # colour of glass
KIND = _KEPT.field()  # 0 no ray, 1 one, 2 one that is mirrored and one that goes through
ALPHA = _KEPT.field()
UNDER = _KEPT.field(3)  # as SHARE, of the lobe under the coat
UNDER_ALPHA = _KEPT.field()


class Lamps(NamedTuple):
    """Lamps as balls, by which rough gloss shows them, for kernels: (n, 11) float32 each.

    Centre, radius in metres, luminance r, g, b, mean normal; whether it is flat.  part: (n,) int32.
    """

    balls: NDArray[np.float32]
    part: NDArray[np.int32]


def build_lamps(flat: FlatScene) -> Lamps:
    """Return a ball for each part that shines."""
    corners = flat.mesh.vertices.astype(np.float64)[flat.mesh.faces]
    cross = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    parts = np.flatnonzero((flat.parts.emission > 0.0).any(axis=1) & ~flat.parts.portal)
    rows = []
    for part in parts:
        faces = np.flatnonzero(flat.face_part == part)
        area = np.linalg.norm(cross[faces], axis=1)
        center = np.average(corners[faces].mean(axis=1), axis=0, weights=np.maximum(area, 1e-12))
        seen = max(np.maximum(sign * cross[faces][:, axis], 0.0).sum() for axis in range(3) for sign in (-1.0, 1.0))
        normal = cross[faces].sum(axis=0)
        level = np.linalg.norm(normal) > 0.5 * area.sum()
        normal /= max(np.linalg.norm(normal), 1e-12)
        rows.append([*center, np.sqrt(seen / np.pi), *flat.parts.emission[part], *normal, float(level)])
    return Lamps(np.array(rows, np.float32).reshape(-1, 11), parts.astype(np.int32))


class Cache(NamedTuple):
    """What frames look up: fine nodes and their light, coarse nodes and illuminance over pi there, (n, 3), lux."""

    fine: Atlas
    light: NodeLight
    smooth: NDArray[np.float32]
    coarse: Atlas
    even: NDArray[np.float32]


class Gloss(NamedTuple):
    """Which hits send a ray: those whose microfacets reflect at least ``least`` and are no rougher than ``roughest``."""

    least: np.float32
    roughest: np.float32


class Around(NamedTuple):
    """Memory of one thread: nodes, weights: (4,); kept: (KEPT, 16), of primary hits while their rays are traced."""

    nodes: NDArray[np.int32]
    weights: NDArray[np.float32]
    kept: NDArray[np.float32]


def make_around() -> Around:
    """Return that memory."""
    return Around(np.zeros(4, np.int32), np.zeros(4, np.float32), np.zeros((_KEPT.size, LANES), np.float32))


@entry
def want_nodes(atlas: Atlas, mesh_vertices: NDArray[np.float32], faces: NDArray[np.uint32], camera: PosedCamera, hits: Hits, wanted: NDArray[np.bool_], around: Around, scratch: Scratch, distance: NDArray[np.float32], first: int, step: int) -> None:
    """Mark the nodes that the hits of rows of tiles ``first``, ``first + step``, ... read."""
    rays = scratch.rays
    for row in range(first * TILE, camera.height, step * TILE):
        for column in range(0, camera.width, TILE):
            aim_tile(camera, column, row, CENTRE, rays)
            if camera.row_step > _ZERO:
                move_rays(camera, row, MIDDLE, rays)
            restore_hits(mesh_vertices, faces, camera, column, row, distance, hits, scratch)
            real, integer = rays.real, rays.integer
            for k in range(LANES):
                if integer[ray.GEOM_ID + k] == INVALID_ID:
                    continue
                toward = real[ray.DIR_X + k] * real[ray.NG_X + k] + real[ray.DIR_Y + k] * real[ray.NG_Y + k] + real[ray.DIR_Z + k] * real[ray.NG_Z + k]
                count = find_nodes(atlas, integer[ray.PRIM_ID + k], real[ray.BARY_U + k], real[ray.BARY_V + k], toward < _ZERO, around.nodes, around.weights)
                for i in range(count):
                    wanted[around.nodes[i]] = True


@entry
def shade_hits(
    scene: SceneHandle,
    surfaces: Surfaces,
    lights: Lights,
    lamps: Lamps,
    cache: Cache,
    gloss: Gloss,
    vertices: NDArray[np.float32],
    faces: NDArray[np.uint32],
    camera: PosedCamera,
    frame_key: np.uint32,
    distance: NDArray[np.float32],
    hits: Hits,
    scratch: Scratch,
    around: Around,
    radiance: NDArray[np.float32],
    first: int,
    step: int,
) -> None:
    """Fill the rows of tiles ``first``, ``first + step``, ... of ``radiance`` (height, width, 3), cd/m2."""
    rays, lanes, kept = scratch.rays, scratch.lanes, around.kept
    real, integer = rays.real, rays.integer
    spread = _ONE / camera.focal_px
    has_sun = len(lights.infinite.part) > 0
    for row in range(first * TILE, camera.height, step * TILE):
        for column in range(0, camera.width, TILE):
            aim_tile(camera, column, row, CENTRE, rays)
            if camera.row_step > _ZERO:
                move_rays(camera, row, MIDDLE, rays)
            restore_hits(vertices, faces, camera, column, row, distance, hits, scratch)
            for k in range(LANES):
                lanes[ln.WIDTH + k], lanes[ln.SPREAD + k] = _ZERO, spread
                lanes[ln.RAY_PDF + k] = _INFINITE
            evaluate_surfaces(surfaces, lights, True, _INFINITE, scratch)
            kinds = build_bsdfs(surfaces, True, scratch)
            # Diffuse light, and what is mirrored as far as the first order of the light around tells.
            sunny = traced = lamplit = 0
            for k in range(LANES):
                r, g, b = lanes[ln.LE_R + k], lanes[ln.LE_G + k], lanes[ln.LE_B + k]
                lanes[ln.IMPORTANCE + k] = _ZERO
                kept[KIND, k] = lanes[ln.LIGHT_PDF + k] = _ZERO
                if lanes[ln.HIT + k] > _ZERO:
                    ir, ig, ib, tx, ty, tz, sun = _read(cache, integer[ray.PRIM_ID + k], real[ray.BARY_U + k], real[ray.BARY_V + k], lanes[ln.COS_FRONT + k] > _ZERO, around)
                    nx, ny, nz = lanes[ln.NS_X + k], lanes[ln.NS_Y + k], lanes[ln.NS_Z + k]
                    along = tx * nx + ty * ny + tz * nz
                    bend = (min(max(along, _ZERO), _STEEPEST) if tx * tx + ty * ty + tz * tz > _ZERO else _ONE) * _INVERSE_PI
                    dr, dg, db = diffuse_albedo(lanes, kinds, k)
                    r, g, b = r + bend * dr * ir, g + bend * dg * ig, b + bend * db * ib
                    if sun > _ZERO:
                        lanes[ln.IMPORTANCE + k] = _ONE
                        sunny += 1
                    sr, sg, sb = specular_albedo(lanes, kinds, k)
                    coat = coat_albedo(lanes, kinds, k)
                    roughness = lanes[ln.ROUGHNESS + k]
                    glass = (lanes[ln.TRANSMISSION + k] > _HALF) & (lanes[ln.THIN + k] == _ZERO)
                    if lanes[ln.THIN + k] > _ZERO:
                        sr = sg = sb = fresnel_thin_dielectric(lanes[ln.WO_Z + k], lanes[ln.IOR + k])
                        roughness = _ZERO
                    if glass:
                        sr = sg = sb = fresnel_dielectric(lanes[ln.WO_Z + k], lanes[ln.ETA + k])
                    if coat > _ZERO:
                        # The coat's mirror image is traced; what lies under it is rough beside that.
                        share = _INVERSE_PI
                        r, g, b = r + share * sr * ir, g + share * sg * ig, b + share * sb * ib
                        kept[UNDER, k], kept[UNDER + 1, k], kept[UNDER + 2, k] = sr, sg, sb
                        kept[UNDER_ALPHA, k] = max(roughness * roughness, _SHARP)
                        sr = sg = sb = coat
                        roughness = lanes[ln.COAT_ROUGHNESS + k]
                    else:
                        kept[UNDER, k] = kept[UNDER + 1, k] = kept[UNDER + 2, k] = _ZERO
                        kept[UNDER_ALPHA, k] = _ONE
                    most = max(sr, sg, sb)
                    dx, dy, dz = real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k]
                    if (most > gloss.least) & (roughness < gloss.roughest) or glass:
                        kept[SHARE, k], kept[SHARE + 1, k], kept[SHARE + 2, k] = sr, sg, sb
                        kept[ALPHA, k] = max(roughness * roughness, np.float32(1e-4))
                        kept[KIND, k] = np.float32(2.0) if glass else _ONE
                        kept[BASE, k], kept[BASE + 1, k], kept[BASE + 2, k] = lanes[ln.BASE_R + k], lanes[ln.BASE_G + k], lanes[ln.BASE_B + k]
                        kept[POINT, k], kept[POINT + 1, k], kept[POINT + 2, k] = lanes[ln.P_X + k], lanes[ln.P_Y + k], lanes[ln.P_Z + k]
                        traced += 1
                        _aim_gloss(camera, column + (k & 3), row + (k >> 2), frame_key, k, kept, lanes, _ONE)
                        if kept[ALPHA, k] >= _SHARP:
                            lamplit += _choose_lamp(surfaces, lamps, k, r + g + b, kept, lanes)
                    else:
                        cosine = -_TWO * (dx * nx + dy * ny + dz * nz)
                        mx, my, mz = dx + cosine * nx, dy + cosine * ny, dz + cosine * nz
                        ahead = tx * mx + ty * my + tz * mz - (mx * nx + my * ny + mz * nz) * along
                        share = min(max(_ONE + _FIRST_ORDER * ahead, _ZERO), _STEEPEST) * _INVERSE_PI
                        r, g, b = r + share * sr * ir, g + share * sg * ig, b + share * sb * ib
                kept[LIGHT, k], kept[LIGHT + 1, k], kept[LIGHT + 2, k] = r, g, b
            if lamplit > 0:
                pass_glass(scene, surfaces, lanes, scratch)
                for k in range(LANES):
                    if lanes[ln.LIGHT_PDF + k] > _ZERO:
                        for channel in range(3):
                            kept[LIGHT + channel, k] += lanes[ln.LI_R + LANES * channel + k]
            if has_sun and sunny > 0:
                _add_sun(scene, surfaces, lights, kinds, camera, column, row, frame_key, scratch, kept)
            if traced > 0:
                _add_gloss(scene, surfaces, lights, cache, spread, camera, column, row, frame_key, scratch, around)
            for k in range(LANES):
                x, y = column + (k & 3), row + (k >> 2)
                if x < camera.width and y < camera.height:
                    radiance[y, x, 0], radiance[y, x, 1], radiance[y, x, 2] = kept[LIGHT, k], kept[LIGHT + 1, k], kept[LIGHT + 2, k]


@inlined
def _read(
    cache: Cache, face: int, u: np.float32, v: np.float32, front: bool, around: Around
) -> tuple[np.float32, np.float32, np.float32, np.float32, np.float32, np.float32, np.float32]:
    """Return illuminance without the sun's, its direction, and the most of the sun's share that any node has."""
    nodes, weights, light = around.nodes, around.weights, cache.light
    count = find_nodes(cache.fine, face, u, v, front, nodes, weights)
    r = g = b = x = y = z = sun = total = _ZERO
    for i in range(count):
        total += weights[i] * light.valid[nodes[i]]
    if total <= np.float32(1e-3):
        count = find_nodes(cache.coarse, face, u, v, front, nodes, weights)
        for i in range(count):
            r += np.float32(np.pi) * weights[i] * cache.even[nodes[i], 0]
            g += np.float32(np.pi) * weights[i] * cache.even[nodes[i], 1]
            b += np.float32(np.pi) * weights[i] * cache.even[nodes[i], 2]
        return r, g, b, x, y, z, sun
    for i in range(count):
        node = nodes[i]
        weight = weights[i] * light.valid[node] / total
        r += weight * (cache.smooth[node, 0] + light.direct[node, 0])
        g += weight * (cache.smooth[node, 1] + light.direct[node, 1])
        b += weight * (cache.smooth[node, 2] + light.direct[node, 2])
        x, y, z = x + weight * light.toward[node, 0], y + weight * light.toward[node, 1], z + weight * light.toward[node, 2]
        sun = max(sun, light.sun[node, 3])
    return r, g, b, x, y, z, sun


@inlined
def _noise(camera: PosedCamera, x: int, y: int, key: np.uint32) -> tuple[np.float32, np.float32]:
    """Return two numbers in [0, 1) for a pixel, far from those of its neighbours."""
    a = np.float32(mix_bits(key) >> np.uint32(8)) * np.float32(2.0**-24) + np.float32(0.7548777) * np.float32(x) + np.float32(0.5698403) * np.float32(y)
    b = np.float32(mix_bits(np.uint32(key + np.uint32(1))) >> np.uint32(8)) * np.float32(2.0**-24) + np.float32(0.4301597) * np.float32(x) + np.float32(0.7548777) * np.float32(y)
    return a - np.floor(a), b - np.floor(b)


@inlined
def _aim_gloss(camera: PosedCamera, x: int, y: int, key: np.uint32, k: int, kept: NDArray[np.float32], lanes: NDArray[np.float32], scale: np.float32) -> None:
    """Keep the direction of lane k's mirrored ray, world: sampled among the microfacets that are seen."""
    u, v = _noise(camera, x, y, key)
    wo_x, wo_y, wo_z = lanes[ln.WO_X + k], lanes[ln.WO_Y + k], lanes[ln.WO_Z + k]
    wm_x, wm_y, wm_z = sample_ggx_wm(wo_x, wo_y, wo_z, kept[ALPHA, k], u, v)
    twice = _TWO * (wo_x * wm_x + wo_y * wm_y + wo_z * wm_z)
    a, b, c = twice * wm_x - wo_x, twice * wm_y - wo_y, max(twice * wm_z - wo_z, np.float32(1e-3))
    kept[AHEAD, k] = a * lanes[ln.TANGENT_X + k] + b * lanes[ln.BITANGENT_X + k] + c * lanes[ln.NS_X + k]
    kept[AHEAD + 1, k] = a * lanes[ln.TANGENT_Y + k] + b * lanes[ln.BITANGENT_Y + k] + c * lanes[ln.NS_Y + k]
    kept[AHEAD + 2, k] = a * lanes[ln.TANGENT_Z + k] + b * lanes[ln.BITANGENT_Z + k] + c * lanes[ln.NS_Z + k]


@inlined
def _lobe(facet: np.float32, cosine: np.float32, height: np.float32, alpha: np.float32, size: np.float32) -> np.float32:
    """Return D G / (4 cos cos) of GGX, widened for a ball of this radius over distance."""
    wide = min(alpha + _HALF * size, _ONE)
    square = alpha * alpha
    t = (_ONE - facet * facet) / square + facet * facet
    value: np.float32 = _INVERSE_PI / (wide * wide * t * t) * _HALF
    return value / (cosine * ggx_g1_root(height, alpha) + height * ggx_g1_root(cosine, alpha))


@inlined
def _choose_lamp(surfaces: Surfaces, lamps: Lamps, k: int, shown: np.float32, kept: NDArray[np.float32], lanes: NDArray[np.float32]) -> int:
    """Fill TO_LIGHT and LI, what it adds to the pixel, of the lamp that lane k mirrors most, and LIGHT_PDF; return 1 if there is one.

    Karis, "Real Shading in Unreal Engine 4" (2013): the point of a ball that is nearest to the mirrored ray stands for it.
    """
    balls = lamps.balls
    px, py, pz = lanes[ln.P_X + k], lanes[ln.P_Y + k], lanes[ln.P_Z + k]
    nx, ny, nz = lanes[ln.NS_X + k], lanes[ln.NS_Y + k], lanes[ln.NS_Z + k]
    wo_x = lanes[ln.WO_X + k] * lanes[ln.TANGENT_X + k] + lanes[ln.WO_Y + k] * lanes[ln.BITANGENT_X + k] + lanes[ln.WO_Z + k] * nx
    wo_y = lanes[ln.WO_X + k] * lanes[ln.TANGENT_Y + k] + lanes[ln.WO_Y + k] * lanes[ln.BITANGENT_Y + k] + lanes[ln.WO_Z + k] * ny
    wo_z = lanes[ln.WO_X + k] * lanes[ln.TANGENT_Z + k] + lanes[ln.WO_Y + k] * lanes[ln.BITANGENT_Z + k] + lanes[ln.WO_Z + k] * nz
    height = lanes[ln.WO_Z + k]
    mx, my, mz = _TWO * height * nx - wo_x, _TWO * height * ny - wo_y, _TWO * height * nz - wo_z
    alpha = kept[ALPHA, k]
    best, found = shown * np.float32(0.01), 0
    for i in range(len(balls)):
        cx, cy, cz, radius = balls[i, 0] - px, balls[i, 1] - py, balls[i, 2] - pz, balls[i, 3]
        along = cx * mx + cy * my + cz * mz
        ax, ay, az = along * mx - cx, along * my - cy, along * mz - cz
        aside = np.sqrt(max(ax * ax + ay * ay + az * az, _TINY))
        pull = min(radius / aside, _ONE) * np.float32(0.9)
        tx, ty, tz = cx + pull * ax, cy + pull * ay, cz + pull * az
        squared = tx * tx + ty * ty + tz * tz
        distance = np.sqrt(max(squared, _TINY))
        lx, ly, lz = tx / distance, ty / distance, tz / distance
        cosine = lx * nx + ly * ny + lz * nz
        if cosine <= _ZERO or distance <= radius:
            continue
        hx, hy, hz = lx + wo_x, ly + wo_y, lz + wo_z
        scale = _ONE / np.sqrt(max(hx * hx + hy * hy + hz * hz, _TINY))
        facet = max((hx * nx + hy * ny + hz * nz) * scale, _ZERO)
        value = cosine * radius * radius / squared * np.float32(np.pi)
        if balls[i, 10] > _ZERO:
            value *= max(-(lx * balls[i, 7] + ly * balls[i, 8] + lz * balls[i, 9]), _ZERO)
        row = lamps.part[i] * st.ROW_SIZE
        if surfaces.materials[row + st.PROFILE] > _ZERO:
            value *= profile_toward(surfaces.profiles, int(surfaces.materials[row + st.PROFILE]) - 1, -lx, -ly, -lz)
        # The share of the albedo at normal incidence stands for Fresnel's.
        over = value * _lobe(facet, cosine, height, alpha, radius / distance)
        under = value * _lobe(facet, cosine, height, kept[UNDER_ALPHA, k], radius / distance)
        r = (over * kept[SHARE, k] + under * kept[UNDER, k]) * balls[i, 4]
        g = (over * kept[SHARE + 1, k] + under * kept[UNDER + 1, k]) * balls[i, 5]
        b = (over * kept[SHARE + 2, k] + under * kept[UNDER + 2, k]) * balls[i, 6]
        if r + g + b > best:
            best, found = r + g + b, 1
            lanes[ln.LI_R + k], lanes[ln.LI_G + k], lanes[ln.LI_B + k] = r, g, b
            reach = (distance - radius) / distance if balls[i, 10] == _ZERO else np.float32(0.98)
            reach = max(reach, _HALF)
            lanes[ln.TO_LIGHT_X + k], lanes[ln.TO_LIGHT_Y + k], lanes[ln.TO_LIGHT_Z + k] = reach * tx, reach * ty, reach * tz
            lanes[ln.LIGHT_PDF + k] = _ONE
    return found


@inlined
def _add_sun(
    scene: SceneHandle, surfaces: Surfaces, lights: Lights, kinds: int, camera: PosedCamera, column: int, row: int, key: np.uint32, scratch: Scratch, kept: NDArray[np.float32]
) -> None:
    """Add the sun's light, sampled once, where the nodes around have any."""
    lanes = scratch.lanes
    for k in range(LANES):
        lanes[ln.U_INFINITE_0 + k], lanes[ln.U_INFINITE_1 + k] = _noise(camera, column + (k & 3), row + (k >> 2), np.uint32(key + np.uint32(7)))
    sample_infinite_light(surfaces, lights.infinite, scratch)
    pass_glass(scene, surfaces, lanes, scratch)
    wi_to_lights(lanes)
    evaluate_bsdf(lanes, kinds, surfaces.albedos.reflected)
    for k in range(LANES):
        if lanes[ln.LIGHT_PDF + k] > _ZERO:
            for channel in range(3):
                kept[LIGHT + channel, k] += lanes[ln.LI_R + LANES * channel + k] * lanes[ln.F_COS_R + LANES * channel + k] / lanes[ln.LIGHT_PDF + k]


@inlined
def _add_gloss(
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
            aim_tile(camera, column, row, CENTRE, rays)
            for k in range(LANES):
                alive[k] = -1 if kept[KIND, k] > np.float32(1.5) else 0
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
                clear = (table[at + st.TRANSMISSION] > _HALF) & (table[at + st.PORTAL] == _ZERO)
                mirror = (table[at + st.METALLIC] > _HALF) & (table[at + st.ROUGHNESS] < np.float32(0.15))
                if (clear or mirror) and depth + 1 < _DEEPEST:
                    for channel in range(3):
                        base = table[at + st.BASE + channel]
                        lanes[ln.BETA_R + LANES * channel + k] *= np.sqrt(base) * np.float32(0.96) if clear else base
                    if mirror:
                        dx, dy, dz = real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k]
                        nx, ny, nz = real[ray.NG_X + k], real[ray.NG_Y + k], real[ray.NG_Z + k]
                        scale = -_TWO * (dx * nx + dy * ny + dz * nz) / max(nx * nx + ny * ny + nz * nz, _TINY)
                        t = real[ray.TFAR + k]
                        real[ray.ORG_X + k] += t * dx
                        real[ray.ORG_Y + k] += t * dy
                        real[ray.ORG_Z + k] += t * dz
                        real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k] = dx + scale * nx, dy + scale * ny, dz + scale * nz
                        real[ray.TNEAR + k] = np.float32(1e-4)
                    else:
                        real[ray.TNEAR + k] = real[ray.TFAR + k] + np.float32(1e-4)
                    real[ray.TFAR + k] = np.inf
                    integer[ray.GEOM_ID + k] = INVALID_ID
                    alive[k] = -1
                    waiting += 1
        for k in range(LANES):
            use = (kept[KIND, k] > _ZERO) if side == 0 else (kept[KIND, k] > np.float32(1.5))
            alive[k] = -1 if use else 0
            lanes[ln.WIDTH + k], lanes[ln.SPREAD + k] = _ZERO, spread
            lanes[ln.RAY_PDF + k], lanes[ln.PREV_IMPORTANCE + k] = np.float32(1e-20), _ONE
            if not use:
                integer[ray.GEOM_ID + k] = INVALID_ID
        evaluate_surfaces(surfaces, lights, True, _INFINITE, scratch)
        kinds = build_bsdfs(surfaces, True, scratch)
        for k in range(LANES):
            if alive[k] == 0 or lanes[ln.HIT + k] == _ZERO:
                continue
            r, g, b = lanes[ln.LE_R + k], lanes[ln.LE_G + k], lanes[ln.LE_B + k]
            at = surfaces.face_part[integer[ray.PRIM_ID + k]] * st.ROW_SIZE
            if side == 0 and kept[ALPHA, k] >= _SHARP and surfaces.materials[at + st.EMISSION + 1] > _ZERO:
                r = g = b = _ZERO
            dr, dg, db = total_albedo(lanes, kinds, k)
            count = find_nodes(cache.coarse, integer[ray.PRIM_ID + k], real[ray.BARY_U + k], real[ray.BARY_V + k], lanes[ln.COS_FRONT + k] > _ZERO, around.nodes, around.weights)
            for i in range(count):
                node, weight = around.nodes[i], around.weights[i]
                r += weight * dr * cache.even[node, 0]
                g += weight * dg * cache.even[node, 1]
                b += weight * db * cache.even[node, 2]
            wr, wg, wb = kept[SHARE, k], kept[SHARE + 1, k], kept[SHARE + 2, k]
            if side == 1:
                wr, wg, wb = (_ONE - wr) * np.sqrt(kept[BASE, k]), (_ONE - wg) * np.sqrt(kept[BASE + 1, k]), (_ONE - wb) * np.sqrt(kept[BASE + 2, k])
            kept[LIGHT, k] += wr * lanes[ln.BETA_R + k] * r
            kept[LIGHT + 1, k] += wg * lanes[ln.BETA_G + k] * g
            kept[LIGHT + 2, k] += wb * lanes[ln.BETA_B + k] * b
