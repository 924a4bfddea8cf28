"""The objects of rooms as BOP's models: millimetres, z up, the origin in the middle of the box around them."""

import hashlib
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.distance import pdist

from renderer.annotations.object_meshes import ObjectMeshes
from renderer.annotations.things import things_of
from renderer.core.color import srgb_from_linear
from renderer.geometry.mesh import Mesh
from renderer.scene.flat_scene import FlatScene
from scene_description import SceneDescription
from scene_description.label_standards import label_standard
from scene_description.poses import rotation_from_quaternion
from scene_description.products import matmul

_SAME_M = 1e-4
"""Vertices of equal models differ by less: they were moved into the world and back in float32."""
_KEPT = 64
"""Vertices of a model that are kept to know an equal one by, so that memory does not grow with the meshes of all rooms."""


class ObjectPose(NamedTuple):
    """An object of a room: the number of its model, and the rotation (3, 3) and the place (3,), metres, of the model in the map."""

    model: int
    rotation: NDArray[np.float64]
    place_m: NDArray[np.float64]


class Model(NamedTuple):
    """A model: its number, its mesh in metres, the colours (n, 3) of its vertices, 8-bit sRGB, its category."""

    number: int
    mesh: Mesh
    colors: NDArray[np.uint8]
    category: str

    def info(self) -> dict[str, Any]:
        """Return the model's row of ``models_info.json``: millimetres, with its category as ``name``."""
        vertices = self.mesh.vertices.astype(np.float64) * 1000.0
        low, size = vertices.min(axis=0), np.ptp(vertices, axis=0)
        row: dict[str, Any] = {"diameter": diameter(vertices)}
        row |= {f"min_{axis}": float(value) for axis, value in zip("xyz", low, strict=True)}
        row |= {f"size_{axis}": float(value) for axis, value in zip("xyz", size, strict=True)}
        return row | {"name": self.category}


class ModelLibrary:
    """Knows the models of all rooms, each once, numbered from 1 in the order in which they come.

    Two objects have one model if category, triangles and colours are equal and the kept vertices lie within ``_SAME_M`` of each other.
    """

    def __init__(self) -> None:
        self._count = 0
        self._alike: dict[tuple[str, int, bytes], list[tuple[int, NDArray[np.float32]]]] = {}

    def add_room(self, scene: SceneDescription, flat: FlatScene, meshes: ObjectMeshes) -> tuple[dict[int, ObjectPose], list[Model]]:
        """Return the objects and openings of a room by their ids, and the models that were not there before."""
        poses: dict[int, ObjectPose] = {}
        fresh: list[Model] = []
        for key, thing in things_of(scene, meshes, label_standard("nyu40")).items():
            rotation = rotation_from_quaternion(thing.box.orientation)
            mesh, colors, place = _local(flat, key, rotation)
            number, is_new = self._number(mesh, colors, thing.category)
            poses[key] = ObjectPose(number, rotation, place)
            if is_new:
                fresh.append(Model(number, mesh, colors, thing.category))
        return poses, fresh

    def _number(self, mesh: Mesh, colors: NDArray[np.uint8], category: str) -> tuple[int, bool]:
        """Return the number of a model, that of an equal one if there is one, and whether there is none."""
        kept = mesh.vertices[:: max(len(mesh.vertices) // _KEPT, 1)].copy()
        exact = hashlib.sha256(mesh.faces.tobytes() + colors.tobytes()).digest()
        alike = self._alike.setdefault((category, len(mesh.vertices), exact), [])
        for number, vertices in alike:
            if float(np.abs(vertices - kept).max()) < _SAME_M:
                return number, False
        self._count += 1
        alike.append((self._count, kept))
        return self._count, True


def diameter(vertices: NDArray[np.float64]) -> float:
    """Return the largest distance between two of the vertices (n, 3)."""
    try:
        corners = vertices[ConvexHull(vertices).vertices]
    except QhullError:  # all in a plane
        corners = vertices[ConvexHull(vertices, qhull_options="QJ").vertices] if len(vertices) > 5 else vertices
    return float(pdist(corners).max())


def _local(flat: FlatScene, key: int, rotation: NDArray[np.float64]) -> tuple[Mesh, NDArray[np.uint8], NDArray[np.float64]]:
    """Return the mesh of an object in its own frame, its vertices' colours, and where the middle of the box around it lies in the map.

    A colour is that of the material, without its texture.
    """
    own = flat.parts.object_id[flat.face_part] == key
    used, places = np.unique(flat.mesh.faces[own], return_inverse=True)
    faces = places.reshape(-1, 3)
    turned = matmul(flat.mesh.vertices[used].astype(np.float64), rotation)
    middle = 0.5 * (turned.min(axis=0) + turned.max(axis=0))
    normals = matmul(flat.mesh.normals[used].astype(np.float64), rotation)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    linear = flat.materials.base_color[flat.parts.material[flat.face_part[own]]]
    colors = np.zeros((len(used), 3), np.uint8)
    colors[faces] = np.rint(255.0 * np.clip(srgb_from_linear(linear), 0.0, 1.0)).astype(np.uint8)[:, None]
    local = Mesh((turned - middle).astype(np.float32), normals.astype(np.float32), faces.astype(np.uint32))
    return local, colors, matmul(rotation, middle)
