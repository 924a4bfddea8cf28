"""Depth, normals and ids of a view, all from one hit record: the primary rays through the pixel centres.

Rays go in packets of 4 x 4 pixels.  Those of the ideal pinhole are aimed with an optical z of 1, so the distance that Embree returns *is*
the depth.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import DTypeLike, NDArray

from renderer.camera.camera_rays import TILE
from renderer.camera.cameras import PosedCamera
from renderer.camera.shutter import aim_exposed_tile, unturn_rays
from renderer.core.embree import (
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
    PRIM_ID,
    TFAR,
    Packet,
    SceneHandle,
    intersect16,
)
from renderer.core.kernel import entry, kernel

_ZERO, _ONE, _HALF, _TINY, _NAN = np.float32(0.0), np.float32(1.0), np.float32(0.5), np.float32(1e-30), np.float32(np.nan)


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


def hit_record_shapes(height: int, width: int) -> list[tuple[tuple[int, int], DTypeLike]]:
    """Return the shapes and dtypes of a hit record's fields."""
    return [((height, width), dtype) for dtype in (np.int32, np.float32, np.float32)]


class Labels(NamedTuple):
    """Triangle -> part (m,) int32; part -> NYU40 class (p,) uint8; part -> object id (p,) uint16."""

    face_part: NDArray[np.int32]
    label: NDArray[np.uint8]
    object_id: NDArray[np.uint16]


@kernel
def _face_camera(camera: PosedCamera, packet: Packet) -> None:
    """Turn the packet's geometric normals into unit normals of the optical frame that look towards the camera."""
    real, r = packet.real, camera.rotation
    r00, r01, r02, r10, r11, r12, r20, r21, r22 = r[0, 0], r[0, 1], r[0, 2], r[1, 0], r[1, 1], r[1, 2], r[2, 0], r[2, 1], r[2, 2]
    for k in range(LANES):
        x, y, z = real[NG_X + k], real[NG_Y + k], real[NG_Z + k]
        away = x * real[DIR_X + k] + y * real[DIR_Y + k] + z * real[DIR_Z + k]
        scale = _ONE / max(np.sqrt(x * x + y * y + z * z), _TINY)
        scale = -scale if away > _ZERO else scale
        real[NG_X + k] = (r00 * x + r10 * y + r20 * z) * scale
        real[NG_Y + k] = (r01 * x + r11 * y + r21 * z) * scale
        real[NG_Z + k] = (r02 * x + r12 * y + r22 * z) * scale


@entry
def trace_geometry(
    scene: SceneHandle,
    labels: Labels,
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
    real, integer = packet.real, packet.integer
    depth, distance, normals, semantic, instance = images
    lens, recorded = len(camera.bearings) > 0, hits.face.shape[0] > 0
    r02, r12, r22 = camera.rotation[0, 2], camera.rotation[1, 2], camera.rotation[2, 2]
    for row in range(first * TILE, camera.height, step * TILE):
        for column in range(0, camera.width, TILE):
            aim_exposed_tile(camera, column, row, centre, packet)
            intersect16(packet.alive.ctypes.data, scene.address, real.ctypes.data, scene.coherent)
            if camera.row_step > _ZERO:
                unturn_rays(camera, row, packet)
            _face_camera(camera, packet)
            for k in range(LANES):
                x, y = column + (k & 3), row + (k >> 2)
                if x >= camera.width or y >= camera.height:
                    continue
                dx, dy, dz = real[DIR_X + k], real[DIR_Y + k], real[DIR_Z + k]
                t = real[TFAR + k] if packet.alive[k] else _NAN
                depth[y, x] = t * (r02 * dx + r12 * dy + r22 * dz) if lens else t
                distance[y, x] = t * np.sqrt(dx * dx + dy * dy + dz * dz)
                normals[y, x, 0] = real[NG_X + k]
                normals[y, x, 1] = real[NG_Y + k]
                normals[y, x, 2] = real[NG_Z + k]
                semantic[y, x] = 0
                instance[y, x] = 0
                hit = integer[GEOM_ID + k] != INVALID_ID
                if recorded:
                    hits.face[y, x] = np.int32(integer[PRIM_ID + k]) if hit else np.int32(-1)
                    hits.u[y, x] = real[BARY_U + k] if hit else _ZERO
                    hits.v[y, x] = real[BARY_V + k] if hit else _ZERO
                if hit:
                    part = labels.face_part[integer[PRIM_ID + k]]
                    semantic[y, x] = labels.label[part]
                    instance[y, x] = labels.object_id[part]
