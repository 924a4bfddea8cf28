"""Sun patches: where the sun's beams fall first, found once per scene, so that paths can look for them on purpose.

In a room that a low sun lights, nearly all light comes from a few bright patches by way of other surfaces; rays sampled from BSDFs find
them by luck.  Beams are traced from points of the portals, evenly over their cross-section; of those that nothing outside keeps out, what
they meet is gathered in *patches*: spheres about points that face alike, with a cone about their normals, described as groups of lights
are (:mod:`renderer.path.lights`).

A diffuse hit samples a quarter of its rays from the cones that the patches' spheres fill, each chosen by a bound of the light that it can
send there; the others from the BSDF.  The pdf of a direction is that of both together, so what is lit otherwise than by these beams, or
hidden from them, is still right in the mean: patches decide about noise only.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import kernel_cache.elementary as el
from renderer.core import lanes as ln
from renderer.core import ray_packet as ray
from renderer.core.color import LUMINANCE
from renderer.core.embree import SceneHandle, intersect16, occluded16
from renderer.core.kernel import entry, inlined, kernel
from renderer.core.ray_packet import INVALID_ID, LANES, MEET_ALL, PASS_PANES, Packet, make_packet
from renderer.core.sampling import coordinate_system, cos_sin_two_pi
from renderer.path.infinite_light import InfiniteLight
from renderer.path.lights import importance
from renderer.path.records import Scratch
from renderer.scene.flat_scene import FlatScene
from scene_description.products import matmul, norm

BEAMS, MOST_PATCHES, SMALL_M = 2048, 24, 0.15
_START_M = 2e-3
"""How far off its portal a beam begins."""
_DARKEST = 0.05
_LEAST_COS = 0.2
"""Of the sun's incidence, where penumbrae are drawn out."""
_SHARE = np.float32(0.25)
"""Of a diffuse hit's rays, sampled from the patches' cones."""
_ROUNDING_RAD = np.float32(1e-6)
"""By how much a sampled direction may leave its cone: what is sampled there must have the cone's pdf, or it counts thousandfold."""
_ZERO, _ONE, _TWO, _TINY, _TURN = np.float32(0.0), np.float32(1.0), np.float32(2.0), np.float32(1e-30), np.float32(2.0 * np.pi)
_CLEAR = np.float32(1.05)
"""A hit samples the patches from whose sphere it is at least this times the radius away."""


class Beams(NamedTuple):
    """Beams of the sun, evenly over the cross-section of all that the portals let in, ``section_m2``.

    origins: (n, 3) float64, metres, just within the portals; portals: (n,) int64, rows of ``InfiniteLight.portals``.
    """

    origins: NDArray[np.float64]
    portals: NDArray[np.int64]
    section_m2: float


def make_beams(infinite: InfiniteLight, count: int) -> Beams | None:
    """Return so many beams; None without a sun that shines on a portal."""
    if not len(infinite.sun) or not len(infinite.part):
        return None
    sun, portals = infinite.sun[:3].astype(np.float64), infinite.portals.astype(np.float64)
    corner, along, across, inward = (portals[:, first : first + 3] for first in range(0, 12, 3))
    section = np.maximum(matmul(-inward, sun), 0.0) * 0.5 * np.linalg.norm(np.cross(along, across), axis=1)
    if section.sum() <= 0.0:
        return None
    # Points of the portals, evenly over the beams' cross-section (Roberts' R2 sequence).
    number = np.arange(count)
    chosen = np.searchsorted(np.cumsum(section) / section.sum(), (number + 0.5) / count).clip(0, len(section) - 1)
    u, v = (0.5 + number * 0.7548776662466927) % 1.0, (0.5 + number * 0.5698402909980532) % 1.0
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    origins = corner[chosen] + u[:, None] * along[chosen] + v[:, None] * across[chosen] - _START_M * sun
    return Beams(origins, chosen, float(section.sum()))


