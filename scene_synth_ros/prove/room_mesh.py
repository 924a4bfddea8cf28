"""A room as a mesh: its exported GLB, read and cast into by trimesh."""

import io
import json
import struct
from typing import NamedTuple

import numpy as np
import trimesh
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_JSON_AT = 20
"""Where the JSON of a GLB file begins, behind the file's and the chunk's header (glTF 2.0, section 4.4)."""


class Hits(NamedTuple):
    """What rays meet first: distance (n,), infinite for nothing; face normal (n, 3); object's id and class (n,), -1 for nothing."""

    distance: Floats
    normal: Floats
    object_id: NDArray[np.int64]
    label: NDArray[np.int64]


class RoomMesh:
    """The triangles of a GLB file, z up."""

    def __init__(self, glb: bytes) -> None:
        (length,) = struct.unpack_from("<I", glb, _JSON_AT - 8)
        nodes = json.loads(glb[_JSON_AT : _JSON_AT + length])["nodes"]
        said = {node["name"]: node.get("extras", {}) for node in nodes}
        scene = trimesh.load_scene(io.BytesIO(glb), file_type="glb", process=False, merge_primitives=False)
        corners, ids, labels = [], [], []
        for node in scene.graph.nodes_geometry:
            transform, name = scene.graph[node]
            mesh, extras = scene.geometry[name], said.get(node, {})
            corners.append(trimesh.transform_points(mesh.vertices, transform)[mesh.faces])
            ids.append(np.full(len(mesh.faces), extras.get("id", -1)))
            labels.append(np.full(len(mesh.faces), extras.get("label", -1)))
        triangles = np.concatenate(corners)[..., [0, 2, 1]] * (1.0, -1.0, 1.0)  # glTF has y up
        self._ids, self._labels = np.concatenate(ids).astype(np.int64), np.concatenate(labels).astype(np.int64)
        self._first = triangles[:, 0]
        normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        self._normal = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
        faces = np.arange(3 * len(triangles)).reshape(-1, 3)
        self._mesh = trimesh.Trimesh(triangles.reshape(-1, 3), faces, process=False)

    def cast(self, origins: Floats, rays: Floats) -> Hits:
        """Return what rays from ``origins`` (n, 3) along unit ``rays`` (n, 3) meet; the distance is that to the triangle's plane."""
        face = np.asarray(self._mesh.ray.intersects_first(origins, rays), np.int64)
        hit, face = face >= 0, np.maximum(face, 0)
        normal = self._normal[face]
        slope = np.einsum("ij,ij->i", normal, rays)
        with np.errstate(divide="ignore", invalid="ignore"):
            distance = np.einsum("ij,ij->i", normal, self._first[face] - origins) / slope
        facing = np.where(slope[:, None] > 0.0, -normal, normal)
        return Hits(np.where(hit, distance, np.inf), facing, np.where(hit, self._ids[face], -1), np.where(hit, self._labels[face], -1))
