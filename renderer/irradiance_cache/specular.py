"""Surfaces that rays of the cache go on from: clear glass, straight through it and tinted, mirrors, and gloss by its microfacets."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.layers import boundary_reflectance
from renderer.bsdf.microfacet import sample_ggx_wm, schlick_weight, visible_share
from renderer.core import lanes as ln
from renderer.core import ray_packet as ray
from renderer.core.embree import intersect16, occluded16
from renderer.core.kernel import inlined
from renderer.core.random_numbers import mix_bits, unit_of
from renderer.core.ray_packet import INVALID_ID, LANES, MEET_ALL, PASS_PANES, Packet
from renderer.core.sampling import Vector, coordinate_system
from renderer.path import surface_tables as st
from renderer.path.records import LitScene, Scratch
from renderer.path.surface_tables import Surfaces

_ZERO, _HALF, _ONE, _TWO, _TINY = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(2.0), np.float32(1e-20)
SMOOTH = np.float32(0.15)
"""Roughness below which metal is a mirror."""
_CLEAR_M = np.float32(1e-4)
_SECOND, _LEAST_COSINE = np.uint32(23), np.float32(1e-6)
_DEEPEST = 8
"""Most faces of glass that a shadow ray passes."""


@inlined
def is_clear(materials: NDArray[np.float32], row: int) -> bool:
    """Return whether the part whose material begins at ``row`` is glass, panes apart."""
    clear: bool = (materials[row + st.TRANSMISSION] > st.CLEAR) & (materials[row + st.PORTAL] == _ZERO)
    return clear


@inlined
def clear_share(materials: NDArray[np.float32], row: int, channel: int) -> np.float32:
    """Return what of a channel's light goes on through one face of the clear glass whose material begins at ``row``.

    Two faces have the colour of the glass; as much as is opaque, and what is mirrored about, does not go on.
    """
    share: np.float32 = np.sqrt(materials[row + st.BASE + channel]) * materials[row + st.TRANSMISSION] * np.float32(0.96)
    return share


@inlined
def scattered_share(materials: NDArray[np.float32], row: int, channel: int, opaque: np.float32) -> np.float32:
    """Return what the front of clear glass mirrors and scatters of a channel's light, over all that does not go on through it.

    ``opaque``: what it reflects of light by all that is not glass.
    """
    reflected = opaque + np.float32(0.04) * materials[row + st.TRANSMISSION]
    return min(reflected / max(_ONE - clear_share(materials, row, channel), _TINY), _ONE)


@inlined
def is_mirror(materials: NDArray[np.float32], row: int) -> bool:
    """Return whether the part whose material begins at ``row`` is smooth metal."""
    mirror: bool = (materials[row + st.METALLIC] > _HALF) & (materials[row + st.ROUGHNESS] < SMOOTH)
    return mirror


@inlined
def is_brushed(materials: NDArray[np.float32], row: int) -> bool:
    """Return whether the part whose material begins at ``row`` is metal that scatters light about where it would mirror it."""
    brushed: bool = (materials[row + st.METALLIC] > _HALF) & (materials[row + st.ROUGHNESS] >= SMOOTH)
    return brushed


@inlined
def ray_cosine(rays: Packet, k: int) -> np.float32:
    """Return the cosine, from 0 on, between ray k and the normal of what it has hit."""
    real = rays.real
    dx, dy, dz = real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k]
    nx, ny, nz = real[ray.NG_X + k], real[ray.NG_Y + k], real[ray.NG_Z + k]
    squared = (dx * dx + dy * dy + dz * dz) * (nx * nx + ny * ny + nz * nz)
    cosine: np.float32 = abs(dx * nx + dy * ny + dz * nz) / np.sqrt(max(squared, _TINY))
    return min(cosine, _ONE)


@inlined
def along_normal(rays: Packet, k: int) -> np.float32:
    """Return the product of ray k's direction and the normal of what it has hit, neither of unit length: below 0 at the front."""
    real = rays.real
    along: np.float32 = (
        real[ray.DIR_X + k] * real[ray.NG_X + k] + real[ray.DIR_Y + k] * real[ray.NG_Y + k] + real[ray.DIR_Z + k] * real[ray.NG_Z + k]
    )
    return along


