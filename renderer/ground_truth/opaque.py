"""What lies behind glass: the first surface that lets no light through, on the straight line of sight."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.camera.camera_rays import CENTRE, TILE
from renderer.camera.cameras import PosedCamera
from renderer.camera.shutter import aim_exposed_tile, unturn_rays
from renderer.core import ray_packet as ray
from renderer.core.embree import SceneHandle, intersect16
from renderer.core.kernel import entry, inlined
from renderer.core.ray_packet import INVALID_ID, LANES, Packet
from renderer.ground_truth.hit_view import HitView, shared_fields
from renderer.path.ground_truth import Hits

MOST_PANES = 16
"""A ray that has met so many surfaces of glass ends there, as if nothing were behind."""
_ZERO, _ONE = np.float32(0.0), np.float32(1.0)
_ONWARD = np.float32(1.0 + 4e-6)


class OpaqueImages(NamedTuple):
    """As ``GeometricImages``, but for range: behind what lets light through."""

    depth: NDArray[np.float32]
    normals: NDArray[np.float32]
    semantic: NDArray[np.uint8]
    instance: NDArray[np.uint16]


def is_clear(view: HitView) -> NDArray[np.bool_]:
    """Return which parts let most of the light through, window panes among them, (p,)."""
    flat = view.scene.flat
    return flat.parts.portal | (flat.materials.transmission[flat.parts.material] > 0.5)


def opaque_images(view: HitView) -> OpaqueImages:
    """Return the images of the first opaque surfaces that the view's layers need; where no glass is seen, those of the first surfaces."""
    scene, first_hits, clear = view.scene, view.images, is_clear(view)
    through = np.empty(view.hits.face.shape, np.bool_)
    scene.in_rows(_find_clear, scene.flat.face_part, clear, view.hits, through)
    first_surfaces = OpaqueImages(first_hits.depth, first_hits.normals, first_hits.semantic, first_hits.instance)
    if not through.any():
        return first_surfaces
    first: dict[str, NDArray[Any]] = first_surfaces._asdict()
    needed = [image if f"{name}_opaque" in view.names else image[:0] for name, image in first.items()]
    copies = scene.memory.empty([(image.shape, image.dtype) for image in needed])
    for copy, image in zip(copies, needed, strict=True):
        np.copyto(copy, image)
    images = OpaqueImages(*copies)
    parts = _Parts(scene.tree, scene.flat.face_part, clear, scene.label, scene.flat.parts.object_id)
    scene.in_tiles(_look_through, parts, view.camera, through, images)
    return images


class _Parts(NamedTuple):
    """Triangles (m,) and their parts (p,): whether these let light through, their semantic id and that of their object."""

    tree: SceneHandle
    face_part: NDArray[np.int32]
    clear: NDArray[np.bool_]
    label: NDArray[np.uint8]
    object_id: NDArray[np.uint16]


@entry
def _find_clear(
    face_part: NDArray[np.int32], clear: NDArray[np.bool_], hits: Hits, through: NDArray[np.bool_], first: int, step: int
) -> None:
    height, width = through.shape
    for y in range(first, height, step):
        for x in range(width):
            face = hits.face[y, x]
            through[y, x] = face >= 0 and clear[face_part[face]]


@entry
def _look_through(
    packet: Packet,
    _lanes: NDArray[np.float32],
    parts: _Parts,
    camera: PosedCamera,
    through: NDArray[np.bool_],
    images: OpaqueImages,
    first: int,
    step: int,
) -> None:
    """Fill the pixels that see glass ``through`` which they look, in the rows of tiles ``first``, ``first + step``, ..."""
    for row in range(first * TILE, camera.height, step * TILE):
        for column in range(0, camera.width, TILE):
            bottom, right = min(row + TILE, camera.height), min(column + TILE, camera.width)
            if not through[row:bottom, column:right].any():
                continue
            aim_exposed_tile(camera, column, row, CENTRE, packet)
            _pass_clear(parts, packet)
            if camera.row_step > _ZERO:
                unturn_rays(camera, row, packet)
            for k in range(LANES):
                y, x = row + (k >> 2), column + (k & 3)
                if y < bottom and x < right and through[y, x]:
                    _store(parts, camera, k, packet, images, y, x)


@inlined
def _pass_clear(parts: _Parts, packet: Packet) -> None:
    """Trace until no ray's hit is clear; distances stay those from the camera."""
    real, integer = packet.real, packet.integer
    for _ in range(MOST_PANES):
        intersect16(packet.alive.ctypes.data, parts.tree.address, real.ctypes.data, parts.tree.coherent)
        going = 0
        for k in range(LANES):
            hit = packet.alive[k] != 0 and integer[ray.GEOM_ID + k] != INVALID_ID
            packet.alive[k] = 0
            if hit and parts.clear[parts.face_part[integer[ray.PRIM_ID + k]]]:
                packet.alive[k], integer[ray.GEOM_ID + k] = -1, INVALID_ID
                real[ray.TNEAR + k], real[ray.TFAR + k] = real[ray.TFAR + k] * _ONWARD, np.float32(np.inf)
                going += 1
        if going == 0:
            break


@inlined
def _store(parts: _Parts, camera: PosedCamera, k: int, packet: Packet, images: OpaqueImages, y: int, x: int) -> None:
    """Write what ray k has ended at to pixel (x, y)."""
    real, r = packet.real, camera.rotation
    hit = packet.integer[ray.GEOM_ID + k] != INVALID_ID
    part = parts.face_part[packet.integer[ray.PRIM_ID + k]] if hit else 0
    dx, dy, dz = real[ray.DIR_X + k], real[ray.DIR_X + LANES + k], real[ray.DIR_X + 2 * LANES + k]
    nx, ny, nz = real[ray.NG_X + k], real[ray.NG_X + LANES + k], real[ray.NG_X + 2 * LANES + k]
    along = r[0, 2] * dx + r[1, 2] * dy + r[2, 2] * dz if len(camera.bearings) > 0 else _ONE
    if len(images.depth):
        images.depth[y, x] = real[ray.TFAR + k] * along if hit else np.float32(np.inf)
    if len(images.semantic):
        images.semantic[y, x] = parts.label[part] if hit else np.uint8(0)
    if len(images.instance):
        images.instance[y, x] = parts.object_id[part] if hit else np.uint16(0)
    if len(images.normals):
        length = np.sqrt(nx * nx + ny * ny + nz * nz)
        scale = _ONE / length if hit and length > _ZERO else _ZERO
        scale = -scale if nx * dx + ny * dy + nz * dz > _ZERO else scale
        for axis in range(3):
            images.normals[y, x, axis] = (r[0, axis] * nx + r[1, axis] * ny + r[2, axis] * nz) * scale


LAYERS = shared_fields(opaque_images, OpaqueImages._fields, "_opaque")
