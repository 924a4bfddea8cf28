"""Colour by the irradiance cache, behind the same interface as the path tracer: a view and its hits in, luminance out."""

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.reflectance import WIDE
from renderer.cached_frames.corners import look_between
from renderer.cached_frames.curvature import bend_of_faces
from renderer.cached_frames.edges import EdgeSamples, make_edge_samples, smooth_edges
from renderer.cached_frames.lamp_shapes import build_lamps
from renderer.cached_frames.lone_pixels import lift_lone
from renderer.cached_frames.reconstruction import Picture, make_picture, mix_gloss, sum_across
from renderer.cached_frames.records import CachedView, Tables, make_shade_scratch
from renderer.cached_frames.shading import shade_hits
from renderer.cached_frames.strays import LitStrays, make_strays, none_lit, places_of, share_strays
from renderer.cached_frames.wanted import want_nodes, want_shown
from renderer.core.embree import SceneHandle
from renderer.ground_truth.hit_view import TracedScene
from renderer.irradiance_cache.cache import IrradianceCache
from renderer.irradiance_cache.nodes import NodeLight
from renderer.path.ground_truth import Hits, TracedView

_LEAST_SHARE = np.float32(0.02)


class CachedIntegrator:
    """The cache of one room, and frames by it.

    A frame depends on the scene, ``scene_key``, the view and the frame's key only: each node is a pure function of the scene and its own
    number, whenever it is computed.
    """

    def __init__(self, scene: TracedScene, tree: SceneHandle, store: IrradianceCache, *, coarse: bool = False) -> None:
        """Take the room's cache, which is solved.

        ``tree``: the scene's triangles as light is traced through them; ``coarse``: frames look the coarse nodes up, which are known.
        """
        self._scene, self._tree, self._coarse = scene, tree, coarse
        self._memory = [make_shade_scratch(scratch) for scratch in scene.scratch]
        self._store = store
        self._none = make_edge_samples(0, 0, 0)
        self._images = make_picture(0, 0), self._none, make_strays(0, 0)
        self.filling_s = 0.0
        """How long computing the nodes of the newest view took (s)."""
        self.strays = 0
        """Places of the newest view that no node knows: light was computed for them alone."""
        lamps, bend = build_lamps(scene.flat, scene.lit.surfaces.sky), bend_of_faces(scene.flat)
        atlas, rows, sun, spacing_m = store.atlas, store.rows, store.light.sun, store.config.spacing_m
        if coarse:
            atlas, rows, spacing_m = store.coarse, store.coarse_rows(), store.config.coarse_spacing_m
            sun = np.zeros((len(rows), 4), np.float32)
        light = (store.source, store.even, store.around, store.leaving)
        parts, ior = scene.flat.parts, scene.flat.materials.ior
        pane_ior = ior[parts.material[parts.portal]].max(initial=np.float32(1.0))
        self._tables = Tables(atlas, rows, sun, *light, np.float32(spacing_m), lamps, _LEAST_SHARE, WIDE, pane_ior, bend)

    @property
    def size_bytes(self) -> int:
        """Memory that the room's cache holds."""
        return self._store.size_bytes

    def radiance(self, view: TracedView, frame_key: np.uint32, cancelled: Callable[[], bool] | None = None) -> NDArray[np.float32]:
        """Return the luminance of a view, (height, width, 3) float32, cd/m2.

        Raises:
            RenderCancelled: ``cancelled`` returned True.
        """
        scene, (height, width) = self._scene.lit._replace(tree=self._tree), view.distance.shape
        if self._images[0].light.shape[:2] != (height, width):
            samples = make_edge_samples(height, width, len(self._tables.rows))
            self._images = make_picture(height, width), samples, make_strays(*samples.hits.shape[::2])
        picture, samples, _ = self._images
        step, self.filling_s = self._scene.workers.count, 0.0
        shown = CachedView(scene, self._tables, view, frame_key, self._nodes_of(view.hits))
        self._scene.workers.run(lambda worker, first: want_shown(shown, self._memory[worker], shown.is_read, first, step), range(step))
        self._fill(shown.is_read, cancelled)
        lit = self._shade(shown, self._none, picture, none_lit(len(self._scene.flat.part_names)), cancelled)
        for mix in (sum_across, mix_gloss):
            self._scene.in_rows(mix, scene.surfaces, view.hits, picture, view.camera.focal_px)
        picture = self._smooth(shown, samples, picture, lit, cancelled)
        self._scene.in_rows(lift_lone, picture.light)
        return picture.light

    def _smooth(
        self, shown: CachedView, samples: EdgeSamples, picture: Picture, lit: LitStrays, cancelled: Callable[[], bool] | None
    ) -> Picture:
        """Return a picture with more points in some of its pixels; ``lit``: its strays."""
        step, smooth = self._scene.workers.count, np.empty_like(picture.light)

        missed = np.zeros(smooth.shape[:2], np.bool_)

        def smooth_rows(worker: int, first: int) -> None:
            smooth_edges(shown, self._memory[worker], picture, smooth, missed, samples, first, step)

        samples.is_read[:] = False
        self._scene.workers.run(lambda worker, first: look_between(shown, self._memory[worker], missed, first, step), range(step))
        self._scene.workers.run(smooth_rows, range(step))
        self._fill(samples.is_read, cancelled)
        np.logical_or(shown.is_read, samples.is_read, out=shown.is_read)
        smoothed = picture._replace(light=smooth)
        self.strays = len(self._shade(shown, samples, smoothed, lit, cancelled).part)
        return smoothed

    def _shade(
        self, shown: CachedView, samples: EdgeSamples, picture: Picture, lit: LitStrays, cancelled: Callable[[], bool] | None
    ) -> LitStrays:
        """Shade a picture, or samples of it; return the strays that are ``lit`` and those that were beside."""
        workers, step, strays = self._scene.workers, self._scene.workers.count, self._images[2]

        def shade(worker: int, first: int) -> None:
            shade_hits(shown, samples, strays, self._memory[worker], picture, first, step)

        workers.run(shade, range(step), cancelled)
        if strays.counts.any():
            lit = share_strays(strays, lit, self._tables.spacing_m)
            new = self._store.light_at(places_of(lit), cancelled)
            lit = lit._replace(light=NodeLight(*(np.concatenate(both) for both in zip(lit.light, new, strict=True))))
            strays = strays._replace(light=lit.light)
            workers.run(shade, range(step), cancelled)
        return lit

    def prepare(self, hits: Hits, cancelled: Callable[[], bool] | None = None) -> int:
        """Compute the nodes that a view reads, as far as they are not known; return how many those were."""
        self.filling_s = 0.0
        return self._fill(self._nodes_of(hits), cancelled)

    def _nodes_of(self, hits: Hits) -> NDArray[np.bool_]:
        """Return which nodes (n,) lie around some hits."""
        step, is_read = self._scene.workers.count, np.zeros(len(self._tables.rows), np.bool_)
        self._scene.workers.run(lambda _, first: want_nodes(self._tables.fine, hits, is_read, first, step), range(step))
        return is_read

    def _fill(self, is_read: NDArray[np.bool_], cancelled: Callable[[], bool] | None) -> int:
        began = time.perf_counter()
        new = 0 if self._coarse else self._store.fill(is_read, cancelled)
        self.filling_s += time.perf_counter() - began
        return new
