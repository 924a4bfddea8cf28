"""Where the light of each pixel comes back from: through clear glass, by way of mirrors, and whether the projector reaches the place.

A beam starts through a pixel, as the primary rays of the ground truth do.  Clear glass lets it pass, straight; a smooth metal mirrors it;
what else it hits sends light back to where it came from.  The device takes the way for straight, so behind a mirror it sees the mirror's
world. Window panes let beams leave the room: nothing returns.

How much returns is told as the reflectance of a matt surface that would send back as much: pi times the BSDF for light that returns to
its source.  That is the diffuse share plus, with D of GGX and the masking of Smith, F D G / 4 cos^2 of the gloss, whose half vector is
the beam itself.  Light of 850 nm is taken to be reflected as red is, the nearest that is known.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.camera.camera_rays import TILE, aim_tile
from renderer.camera.cameras import PosedCamera
from renderer.core import lanes as ln
from renderer.core import ray_packet as ray
from renderer.core.embree import SceneHandle, intersect16, occluded16
from renderer.core.kernel import entry, inlined, kernel
from renderer.core.ray_packet import INVALID_ID, LANES, Packet
from renderer.path import surface_tables as st
from renderer.path.surface_tables import Surfaces
from renderer.path.surfaces import apply_texture, lift_height

_ZERO, _ONE, _HALF, _TINY, _PI = np.float32(0.0), np.float32(1.0), np.float32(0.5), np.float32(1e-20), np.float32(np.pi)
_INFINITE, _NAN = np.float32(np.inf), np.float32(np.nan)
_DEEPEST = 5
"""Most mirrors and sheets of glass that a beam passes."""
_SMOOTH, _GLASS_PASS, _GLOSS = np.float32(0.15), np.float32(0.92), np.float32(0.04)
_SHADOW_END = np.float32(0.999)


class Beams(NamedTuple):
    """What returns to each pixel; (height, width), float32 unless told otherwise.

    distance: m, along the beam, +inf where nothing returns, NaN where the lens sees nothing; z: optical z of a unit of ``distance``;
    cosine: of the angle of incidence; reflectance: of a matt surface that would send back as much; normal: (height, width, 3), of the
    surface, unit, optical frame; 0 where mirrors or glass lie between; point, world_normal: (height, width, 3), m, world; color:
    (height, width, 2), luminance and red of the base colour, above 1 what shines itself; lit: uint8, 1 where the projector's light arrives.
    """

    distance: NDArray[np.float32]
    z: NDArray[np.float32]
    cosine: NDArray[np.float32]
    reflectance: NDArray[np.float32]
    normal: NDArray[np.float32]
    point: NDArray[np.float32]
    world_normal: NDArray[np.float32]
    color: NDArray[np.float32]
    lit: NDArray[np.uint8]


class Eye(NamedTuple):
    """What beams are traced with: triangles, what they are made of, the camera, and where its light comes from.

    light: (3,) float32, world, metres; (0,) where there is none.
    """

    tree: SceneHandle
    surfaces: Surfaces
    camera: PosedCamera
    light: NDArray[np.float32]


class BeamScratch(NamedTuple):
    """Memory of one thread: rays, lanes as of ``renderer.core.lanes``, and the beams of a packet, (16 * BEAM_FIELDS,) float32."""

    rays: Packet
    lanes: NDArray[np.float32]
    state: NDArray[np.float32]


_DONE, _WAY, _THROUGHPUT, _CLEAN, _Z = (LANES * field for field in range(5))
BEAM_FIELDS = 5


def make_beams(height: int, width: int) -> Beams:
    """Return images to be filled."""
    distance, z, cosine, reflectance = np.zeros((4, height, width), np.float32)
    normal, point, world_normal = np.zeros((3, height, width, 3), np.float32)
    color, lit = np.zeros((height, width, 2), np.float32), np.zeros((height, width), np.uint8)
    return Beams(distance, z, cosine, reflectance, normal, point, world_normal, color, lit)


def make_beam_scratch() -> BeamScratch:
    """Return the memory that one thread needs."""
    return BeamScratch(ray.make_packet(), ray.aligned_floats(ln.LANES_SIZE), ray.aligned_floats(BEAM_FIELDS * LANES))


@entry
def trace_beams(
    eye: Eye, jitter: NDArray[np.float32], tiles: NDArray[np.int32], scratch: BeamScratch, beams: Beams, first: int, step: int
) -> None:
    """Fill the beams of tiles ``first``, ``first + step``, ... of ``tiles``, numbers of 4 x 4 pixels row by row.

    ``jitter``: (32,) float32, as of ``aim_tile``.
    """
    rays, tree, camera = scratch.rays, eye.tree, eye.camera
    across = (camera.width + TILE - 1) // TILE
    for index in range(first, len(tiles), step):
        row, column = (tiles[index] // across) * TILE, (tiles[index] % across) * TILE
        aim_tile(camera, column, row, jitter, rays)
        _begin(camera, rays, scratch.lanes, scratch.state)
        _clear_pixels(camera, column, row, scratch, beams)
        # From surface to surface, until all beams have ended.
        going, depth = True, 0
        while going and depth <= _DEEPEST:
            intersect16(rays.alive.ctypes.data, tree.address, rays.real.ctypes.data, tree.coherent if depth == 0 else tree.incoherent)
            going = False
            for k in range(LANES):
                if rays.alive[k] != 0:
                    going |= _meet(eye, column + (k & 3), row + (k >> 2), k, scratch, beams)
            depth += 1
        if len(eye.light):
            _find_lit(eye, row, column, scratch, beams)


@inlined
def _clear_pixels(camera: PosedCamera, column: int, row: int, scratch: BeamScratch, beams: Beams) -> None:
    """Let nothing return to the pixels of a tile, and switch off the beams beside the image."""
    rays = scratch.rays
    for k in range(LANES):
        x, y = column + (k & 3), row + (k >> 2)
        if x >= camera.width or y >= camera.height:
            rays.alive[k] = 0
            continue
        beams.distance[y, x] = _INFINITE if rays.alive[k] != 0 else _NAN
        beams.z[y, x] = scratch.state[_Z + k]
        beams.cosine[y, x] = beams.reflectance[y, x] = _ZERO
        beams.lit[y, x] = 0
        for axis in range(3):
            beams.normal[y, x, axis] = beams.point[y, x, axis] = beams.world_normal[y, x, axis] = _ZERO
        beams.color[y, x, 0] = beams.color[y, x, 1] = _ZERO


@kernel
def _begin(camera: PosedCamera, rays: Packet, lanes: NDArray[np.float32], state: NDArray[np.float32]) -> None:
    """Make directions unit and the beams new."""
    real, r = rays.real, camera.rotation
    for k in range(LANES):
        dx, dy, dz = real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k]
        scale = _ONE / np.sqrt(dx * dx + dy * dy + dz * dz)
        real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k] = dx * scale, dy * scale, dz * scale
        state[_Z + k] = (r[0, 2] * dx + r[1, 2] * dy + r[2, 2] * dz) * scale
        state[_WAY + k], state[_THROUGHPUT + k], state[_CLEAN + k] = _ZERO, _ONE, _ONE
        state[_DONE + k] = _ZERO
        lanes[ln.WIDTH + k] = _ZERO


@kernel
def _meet(eye: Eye, x: int, y: int, k: int, scratch: BeamScratch, beams: Beams) -> bool:
    """Take what the beam of lane k has hit: write what returns, or send it on and return True."""
    rays, lanes, state, camera, surfaces = scratch.rays, scratch.lanes, scratch.state, eye.camera, eye.surfaces
    if rays.integer[ray.GEOM_ID + k] == INVALID_ID:
        rays.alive[k] = 0
        return False
    part = surfaces.face_part[rays.integer[ray.PRIM_ID + k]]
    at = np.int64(part) * st.ROW_SIZE
    table = surfaces.materials
    if table[at + st.PORTAL] > _ZERO:
        rays.alive[k] = 0
        beams.color[y, x, 0] = beams.color[y, x, 1] = np.float32(2.0)
        return False
    _find_place(camera, k, rays, lanes, state)
    _find_material(surfaces, part, at, k, rays, lanes)
    clear = table[at + st.TRANSMISSION]
    mirror = lanes[ln.METALLIC + k] > _HALF and lanes[ln.ROUGHNESS + k] < _SMOOTH
    if clear > _HALF or mirror:
        _send_on(mirror, clear, k, rays, lanes, state)
        return True
    shines = table[at + st.EMISSION] + table[at + st.EMISSION + 1] + table[at + st.EMISSION + 2] > _ZERO
    rays.alive[k] = 0
    _write_return(camera, clear, shines, x, y, k, scratch, beams)
    return False


@inlined
def _find_place(camera: PosedCamera, k: int, rays: Packet, lanes: NDArray[np.float32], state: NDArray[np.float32]) -> None:
    """Write the point of lane k, its normal towards the beam, the cosine there, and how far and wide the beam is by then."""
    real = rays.real
    t = real[ray.TFAR + k]
    dx, dy, dz = real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k]
    nx, ny, nz = real[ray.NG_X + k], real[ray.NG_Y + k], real[ray.NG_Z + k]
    scale = _ONE / max(np.sqrt(nx * nx + ny * ny + nz * nz), _TINY)
    cosine = -(nx * dx + ny * dy + nz * dz) * scale
    scale = -scale if cosine < _ZERO else scale
    lanes[ln.NG_X + k], lanes[ln.NG_Y + k], lanes[ln.NG_Z + k] = nx * scale, ny * scale, nz * scale
    lanes[ln.COS_FRONT + k] = max(abs(cosine), np.float32(1e-4))
    lanes[ln.P_X + k] = real[ray.ORG_X + k] + t * dx
    lanes[ln.P_Y + k] = real[ray.ORG_Y + k] + t * dy
    lanes[ln.P_Z + k] = real[ray.ORG_Z + k] + t * dz
    state[_WAY + k] += t
    lanes[ln.WIDTH + k] += t / camera.focal_px


@inlined
def _find_material(surfaces: Surfaces, part: int, at: np.int64, k: int, rays: Packet, lanes: NDArray[np.float32]) -> None:
    """Write the base colour, roughness and metalness of lane k, texture included; ``at``: where the row of its part begins."""
    table = surfaces.materials
    lanes[ln.BASE_R + k], lanes[ln.BASE_G + k], lanes[ln.BASE_B + k] = table[at + st.BASE], table[at + st.BASE + 1], table[at + st.BASE + 2]
    lanes[ln.ROUGHNESS + k], lanes[ln.METALLIC + k] = table[at + st.ROUGHNESS], table[at + st.METALLIC]
    lanes[ln.NS_X + k], lanes[ln.NS_Y + k], lanes[ln.NS_Z + k] = lanes[ln.NG_X + k], lanes[ln.NG_Y + k], lanes[ln.NG_Z + k]
    texture = surfaces.textures.part[part]
    if texture >= 0:
        apply_texture(surfaces.textures, texture, False, rays, k, lanes)


@inlined
def _send_on(mirror: bool, clear: np.float32, k: int, rays: Packet, lanes: NDArray[np.float32], state: NDArray[np.float32]) -> None:
    """Let the beam of lane k go on from a mirror or through glass of transmission ``clear``."""
    real = rays.real
    px, py, pz = lanes[ln.P_X + k], lanes[ln.P_Y + k], lanes[ln.P_Z + k]
    nx, ny, nz = lanes[ln.NG_X + k], lanes[ln.NG_Y + k], lanes[ln.NG_Z + k]
    side = lift_height(px, py, pz)
    if mirror:
        fold = np.float32(2.0) * lanes[ln.COS_FRONT + k]
        real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k] = (
            real[ray.DIR_X + k] + fold * nx,
            real[ray.DIR_Y + k] + fold * ny,
            real[ray.DIR_Z + k] + fold * nz,
        )
        state[_THROUGHPUT + k] *= lanes[ln.BASE_R + k] * lanes[ln.BASE_R + k]
    else:
        side = -side
        state[_THROUGHPUT + k] *= clear * clear * _GLASS_PASS
    state[_CLEAN + k] = _ZERO
    real[ray.ORG_X + k], real[ray.ORG_Y + k], real[ray.ORG_Z + k] = px + side * nx, py + side * ny, pz + side * nz
    real[ray.TNEAR + k], real[ray.TFAR + k] = _ZERO, _INFINITE
    rays.integer[ray.GEOM_ID + k] = INVALID_ID


@inlined
def _write_return(camera: PosedCamera, clear: np.float32, shines: bool, x: int, y: int, k: int, scratch: BeamScratch, beams: Beams) -> None:
    """Write to pixel (x, y) what the surface sends back along the beam of lane k; what ``shines`` itself is brighter than any base."""
    lanes, state = scratch.lanes, scratch.state
    red, green, blue = lanes[ln.BASE_R + k], lanes[ln.BASE_G + k], lanes[ln.BASE_B + k]
    metallic, rough, cosine = lanes[ln.METALLIC + k], lanes[ln.ROUGHNESS + k], lanes[ln.COS_FRONT + k]
    alpha2 = max(rough * rough, np.float32(1e-3))
    alpha2 *= alpha2
    c2 = cosine * cosine
    base = c2 * (alpha2 - _ONE) + _ONE
    masking = np.float32(2.0) * cosine / (cosine + np.sqrt(alpha2 + (_ONE - alpha2) * c2))
    gloss = (_GLOSS + (red - _GLOSS) * metallic) * alpha2 / (base * base) * masking / (np.float32(4.0) * c2)
    matt = (_ONE - metallic) * (_ONE - clear) * red
    beams.distance[y, x], beams.cosine[y, x] = state[_WAY + k], cosine
    beams.reflectance[y, x] = (matt + gloss) * state[_THROUGHPUT + k]
    beams.color[y, x, 0] = np.float32(2.0) if shines else np.float32(0.2126) * red + np.float32(0.7152) * green + np.float32(0.0722) * blue
    beams.color[y, x, 1] = np.float32(2.0) if shines else red * (_ONE - np.float32(0.5) * metallic)
    r, clean = camera.rotation, state[_CLEAN + k]
    nx, ny, nz = lanes[ln.NG_X + k], lanes[ln.NG_Y + k], lanes[ln.NG_Z + k]
    lift = lift_height(lanes[ln.P_X + k], lanes[ln.P_Y + k], lanes[ln.P_Z + k])
    for axis in range(3):
        beams.normal[y, x, axis] = clean * (r[0, axis] * nx + r[1, axis] * ny + r[2, axis] * nz)
        normal = lanes[ln.NG_X + LANES * axis + k]
        beams.world_normal[y, x, axis] = normal
        beams.point[y, x, axis] = lanes[ln.P_X + LANES * axis + k] + lift * normal
    beams.lit[y, x] = 1


@kernel
def _find_lit(eye: Eye, row: int, column: int, scratch: BeamScratch, beams: Beams) -> None:
    """Put in shadow what the projector does not see; what lies behind glass or in a mirror counts as lit."""
    rays, camera, tree, light = scratch.rays, eye.camera, eye.tree, eye.light
    real, integer = rays.real, rays.integer
    for k in range(LANES):
        x, y = column + (k & 3), row + (k >> 2)
        rays.alive[k] = 0
        if x < camera.width and y < camera.height and beams.lit[y, x] and scratch.state[_CLEAN + k] > _ZERO:
            rays.alive[k] = -1
            px, py, pz = beams.point[y, x, 0], beams.point[y, x, 1], beams.point[y, x, 2]
            dx, dy, dz = light[0] - px, light[1] - py, light[2] - pz
            if dx * beams.world_normal[y, x, 0] + dy * beams.world_normal[y, x, 1] + dz * beams.world_normal[y, x, 2] <= _ZERO:
                rays.alive[k] = 0
                beams.lit[y, x] = 0
            real[ray.ORG_X + k], real[ray.ORG_Y + k], real[ray.ORG_Z + k] = px, py, pz
            real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k] = dx, dy, dz
            real[ray.TNEAR + k], real[ray.TFAR + k] = _ZERO, _SHADOW_END
        integer[ray.GEOM_ID + k] = INVALID_ID
    occluded16(rays.alive.ctypes.data, tree.address, real.ctypes.data, tree.coherent)
    for k in range(LANES):
        if rays.alive[k] != 0 and real[ray.TFAR + k] < _ZERO:
            beams.lit[row + (k >> 2), column + (k & 3)] = 0
