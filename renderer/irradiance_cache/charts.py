"""Charts: the flat regions of a mesh, each with a frame of its own in which a grid of nodes can lie."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core.kernel import entry
from renderer.geometry.mesh import Mesh
from scene_description.products import dot

_WELD_M = 1e-4
_FLAT, _COPLANAR = 0.9995, 0.99999
_LEAST_AREA_M2 = 1e-10
_BEHIND_M = 1e-4
_LEAN = (0.0131, 0.0079)
"""By how much rays lean away from the normal, so that they meet no edges of the same shape opposite."""
CURVED, DEGENERATE = -1, -2
"""``face_chart`` of triangles that are on no chart."""


class Charts(NamedTuple):
    """The flat regions of a mesh of m triangles.

    face_chart: (m,) int32, the chart of each triangle, CURVED or DEGENERATE; normal, along, across: (c, 3) float64, unit, a right-handed
    frame (along, across, normal) of each chart; at: (m, 3, 2) float64, metres along and across of the corners of triangles on charts.
    area: (m,) float64, m2.  closed: (m,) bool, triangles of bodies that nobody sees from behind: every edge of theirs belongs to two
    triangles, and their faces look outward.  body: (m,) int64, the least triangle of those that hang together by edges.
    """

    face_chart: NDArray[np.int32]
    normal: NDArray[np.float64]
    along: NDArray[np.float64]
    across: NDArray[np.float64]
    at: NDArray[np.float64]
    area: NDArray[np.float64]
    closed: NDArray[np.bool_]
    body: NDArray[np.int64]


def find_charts(mesh: Mesh, face_part: NDArray[np.int32]) -> Charts:
    """Join triangles of one part that share an edge and a plane, where the mesh is shaded flat."""
    corners = mesh.vertices.astype(np.float64)[mesh.faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = 0.5 * np.linalg.norm(cross, axis=1)
    unit = cross / np.maximum(2.0 * area, 1e-30)[:, None]
    shading = mesh.normals.astype(np.float64)[mesh.faces]
    sound = area > _LEAST_AREA_M2
    flat = sound & (dot(shading, unit[:, None]) > _FLAT).all(axis=1)
    first, second, face = _edges(corners, face_part)
    by_edge = np.lexsort((face, second, first))
    first, second, face = first[by_edge], second[by_edge], face[by_edge]
    same = (first[1:] == first[:-1]) & (second[1:] == second[:-1])
    a, b = face[:-1][same], face[1:][same]
    run = np.concatenate([[True], ~same])
    lonely = face[np.flatnonzero(run)[np.diff(np.append(np.flatnonzero(run), len(face))) != 2]]
    body = _join(len(face_part), a, b)
    closed = _find_closed(corners, body, lonely)
    joined = flat[a] & flat[b] & (dot(unit[a], unit[b]) > _COPLANAR)
    root = _join(len(face_part), a[joined], b[joined])
    face_chart = np.where(sound, CURVED, DEGENERATE).astype(np.int32)
    roots, face_chart[flat] = np.unique(root[flat], return_inverse=True)
    count = len(roots)
    # Each chart looks along the longest edge of its outline: a grid that lies along a diagonal fits no rectangle.
    edges = corners[:, (1, 2, 0)] - corners
    length = np.linalg.norm(edges, axis=2)
    length.reshape(-1)[np.concatenate([by_edge[:-1][same][joined], by_edge[1:][same][joined]])] = 0.0
    longest = np.take_along_axis(edges, length.argmax(axis=1)[:, None, None].repeat(3, 2), axis=1)[:, 0]
    members = np.flatnonzero(flat)
    order = members[np.lexsort((members, -length[members].max(axis=1), face_chart[members]))]
    lead = order[np.searchsorted(face_chart[order], np.arange(count))]
    normal = unit[lead]
    along = longest[lead] - (longest[lead] * normal).sum(axis=1, keepdims=True) * normal
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    across = np.cross(normal, along)
    at = np.zeros((len(face_part), 3, 2))
    chart = face_chart[members]
    at[members, :, 0] = dot(corners[members], along[chart][:, None])
    at[members, :, 1] = dot(corners[members], across[chart][:, None])
    return Charts(face_chart, normal, along, across, at, area, closed, body)


def _find_closed(corners: NDArray[np.float64], body: NDArray[np.int64], lonely: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return which triangles (m,) belong to a body that is closed and holds a volume.

    ``body``: (m,), a triangle of each one's body; ``lonely``: triangles that have an edge which does not belong to just two.
    """
    at = corners - corners[body, :1]
    volume = np.bincount(body, dot(at[:, 0], np.cross(at[:, 1], at[:, 2])), len(body))
    volume[body[lonely]] = 0.0
    return np.asarray(volume[body] > 0.0)


def _edges(corners: NDArray[np.float64], face_part: NDArray[np.int32]) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Return the edges of all triangles: two welded vertices, the lesser first, and the triangle; parts share no vertex."""
    places = np.rint(corners / _WELD_M).astype(np.int64).reshape(-1, 3)
    vertex = np.unique(mix_rows(places, np.repeat(face_part, 3)), return_inverse=True)[1].reshape(-1, 3)
    ends = np.stack([vertex, vertex[:, (1, 2, 0)]], axis=2).reshape(-1, 2)
    face = np.repeat(np.arange(len(corners)), 3)
    return ends.min(axis=1), ends.max(axis=1), face


def mix_rows(places: NDArray[np.int64], *columns: NDArray[np.integer]) -> NDArray[np.int64]:
    """Return one 64-bit hash for each row of ``places`` (n, 3) with its entries of ``columns`` (n,)."""
    key = np.zeros(len(places), np.uint64)
    for column in (*places.T, *columns):
        key = (key ^ column.astype(np.uint64)) * np.uint64(0x9E3779B97F4A7C15)
        key ^= key >> np.uint64(29)
    return key.view(np.int64)


@entry
def _join_pairs(root: NDArray[np.int64], first: NDArray[np.int64], second: NDArray[np.int64]) -> None:
    for i in range(len(first)):
        a, b = first[i], second[i]
        while root[a] != a:
            root[a] = root[root[a]]
            a = root[a]
        while root[b] != b:
            root[b] = root[root[b]]
            b = root[b]
        if a < b:
            root[b] = a
        else:
            root[a] = b
    for i in range(len(root)):
        a = i
        while root[a] != a:
            a = root[a]
        root[i] = a


def _join(count: int, first: NDArray[np.int64], second: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the least member of each item's set, (count,), once the sets of all pairs are joined."""
    root = np.arange(count)
    _join_pairs(root, first, second)
    return root


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
