"""Depth, normals and ids of a view, all from one hit record: the primary rays through the pixel centres.

Rays go in packets of 4 x 4 pixels.  Those of the ideal pinhole are aimed with an optical z of 1, so the distance that Embree returns *is*
the depth.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import DTypeLike, NDArray

from renderer.camera.camera_rays import TILE
from renderer.camera.cameras import PosedCamera
from renderer.camera.shutter import aim_exposed_tile, unturn_rays
from renderer.core import ray_packet as ray
from renderer.core.embree import SceneHandle, intersect16
from renderer.core.kernel import entry, inlined, kernel
from renderer.core.ray_packet import INVALID_ID, LANES, Packet
from renderer.core.tiles import store_bits, store_numbers, store_vectors

_ZERO, _ONE, _TINY, _NAN = np.float32(0.0), np.float32(1.0), np.float32(1e-30), np.float32(np.nan)


class GeometricImages(NamedTuple):
    """The images that :func:`trace_geometry` fills: a field for each geometric layer of ``renderer.film.layers.ROWS``."""

    depth: NDArray[np.float32]
    range: NDArray[np.float32]
    normals: NDArray[np.float32]
    semantic: NDArray[np.uint8]
    instance: NDArray[np.uint16]


class Hits(NamedTuple):
    """The hit record of a view: (height, width) each, a height of 0 where nobody asks for it.

    face: int32, the triangle, -1 where the ray hits nothing; u, v: float32, barycentric weights of its second and third corner, 0 there.
    """

    face: NDArray[np.int32]
    u: NDArray[np.float32]
    v: NDArray[np.float32]


class TracedView(NamedTuple):
    """A view whose rays have been traced: camera, distance along the rays (height, width), metres, hit record, and the mesh that was hit.

    vertices: (n, 3) float32; faces: (m, 3) uint32.
    """

    camera: PosedCamera
    distance: NDArray[np.float32]
    hits: Hits
    vertices: NDArray[np.float32]
    faces: NDArray[np.uint32]


def hit_record_shapes(height: int, width: int) -> list[tuple[tuple[int, int], DTypeLike]]:
    """Return the shapes and dtypes of a hit record's fields."""
    return [((height, width), dtype) for dtype in (np.int32, np.float32, np.float32)]


class LabelledScene(NamedTuple):
    """Triangles, and what they are.

    ids: (m + 1,) uint32, the object's id times 256 plus the NYU40 class, so that one look-up gives both; last 0.
    """

    tree: SceneHandle
    ids: NDArray[np.uint32]


def label_scene(tree: SceneHandle, face_part: NDArray[np.int32], label: NDArray[np.uint8], object_id: NDArray[np.uint16]) -> LabelledScene:
    """Return triangles with their ids for ``face_part`` (m,), the part of each, and of the parts NYU40 class (p,) and object id (p,)."""
    return LabelledScene(tree, np.append((object_id.astype(np.uint32) << 8 | label)[face_part], np.uint32(0)))


@kernel
def _measure(r: NDArray[np.float32], lens: bool, real: NDArray[np.float32], alive: NDArray[np.int32]) -> None:
    """Replace the packet's geometric normals by unit normals of the optical frame, rotation ``r``, that look towards the camera.

    Replace TFAR by the depth, and DIR_X by the distance; NaN for rays that are off.
    """
    r00, r01, r02, r10, r11, r12, r20, r21, r22 = r[0, 0], r[0, 1], r[0, 2], r[1, 0], r[1, 1], r[1, 2], r[2, 0], r[2, 1], r[2, 2]
    for k in range(LANES):
        x, y, z = real[ray.NG_X + k], real[ray.NG_Y + k], real[ray.NG_Z + k]
        dx, dy, dz = real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k]
        length = np.sqrt(x * x + y * y + z * z)
        scale = _ONE / (length if length > _TINY else _TINY)
        scale = -scale if x * dx + y * dy + z * dz > _ZERO else scale
        real[ray.NG_X + k] = (r00 * x + r10 * y + r20 * z) * scale
        real[ray.NG_Y + k] = (r01 * x + r11 * y + r21 * z) * scale
        real[ray.NG_Z + k] = (r02 * x + r12 * y + r22 * z) * scale
        t = real[ray.TFAR + k]
        t = t if alive[k] != 0 else _NAN
        real[ray.TFAR + k] = t * (r02 * dx + r12 * dy + r22 * dz) if lens else t
        real[ray.DIR_X + k] = t * np.sqrt(dx * dx + dy * dy + dz * dz)


@kernel
def _look_up_ids(ids: NDArray[np.uint32], integer: NDArray[np.uint32]) -> None:
    """Replace GEOM_ID by the ids of the triangles that were hit, 0 for none."""
    nothing = np.uint32(len(ids) - 1)
    first = integer[ray.PRIM_ID]
    others = np.uint32(0)
    for k in range(LANES):
        others |= (integer[ray.PRIM_ID + k] ^ first) | integer[ray.GEOM_ID + k]
    if others == 0:
        value = ids[first]
        for k in range(LANES):
            integer[ray.GEOM_ID + k] = value
    else:
        for k in range(LANES):
            face = integer[ray.PRIM_ID + k]
            integer[ray.GEOM_ID + k] = ids[face if integer[ray.GEOM_ID + k] != INVALID_ID else nothing]


@inlined
def _record_hits(packet: Packet, column: int, row: int, hits: Hits) -> None:
    """Write the hit record of a tile that begins at (column, row)."""
    real, integer = packet.real, packet.integer
    for k in range(LANES):
        hit = integer[ray.GEOM_ID + k] != INVALID_ID
        integer[ray.PRIM_ID + k] = integer[ray.PRIM_ID + k] if hit else INVALID_ID
        real[ray.BARY_U + k] = real[ray.BARY_U + k] if hit else _ZERO
        real[ray.BARY_V + k] = real[ray.BARY_V + k] if hit else _ZERO
    store_bits(integer, ray.PRIM_ID, 0, column, row, hits.face)
    store_numbers(real, ray.BARY_U, column, row, hits.u)
    store_numbers(real, ray.BARY_V, column, row, hits.v)


@entry
def trace_geometry(
    scene: LabelledScene,
    camera: PosedCamera,
    packet: Packet,
    centre: NDArray[np.float32],
    images: GeometricImages,
    hits: Hits,
    first: int,
    step: int,
) -> None:
    """Fill the rows of tiles ``first``, ``first + step``, ... of all images; ``packet`` is scratch memory of the calling thread.

    ``centre``: (32,) float32, the offsets of the rays from the pixel centres, ``CENTRE``.
    """
    tree = scene.tree
    lens, recorded = len(camera.bearings) > 0, hits.face.shape[0] > 0
    real, integer, r = packet.real, packet.integer, camera.rotation
    for row in range(first * TILE, camera.height, step * TILE):
        for column in range(0, camera.width, TILE):
            aim_exposed_tile(camera, column, row, centre, packet)
            intersect16(packet.alive.ctypes.data, tree.address, real.ctypes.data, tree.primary)
            if camera.row_step > _ZERO:
                unturn_rays(camera, row, packet)
            if recorded:
                _record_hits(packet, column, row, hits)
            _measure(r, lens, real, packet.alive)
            _look_up_ids(scene.ids, integer)
            store_numbers(real, ray.TFAR, column, row, images.depth)
            store_numbers(real, ray.DIR_X, column, row, images.range)
            store_vectors(real, ray.NG_X, column, row, images.normals)
            store_bits(integer, ray.GEOM_ID, 0, column, row, images.semantic)
            store_bits(integer, ray.GEOM_ID, 8, column, row, images.instance)
