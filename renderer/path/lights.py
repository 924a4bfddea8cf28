"""Lights: emissive triangles and window panes, and how a point is sampled among them.

Light leaves the front of a surface only.  A portal, a window pane, shows the environment behind it, so its luminance depends on direction.

Triangles are gathered in *groups*: those of one part that look along the same world axis, outer and inner sides apart.  From a point, a
group is chosen with probability proportional to a bound of the light that it can bring there: power over squared distance, times bounds of
the cosines at both ends (as importance in light trees, Conty Estevez and Kulla, "Importance Sampling of Many Lights", 2018), then a point
on the group evenly.  A group of importance 0 cannot light the point, so nothing is lost.
"""

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import kernel_cache.elementary as el
from renderer.core.color import LUMINANCE
from renderer.core.equirectangular import pixel_solid_angles
from renderer.core.kernel import inlined, kernel
from renderer.core.layout import Layout
from renderer.path.infinite_light import InfiniteLight, build_infinite_light
from renderer.scene.flat_scene import FlatScene
from renderer.scene.sky import sky_of
from renderer.scene.spot_lights import brightest_seen
from scene_description.products import matmul, norm

_ZERO, _ONE, _HALF, _TINY = np.float32(0.0), np.float32(1.0), np.float32(0.5), np.float32(1e-30)
_BELOW_ONE = np.float32(0.99999994)


class LightGroups(NamedTuple):
    """Groups of emitters, for kernels; arrays have one row per group, float32, metres.

    bounds: (g, 11), center and radius of a sphere around the vertices; axis, cosine and sine of a cone around the normals; the most that
    any triangle's plane lies behind the center; power, luminance times area.  area: (g,), m2.  start: (g + 1,) int32, ranges of triangles.
    """

    bounds: NDArray[np.float32]
    area: NDArray[np.float32]
    start: NDArray[np.int32]


Bounds = tuple[np.float32, ...]
"""A row of ``LightGroups.bounds`` in registers, so that loops over lanes read no table."""


_ROW = Layout()
EMITTER_CORNER = _ROW.field(3)  # metres
EMITTER_EDGE_1 = _ROW.field(3)
EMITTER_EDGE_2 = _ROW.field(3)
EMITTER_NORMAL = _ROW.field(3)  # unit
EMITTER_LE = _ROW.field(3)  # luminance (r, g, b) of a part that shines alike in all directions, cd/m2
EMITTER_AREA = _ROW.field()  # of its whole group, m2
EMITTER_KEEP = _ROW.field()  # share of its step of the group's alias table that is its own
EMITTER_SIZE = _ROW.size
EVENLY, BY_SKY, BY_PROFILE = range(3)


class Lights(NamedTuple):
    """All emitters of a scene, for kernels.

    emitters: (e * EMITTER_SIZE,) float32, a row of EMITTER fields for each triangle; other: (e,) int32, the triangle to which the rest of
    its step of the alias table belongs; varies: (e,) int32, how luminance depends on direction: EVENLY, BY_SKY or BY_PROFILE; part: (e,)
    int32; face_group: (m,) int32, group of each triangle of the scene, -1 where it does not shine; patches: (n, 11) float32, as
    :mod:`renderer.path.sun_patches` finds them in the scene's triangles, none until then.
    """

    groups: LightGroups
    emitters: NDArray[np.float32]
    other: NDArray[np.int32]
    varies: NDArray[np.int32]
    part: NDArray[np.int32]
    face_group: NDArray[np.int32]
    infinite: InfiniteLight
    patches: NDArray[np.float32]


