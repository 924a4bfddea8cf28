"""Lamps, and the sky in panes, as flat mirrors show them, and lamps as panes do: nodes sample these images as lights."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.microfacet import fresnel_thin_dielectric
from renderer.bsdf.reflectance import Reflector, reflected_share
from renderer.core import ray_packet as ray
from renderer.core.color import LUMINANCE
from renderer.core.kernel import inlined
from renderer.core.layout import Layout
from renderer.core.random_numbers import mix_bits, unit_of
from renderer.core.ray_packet import LANES, Packet
from renderer.core.sampling import coordinate_system, cos_sin_two_pi, even_points
from renderer.irradiance_cache.hemisphere import GatherScratch, aim_hemisphere, follow, node_seed, sighted_light
from renderer.irradiance_cache.nodes import turned, unit_hash
from renderer.path import surface_tables as st
from renderer.path.infinite_light import sky_le
from renderer.path.light_nodes import Atlas
from renderer.path.records import LitScene
from renderer.path.surface_tables import Surfaces
from renderer.scene.flat_scene import FlatScene
from scene_description.products import matmul, norm

_ZERO, _ONE, _TWO, _FOUR, _PI = np.float32(0.0), np.float32(1.0), np.float32(2.0), np.float32(4.0), np.float32(np.pi)
_RED, _GREEN, _BLUE = (np.float32(weight) for weight in LUMINANCE)
_CHOICE = np.uint32(0x51A7E3)
_CLEAR_M = np.float32(1e-3)
_LEAST, _BY_PANE = np.float32(0.002), np.float32(0.1)
"""What an image must be able to bring, over all other light, to be sampled, and about what panes mirror."""

# A row of ``LampImages.rows``: the image of a lamp, or of a pane that shows the sky, in a mirror, metres, world.
_IMAGE = Layout()
IMAGE_BALL = _IMAGE.field(4)  # center and radius of a sphere around the image
IMAGE_ACROSS, IMAGE_UP = _IMAGE.field(3), _IMAGE.field(3)  # of a pane, half the sides of its image, vectors, else 0
MIRROR_NORMAL = _IMAGE.field(3)  # unit
MIRROR_LAMP_M = _IMAGE.field()  # how far before the mirror the lamp's center is
MIRROR_CENTER = _IMAGE.field(3)
MIRROR_ACROSS, MIRROR_UP = _IMAGE.field(3), _IMAGE.field(3)  # unit vectors of a rectangle around the mirror
MIRROR_HALF = _IMAGE.field(2)  # half of its sides
MIRROR_TINT = _IMAGE.field(3)  # what it mirrors of light, for a pane 1
MIRROR_IOR = _IMAGE.field()  # of a pane, which mirrors after Fresnel, else 0


class LampImages(NamedTuple):
    """Lamps and the sky in panes as flat mirrors show them, and lamps as panes do, which nodes sample as lights.

    Few of their rays would meet them by chance.

    rows: (i, _IMAGE.size) float32; lamp: (i,) int32, part, a lamp or pane; mirror: (i,) int32, its chart, as ``mirror`` of
    :class:`renderer.irradiance_cache.hemisphere.GatherScratch`; sampled: (p,) bool, parts whose images in all flat mirrors are among them;
    pattern: (16, 2) float32, points of the unit square by which nodes sample an image.
    """

    rows: NDArray[np.float32]
    lamp: NDArray[np.int32]
    mirror: NDArray[np.int32]
    sampled: NDArray[np.bool_]
    pattern: NDArray[np.float32]


NO_IMAGES = LampImages(
    np.zeros((0, _IMAGE.size), np.float32), np.zeros(0, np.int32), np.zeros(0, np.int32), np.zeros(0, np.bool_), even_points(LANES)
)


def find_images(flat: FlatScene, shines: NDArray[np.bool_], mirrors: NDArray[np.bool_], chart: NDArray[np.int32]) -> LampImages:
    """Return the images of all lights in all flat mirrors that they stand before, and of all lamps in panes.

    ``shines``, ``mirrors``: (m,) bool, triangles that are lights, panes among them, and those that are mirrors or panes; ``chart``: (m,)
    int32, equal for those that lie in one plane side by side.
    """
    corners = flat.mesh.vertices.astype(np.float64)[flat.mesh.faces]
    lights, panes = np.unique(flat.face_part[shines]), np.flatnonzero(flat.parts.portal)
    rows, pairs = [], []
    for plane in np.unique(chart[mirrors]).tolist():
        faces = np.flatnonzero(mirrors & (chart == plane))
        normal, center, axes, halves = _rectangle(corners[faces])
        part = flat.face_part[faces[0]]
        material = flat.parts.material[part]
        is_pane = flat.parts.portal[part]
        tint, ior = (np.ones(3), flat.materials.ior[material]) if is_pane else (flat.materials.base_color[material], 0.0)
        for lamp in (np.setdiff1d(lights, panes) if is_pane else lights).tolist():
            points = corners[flat.face_part == lamp].reshape(-1, 3)
            middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
            before_m = float(matmul(middle - center, normal))
            radius = np.linalg.norm(points - middle, axis=1).max()
            image = [*(middle - 2.0 * before_m * normal), radius, *_mirrored_sides(corners, flat, lamp, normal)]
            rows.append([*image, *normal, before_m, *center, *axes.ravel(), *halves, *tint, ior])
            pairs.append((lamp, plane))
    lamp, mirror = np.array(pairs, np.int32).reshape(-1, 2).T.copy()
    sampled = np.zeros(len(flat.parts.label), np.bool_)
    sampled[lamp] = True
    return LampImages(np.array(rows, np.float32).reshape(-1, _IMAGE.size), lamp, mirror, sampled, even_points(LANES))


def _mirrored_sides(corners: NDArray[np.float64], flat: FlatScene, light: int, normal: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return half the sides, two vectors, of the rectangle of a pane's image in a mirror of unit ``normal``; zeros for lamps."""
    if not flat.parts.portal[light]:
        return np.zeros(6)
    _, _, axes, halves = _rectangle(corners[flat.face_part == light])
    sides = axes * halves[:, None]
    return np.asarray(sides - 2.0 * matmul(sides, normal)[:, None] * normal).ravel()


