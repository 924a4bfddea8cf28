"""The triangles of a flat scene by object, each object with an Embree scene of its own, made when it is first asked for."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core.embree import EmbreeScene
from renderer.scene.flat_scene import FlatScene

_SPACING_M = 0.1
_MOST_PIECES = 32


class ObjectMesh(NamedTuple):
    """Vertices (n, 3) float32, metres, world; faces (m, 3) uint32."""

    vertices: NDArray[np.float32]
    faces: NDArray[np.uint32]


class ObjectMeshes:
    """Meshes and Embree scenes of a room's objects and openings; ``close`` releases Embree's memory.

    ``portable``: as of ``EmbreeScene``, the same as of the scene that the frames are rendered with.
    """

    def __init__(self, flat: FlatScene, *, portable: bool = False) -> None:
        owner = flat.parts.object_id[flat.face_part]
        self._order = np.argsort(owner, kind="stable")
        ids, starts = np.unique(owner[self._order], return_index=True)
        ends = [*starts[1:], len(owner)]
        self._runs = {int(key): (int(start), int(end)) for key, start, end in zip(ids, starts, ends, strict=True) if key}
        self._flat, self._portable = flat.mesh, portable
        self._meshes: dict[int, ObjectMesh] = {}
        self._outlines: dict[int, NDArray[np.float32]] = {}
        self._trees: dict[int, EmbreeScene] = {}

    @property
    def ids(self) -> frozenset[int]:
        """Ids of the objects and openings that have triangles."""
        return frozenset(self._runs)

    def mesh(self, key: int) -> ObjectMesh:
        """Return the triangles of an object alone."""
        if key not in self._meshes:
            start, end = self._runs[key]
            used, places = np.unique(self._flat.faces[self._order[start:end]], return_inverse=True)
            self._meshes[key] = ObjectMesh(self._flat.vertices[used], places.reshape(-1, 3).astype(np.uint32))
        return self._meshes[key]

    def outline(self, key: int) -> NDArray[np.float32]:
        """Return points (n, 3) that bound an object where lenses bend straight edges: its vertices, and points along its long edges."""
        if key not in self._outlines:
            vertices, faces = self.mesh(key)
            edges = np.unique(np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
            start, way = vertices[edges[:, 0]], vertices[edges[:, 1]] - vertices[edges[:, 0]]
            lengths = np.linalg.norm(way, axis=1)
            long, longest = lengths > _SPACING_M, float(lengths.max(initial=0.0))
            shares = np.linspace(0.0, 1.0, min(_MOST_PIECES, int(np.ceil(longest / _SPACING_M))) + 1, dtype=np.float32)[1:-1]
            between = start[long, None, :] + shares[:, None] * way[long, None, :]
            self._outlines[key] = np.concatenate([vertices, between.reshape(-1, 3)])
        return self._outlines[key]

    def tree(self, key: int) -> EmbreeScene:
        """Return the scene that holds an object alone."""
        if key not in self._trees:
            mesh = self.mesh(key)
            self._trees[key] = EmbreeScene(mesh.vertices, mesh.faces, portable=self._portable)
        return self._trees[key]

    def close(self) -> None:
        """Release Embree's memory; harmless when repeated."""
        for tree in self._trees.values():
            tree.close()
        self._trees.clear()
