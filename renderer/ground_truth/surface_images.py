"""Material, emission, shading normal and seen light at the hits of a view, by the same look-ups as the path tracer's."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.camera.camera_rays import CENTRE, TILE
from renderer.camera.cameras import PosedCamera
from renderer.camera.shutter import aim_exposed_tile, unturn_vectors
from renderer.core import lanes as ln
from renderer.core import ray_packet as ray
from renderer.core.kernel import entry, inlined, kernel
from renderer.core.ray_packet import INVALID_ID, LANES, Packet
from renderer.core.tiles import load_numbers, store_numbers, store_vectors
from renderer.ground_truth.hit_view import HitView, shared_fields
from renderer.path.ground_truth import TracedView
from renderer.path.records import LitScene, Scratch
from renderer.path.surfaces import evaluate_surfaces
from scene_description.light_labels import SKY_ID

_ZERO, _ONE, _INFINITE = np.float32(0.0), np.float32(1.0), np.float32(np.inf)


_STORED = (ln.BASE_R, ln.BASE_G, ln.BASE_B, ln.LE_R, ln.LE_G, ln.LE_B, ln.ROUGHNESS, ln.METALLIC, ln.NS_X, ln.NS_Y, ln.NS_Z)
"""Fields of the lanes that images are made of."""


class SurfaceImages(NamedTuple):
    """What :func:`evaluate_hits` fills, a field for each layer of that name; those that nobody needs have a height of 0.

    float32 and 0 where nothing is hit: base_color (height, width, 3), linear; roughness, metallic (height, width); emission (height,
    width, 3), luminance towards the camera in cd/m2; shading_normals, shading_normals_world: (height, width, 3), unit, towards the camera,
    optical frame and world.  light_seen: (height, width) uint16, as ``scene_description.light_labels.light_ids`` has them, 0 for what
    sends no light itself: the backs of lamps and panes, and the black of glowing screens, too.
    """

    base_color: NDArray[np.float32]
    roughness: NDArray[np.float32]
    metallic: NDArray[np.float32]
    emission: NDArray[np.float32]
    shading_normals: NDArray[np.float32]
    shading_normals_world: NDArray[np.float32]
    light_seen: NDArray[np.uint16]


_CHANNELS = {"base_color": (3,), "emission": (3,), "shading_normals": (3,), "shading_normals_world": (3,)}


def surface_images(view: HitView) -> SurfaceImages:
    """Return the images that the view's layers need, textures included."""
    height, width = view.hits.face.shape
    shapes = [(height if name in view.names else 0, width, *_CHANNELS.get(name, ())) for name in SurfaceImages._fields]
    images = SurfaceImages(*view.scene.memory.empty([(shape, np.float32) for shape in shapes[:-1]] + [(shapes[-1], np.uint16)]))
    scene, flat, step = view.scene, view.scene.flat, view.scene.workers.count
    lights = flat.light_id if len(flat.light_id) else np.zeros(len(flat.part_names), np.uint16)
    inputs = (scene.lit, view.traced, lights)
    scene.workers.run(lambda worker, first: evaluate_hits(*inputs, scene.scratch[worker], images, first, step), range(step))
    return images


@entry
def evaluate_hits(
    scene: LitScene, view: TracedView, light_id: NDArray[np.uint16], scratch: Scratch, images: SurfaceImages, first: int, step: int
) -> None:
    """Fill the rows of tiles ``first``, ``first + step``, ...

    ``light_id``: (p,), of parts.  Rays are aimed again, not traced again.  Textures are filtered over the footprint of a pixel.
    """
    rays, lanes, camera = scratch.rays, scratch.lanes, view.camera
    spread = _ONE / camera.focal_px
    for row in range(first * TILE, camera.height, step * TILE):
        for column in range(0, camera.width, TILE):
            aim_exposed_tile(camera, column, row, CENTRE, rays)
            restore_hits(view, column, row, rays)
            for k in range(LANES):
                lanes[ln.WIDTH + k], lanes[ln.SPREAD + k] = _ZERO, spread
                lanes[ln.OUTSIDE + k], lanes[ln.RAY_PDF + k] = _ZERO, _INFINITE
            evaluate_surfaces(scene, True, True, _INFINITE, scratch)
            _store(light_id, view, column, row, scratch, images)


