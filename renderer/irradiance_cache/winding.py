"""Closed bodies that overlap themselves: which of their triangles are seen from behind all the same, as the underside of a deep bowl is."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.core.kernel import entry
from renderer.geometry.mesh import Mesh
from renderer.irradiance_cache.charts import Charts

_BEHIND_M = 1e-4
_LEAN = (0.0131, 0.0079)
"""By how much rays lean away from the normal, so that they meet no edges of the same shape opposite."""


def seen_from_behind(mesh: Mesh, charts: Charts, doubtful: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the triangles (m,) of closed bodies behind which, or behind one of whose chart, there is no inside.

    A point just behind the middle of a triangle is within the body if its winding number is not 0: the number of times that a ray from it
    leaves the body, less that it enters it.  Only those of ``doubtful`` (m,) are looked at.
    """
    corners = mesh.vertices.astype(np.float64)[mesh.faces]
    found = np.zeros(len(corners), np.bool_)
    faces = np.flatnonzero(charts.closed & (charts.area > 0.0))
    if not len(faces):
        return found
    faces = faces[np.argsort(charts.body[faces], kind="stable")]
    start = np.flatnonzero(np.diff(charts.body[faces], prepend=-1))
    size = np.diff(np.append(start, len(faces)))
    asked = np.flatnonzero(doubtful[faces])
    winding = np.zeros(len(asked), np.int64)
    first, second = corners[faces, 1] - corners[faces, 0], corners[faces, 2] - corners[faces, 0]
    normal = np.cross(first, second) / (2.0 * charts.area[faces, None])
    along = first / np.sqrt((first * first).sum(axis=1))[:, None]
    direction = -normal + _LEAN[0] * along + _LEAN[1] * np.cross(normal, along)
    origin = corners[faces].mean(axis=1) - _BEHIND_M * normal
    begin = np.repeat(start, size)
    wind(corners[faces, 0], first, second, begin, begin + np.repeat(size, size), asked, origin, direction, winding)
    outside = faces[asked[winding == 0]]
    found[outside] = True
    on_chart = charts.face_chart >= 0
    behind = np.zeros(len(charts.normal), np.bool_)
    behind[charts.face_chart[outside[on_chart[outside]]]] = True
    found[on_chart] |= behind[charts.face_chart[on_chart]]
    return found & charts.closed


@entry
def wind(
    corner: NDArray[np.float64],
    first: NDArray[np.float64],
    second: NDArray[np.float64],
    begin: NDArray[np.int64],
    end: NDArray[np.int64],
    asked: NDArray[np.int64],
    origin: NDArray[np.float64],
    direction: NDArray[np.float64],
    winding: NDArray[np.int64],
) -> None:
    """Fill the winding number (a,) of each point ``origin`` (f, 3) that is ``asked`` (a,) about the triangles [begin, end) of its body.

    ``corner``, ``first``, ``second``: (f, 3), a corner of each triangle and its edges from there; crossings by Moeller and Trumbore, "Fast,
    Minimum Storage Ray-Triangle Intersection" (1997).
    """
    for index in range(len(asked)):
        i = asked[index]
        dx, dy, dz = direction[i, 0], direction[i, 1], direction[i, 2]
        for j in range(begin[i], end[i]):
            if j == i:
                continue
            ax, ay, az = first[j, 0], first[j, 1], first[j, 2]
            bx, by, bz = second[j, 0], second[j, 1], second[j, 2]
            px, py, pz = dy * bz - dz * by, dz * bx - dx * bz, dx * by - dy * bx
            scale = ax * px + ay * py + az * pz
            if scale == 0.0:
                continue
            sx, sy, sz = origin[i, 0] - corner[j, 0], origin[i, 1] - corner[j, 1], origin[i, 2] - corner[j, 2]
            u = (sx * px + sy * py + sz * pz) / scale
            if u < 0.0 or u > 1.0:
                continue
            qx, qy, qz = sy * az - sz * ay, sz * ax - sx * az, sx * ay - sy * ax
            v = (dx * qx + dy * qy + dz * qz) / scale
            if v < 0.0 or u + v > 1.0 or (bx * qx + by * qy + bz * qz) / scale <= 0.0:
                continue
            # The determinant is negative where the ray leaves, through the triangle's back.
            winding[index] += 1 if scale < 0.0 else -1