@inlined
def go_on(packet: Packet, k: int, mirror: bool) -> None:
    """Send ray k on from its hit, mirrored or straight, to be traced again."""
    real = packet.real
    if mirror:
        dx, dy, dz = real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k]
        nx, ny, nz = real[ray.NG_X + k], real[ray.NG_Y + k], real[ray.NG_Z + k]
        scale = -_TWO * (dx * nx + dy * ny + dz * nz) / max(nx * nx + ny * ny + nz * nz, _TINY)
        t = real[ray.TFAR + k]
        real[ray.ORG_X + k] += t * dx
        real[ray.ORG_Y + k] += t * dy
        real[ray.ORG_Z + k] += t * dz
        real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k] = dx + scale * nx, dy + scale * ny, dz + scale * nz
        real[ray.TNEAR + k] = _CLEAR_M
    else:
        real[ray.TNEAR + k] = real[ray.TFAR + k] + _CLEAR_M
    real[ray.TFAR + k] = np.inf
    packet.integer[ray.GEOM_ID + k] = INVALID_ID
    packet.alive[k] = -1


class Lobe(NamedTuple):
    """Microfacets: alpha, and what they reflect of each channel at normal incidence, and at grazing of all, for Schlick's formula."""

    alpha: np.float32
    r: np.float32
    g: np.float32
    b: np.float32
    f90: np.float32


@inlined
def metal_lobe(materials: NDArray[np.float32], row: int) -> Lobe:
    """Return that of the metal whose material begins at ``row``; what of it is no metal mirrors as its boundary does."""
    roughness, base, metal = materials[row + st.ROUGHNESS], row + st.BASE, materials[row + st.METALLIC]
    f0, f90 = boundary_reflectance(materials[row + st.IOR])
    f0, f90, alpha = (_ONE - metal) * f0, (_ONE - metal) * f90 + metal, roughness * roughness
    return Lobe(alpha, f0 + metal * materials[base], f0 + metal * materials[base + 1], f0 + metal * materials[base + 2], f90)


@inlined
def facing_normal(surfaces: Surfaces, k: int, rays: Packet) -> Vector:
    """Return the unit shading normal of what ray k has hit, on the side from which the ray comes."""
    real, normals = rays.real, surfaces.normals
    at = 9 * np.int64(rays.integer[ray.PRIM_ID + k])
    v, w = real[ray.BARY_U + k], real[ray.BARY_V + k]
    u = _ONE - v - w
    nx = u * normals[at] + v * normals[at + 3] + w * normals[at + 6]
    ny = u * normals[at + 1] + v * normals[at + 4] + w * normals[at + 7]
    nz = u * normals[at + 2] + v * normals[at + 5] + w * normals[at + 8]
    scale = (-_ONE if along_normal(rays, k) > _ZERO else _ONE) / max(np.sqrt(nx * nx + ny * ny + nz * nz), _TINY)
    return scale * nx, scale * ny, scale * nz


@inlined
def mirror_by_facet(surfaces: Surfaces, lobe: Lobe, seed: np.uint32, k: int, scratch: Scratch) -> bool:
    """Send ray k on from a surface by one of its microfacets that it sees; return whether it goes.

    BETA takes their colour, after Schlick, and what other microfacets do not hide.  A ray that would go into the surface ends.  Its back is
    like its front.  ``seed``: chooses the microfacet.
    """
    rays, lanes = scratch.rays, scratch.lanes
    real = rays.real
    dx, dy, dz = real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k]
    nx, ny, nz = facing_normal(surfaces, k, rays)
    wo_z = -(dx * nx + dy * ny + dz * nz)
    if wo_z <= _LEAST_COSINE:
        return False
    ux, uy, uz, vx, vy, vz = coordinate_system(nx, ny, nz)
    wo_x, wo_y = -(dx * ux + dy * uy + dz * uz), -(dx * vx + dy * vy + dz * vz)
    wm_x, wm_y, wm_z = sample_ggx_wm(wo_x, wo_y, wo_z, lobe.alpha, unit_of(seed), unit_of(mix_bits(np.uint32(seed + _SECOND))))
    half = wo_x * wm_x + wo_y * wm_y + wo_z * wm_z
    a, b, c = _TWO * half * wm_x - wo_x, _TWO * half * wm_y - wo_y, _TWO * half * wm_z - wo_z
    if c <= _ZERO:
        return False
    seen, schlick = visible_share(wo_z, c, lobe.alpha), schlick_weight(half)
    lanes[ln.BETA_R + k] *= seen * (lobe.r + (lobe.f90 - lobe.r) * schlick)
    lanes[ln.BETA_G + k] *= seen * (lobe.g + (lobe.f90 - lobe.g) * schlick)
    lanes[ln.BETA_B + k] *= seen * (lobe.b + (lobe.f90 - lobe.b) * schlick)
    go_on(rays, k, True)
    real[ray.DIR_X + k] = a * ux + b * vx + c * nx
    real[ray.DIR_Y + k] = a * uy + b * vy + c * ny
    real[ray.DIR_Z + k] = a * uz + b * vz + c * nz
    return True


