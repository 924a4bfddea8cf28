"""One view with its hit record, and what several layers need of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from renderer.camera.camera_rays import CENTRE, MIDDLE, TILE, aim_tile
from renderer.camera.cameras import PosedCamera, pose_camera
from renderer.camera.config import CameraConfig
from renderer.camera.shutter import move_rays
from renderer.core.embree import DIR_X, DIR_Y, DIR_Z, LANES, ORG_X, ORG_Y, ORG_Z, Packet, SceneHandle
from renderer.core.kernel import entry, kernel
from renderer.core.workers import Workers
from renderer.ground_truth.surface_images import SurfaceImages, evaluate_hits, make_surface_images
from renderer.path.ground_truth import GeometricImages, Hits
from renderer.path.lights import Lights
from renderer.path.records import Scratch
from renderer.path.surface_tables import Surfaces
from renderer.scene.flat_scene import FlatScene
from scene_description.types import CameraPose

Result = TypeVar("Result")
NOWHERE = np.zeros(3, np.float32)


@dataclass(frozen=True, slots=True)
class TracedScene:
    """A scene as rays and look-ups take it, and the threads that work on it, each with its scratch memory.

    label: (p,) uint8, semantic id of each part, as the basic layers hold it.
    """

    flat: FlatScene
    label: NDArray[np.uint8]
    surfaces: Surfaces
    lights: Lights
    tree: SceneHandle
    workers: Workers
    scratch: Sequence[Scratch]

    def in_rows(self, kernel: Callable[..., None], *arguments: Any) -> None:
        """Call ``kernel(*arguments, first, step)`` in every thread: it does rows ``first``, ``first + step``, ... of pixels."""
        step = self.workers.count
        self.workers.run(lambda _, first: kernel(*arguments, first, step), range(step))

    def in_tiles(self, kernel: Callable[..., None], *arguments: Any) -> None:
        """Call ``kernel(packet, *arguments, first, step)`` in every thread: the same, with rows of tiles and a packet for rays."""
        step = self.workers.count
        self.workers.run(lambda worker, first: kernel(self.scratch[worker].rays, *arguments, first, step), range(step))


@dataclass(frozen=True)
class HitView:
    """A view and its hit record; what follows from them is computed when it is first asked for.

    Attributes:
        scene: what was seen.
        config: the camera's lens.
        camera: the same at the frame's pose.
        images: the basic layers.
        hits: the hit record.
        pose: of the optical frame.
        path: the camera's poses; those before and after ``pose`` are the neighbouring frames.
    """

    scene: TracedScene
    config: CameraConfig
    camera: PosedCamera
    images: GeometricImages
    hits: Hits
    pose: CameraPose
    path: Sequence[CameraPose] = ()
    _shared: dict[Callable[[HitView], Any], Any] = field(default_factory=dict, repr=False)

    def shared(self, compute: Callable[[HitView], Result]) -> Result:
        """Return what a function makes of this view, computed once for all layers that need it."""
        if compute not in self._shared:
            self._shared[compute] = compute(self)
        result: Result = self._shared[compute]
        return result

    @cached_property
    def part(self) -> NDArray[np.int32]:
        """Row of the part table at each pixel, (height, width); -1 where nothing is hit."""
        return self.of_face(self.scene.flat.face_part, -1)

    @cached_property
    def missed(self) -> NDArray[np.bool_]:
        """Where nothing is hit, (height, width)."""
        return self.hits.face < 0

    @cached_property
    def position(self) -> NDArray[np.float32]:
        """The point that is hit, (height, width, 3), world, metres; NaN where nothing is.

        It lies on the pixel's ray: barycentric weights of slender triangles seen at grazing angles are off by up to a millimetre.
        """
        image = np.empty((*self.hits.face.shape, 3), np.float32)
        self.scene.in_tiles(place, self.camera, self.images.range, image)
        return image

    @cached_property
    def surface(self) -> SurfaceImages:
        """Material, emission and shading normal at each hit, textures included."""
        images = make_surface_images(*self.hits.face.shape)
        scene, mesh, step = self.scene, self.scene.flat.mesh, self.scene.workers.count

        def fill(worker: int, first: int) -> None:
            scratch = scene.scratch[worker]
            evaluate_hits(
                scene.tree,
                scene.surfaces,
                scene.lights,
                mesh.vertices,
                mesh.faces,
                self.camera,
                self.images.range,
                self.hits,
                scratch,
                images,
                first,
                step,
            )

        scene.workers.run(fill, range(step))
        return images

    @cached_property
    def normals_world(self) -> NDArray[np.float32]:
        """Geometric unit normal towards the camera, (height, width, 3), world; 0 where nothing is hit."""
        return self.turned(self.images.normals, self.camera.rotation)

    @cached_property
    def neighbours(self) -> tuple[CameraPose | None, CameraPose | None]:
        """Poses of the frames before and after this one on the path; None at its ends, and for a pose that is none of the path's."""
        try:
            index = self.path.index(self.pose)
        except ValueError:
            return None, None
        return (self.path[index - 1] if index else None), (self.path[index + 1] if index + 1 < len(self.path) else None)

    def camera_at(self, pose: CameraPose) -> PosedCamera:
        """Return the same camera, at rest, at another pose."""
        return pose_camera(self.config, pose)

    def of_face(self, table: NDArray[np.int32], missing: int) -> NDArray[np.int32]:
        """Return the entry of a table (m,) by triangle at each pixel, (height, width) int32."""
        return np.where(self.missed, np.int32(missing), np.take(table, self.hits.face, mode="clip"))

    def of_part(self, table: NDArray[np.generic]) -> NDArray[np.generic]:
        """Return the row of a table (p, ...) by part at each pixel, (height, width, ...) of its dtype, 0 where nothing is hit."""
        padded = np.concatenate([table, np.zeros((1, *table.shape[1:]), table.dtype)])
        return np.take(padded, self.part, axis=0, mode="wrap")

    def interpolated(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return values (n, c) by vertex at each hit, (height, width, c) float32; NaN where nothing is hit."""
        image = np.empty((*self.hits.face.shape, values.shape[1]), np.float32)
        self.scene.in_rows(interpolate, values, self.scene.flat.mesh.faces, self.hits, image)
        return image

    def turned(
        self, vectors: NDArray[np.float32], rotation: NDArray[np.float32], away: NDArray[np.float32] = NOWHERE
    ) -> NDArray[np.float32]:
        """Return vectors (height, width, 3), less ``away`` (3,), multiplied by a rotation (3, 3), float32."""
        image = np.empty_like(vectors)
        self.scene.in_rows(turn, vectors, np.ascontiguousarray(rotation), away, image)
        return image


@entry
def place(packet: Packet, camera: PosedCamera, distance: NDArray[np.float32], image: NDArray[np.float32], first: int, step: int) -> None:
    """Fill rows of tiles of an image with the points at a distance (height, width) along the rays, NaN where it is not finite."""
    real = packet.real
    for row in range(first * TILE, camera.height, step * TILE):
        for column in range(0, camera.width, TILE):
            aim_tile(camera, column, row, CENTRE, packet)
            if camera.row_step > np.float32(0.0):
                move_rays(camera, row, MIDDLE, packet)
            for k in range(LANES):
                y, x = row + (k >> 2), column + (k & 3)
                if y >= camera.height or x >= camera.width:
                    continue
                dx, dy, dz = real[DIR_X + k], real[DIR_Y + k], real[DIR_Z + k]
                t = distance[y, x] / np.sqrt(dx * dx + dy * dy + dz * dz)
                t = t if np.isfinite(t) else np.float32(np.nan)
                image[y, x, 0], image[y, x, 1], image[y, x, 2] = (
                    real[ORG_X + k] + t * dx,
                    real[ORG_Y + k] + t * dy,
                    real[ORG_Z + k] + t * dz,
                )


@entry
def interpolate(
    values: NDArray[np.float32], faces: NDArray[np.uint32], hits: Hits, image: NDArray[np.float32], first: int, step: int
) -> None:
    """Fill rows ``first``, ``first + step``, ... of an image with values by vertex at the hits, NaN where there is none."""
    height, width, channels = image.shape
    for y in range(first, height, step):
        for x in range(width):
            face = hits.face[y, x]
            for c in range(channels):
                image[y, x, c] = _at_hit(values, faces, hits, y, x, face, c) if face >= 0 else np.float32(np.nan)


@kernel
def _at_hit(values: NDArray[np.float32], faces: NDArray[np.uint32], hits: Hits, y: int, x: int, face: int, c: int) -> np.float32:
    u, v = hits.u[y, x], hits.v[y, x]
    value: np.float32 = (
        (np.float32(1.0) - u - v) * values[faces[face, 0], c] + u * values[faces[face, 1], c] + v * values[faces[face, 2], c]
    )
    return value


@entry
def turn(
    vectors: NDArray[np.float32],
    rotation: NDArray[np.float32],
    away: NDArray[np.float32],
    image: NDArray[np.float32],
    first: int,
    step: int,
) -> None:
    """Fill rows ``first``, ``first + step``, ... of an image with vectors (height, width, 3) less ``away`` (3,), rotated."""
    height, width, _ = vectors.shape
    for i in range(first, height, step):
        for j in range(width):
            x, y, z = vectors[i, j, 0] - away[0], vectors[i, j, 1] - away[1], vectors[i, j, 2] - away[2]
            for axis in range(3):
                image[i, j, axis] = rotation[axis, 0] * x + rotation[axis, 1] * y + rotation[axis, 2] * z


HitLayers = Mapping[str, Callable[[HitView], NDArray[Any]]]
"""Name of a layer -> what computes it."""
