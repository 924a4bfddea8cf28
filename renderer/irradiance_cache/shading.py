"""Frames by the irradiance cache: hits that are known, shaded with light that is known."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.bsdf import evaluate_bsdf
from renderer.bsdf.microfacet import fresnel_dielectric, fresnel_thin_dielectric
from renderer.camera.camera_rays import CENTRE, TILE
from renderer.camera.cameras import PosedCamera
from renderer.camera.shutter import aim_exposed_tile
from renderer.core import embree as ray
from renderer.core import lanes as ln
from renderer.core.embree import LANES, SceneHandle
from renderer.core.kernel import entry, inlined
from renderer.ground_truth.surface_images import restore_hits
from renderer.irradiance_cache.atlas import CORNERS, GRID, Atlas, find_cell, find_nodes
from renderer.irradiance_cache.lamps import Lamps, choose_lamp
from renderer.irradiance_cache.mirrored import add_gloss, aim_gloss, pixel_noise
from renderer.irradiance_cache.nodes import LAMPS, SUN, TOWARD, VALID
from renderer.irradiance_cache.nodes import LIGHT as LIT
from renderer.irradiance_cache.reconstruction import Picture
from renderer.irradiance_cache.records import (
    ALPHA,
    BASE,
    KIND,
    LIGHT,
    PANE,
    POINT,
    SEEN,
    SHARE,
    SHARP,
    UNDER,
    UNDER_ALPHA,
    Around,
    Cache,
    Gloss,
    takes_from_others,
)
from renderer.irradiance_cache.reflectance import coat_albedo, diffuse_albedo, specular_albedo
from renderer.irradiance_cache.specular import pass_glass
from renderer.path.direct_light import wi_to_lights
from renderer.path.ground_truth import Hits
from renderer.path.light_sampling import sample_sun
from renderer.path.lights import Lights
from renderer.path.records import Scratch
from renderer.path.scattering import build_bsdfs
from renderer.path.surface_tables import Surfaces
from renderer.path.surfaces import evaluate_surfaces

_ZERO, _HALF, _ONE, _TWO = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(2.0)
_PI, _INVERSE_PI = np.float32(np.pi), np.float32(1.0 / np.pi)
_INFINITE = np.float32(np.inf)
_STEEPEST = np.float32(2.5)
_FIRST_ORDER = np.float32(1.0)
_SUN_RAYS = 4
_LEAST_VALID = np.float32(1e-4)


@entry
def want_nodes(atlas: Atlas, hits: Hits, wanted: NDArray[np.bool_], first: int, step: int) -> None:
    """Mark the nodes around the hits of rows ``first``, ``first + step``, ..., on both sides where there are two."""
    height, width = hits.face.shape
    for y in range(first, height, step):
        last_face = last_cell = -1
        for x in range(width):
            face = hits.face[y, x]
            if face < 0 or (face == last_face and atlas.cells[face, 3] != GRID):
                continue
            last_face = face
            if atlas.cells[face, 3] == CORNERS:
                for corner in range(3):
                    _want(atlas, atlas.cells[face, corner], wanted)
            elif atlas.cells[face, 3] == GRID:
                place, _, _ = find_cell(atlas, face, hits.u[y, x], hits.v[y, x])
                if place == last_cell:
                    continue
                last_cell = place
                columns, rows = atlas.cells[face, 1], atlas.cells[face, 2]
                for corner in range(4):
                    beside = place + (corner & 1 if columns > 1 else 0) + (columns if corner >> 1 and rows > 1 else 0)
                    if atlas.grid[beside] >= 0:
                        _want(atlas, atlas.grid[beside], wanted)


@inlined
def _want(atlas: Atlas, node: int, wanted: NDArray[np.bool_]) -> None:
    wanted[node] = True
    if atlas.back[node] >= 0:
        wanted[atlas.back[node]] = True


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
    picture: Picture,
    first: int,
    step: int,
) -> None:
    """Fill the rows of tiles ``first``, ``first + step``, ... of a picture."""
    rays, lanes, kept = scratch.rays, scratch.lanes, around.kept
    real, integer = rays.real, rays.integer
    spread = _ONE / camera.focal_px
    has_sun = len(lights.infinite.part) > 0
    for row in range(first * TILE, camera.height, step * TILE):
        for column in range(0, camera.width, TILE):
            aim_exposed_tile(camera, column, row, CENTRE, rays)
            restore_hits(vertices, faces, camera, column, row, distance, hits, scratch)
            for k in range(LANES):
                lanes[ln.WIDTH + k], lanes[ln.SPREAD + k] = _ZERO, spread
                lanes[ln.RAY_PDF + k], lanes[ln.OUTSIDE + k] = _INFINITE, _ZERO
            evaluate_surfaces(scene, surfaces, lights, True, _INFINITE, scratch)
            kinds = build_bsdfs(surfaces, True, scratch)
            # Diffuse light, and what is mirrored as far as the first order of the light around tells.
            sunny = traced = lamplit = 0
            for k in range(LANES):
                r, g, b = lanes[ln.LE_R + k], lanes[ln.LE_G + k], lanes[ln.LE_B + k]
                lanes[ln.IMPORTANCE + k] = _ZERO
                kept[KIND, k] = kept[ALPHA, k] = lanes[ln.LIGHT_PDF + k] = _ZERO
                kept[SEEN, k] = kept[SEEN + 1, k] = kept[SEEN + 2, k] = _ZERO
                if lanes[ln.HIT + k] > _ZERO:
                    ir, ig, ib, tx, ty, tz, rest, sun, lamps_share = _read(
                        cache, integer[ray.PRIM_ID + k], real[ray.BARY_U + k], real[ray.BARY_V + k], lanes[ln.COS_FRONT + k] > _ZERO, around
                    )
                    nx, ny, nz = lanes[ln.NS_X + k], lanes[ln.NS_Y + k], lanes[ln.NS_Z + k]
                    along = tx * nx + ty * ny + tz * nz + rest
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
                        glass = lanes[ln.OPEN + k] == _ZERO
                    elif glass:
                        sr = sg = sb = fresnel_dielectric(lanes[ln.WO_Z + k], lanes[ln.ETA + k])
                    # Light around to the first order, where no ray asks for it.
                    dx, dy, dz = real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k]
                    cosine = -_TWO * (dx * nx + dy * ny + dz * nz)
                    mx, my, mz = dx + cosine * nx, dy + cosine * ny, dz + cosine * nz
                    ahead = tx * mx + ty * my + tz * mz - (mx * nx + my * ny + mz * nz) * along
                    around_share = min(max(_ONE + _FIRST_ORDER * ahead, _ZERO), _STEEPEST) * _INVERSE_PI
                    if coat > _ZERO:
                        # The coat's mirror image is traced; what lies under it is rough beside that.
                        share = around_share * (_ONE - lamps_share)
                        r, g, b = r + share * sr * ir, g + share * sg * ig, b + share * sb * ib
                        kept[UNDER, k], kept[UNDER + 1, k], kept[UNDER + 2, k] = sr, sg, sb
                        kept[UNDER_ALPHA, k] = max(roughness * roughness, SHARP)
                        sr = sg = sb = coat
                        roughness = lanes[ln.COAT_ROUGHNESS + k]
                    else:
                        kept[UNDER, k] = kept[UNDER + 1, k] = kept[UNDER + 2, k] = _ZERO
                        kept[UNDER_ALPHA, k] = _ONE
                    most = max(sr, sg, sb)
                    if (most > gloss.least) & (roughness < gloss.roughest) or glass:
                        kept[SHARE, k], kept[SHARE + 1, k], kept[SHARE + 2, k] = sr, sg, sb
                        kept[ALPHA, k] = max(roughness * roughness, np.float32(1e-4))
                        if kept[ALPHA, k] >= SHARP or kept[UNDER_ALPHA, k] < _ONE:
                            lamplit += choose_lamp(surfaces, lamps, k, r + g + b, kept, lanes)
                        if not glass and lanes[ln.METALLIC + k] < _HALF and takes_from_others(column + (k & 3), row + (k >> 2), kept, k):
                            kept[ALPHA, k] = -kept[ALPHA, k]
                            around_share *= _ONE - lamps_share
                            kept[SEEN, k], kept[SEEN + 1, k], kept[SEEN + 2, k] = around_share * ir, around_share * ig, around_share * ib
                        else:
                            kept[KIND, k] = np.float32(2.0) if glass else _ONE
                            kept[PANE, k] = lanes[ln.THIN + k]
                            for channel in range(3):
                                tint = np.sqrt(lanes[ln.BASE_R + LANES * channel + k])
                                kept[BASE + channel, k] = lanes[ln.TRANSMISSION + k] if lanes[ln.THIN + k] > _ZERO else tint
                                kept[POINT + channel, k] = lanes[ln.P_X + LANES * channel + k]
                            traced += 1
                            aim_gloss(column + (k & 3), row + (k >> 2), k, kept, lanes)
                    else:
                        r, g, b = r + around_share * sr * ir, g + around_share * sg * ig, b + around_share * sb * ib
                kept[LIGHT, k], kept[LIGHT + 1, k], kept[LIGHT + 2, k] = r, g, b
            if lamplit > 0:
                pass_glass(scene, surfaces, lanes, scratch)
                for k in range(LANES):
                    if lanes[ln.LIGHT_PDF + k] > _ZERO:
                        for channel in range(3):
                            kept[LIGHT + channel, k] += lanes[ln.LI_R + LANES * channel + k]
            if has_sun and sunny > 0:
                _add_sun(scene, surfaces, lights, kinds, column, row, frame_key, scratch, kept)
            if traced > 0:
                add_gloss(scene, surfaces, lights, cache, spread, camera, column, row, scratch, around)
            for k in range(LANES):
                x, y = column + (k & 3), row + (k >> 2)
                if x < camera.width and y < camera.height:
                    picture.mirrored[y, x, 3] = kept[ALPHA, k]
                    for channel in range(3):
                        picture.light[y, x, channel] = kept[LIGHT + channel, k]
                    if kept[ALPHA, k] != _ZERO:
                        for channel in range(3):
                            picture.mirrored[y, x, channel] = kept[SEEN + channel, k]
                            picture.share[y, x, channel] = kept[SHARE + channel, k]


@inlined
def _read(
    cache: Cache, face: int, u: np.float32, v: np.float32, front: bool, around: Around
) -> tuple[np.float32, np.float32, np.float32, np.float32, np.float32, np.float32, np.float32, np.float32, np.float32]:
    """Return what is known of the light at a hit.

    That is illuminance without the sun's, its direction, what is to be added to the cosine between that and a normal, the most of the
    sun's share that any node has, and the share of lamps.
    """
    nodes, weights, rows = around.nodes, around.weights, cache.rows
    count = find_nodes(cache.fine, face, u, v, front, nodes, weights)
    r = g = b = x = y = z = sun = lamps = total = _ZERO
    for i in range(count):
        node = nodes[i]
        weight = weights[i] * rows[node, VALID]
        total += weight
        r, g, b = r + weight * rows[node, LIT], g + weight * rows[node, LIT + 1], b + weight * rows[node, LIT + 2]
        x += weight * rows[node, TOWARD]
        y += weight * rows[node, TOWARD + 1]
        z += weight * rows[node, TOWARD + 2]
        lamps += weight * rows[node, LAMPS]
        sun = max(sun, rows[node, SUN])
    if total > _LEAST_VALID:
        scale = _ONE / total
        x, y, z = scale * x, scale * y, scale * z
        rest = _turned(cache.fine, count, x, y, z, around) if cache.fine.cells[face, 3] == CORNERS else _ZERO
        return scale * r, scale * g, scale * b, x, y, z, rest, sun, scale * lamps
    # All lie within objects: the coarse ones know what is near.
    r = g = b = _ZERO
    count = find_nodes(cache.coarse, face, u, v, front, nodes, weights)
    for i in range(count):
        weight = _PI * weights[i]
        r += weight * cache.even[nodes[i], 0]
        g += weight * cache.even[nodes[i], 1]
        b += weight * cache.even[nodes[i], 2]
    return r, g, b, _ZERO, _ZERO, _ZERO, _ZERO, sun, _ZERO


@inlined
def _turned(atlas: Atlas, count: int, x: np.float32, y: np.float32, z: np.float32, around: Around) -> np.float32:
    """Return what the light's direction lacks of a cosine of 1 with the normal that lies between those of the nodes around.

    Each node knows illuminance for its own normal.  Between nodes of other normals it is interpolated; only how relief turns the
    normal away from the one in between changes it.
    """
    nx = ny = nz = _ZERO
    for i in range(count):
        node, weight = around.nodes[i], around.weights[i]
        nx += weight * atlas.normal[node, 0]
        ny += weight * atlas.normal[node, 1]
        nz += weight * atlas.normal[node, 2]
    cosine: np.float32 = (x * nx + y * ny + z * nz) / max(np.sqrt(nx * nx + ny * ny + nz * nz), np.float32(1e-6))
    return _ONE - cosine


@inlined
def _add_sun(
    scene: SceneHandle,
    surfaces: Surfaces,
    lights: Lights,
    kinds: int,
    column: int,
    row: int,
    key: np.uint32,
    scratch: Scratch,
    kept: NDArray[np.float32],
) -> None:
    """Add the sun's light, sampled once, where the nodes around have any."""
    lanes = scratch.lanes
    for sample in range(_SUN_RAYS):
        for k in range(LANES):
            u, v = pixel_noise(column + (k & 3), row + (k >> 2), np.uint32(key + np.uint32(7)))
            v += np.float32(sample) / np.float32(_SUN_RAYS)
            lanes[ln.U_INFINITE_0 + k], lanes[ln.U_INFINITE_1 + k] = u, v - np.floor(v)
        sample_sun(surfaces, lights, scratch)
        pass_glass(scene, surfaces, lanes, scratch)
        wi_to_lights(lanes)
        evaluate_bsdf(lanes, kinds, surfaces.albedos.reflected)
        for k in range(LANES):
            if lanes[ln.LIGHT_PDF + k] > _ZERO:
                gain = _ONE / (np.float32(_SUN_RAYS) * lanes[ln.LIGHT_PDF + k])
                for channel in range(0, 3 * LANES, LANES):
                    kept[LIGHT + channel // LANES, k] += gain * lanes[ln.LI_R + channel + k] * lanes[ln.F_COS_R + channel + k]
