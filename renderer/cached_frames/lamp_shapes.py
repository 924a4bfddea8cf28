"""What lamps and panes are like where rough gloss shows them: ellipsoids, and rectangles for what is flat."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

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
