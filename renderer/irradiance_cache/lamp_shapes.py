"""What lamps and panes are like where rough gloss shows them: ellipsoids, and rectangles for what is flat; their images in mirrors."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core.layout import Layout
from renderer.core.ray_packet import LANES
from renderer.core.sampling import even_points
from renderer.scene.flat_scene import FlatScene, Sky
from scene_description.products import matmul, norm


class Lamps(NamedTuple):
    """Lamps and panes as balls and rectangles, by which rough gloss shows them, for kernels.

    balls: (n, 14) float32, centre, radius in metres, mean normal, whether it is flat, and if so half the sides (two vectors, metres) of
    its rectangle, otherwise the form (xx, yy, zz, xy, xz, yz, m4) of directions that is the fourth power of the radius of what it shows
    there; part: (n,) int32; most: (n,) float32, the most that one shows, r + g + b, cd/m2.
    """

    balls: NDArray[np.float32]
    part: NDArray[np.int32]
    most: NDArray[np.float32]


_AXES = ((1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, -1, 0), (1, 0, 1), (1, 0, -1), (0, 1, 1), (0, 1, -1))
"""Along these and between two each it is asked what a lamp shows."""


def build_lamps(flat: FlatScene, sky: Sky) -> Lamps:
    """Return a ball for each part that shines and each pane, with its rectangle for what is flat, and what else shows in directions.

    ``sky``: what panes show.
    """
    corners = flat.mesh.vertices.astype(np.float64)[flat.mesh.faces]
    cross = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    found = np.flatnonzero((flat.parts.emission > 0.0).any(axis=1) | flat.parts.portal)
    rows, parts = [], []
    for part in found.tolist():
        faces = np.flatnonzero(flat.face_part == part)
        area = np.linalg.norm(cross[faces], axis=1)
        center = np.average(corners[faces].mean(axis=1), axis=0, weights=np.maximum(area, 1e-12))
        normal = cross[faces].sum(axis=0)
        level = norm(normal) > 0.5 * area.sum()
        shown_m2 = max(_shown_m2(cross[faces], axis) for axis in np.eye(3))
        if flat.parts.portal[part]:
            shown_m2 = norm(normal)
        normal /= max(norm(normal), 1e-12)
        shape = _half_axes(corners[faces], area, normal, shown_m2).ravel() if level else _squared_radii(cross[faces])
        rows.append([*center, np.sqrt(shown_m2 / np.pi), *normal, float(level), *shape])
        parts.append(part)
    most = np.where(flat.parts.portal[found], _brightest(sky), flat.parts.emission[found].sum(axis=1))
    return Lamps(np.array(rows, np.float32).reshape(-1, 14), np.array(parts, np.int32), most.astype(np.float32))


def _brightest(sky: Sky) -> float:
    """Return the most luminance of a sky, r + g + b, cd/m2, its sun and the like apart."""
    if sky.table.size:
        return float(sky.table.sum(axis=2).max())
    return float(max(color.sum() for color in (sky.zenith, sky.horizon, sky.ground)))


def _shown_m2(cross: NDArray[np.float64], axis: NDArray[np.float64]) -> float:
    """Return the area that triangles of area vectors (m, 3) show along an axis, from the side from which they show more."""
    along = matmul(cross, axis)
    return float(max(np.maximum(along, 0.0).sum(), np.maximum(-along, 0.0).sum()))


def _squared_radii(cross: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the quadratic form (xx, yy, zz, xy, xz, yz), m4, of unit directions: the fourth power of the radius of the disc shown there.

    What an ellipsoid shows is the root of such a form; ``cross``: (m, 3), area vectors of what is to be like one.
    """
    squared = {axis: (_shown_m2(cross, np.array(axis) / norm(np.array(axis, np.float64))) / np.pi) ** 2 for axis in _AXES}
    mixed = [0.5 * (squared[axis] - squared[other]) for axis, other in zip(_AXES[3::2], _AXES[4::2], strict=True)]
    return np.array([*(squared[axis] for axis in _AXES[:3]), *mixed])