def _rectangle(
    corners: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return unit normal, center, unit axes (2, 3) and half sides (2,) of a rectangle around triangles of a plane, (m, 3, 3)."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).sum(axis=0)
    normal /= norm(normal)
    across = corners[0, 1] - corners[0, 0]
    across /= norm(across)
    axes = np.array([across, np.cross(normal, across)])
    along = matmul(corners.reshape(-1, 3), axes.T)
    middle, halves = 0.5 * (along.min(axis=0) + along.max(axis=0)), 0.5 * np.ptp(along, axis=0)
    center = matmul(middle, axes) + matmul(corners[0, 0], normal) * normal
    return normal, center, axes, halves


@inlined
def is_image(images: LampImages, k: int, memory: GatherScratch) -> bool:
    """Return whether ray k has sighted a lamp by one flat mirror, as nodes sample it."""
    return bool(memory.mirror[k] >= 0 and images.sampled[memory.sighted[k]])


@inlined
def aim_cone(
    x: np.float32,
    y: np.float32,
    z: np.float32,
    spread: np.float32,
    pattern: NDArray[np.float32],
    u: np.float32,
    v: np.float32,
    rays: Packet,
) -> None:
    """Turn the 16 rays of a packet to directions of a cone about a unit direction, evenly over its solid angle.

    ``spread``: 1 less the cosine of half its angle; ``pattern``, ``u``, ``v``: as of :func:`aim_hemisphere`, which sets where rays begin.
    """
    ux, uy, uz, vx, vy, vz = coordinate_system(x, y, z)
    for k in range(LANES):
        below = spread * turned(pattern[k, 0], u)
        cosine, sine = cos_sin_two_pi(turned(pattern[k, 1], v))
        out = np.sqrt(below * (_TWO - below))
        a, b, c = out * cosine, out * sine, _ONE - below
        rays.real[ray.DIR_X + k] = a * ux + b * vx + c * x
        rays.real[ray.DIR_Y + k] = a * uy + b * vy + c * y
        rays.real[ray.DIR_Z + k] = a * uz + b * vz + c * z


@inlined
def _aim_at_pane(row: NDArray[np.float32], pattern: NDArray[np.float32], u: np.float32, v: np.float32, rays: Packet) -> None:
    """Turn the 16 rays of a packet to points that are evenly spread over a pane's image."""
    for k in range(LANES):
        right, up = _TWO * turned(pattern[k, 0], u) - _ONE, _TWO * turned(pattern[k, 1], v) - _ONE
        squared = _ZERO
        for axis in range(3):
            at = row[IMAGE_BALL + axis] + right * row[IMAGE_ACROSS + axis] + up * row[IMAGE_UP + axis]
            way = at - rays.real[ray.ORG_X + LANES * axis + k]
            rays.real[ray.DIR_X + LANES * axis + k] = way
            squared += way * way
        scale = _ONE / np.sqrt(squared)
        for axis in range(3):
            rays.real[ray.DIR_X + LANES * axis + k] *= scale


@inlined
def _solid_angle(
    row: NDArray[np.float32], position: NDArray[np.float32], x: np.float32, y: np.float32, z: np.float32, spread: np.float32
) -> np.float32:
    """Return the solid angle that one of 16 rays in a unit direction (x, y, z) stands for, sr; ``spread``: of the cone around an image."""
    ax, ay, az = row[IMAGE_ACROSS], row[IMAGE_ACROSS + 1], row[IMAGE_ACROSS + 2]
    bx, by, bz = row[IMAGE_UP], row[IMAGE_UP + 1], row[IMAGE_UP + 2]
    # Four times the cross product of half the sides is the pane's area times its normal.
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    along, before = x * nx + y * ny + z * nz, _ZERO
    before += (row[IMAGE_BALL] - position[0]) * nx
    before += (row[IMAGE_BALL + 1] - position[1]) * ny
    before += (row[IMAGE_BALL + 2] - position[2]) * nz
    if nx * nx + ny * ny + nz * nz == _ZERO or before == _ZERO:
        return _TWO * _PI * spread / np.float32(LANES)
    far = before / along
    angle: np.float32 = _FOUR * abs(along) / (far * far * np.float32(LANES))
    return angle


@inlined
def light_of_images(
    scene: LitScene,
    target: Atlas,
    atlas: Atlas,
    images: LampImages,
    reflector: Reflector,
    node: int,
    known: np.float32,
    key: np.uint32,
    memory: GatherScratch,
) -> tuple[np.float32, np.float32, np.float32, np.float32, np.float32, np.float32]:
    """Return illuminance (r, g, b) by lamps that flat mirrors and panes show to a node of ``target``, and luminance times direction.

    ``atlas``: coarse nodes; ``known``: other illuminance, r + g + b, of which a five-hundredth is too little to look for.  All images in
    mirrors are sampled, and of those in panes, which are faint, one by what it may bring.
    """
    u = unit_of(mix_bits(np.uint32(node_seed(node, key) ^ _CHOICE)))
    total, chosen, worth = _ZERO, -1, _ZERO
    r = g = b = x = y = z = _ZERO
    for i in range(len(images.lamp)):
        x_i, y_i, z_i, spread = _toward_image(images.rows[i], target.position[node], target.normal[node])
        share = _TWO * _PI * spread * _shown(scene.surfaces, images.lamp[i], images.rows[i], x_i, y_i, z_i)
        if images.rows[i, MIRROR_IOR] > _ZERO:
            share *= _BY_PANE
        if share <= _LEAST * known:
            continue
        if images.rows[i, MIRROR_IOR] > _ZERO:
            total += share
            # One of them, each with its share, by a single number (reservoir sampling).
            if u * total < share:
                chosen, worth, u = i, share, u * total / share
            else:
                u = (u * total - share) / (total - share)
            continue
        red, green, blue, dx, dy, dz = _light_of_image(scene, target, atlas, images, i, reflector, node, key, memory)
        r, g, b, x, y, z = r + red, g + green, b + blue, x + dx, y + dy, z + dz
    if chosen >= 0:
        red, green, blue, dx, dy, dz = _light_of_image(scene, target, atlas, images, chosen, reflector, node, key, memory)
        scale = total / worth
        r, g, b, x, y, z = r + scale * red, g + scale * green, b + scale * blue, x + scale * dx, y + scale * dy, z + scale * dz
    return r, g, b, x, y, z


@inlined
def _shown(surfaces: Surfaces, part: int, row: NDArray[np.float32], x: np.float32, y: np.float32, z: np.float32) -> np.float32:
    """Return the luminance, r + g + b, cd/m2, of a lamp, or of the sky that a pane shows, by a mirror in a unit direction."""
    emission = part * st.ROW_SIZE + st.EMISSION
    r, g, b = surfaces.materials[emission], surfaces.materials[emission + 1], surfaces.materials[emission + 2]
    if surfaces.materials[part * st.ROW_SIZE + st.PORTAL] > _ZERO:
        nx, ny, nz = row[MIRROR_NORMAL], row[MIRROR_NORMAL + 1], row[MIRROR_NORMAL + 2]
        back = _TWO * (x * nx + y * ny + z * nz)
        r, g, b = sky_le(surfaces.sky, x - back * nx, y - back * ny, z - back * nz)
    shown: np.float32 = r + g + b
    return shown


@inlined
def _light_of_image(
    scene: LitScene,
    target: Atlas,
    atlas: Atlas,
    images: LampImages,
    image: int,
    reflector: Reflector,
    node: int,
    key: np.uint32,
    memory: GatherScratch,
) -> tuple[np.float32, np.float32, np.float32, np.float32, np.float32, np.float32]:
    """Return the same by one image: 16 rays go to a sphere about it, or to a pane's rectangle; that light counts, by that mirror alone."""
    row, nx, ny, nz = images.rows[image], target.normal[node, 0], target.normal[node, 1], target.normal[node, 2]
    u, v = unit_hash(node, key)
    x, y, z, spread = _toward_image(row, target.position[node], target.normal[node])
    aim_hemisphere(target, node, images.pattern, 0, u, v, memory.trace.rays)
    if scene.surfaces.materials[images.lamp[image] * st.ROW_SIZE + st.PORTAL] > _ZERO:
        _aim_at_pane(row, images.pattern, u, v, memory.trace.rays)
    else:
        aim_cone(x, y, z, spread, images.pattern, u, v, memory.trace.rays)
    for j in range(3 * LANES):
        memory.toward[j] = memory.trace.rays.real[ray.DIR_X + j]
    memory.certain[0] = images.mirror[image]
    follow(scene, atlas, node_seed(node, key) + np.uint32(31 * image), memory)
    memory.certain[0] = -1
    r = g = b = vx = vy = vz = _ZERO
    for k in range(LANES):
        dx, dy, dz = memory.toward[k], memory.toward[LANES + k], memory.toward[2 * LANES + k]
        cosine = dx * nx + dy * ny + dz * nz
        if cosine > _ZERO and memory.sighted[k] == images.lamp[image] and memory.mirror[k] == images.mirror[image]:
            share = _solid_angle(row, target.position[node], dx, dy, dz, spread)
            share *= reflected_share(reflector, cosine, scene.surfaces.albedos.reflected)
            if row[MIRROR_IOR] > _ZERO:
                slant = abs(dx * row[MIRROR_NORMAL] + dy * row[MIRROR_NORMAL + 1] + dz * row[MIRROR_NORMAL + 2])
                share *= fresnel_thin_dielectric(min(slant, _ONE), row[MIRROR_IOR])
            red, green, blue = sighted_light(scene.surfaces, memory.sighted[k], memory.sights, k)
            red, green, blue = share * row[MIRROR_TINT] * red, share * row[MIRROR_TINT + 1] * green, share * row[MIRROR_TINT + 2] * blue
            r, g, b = r + cosine * red, g + cosine * green, b + cosine * blue
            weight = _RED * red + _GREEN * green + _BLUE * blue
            vx, vy, vz = vx + weight * dx, vy + weight * dy, vz + weight * dz
    return r, g, b, vx, vy, vz


@inlined
def _toward_image(
    row: NDArray[np.float32], position: NDArray[np.float32], normal: NDArray[np.float32]
) -> tuple[np.float32, np.float32, np.float32, np.float32]:
    """Return the unit direction from a node to a lamp's image, and 1 less the cosine of half the angle that it fills; 0 if it is not seen.

    It is seen within the rectangle around its mirror.
    """
    before_m = along = squared = _ZERO
    for axis in range(3):
        before_m += (position[axis] - row[MIRROR_CENTER + axis]) * row[MIRROR_NORMAL + axis]
        between = row[IMAGE_BALL + axis] - position[axis]
        along += between * normal[axis]
        squared += between * between
    radius = row[IMAGE_BALL + 3]
    if before_m <= _CLEAR_M or row[MIRROR_LAMP_M] <= _ZERO or along <= -radius or squared <= radius * radius:
        return _ZERO, _ZERO, _ZERO, _ZERO
    through_m = before_m + row[MIRROR_LAMP_M]
    share, right, up = before_m / through_m, _ZERO, _ZERO
    for axis in range(3):
        at = position[axis] + share * (row[IMAGE_BALL + axis] - position[axis]) - row[MIRROR_CENTER + axis]
        right, up = right + at * row[MIRROR_ACROSS + axis], up + at * row[MIRROR_UP + axis]
    far_m = np.sqrt(squared)
    margin, inverse = share * radius * far_m / through_m, _ONE / far_m
    if abs(right) > row[MIRROR_HALF] + margin or abs(up) > row[MIRROR_HALF + 1] + margin:
        return _ZERO, _ZERO, _ZERO, _ZERO
    sine_2 = radius * radius / squared
    x, y, z = row[IMAGE_BALL] - position[0], row[IMAGE_BALL + 1] - position[1], row[IMAGE_BALL + 2] - position[2]
    return inverse * x, inverse * y, inverse * z, sine_2 / (_ONE + np.sqrt(_ONE - sine_2))