@inlined
def _meets_box(boxes: NDArray[np.float32], packet: Packet, k: int) -> bool:
    """Return whether the line of ray k meets one of some boxes (n, 6)."""
    real = packet.real
    for i in range(len(boxes)):
        near, far = _ZERO, np.float32(np.inf)
        for axis in range(3):
            per = _ONE / real[ray.DIR_X + LANES * axis + k]
            origin = real[ray.ORG_X + LANES * axis + k]
            a, b = (boxes[i, axis] - origin) * per, (boxes[i, 3 + axis] - origin) * per
            first, last = (a, b) if a < b else (b, a)
            near, far = first if first > near else near, last if last < far else far
        if near <= far:
            return True
    return False


@inlined
def pass_glass(scene: LitScene, scratch: Scratch) -> None:
    """Trace shadow rays from P along TO_LIGHT; where something other than clear glass stands between, LIGHT_PDF becomes 0.

    Glass takes its colour from LI.
    """
    lanes, surfaces, packet = scratch.lanes, scene.surfaces, scratch.shadow_rays.packet
    real, integer, alive = packet.real, packet.integer, packet.alive
    for k in range(LANES):
        for axis in range(0, 3 * LANES, LANES):
            real[ray.ORG_X + axis + k], real[ray.DIR_X + axis + k] = lanes[ln.P_X + axis + k], lanes[ln.TO_LIGHT_X + axis + k]
        end = lanes[ln.LIGHT_END + k]
        real[ray.TNEAR + k], real[ray.TFAR + k] = _ZERO, end
        integer[ray.MASK + k] = PASS_PANES if end > _ONE else MEET_ALL
        alive[k] = -1 if lanes[ln.LIGHT_PDF + k] > _ZERO else 0
    occluded16(alive.ctypes.data, scene.tree.address, real.ctypes.data, scene.tree.incoherent)
    scratch.traced[0] += LANES
    waiting = 0
    for k in range(LANES):
        blocked = (alive[k] != 0) & (real[ray.TFAR + k] < _ZERO)
        glazed = blocked and _meets_box(surfaces.glass_boxes, packet, k)
        if blocked and not glazed:
            lanes[ln.LIGHT_PDF + k] = _ZERO
        alive[k] = -1 if glazed else 0
        waiting += glazed
        real[ray.TFAR + k], integer[ray.GEOM_ID + k] = lanes[ln.LIGHT_END + k], INVALID_ID
    # What is blocked may be so by clear glass where there is any: it is traced on from face to face.
    for _ in range(_DEEPEST):
        if waiting == 0:
            break
        intersect16(alive.ctypes.data, scene.tree.address, real.ctypes.data, scene.tree.incoherent)
        waiting = 0
        for k in range(LANES):
            if alive[k] == 0:
                continue
            if integer[ray.GEOM_ID + k] == INVALID_ID:
                alive[k] = 0
                continue
            row = surfaces.face_part[integer[ray.PRIM_ID + k]] * st.ROW_SIZE
            if is_clear(surfaces.materials, row):
                for channel in range(3):
                    lanes[ln.LI_R + channel * LANES + k] *= clear_share(surfaces.materials, row, channel)
                real[ray.TNEAR + k] = real[ray.TFAR + k] + np.float32(1e-5)
                real[ray.TFAR + k], integer[ray.GEOM_ID + k] = lanes[ln.LIGHT_END + k], INVALID_ID
                waiting += 1
            else:
                lanes[ln.LIGHT_PDF + k] = _ZERO
                alive[k] = 0
    for k in range(LANES):
        if alive[k] != 0:
            lanes[ln.LIGHT_PDF + k] = _ZERO