def find_sun_patches(flat: FlatScene, infinite: InfiniteLight, tree: SceneHandle) -> NDArray[np.float32]:
    """Return the patches of a scene, (n, 11) float32, as ``LightGroups.bounds``; none without a sun that shines through a portal."""
    none = np.zeros((0, 11), np.float32)
    beams = make_beams(infinite, BEAMS)
    if beams is None:
        return none
    sun, origins = infinite.sun[:3].astype(np.float64), beams.origins
    triangles, distances = np.full(BEAMS, -1, np.int64), np.zeros(BEAMS, np.float32)
    _trace_beams(tree, make_packet(), origins.astype(np.float32), np.tile(-infinite.sun[:3], (BEAMS, 1)), triangles, distances)
    part = flat.face_part[triangles]
    met = (triangles >= 0) & ~flat.parts.portal[part]
    if not met.any():
        return none
    points = (origins - distances[:, None] * sun)[met]
    a, b, c = (flat.mesh.vertices[flat.mesh.faces[triangles[met], i]].astype(np.float64) for i in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    normals *= np.where(matmul(normals, sun) < 0.0, -1.0, 1.0)[:, None]
    power = _DARKEST + matmul(flat.materials.base_color[flat.parts.material[part[met]]], LUMINANCE)
    # Between beams, and in the penumbra, which is as wide as the sun's disk is from there.
    penumbra = distances[met] * math.sqrt(2.0 * float(infinite.sun[3])) / np.maximum(matmul(normals, sun), _LEAST_COS)
    around = np.sqrt(beams.section_m2 / BEAMS) + penumbra
    return np.array([_described(points[i], normals[i], power[i], around[i].max()) for i in _gathered(points, normals)], np.float32)


def _gathered(points: NDArray[np.float64], normals: NDArray[np.float64]) -> list[NDArray[np.int64]]:
    """Return which points make each patch: those that face along one axis, the widest halved until they are small or many."""
    major = np.abs(normals).argmax(axis=1)
    facing = 2 * major + (np.take_along_axis(normals, major[:, None], axis=1)[:, 0] < 0.0)
    patches = [np.flatnonzero(facing == side) for side in np.unique(facing)]
    while len(patches) < MOST_PATCHES:
        widths = [np.ptp(points[patch], axis=0).max() for patch in patches]
        widest = int(np.argmax(widths))
        if widths[widest] < SMALL_M:
            break
        patch = patches.pop(widest)
        axis = int(np.ptp(points[patch], axis=0).argmax())
        middle = points[patch][:, axis].min() + 0.5 * widths[widest]
        low = points[patch][:, axis] <= middle
        patches += [patch[low], patch[~low]]
    return patches


def _described(points: NDArray[np.float64], normals: NDArray[np.float64], power: NDArray[np.float64], around_m: float) -> list[float]:
    """Return the row of a patch; its sphere reaches so far beyond its points."""
    center = 0.5 * (points.min(axis=0) + points.max(axis=0))
    radius = np.linalg.norm(points - center, axis=1).max() + around_m
    axis = normals.mean(axis=0)
    axis /= norm(axis)
    angle = el.arccos(np.clip(matmul(normals, axis), -1.0, 1.0)).max() + 0.01
    slack = ((center - points) * normals).sum(axis=1).max() + around_m
    return [*center, radius, *axis, math.cos(angle), math.sin(angle), slack, power.sum()]


@entry
def _trace_beams(
    scene: SceneHandle,
    packet: Packet,
    origins: NDArray[np.float32],
    directions: NDArray[np.float32],
    triangles: NDArray[np.int64],
    distances: NDArray[np.float32],
) -> None:
    """Fill ``triangles`` and ``distances`` of the nearest hits of rays from ``origins`` along unit ``directions``, (n, 3) both.

    Left as they are where nothing is met.
    """
    for first in range(0, len(origins), LANES):
        shine_in(scene, packet, origins, directions, first)
        for k in range(LANES):
            if packet.integer[ray.GEOM_ID + k] != INVALID_ID:
                triangles[first + k], distances[first + k] = packet.integer[ray.PRIM_ID + k], packet.real[ray.TFAR + k]


@inlined
def shine_in(scene: SceneHandle, packet: Packet, origins: NDArray[np.float32], directions: NDArray[np.float32], first: int) -> None:
    """Trace 16 beams from ``origins`` along unit ``directions``, (n, 3) both; those that something outside keeps out meet nothing.

    What stands in their way, as the window's frame, is what rays back to the sun or the sky meet, which pass panes.
    """
    real, integer, alive = packet.real, packet.integer, packet.alive
    for k in range(LANES):
        aim(packet, k, origins[first + k], directions[first + k], -_ONE)
        integer[ray.MASK + k], alive[k] = PASS_PANES, -1
    occluded16(alive.ctypes.data, scene.address, real.ctypes.data, scene.coherent)
    for k in range(LANES):
        # Embree sets the end of a blocked ray to minus infinity.
        alive[k] = -1 if real[ray.TFAR + k] > _ZERO else 0
        aim(packet, k, origins[first + k], directions[first + k], _ONE)
        integer[ray.MASK + k], integer[ray.GEOM_ID + k] = MEET_ALL, INVALID_ID
    intersect16(alive.ctypes.data, scene.address, real.ctypes.data, scene.coherent)


@inlined
def aim(packet: Packet, k: int, origin: NDArray[np.float32], direction: NDArray[np.float32], sign: np.float32) -> None:
    """Aim lane k along a direction, or with ``sign`` -1 against it, without an end."""
    for axis in range(3):
        packet.real[ray.ORG_X + LANES * axis + k] = origin[axis]
        packet.real[ray.DIR_X + LANES * axis + k] = sign * direction[axis]
    packet.real[ray.TNEAR + k], packet.real[ray.TFAR + k] = _ZERO, np.float32(np.inf)


@inlined
def weigh_patches(patches: NDArray[np.float32], scratch: Scratch) -> None:
    """Fill the weight of every patch for every lane, PATCHES with their sums, and GUIDED: the share of rays that go for them."""
    lanes, weights = scratch.lanes, scratch.patch_weights
    for k in range(LANES):
        lanes[ln.PATCHES + k] = _ZERO
    for p in range(len(patches)):
        row = patches[p]
        bounds = (row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7], row[8], row[9], row[10])
        near = _CLEAR * _CLEAR * row[3] * row[3]
        for k in range(LANES):
            x, y, z = lanes[ln.P_X + k], lanes[ln.P_Y + k], lanes[ln.P_Z + k]
            value = importance(bounds, x, y, z, lanes[ln.NS_X + k], lanes[ln.NS_Y + k], lanes[ln.NS_Z + k])
            cx, cy, cz = row[0] - x, row[1] - y, row[2] - z
            value = value if cx * cx + cy * cy + cz * cz > near else _ZERO
            weights[p * LANES + k] = value
            lanes[ln.PATCHES + k] += value
    for k in range(LANES):
        usable = (lanes[ln.PATCHES + k] > _ZERO) & (lanes[ln.CONTINUES + k] > _ZERO) & (lanes[ln.PR_GLASS + k] == _ZERO)
        lanes[ln.GUIDED + k] = _SHARE * lanes[ln.PR_DIFFUSE + k] if usable else _ZERO