@inlined
def _store(light_id: NDArray[np.uint16], view: TracedView, column: int, row: int, scratch: Scratch, images: SurfaceImages) -> None:
    """Copy what the rays of a tile have hit to the images that are needed."""
    lanes = scratch.lanes
    _clear_missed(lanes)
    if len(images.base_color):
        store_vectors(lanes, ln.BASE_R, column, row, images.base_color)
    if len(images.emission):
        store_vectors(lanes, ln.LE_R, column, row, images.emission)
    if len(images.roughness):
        store_numbers(lanes, ln.ROUGHNESS, column, row, images.roughness)
    if len(images.metallic):
        store_numbers(lanes, ln.METALLIC, column, row, images.metallic)
    if len(images.light_seen):
        _store_lights(light_id, view.distance, column, row, scratch, images.light_seen)
    if len(images.shading_normals_world):
        store_vectors(lanes, ln.NS_X, column, row, images.shading_normals_world)
    if len(images.shading_normals):
        if view.camera.row_step > _ZERO:
            unturn_vectors(view.camera, row, ln.NS_X, lanes)
        _turn_shading_normals(view.camera, lanes)
        store_vectors(lanes, ln.NS_X, column, row, images.shading_normals)


@kernel
def _turn_shading_normals(camera: PosedCamera, lanes: NDArray[np.float32]) -> None:
    """Turn the shading normals of the lanes from the world into the optical frame."""
    r = camera.rotation
    r00, r01, r02, r10, r11, r12, r20, r21, r22 = r[0, 0], r[0, 1], r[0, 2], r[1, 0], r[1, 1], r[1, 2], r[2, 0], r[2, 1], r[2, 2]
    for k in range(LANES):
        x, y, z = lanes[ln.NS_X + k], lanes[ln.NS_Y + k], lanes[ln.NS_Z + k]
        lanes[ln.NS_X + k] = r00 * x + r10 * y + r20 * z
        lanes[ln.NS_Y + k] = r01 * x + r11 * y + r21 * z
        lanes[ln.NS_Z + k] = r02 * x + r12 * y + r22 * z


@kernel
def _clear_missed(lanes: NDArray[np.float32]) -> None:
    """Write zeros to the lanes that hit nothing."""
    if ln.count_chosen(lanes, ln.HIT) < LANES:
        for field in _STORED:
            for k in range(LANES):
                lanes[field + k] = lanes[field + k] if lanes[ln.HIT + k] != _ZERO else _ZERO


@inlined
def _store_lights(
    light_id: NDArray[np.uint16], distance: NDArray[np.float32], column: int, row: int, scratch: Scratch, image: NDArray[np.uint16]
) -> None:
    """Write which lights the pixels of a tile see."""
    lanes = scratch.lanes
    for y in range(row, min(row + TILE, image.shape[0])):
        for x in range(column, min(column + TILE, image.shape[1])):
            k = (y - row) * TILE + x - column
            if lanes[ln.HIT + k] == _ZERO:
                image[y, x] = SKY_ID if distance[y, x] == _INFINITE else 0
            else:
                shines = lanes[ln.LE_R + k] != _ZERO or lanes[ln.LE_G + k] != _ZERO or lanes[ln.LE_B + k] != _ZERO
                image[y, x] = light_id[scratch.parts[k]] if shines else 0


@inlined
def restore_hits(view: TracedView, column: int, row: int, packet: Packet) -> None:
    """Write the recorded hits of a tile into a packet, as Embree has left them."""
    real, integer, hits, vertices, faces = packet.real, packet.integer, view.hits, view.vertices, view.faces
    height, width = hits.face.shape
    load_numbers(hits.u, column, row, ray.BARY_U, real)
    load_numbers(hits.v, column, row, ray.BARY_V, real)
    load_numbers(view.distance, column, row, ray.TFAR, real)
    before = np.int32(-1)
    nx = ny = nz = _ZERO
    for k in range(LANES):
        face = hits.face[min(row + (k >> 2), height - 1), min(column + (k & 3), width - 1)]
        integer[ray.PRIM_ID + k] = np.uint32(face)
        integer[ray.GEOM_ID + k] = np.uint32(0) if face >= 0 else INVALID_ID
        # Neighbours often hit one triangle: its normal is computed once.
        if face >= 0 and face != before:
            before = face
            a, b, c = faces[face, 0], faces[face, 1], faces[face, 2]
            ux, uy, uz = vertices[b, 0] - vertices[a, 0], vertices[b, 1] - vertices[a, 1], vertices[b, 2] - vertices[a, 2]
            vx, vy, vz = vertices[c, 0] - vertices[a, 0], vertices[c, 1] - vertices[a, 1], vertices[c, 2] - vertices[a, 2]
            nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        real[ray.NG_X + k], real[ray.NG_Y + k], real[ray.NG_Z + k] = nx, ny, nz
    for k in range(LANES):
        dx, dy, dz = real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k]
        real[ray.TFAR + k] /= np.sqrt(dx * dx + dy * dy + dz * dz)


LAYERS = shared_fields(surface_images, SurfaceImages._fields)
