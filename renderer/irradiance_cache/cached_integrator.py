"""Colour by the irradiance cache, behind the same interface as the path tracer: a view and its hits in, luminance out."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from renderer.camera.cameras import PosedCamera
from renderer.core.embree import SceneHandle
from renderer.ground_truth.hit_view import TracedScene
from renderer.irradiance_cache.cache import IrradianceCache
from renderer.irradiance_cache.lamps import build_lamps
from renderer.irradiance_cache.reconstruction import OFFSETS, make_picture, mix_mirrored, smooth_edges
from renderer.irradiance_cache.records import Cache, Gloss, make_around
from renderer.irradiance_cache.shading import shade_hits, want_nodes
from renderer.path.ground_truth import Hits

_LEAST_SHARE, _ROUGHEST = np.float32(0.02), np.float32(0.6)


class CachedIntegrator:
    """The cache of one room, and frames by it.

    A frame depends on the scene, ``scene_key``, the view and the frame's key only: each node is a pure function of the scene and its own
    number, whenever it is computed.
    """

    def __init__(self, scene: TracedScene, tree: SceneHandle, store: IrradianceCache) -> None:
        """Take the room's cache, which is solved.  ``tree``: the scene's triangles as light is traced through them."""
        self._scene, self._tree = scene, tree
        self._lamps = build_lamps(scene.flat)
        self._around = [make_around() for _ in scene.scratch]
        self._store = store
        self._memory = (make_picture(0, 0), np.empty((0, 0, 3), np.float32))
        self.filling_s = 0.0
        """How long computing the nodes of the newest view took (s)."""
        self._cache = Cache(store.atlas, store.rows, store.coarse, store.even, store.geometry.worth, store.leaving)

    @property
    def size_bytes(self) -> int:
        """Memory that the room's cache holds."""
        return self._store.size_bytes

    def radiance(
        self,
        view: PosedCamera,
        distance: NDArray[np.float32],
        hits: Hits,
        frame_key: np.uint32,
        cancelled: Callable[[], bool] | None = None,
    ) -> NDArray[np.float32]:
        """Return the luminance of a view, (height, width, 3) float32, cd/m2.

        ``distance``: (height, width), along the rays of the hit record, metres.

        Raises:
            RenderCancelled: ``cancelled`` returned True.
        """
        self.prepare(hits, cancelled)
        scene, mesh, step = self._scene, self._scene.flat.mesh, self._scene.workers.count
        size = (view.height, view.width)
        if self._memory[0].light.shape[:2] != size:
            self._memory = (make_picture(*size), np.empty((*size, 3), np.float32))
        picture, image = self._memory
        smooth = np.empty((*size, 3), np.float32)
        gloss = Gloss(_LEAST_SHARE, _ROUGHEST)
        tables = (scene.surfaces, scene.lights, self._lamps, self._cache, gloss, mesh.vertices, mesh.faces)

        def shade(worker: int, first: int) -> None:
            memory = (scene.scratch[worker], self._around[worker])
            shade_hits(self._tree, *tables, view, frame_key, distance, hits, *memory, picture, first, step)

        def smooth_rows(worker: int, first: int) -> None:
            memory = (scene.scratch[worker].rays, self._around[worker].edges)
            smooth_edges(self._tree, scene.surfaces, view, distance, hits, OFFSETS, *memory, image, smooth, first, step)

        scene.workers.run(shade, range(step), cancelled)
        scene.in_rows(mix_mirrored, scene.surfaces, hits, picture, image)
        scene.workers.run(smooth_rows, range(step))
        return smooth

    def prepare(self, hits: Hits, cancelled: Callable[[], bool] | None = None) -> int:
        """Compute the nodes that a view reads, as far as they are not known; return how many those were."""
        scene, step = self._scene, self._scene.workers.count
        wanted = np.zeros(len(self._store.atlas.face), np.bool_)

        scene.workers.run(lambda _, first: want_nodes(self._cache.fine, hits, wanted, first, step), range(step))
        began = time.perf_counter()
        new = self._store.fill(wanted, cancelled)
        self.filling_s = time.perf_counter() - began
        return new
