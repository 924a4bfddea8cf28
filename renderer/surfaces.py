"""What the rays of a packet hit: position, normals, reflectance and light sent back, one table look-up per lane.

The *lanes* of a packet are a flat float32 array beside it, in the same form: field ``POINT_X`` of lane k is ``lanes[POINT_X + k]``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.embree import (
    BARY_U,
    BARY_V,
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
    PRIM_ID,
    TFAR,
    Packet,
)
from renderer.flat_scene import FlatScene, Sky
from renderer.kernel import kernel
from renderer.lights import Lights, importance, load_bounds, sky_luminance

(
    POINT_X,  # where to start rays from: the hit, lifted off its surface towards the viewer, metres
    POINT_Y,
    POINT_Z,
    SIDE_X,  # unit geometric normal towards the viewer
    SIDE_Y,
    SIDE_Z,
    SHADE_X,  # unit shading normal, on the viewer's side too
    SHADE_Y,
    SHADE_Z,
    ALBEDO_R,
    ALBEDO_G,
    ALBEDO_B,
    GLOW_R,  # luminance that the surface sends to the viewer by itself, cd/m2
    GLOW_G,
    GLOW_B,
    GLOW_CHANCE,  # probability per steradian that drawing lights at the ray's origin finds this point
    COSINE,  # between the way back and the triangle's front; negative on its back
    REFLECTS,  # 1 where the path may go on, else 0
    CHANCE,  # probability per steradian with which the ray was sampled
    IMPORTANCE,  # of all lights together at the ray's origin
    NEAR,  # how many groups of lights the hit is near to
    FROM_X,  # shading normal at the ray's origin
    FROM_Y,
    FROM_Z,
    WEIGHT_R,  # throughput of the path so far
    WEIGHT_G,
    WEIGHT_B,
    LIGHT_R,  # light gathered by the path
    LIGHT_G,
    LIGHT_B,
    PENDING_R,  # light that arrives if the shadow ray is free
    PENDING_G,
    PENDING_B,
    DRAW_U,  # the current pair of random numbers
    DRAW_V,
) = range(0, 35 * LANES, LANES)
LANES_SIZE = 35 * LANES

_ZERO, _ONE, _TINY = np.float32(0.0), np.float32(1.0), np.float32(1e-30)
_USABLE = np.float32(1e-3)
_LIFT_M, _LIFT_RATIO = np.float32(2e-5), np.float32(4e-6)


class Surfaces(NamedTuple):
    """Triangles and parts of a scene, for kernels.

    faces (m, 3) uint32, normals (n, 3) float32, face_part (m,) int32; per part: albedo and emission (p, 3) float32, portal (p,) bool,
    transmission (p,) float32.
    """

    faces: NDArray[np.uint32]
    normals: NDArray[np.float32]
    face_part: NDArray[np.int32]
    albedo: NDArray[np.float32]
    emission: NDArray[np.float32]
    portal: NDArray[np.bool_]
    transmission: NDArray[np.float32]
    sky: Sky


def build_surfaces(flat: FlatScene) -> Surfaces:
    """Resolve the materials of a scene's parts."""
    material = flat.parts.material
    return Surfaces(
        np.ascontiguousarray(flat.mesh.faces),
        np.ascontiguousarray(flat.mesh.normals),
        np.ascontiguousarray(flat.face_part),
        np.ascontiguousarray(flat.materials.base_color[material]),
        np.ascontiguousarray(flat.parts.emission),
        np.ascontiguousarray(flat.parts.portal),
        np.ascontiguousarray(flat.materials.transmission[material]),
        Sky(*(np.ascontiguousarray(color) for color in flat.sky)),
    )


@kernel
def lift_height(x: np.float32, y: np.float32, z: np.float32) -> np.float32:
    """Return how far to stay off a surface at a point, in metres: some ten roundings of its coordinates."""
    return _LIFT_M + _LIFT_RATIO * max(abs(x), abs(y), abs(z))


@kernel
def find_surfaces(packet: Packet, surfaces: Surfaces, lights: Lights, primary: bool, lanes: NDArray[np.float32]) -> None:
    """Fill POINT to REFLECTS for 16 traced rays, and make their directions unit; lanes without a surface neither reflect nor glow.

    Camera rays (``primary``) that leave the scene see the sky; others are dark, as light from outside enters by panes only.
    """
    real, integer, sky = packet.real, packet.integer, surfaces.sky
    _place_points(packet, lanes)
    for k in range(LANES):
        lanes[REFLECTS + k] = _ZERO
        lanes[GLOW_CHANCE + k] = _ZERO
        for channel in range(0, 3 * LANES, LANES):
            lanes[GLOW_R + channel + k] = _ZERO
            lanes[ALBEDO_R + channel + k] = _ZERO
        if packet.alive[k] == 0:
            continue
        if integer[GEOM_ID + k] == INVALID_ID:
            if primary:
                for channel in range(3):
                    lanes[GLOW_R + LANES * channel + k] = sky_luminance(sky, channel, real[DIR_Z + k])
            continue
        face = integer[PRIM_ID + k]
        part = surfaces.face_part[face]
        if not surfaces.portal[part]:
            lanes[REFLECTS + k] = _ONE
            for channel in range(3):
                lanes[ALBEDO_R + LANES * channel + k] = surfaces.albedo[part, channel]
        _interpolate_normal(packet, surfaces, face, k, lanes)
        group = lights.face_group[face]
        if group >= 0 and lanes[COSINE + k] > _ZERO:
            for channel in range(3):
                lanes[GLOW_R + LANES * channel + k] = emitted_luminance(surfaces, part, channel, real[DIR_Z + k])
            if not primary:
                lanes[GLOW_CHANCE + k] = _light_chance(packet, lights, group, k, lanes)
    _orient_shading(lanes)