@inlined
def sample_patches(patches: NDArray[np.float32], scratch: Scratch) -> None:
    """Replace WI by a direction to a patch in the lanes whose random number is below GUIDED."""
    lanes, weights = scratch.lanes, scratch.patch_weights
    for k in range(LANES):
        share = lanes[ln.GUIDED + k]
        if not lanes[ln.U_PATCH + k] < share:
            continue
        left, chosen = lanes[ln.U_PATCH + k] / share * lanes[ln.PATCHES + k], -1
        for p in range(len(patches)):
            weight = weights[p * LANES + k]
            if weight > _ZERO:
                chosen = p
                if left < weight:
                    break
                left -= weight
        row = patches[chosen]
        cx, cy, cz = row[0] - lanes[ln.P_X + k], row[1] - lanes[ln.P_Y + k], row[2] - lanes[ln.P_Z + k]
        scale, gap = _cone(cx, cy, cz, row[3])
        cx, cy, cz = cx * scale, cy * scale, cz * scale
        below = lanes[ln.U_BSDF_0 + k] * gap
        sine = np.sqrt(max(below * (_ONE + _ONE - below), _ZERO))
        turn_x, turn_y = cos_sin_two_pi(lanes[ln.U_BSDF_1 + k])
        ux, uy, uz, vx, vy, vz = coordinate_system(cx, cy, cz)
        s, t, along = sine * turn_x, sine * turn_y, _ONE - below
        x, y, z = s * ux + t * vx + along * cx, s * uy + t * vy + along * cy, s * uz + t * vz + along * cz
        lanes[ln.WI_X + k] = x * lanes[ln.TANGENT_X + k] + y * lanes[ln.TANGENT_Y + k] + z * lanes[ln.TANGENT_Z + k]
        lanes[ln.WI_Y + k] = x * lanes[ln.BITANGENT_X + k] + y * lanes[ln.BITANGENT_Y + k] + z * lanes[ln.BITANGENT_Z + k]
        lanes[ln.WI_Z + k] = x * lanes[ln.NS_X + k] + y * lanes[ln.NS_Y + k] + z * lanes[ln.NS_Z + k]


