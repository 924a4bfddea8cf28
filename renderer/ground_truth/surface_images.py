"""Material, emission and shading normal at the hits of a view, by the same look-ups as the path tracer's."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.camera.camera_rays import CENTRE, MIDDLE, TILE, aim_tile
from renderer.camera.cameras import PosedCamera
from renderer.camera.shutter import move_rays
from renderer.core import embree as ray
from renderer.core import lanes as ln
from renderer.core.embree import LANES, SceneHandle
from renderer.core.kernel import entry, inlined
from renderer.path.ground_truth import Hits
from renderer.path.lights import Lights
from renderer.path.records import Scratch
from renderer.path.surface_tables import Surfaces
from renderer.path.surfaces import evaluate_surfaces

_ZERO, _ONE, _INFINITE = np.float32(0.0), np.float32(1.0), np.float32(np.inf)


class SurfaceImages(NamedTuple):
    """What :func:`evaluate_hits` fills, float32, 0 where nothing is hit.

    base_color (height, width, 3), linear; roughness, metallic (height, width); emission (height, width, 3), luminance towards the camera in
    cd/m2; shading_normals (height, width, 3), unit, world, towards the camera.
    """

    base_color: NDArray[np.float32]
    roughness: NDArray[np.float32]
    metallic: NDArray[np.float32]
    emission: NDArray[np.float32]
    shading_normals: NDArray[np.float32]


def make_surface_images(height: int, width: int) -> SurfaceImages:
    """Return room for them."""
    size = (height, width)
    color, number = (*size, 3), size
    return SurfaceImages(*(np.zeros(shape, np.float32) for shape in (color, number, number, color, color)))


@entry
def evaluate_hits(
    scene: SceneHandle,
    surfaces: Surfaces,
    lights: Lights,
    vertices: NDArray[np.float32],
    faces: NDArray[np.uint32],
    camera: PosedCamera,
    distance: NDArray[np.float32],
    hits: Hits,
    scratch: Scratch,
    images: SurfaceImages,
    first: int,
    step: int,
) -> None:
    """Fill the rows of tiles ``first``, ``first + step``, ...

    ``distance``: (height, width) float32, along the rays, metres.  Rays are aimed again, not traced again.  Textures are filtered over the
    footprint of a pixel.
    """
    rays, lanes = scratch.rays, scratch.lanes
    spread = _ONE / camera.focal_px
    for row in range(first * TILE, camera.height, step * TILE):
        for column in range(0, camera.width, TILE):
            aim_tile(camera, column, row, CENTRE, rays)
            if camera.row_step > _ZERO:
                move_rays(camera, row, MIDDLE, rays)
            _restore_hits(vertices, faces, camera, column, row, distance, hits, scratch)
            for k in range(LANES):
                lanes[ln.WIDTH + k], lanes[ln.SPREAD + k] = _ZERO, spread
                lanes[ln.OUTSIDE + k], lanes[ln.RAY_PDF + k] = _ZERO, _INFINITE
            evaluate_surfaces(scene, surfaces, lights, True, _INFINITE, scratch)
            for k in range(LANES):
                x, y = column + (k & 3), row + (k >> 2)
                if x >= camera.width or y >= camera.height or lanes[ln.HIT + k] == _ZERO:
                    continue
                images.roughness[y, x] = lanes[ln.ROUGHNESS + k]
                images.metallic[y, x] = lanes[ln.METALLIC + k]
                for c in range(3):
                    images.base_color[y, x, c] = lanes[ln.BASE_R + LANES * c + k]
                    images.emission[y, x, c] = lanes[ln.LE_R + LANES * c + k]
                    images.shading_normals[y, x, c] = lanes[ln.NS_X + LANES * c + k]


@inlined
def _restore_hits(
    vertices: NDArray[np.float32],
    faces: NDArray[np.uint32],
    camera: PosedCamera,
    column: int,
    row: int,
    distance: NDArray[np.float32],
    hits: Hits,
    scratch: Scratch,
) -> None:
    """Write the recorded hits of a tile into its packet, as Embree has left them."""
    real, integer = scratch.rays.real, scratch.rays.integer
    for k in range(LANES):
        x, y = min(column + (k & 3), camera.width - 1), min(row + (k >> 2), camera.height - 1)
        face = hits.face[y, x]
        if face < 0:
            continue
        integer[ray.GEOM_ID + k], integer[ray.PRIM_ID + k] = np.uint32(0), np.uint32(face)
        real[ray.BARY_U + k], real[ray.BARY_V + k] = hits.u[y, x], hits.v[y, x]
        dx, dy, dz = real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k]
        real[ray.TFAR + k] = distance[y, x] / np.sqrt(dx * dx + dy * dy + dz * dz)
        a, b, c = faces[face, 0], faces[face, 1], faces[face, 2]
        ux, uy, uz = vertices[b, 0] - vertices[a, 0], vertices[b, 1] - vertices[a, 1], vertices[b, 2] - vertices[a, 2]
        vx, vy, vz = vertices[c, 0] - vertices[a, 0], vertices[c, 1] - vertices[a, 1], vertices[c, 2] - vertices[a, 2]
        real[ray.NG_X + k], real[ray.NG_Y + k], real[ray.NG_Z + k] = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