def build_lights(flat: FlatScene) -> Lights:
    """Collect the emissive and portal triangles of a scene that have an area and a luminance."""
    corners = flat.mesh.vertices.astype(np.float64)[flat.mesh.faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = 0.5 * np.linalg.norm(cross, axis=1)
    luminance = _part_luminance(flat, cross)[flat.face_part]
    if len(flat.part_profile):
        row = flat.part_profile[flat.face_part]
        shaped = np.flatnonzero((row >= 0) & (area > 1e-10))
        luminance[shaped] *= brightest_seen(flat.profiles[row[shaped]], cross[shaped] / (2.0 * area[shaped, None]))
    # Triangles that shine, group by group.
    lit = np.flatnonzero((area > 1e-10) & (luminance > 0.0))
    unit = cross[lit] / (2.0 * area[lit, None])
    keys, group = np.unique(_group_keys(flat.face_part[lit].astype(np.int64), corners[lit].mean(axis=1), unit), return_inverse=True)
    order = np.argsort(group, kind="stable")
    lit, unit, group = lit[order], unit[order], group[order]
    start = np.searchsorted(group, np.arange(len(keys) + 1)).astype(np.int32)
    face_group = np.full(len(flat.face_part), -1, np.int32)
    face_group[lit] = group
    # Of each group bounds and area, and a table by which a triangle is drawn by area.
    rows = [_describe_group(corners[lit[a:b]], unit[a:b], area[lit[a:b]], luminance[lit[a:b]].max()) for a, b in pairwise(start)]
    table = np.array(rows, np.float32).reshape(-1, 12)
    groups = LightGroups(np.ascontiguousarray(table[:, :11]), np.ascontiguousarray(table[:, 11]), start)
    steps = [_alias_table(area[lit[a:b]]) for a, b in pairwise(start)]
    # A row for each triangle.
    part = np.ascontiguousarray(flat.face_part[lit], np.int32)
    emitters = np.zeros((len(lit), EMITTER_SIZE), np.float32)
    for column, values in (
        (EMITTER_CORNER, corners[lit, 0]),
        (EMITTER_EDGE_1, corners[lit, 1] - corners[lit, 0]),
        (EMITTER_EDGE_2, corners[lit, 2] - corners[lit, 0]),
        (EMITTER_NORMAL, unit),
        (EMITTER_LE, flat.parts.emission[part]),
    ):
        emitters[:, column : column + 3] = values
    emitters[:, EMITTER_AREA] = groups.area[group]
    emitters[:, EMITTER_KEEP] = np.concatenate([np.zeros(0), *(keep for keep, _ in steps)])
    varies = np.full(len(part), EVENLY, np.int32)
    if len(flat.part_profile):
        varies[flat.part_profile[part] >= 0] = BY_PROFILE
    varies[flat.parts.portal[part]] = BY_SKY
    return Lights(
        groups,
        emitters.reshape(-1),
        np.concatenate([np.zeros(0, np.int32), *(a + other for a, (_, other) in zip(start, steps, strict=False))]).astype(np.int32),
        varies,
        part,
        face_group,
        build_infinite_light(flat),
        np.zeros((0, 11), np.float32),
    )


def _alias_table(weights: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return which share of each of n equal steps is the entry's own (n,), and to which entry the rest belongs (n,).

    So one random number samples entries by weight without a search (Vose, "A Linear Algorithm for Generating Random Numbers with a Given
    Distribution", 1991).
    """
    keep, other = weights * (len(weights) / weights.sum()), np.arange(len(weights))
    small, large = [list(np.flatnonzero(chosen)) for chosen in (keep < 1.0, keep >= 1.0)]
    while small and large:
        low, high = small.pop(), large[-1]
        other[low] = high
        keep[high] -= 1.0 - keep[low]
        if keep[high] < 1.0:
            small.append(large.pop())
    keep[small + large] = 1.0
    return keep, other


def _group_keys(part: NDArray[np.int64], middle: NDArray[np.float64], unit: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return one number per group for triangles with these parts, middles (e, 3) and normals (e, 3)."""
    major = np.abs(unit).argmax(axis=1)
    negative = np.take_along_axis(unit, major[:, None], axis=1)[:, 0] < 0.0
    count = np.maximum(np.bincount(part), 1)
    center = np.column_stack([np.bincount(part, middle[:, axis]) / count for axis in range(3)])
    inward = ((middle - center[part]) * unit).sum(axis=1) < -1e-9
    return np.asarray(part * 12 + major * 4 + negative * 2 + inward)


def _describe_group(
    corners: NDArray[np.float64], unit: NDArray[np.float64], area: NDArray[np.float64], luminance: float
) -> NDArray[np.float64]:
    """Return the row of ``bounds``, and the area, of triangles (e, 3, 3) with normals (e, 3), bounds rounded up."""
    center = 0.5 * (corners.min(axis=(0, 1)) + corners.max(axis=(0, 1)))
    radius = np.linalg.norm(corners - center, axis=2).max() * (1.0 + 1e-5)
    axis = matmul(area, unit)
    axis /= norm(axis)
    angle = el.arccos(np.clip(matmul(unit, axis), -1.0, 1.0)).max() + 1e-4
    slack = ((center - corners[:, 0]) * unit).sum(axis=1).max() + 1e-5 * (1.0 + np.abs(corners).max())
    return np.array([*center, radius, *axis, math.cos(angle), math.sin(angle), slack, luminance * area.sum(), area.sum()])


def _part_luminance(flat: FlatScene, cross: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the mean luminance of each part's front, in cd/m2; ``cross``: (m, 3), the normals, twice the area long."""
    parts = flat.parts
    up = np.zeros((len(parts.label), 3))
    np.add.at(up, flat.face_part, cross)
    tilt = up[:, 2] / np.maximum(np.linalg.norm(up, axis=1), 1e-30)
    sky_share = 0.5 * (1.0 - tilt)  # of what a plane sees through a portal whose front looks the other way
    sky, ground = _mean_luminance(flat)
    # Never zero where any direction is lit: a portal's importance must not vanish while it shines.
    through = flat.materials.transmission[parts.material] * np.maximum(sky_share * sky + (1.0 - sky_share) * ground, 0.01 * (sky + ground))
    return np.asarray(np.where(parts.portal, through, matmul(parts.emission.astype(np.float64), LUMINANCE)))


def _mean_luminance(flat: FlatScene) -> tuple[float, float]:
    """Return the mean luminance of the smooth environment above and below the horizon, cd/m2; positive if there is an infinite light."""
    sky = sky_of(flat)
    least = 1.0 if len(sky.sun) or sky.bright.size else 0.0
    if not sky.table.size:
        return float(matmul(0.5 * (sky.zenith + sky.horizon), LUMINANCE)) + least, float(matmul(sky.ground, LUMINANCE))
    angle = pixel_solid_angles(*sky.table.shape[:2])
    rows = matmul(sky.table.astype(np.float64).mean(axis=1), LUMINANCE)
    half = len(rows) // 2
    return float(np.average(rows[:half], weights=angle[:half])) + least, float(np.average(rows[half:], weights=angle[half:]))


@kernel
def load_bounds(groups: LightGroups, g: int) -> Bounds:
    """Return row ``g`` of the groups' bounds."""
    row = groups.bounds
    x, y, z, radius = row[g, 0], row[g, 1], row[g, 2], row[g, 3]
    axis_x, axis_y, axis_z, cosine, sine = row[g, 4], row[g, 5], row[g, 6], row[g, 7], row[g, 8]
    return x, y, z, radius, axis_x, axis_y, axis_z, cosine, sine, row[g, 9], row[g, 10]


@kernel
def importance(bounds: Bounds, x: np.float32, y: np.float32, z: np.float32, nx: np.float32, ny: np.float32, nz: np.float32) -> np.float32:
    """Return the importance of a group of lights for a point (x, y, z) in metres with unit normal (nx, ny, nz)."""
    center_x, center_y, center_z, radius, axis_x, axis_y, axis_z, cosine, sine, slack, power = bounds
    cx, cy, cz = center_x - x, center_y - y, center_z - z
    squared = cx * cx + cy * cy + cz * cz
    distance = np.sqrt(squared)
    inverse = _ONE / (distance if distance > radius else radius)
    cos_surface = (cx * nx + cy * ny + cz * nz + radius) * inverse
    along = -(cx * axis_x + cy * axis_y + cz * axis_z)
    aside = squared - along * along
    tilted = along * cosine + np.sqrt(aside if aside > _ZERO else _ZERO) * sine
    nearest = distance if along > distance * cosine else tilted
    cos_light = (nearest + slack) * inverse
    # Spelled out, because min() and max() keep LLVM from vectorising the loop over lanes.
    cos_surface = cos_surface if cos_surface > _ZERO else _ZERO
    cos_surface = cos_surface if cos_surface < _ONE else _ONE
    cos_light = cos_light if cos_light > _ZERO else _ZERO
    cos_light = cos_light if cos_light < _ONE else _ONE
    value: np.float32 = power * cos_surface * cos_light * inverse * inverse
    return value


@inlined
def choose_emitter(lights: Lights, group: np.int32, u: np.float32) -> tuple[np.int32, np.float32]:
    """Return which triangle of a group ``u`` in [0, 1) falls on, and where within its share: in [0, 1), as good as a new random number."""
    first, count = lights.groups.start[group], lights.groups.start[group + 1] - lights.groups.start[group]
    scaled = u * np.float32(count)
    step = np.int32(scaled)
    step = step if step < count else count - np.int32(1)
    within, e = scaled - np.float32(step), np.int32(first + step)
    keep = lights.emitters[e * EMITTER_SIZE + EMITTER_KEEP]
    own = within < keep
    rest = _ONE - keep
    within = within / keep if own else (within - keep) / (rest if rest > _TINY else _TINY)
    return e if own else lights.other[e], clamp_unit(within)


@inlined
def clamp_unit(u: np.float32) -> np.float32:
    """Return ``u`` within [0, 1), for numbers that rounding has pushed out; 0 for what is no number."""
    u = u if u > _ZERO else _ZERO
    return u if u < _ONE else _BELOW_ONE


@inlined
def sample_triangle(u: np.float32, v: np.float32) -> tuple[np.float32, np.float32]:
    """Return weights of edge_1 and edge_2, even over the triangle (Heitz, "A Low-Distortion Map Between Triangle and Square", 2019)."""
    half_u, half_v, upper = _HALF * u, _HALF * v, v > u
    return half_u if upper else u - half_v, v - half_u if upper else half_v