@kernel
def _light_chance(packet: Packet, lights: Lights, group: int, k: int, lanes: NDArray[np.float32]) -> np.float32:
    """Return the probability per steradian that drawing lights at the ray's origin gives the point that the ray hit."""
    real, groups = packet.real, lights.groups
    x, y, z = real[ORG_X + k], real[ORG_Y + k], real[ORG_Z + k]
    value = importance(load_bounds(groups, group), x, y, z, lanes[FROM_X + k], lanes[FROM_Y + k], lanes[FROM_Z + k])
    chance: np.float32 = value / lanes[IMPORTANCE + k] * real[TFAR + k] * real[TFAR + k] / (groups.area[group] * lanes[COSINE + k])
    return chance


@kernel
def emitted_luminance(surfaces: Surfaces, part: int, channel: int, z: np.float32) -> np.float32:
    """Return the luminance that the front of a part sends back to where a ray comes from; ``z``: the ray's unit direction's world z."""
    emission: np.float32 = surfaces.emission[part, channel]
    through: np.float32 = surfaces.transmission[part]
    return through * sky_luminance(surfaces.sky, channel, z) if surfaces.portal[part] else emission


@kernel
def _place_points(packet: Packet, lanes: NDArray[np.float32]) -> None:
    """Make directions unit, face the geometric normals to the viewer and lift the hit points off their surfaces."""
    real, integer = packet.real, packet.integer
    for k in range(LANES):
        dx, dy, dz = real[DIR_X + k], real[DIR_Y + k], real[DIR_Z + k]
        length = np.sqrt(dx * dx + dy * dy + dz * dz)
        dx, dy, dz = dx / length, dy / length, dz / length
        t = _ZERO if integer[GEOM_ID + k] == INVALID_ID else real[TFAR + k] * length
        nx, ny, nz = real[NG_X + k], real[NG_Y + k], real[NG_Z + k]
        scale = _ONE / max(np.sqrt(nx * nx + ny * ny + nz * nz), _TINY)
        cosine = -(nx * dx + ny * dy + nz * dz) * scale
        scale = -scale if cosine < _ZERO else scale
        nx, ny, nz = nx * scale, ny * scale, nz * scale
        x, y, z = real[ORG_X + k] + t * dx, real[ORG_Y + k] + t * dy, real[ORG_Z + k] + t * dz
        lift = lift_height(x, y, z)
        real[DIR_X + k], real[DIR_Y + k], real[DIR_Z + k], real[TFAR + k] = dx, dy, dz, t
        lanes[COSINE + k] = cosine
        lanes[SIDE_X + k], lanes[SIDE_Y + k], lanes[SIDE_Z + k] = nx, ny, nz
        lanes[SHADE_X + k], lanes[SHADE_Y + k], lanes[SHADE_Z + k] = nx, ny, nz
        lanes[POINT_X + k], lanes[POINT_Y + k], lanes[POINT_Z + k] = x + lift * nx, y + lift * ny, z + lift * nz


@kernel
def _interpolate_normal(packet: Packet, surfaces: Surfaces, face: int, k: int, lanes: NDArray[np.float32]) -> None:
    """Write the mesh's normal at the hit, not yet of unit length."""
    a, b, c = surfaces.faces[face, 0], surfaces.faces[face, 1], surfaces.faces[face, 2]
    v, w = packet.real[BARY_U + k], packet.real[BARY_V + k]
    u = _ONE - v - w
    for axis in range(3):
        lanes[SHADE_X + LANES * axis + k] = u * surfaces.normals[a, axis] + v * surfaces.normals[b, axis] + w * surfaces.normals[c, axis]


@kernel
def _orient_shading(lanes: NDArray[np.float32]) -> None:
    """Make shading normals unit and turn them to the geometric normal's side; where they are unusable, take the geometric one."""
    for k in range(LANES):
        x, y, z = lanes[SHADE_X + k], lanes[SHADE_Y + k], lanes[SHADE_Z + k]
        nx, ny, nz = lanes[SIDE_X + k], lanes[SIDE_Y + k], lanes[SIDE_Z + k]
        side = x * nx + y * ny + z * nz
        length = np.sqrt(x * x + y * y + z * z)
        scale = _ONE / max(length, _TINY)
        scale = -scale if side < _ZERO else scale
        usable = abs(side) > _USABLE * length
        lanes[SHADE_X + k] = x * scale if usable else nx
        lanes[SHADE_Y + k] = y * scale if usable else ny
        lanes[SHADE_Z + k] = z * scale if usable else nz