@kernel
def mix_patch_pdf(patches: NDArray[np.float32], weights: NDArray[np.float32], lanes: NDArray[np.float32]) -> None:
    """Turn PDF, of sampling WI from the BSDF, into that of sampling it from the BSDF or the patches, whichever is chosen."""
    for k in range(LANES):
        x, y, z = lanes[ln.WI_X + k], lanes[ln.WI_Y + k], lanes[ln.WI_Z + k]
        lanes[ln.TOWARD_X + k] = x * lanes[ln.TANGENT_X + k] + y * lanes[ln.BITANGENT_X + k] + z * lanes[ln.NS_X + k]
        lanes[ln.TOWARD_Y + k] = x * lanes[ln.TANGENT_Y + k] + y * lanes[ln.BITANGENT_Y + k] + z * lanes[ln.NS_Y + k]
        lanes[ln.TOWARD_Z + k] = x * lanes[ln.TANGENT_Z + k] + y * lanes[ln.BITANGENT_Z + k] + z * lanes[ln.NS_Z + k]
        lanes[ln.PATCH_PDF + k] = _ZERO
    for p in range(len(patches)):
        center_x, center_y, center_z, radius = patches[p, 0], patches[p, 1], patches[p, 2], patches[p, 3]
        row = weights[p * LANES : (p + 1) * LANES]
        for k in range(LANES):
            cx, cy, cz = center_x - lanes[ln.P_X + k], center_y - lanes[ln.P_Y + k], center_z - lanes[ln.P_Z + k]
            squared = cx * cx + cy * cy + cz * cz
            sine_squared = radius * radius / squared
            rest = _ONE - sine_squared
            gap = sine_squared / (_ONE + np.sqrt(rest if rest > _ZERO else _ZERO))
            # A cosine as near to 1 as that of a narrow cone has no digits left; half the squared chord is the same gap, with all of them.
            scale = _ONE / np.sqrt(squared)
            dx = lanes[ln.TOWARD_X + k] - scale * cx
            dy = lanes[ln.TOWARD_Y + k] - scale * cy
            dz = lanes[ln.TOWARD_Z + k] - scale * cz
            reach = np.sqrt(_TWO * gap) + _ROUNDING_RAD
            within = dx * dx + dy * dy + dz * dz <= reach * reach
            lanes[ln.PATCH_PDF + k] += row[k] / gap if within else _ZERO
    for k in range(LANES):
        total = _TURN * lanes[ln.PATCHES + k]
        pdf = lanes[ln.PATCH_PDF + k] / (total if total > _TINY else _TINY)
        lanes[ln.PDF + k] += lanes[ln.GUIDED + k] * (pdf - lanes[ln.PDF + k])


@inlined
def _cone(cx: np.float32, cy: np.float32, cz: np.float32, radius: np.float32) -> tuple[np.float32, np.float32]:
    """Return 1 / |c|, and 1 minus the cosine of the angle that a sphere about c fills, seen from the origin outside of it."""
    squared = cx * cx + cy * cy + cz * cz
    sine_squared = radius * radius / squared
    cosine = np.sqrt(max(_ONE - sine_squared, _ZERO))
    return _ONE / np.sqrt(squared), sine_squared / (_ONE + cosine)