def _half_axes(
    corners: NDArray[np.float64], area: NDArray[np.float64], normal: NDArray[np.float64], shown_m2: float
) -> NDArray[np.float64]:
    """Return half the sides, (2, 3), metres, of the rectangle that stands for something flat: of its area, along a side of its own."""
    edges = np.roll(corners[area.argmax()], -1, axis=0) - corners[area.argmax()]
    # The longest edge of half a rectangle is its diagonal.
    along = edges[np.argsort(np.linalg.norm(edges, axis=1), kind="stable")[1]]
    along = along - matmul(along, normal) * normal
    along /= max(norm(along), 1e-12)
    axes = np.array([along, np.cross(normal, along)])
    halves = 0.5 * np.ptp(matmul(corners.reshape(-1, 3), axes.T), axis=0)
    scaled: NDArray[np.float64] = axes * (halves * np.sqrt(shown_m2 / max(4.0 * halves[0] * halves[1], 1e-12)))[:, None]
    return scaled


# A row of ``LampImages.rows``: a lamp's image in a mirror, metres, world.
_IMAGE = Layout()
IMAGE_BALL = _IMAGE.field(4)  # center and radius of a sphere around the image
MIRROR_NORMAL = _IMAGE.field(3)  # unit
MIRROR_LAMP_M = _IMAGE.field()  # how far before the mirror the lamp's center is
MIRROR_CENTER = _IMAGE.field(3)
MIRROR_ACROSS, MIRROR_UP = _IMAGE.field(3), _IMAGE.field(3)  # unit vectors of a rectangle around the mirror
MIRROR_HALF = _IMAGE.field(2)  # half of its sides
MIRROR_TINT = _IMAGE.field(3)  # what it mirrors of light, for a pane 1
MIRROR_IOR = _IMAGE.field()  # of a pane, which mirrors after Fresnel, else 0
IMAGE_LE = _IMAGE.field()  # luminance of the lamp, r + g + b, cd/m2


class LampImages(NamedTuple):
    """Lamps as flat mirrors and panes show them, which nodes sample as lights: their rays would meet few by chance.

    rows: (i, _IMAGE.size) float32; lamp: (i,) int32, part; mirror: (i,) int32, its chart, as ``mirror`` of
    :class:`renderer.irradiance_cache.hemisphere.GatherScratch`; sampled: (p,) bool, parts whose images in all flat mirrors are among them;
    pattern: (16, 2) float32, points of the unit square by which nodes sample an image.
    """

    rows: NDArray[np.float32]
    lamp: NDArray[np.int32]
    mirror: NDArray[np.int32]
    sampled: NDArray[np.bool_]
    pattern: NDArray[np.float32]


def find_images(flat: FlatScene, shines: NDArray[np.bool_], mirrors: NDArray[np.bool_], chart: NDArray[np.int32]) -> LampImages:
    """Return the images of all lamps in all flat mirrors and panes that they stand before.

    ``shines``, ``mirrors``: (m,) bool, triangles that are lights, and those that are mirrors or panes; ``chart``: (m,) int32, equal for those that
    lie in one plane side by side.
    """
    corners = flat.mesh.vertices.astype(np.float64)[flat.mesh.faces]
    lamps = np.setdiff1d(flat.face_part[shines], np.flatnonzero(flat.parts.portal))
    rows, pairs = [], []
    for plane in np.unique(chart[mirrors]).tolist():
        faces = np.flatnonzero(mirrors & (chart == plane))
        normal, center, axes, halves = _rectangle(corners[faces])
        part = flat.face_part[faces[0]]
        material = flat.parts.material[part]
        is_pane = flat.parts.portal[part]
        tint, ior = (np.ones(3), flat.materials.ior[material]) if is_pane else (flat.materials.base_color[material], 0.0)
        for lamp in lamps.tolist():
            points = corners[flat.face_part == lamp].reshape(-1, 3)
            middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
            before_m = float(matmul(middle - center, normal))
            radius = np.linalg.norm(points - middle, axis=1).max()
            image = [*(middle - 2.0 * before_m * normal), radius, *normal, before_m]
            rows.append([*image, *center, *axes.ravel(), *halves, *tint, ior, flat.parts.emission[lamp].sum()])
            pairs.append((lamp, plane))
    lamp, mirror = np.array(pairs, np.int32).reshape(-1, 2).T.copy()
    sampled = np.zeros(len(flat.parts.label), np.bool_)
    sampled[lamp] = True
    return LampImages(np.array(rows, np.float32).reshape(-1, _IMAGE.size), lamp, mirror, sampled, even_points(LANES))


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
