"""Irradiance caches of small scenes, for the tests of renderer/irradiance_cache and renderer/cached_frames."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from renderer import CameraConfig, RenderConfig, Renderer
from renderer.core.embree import EmbreeScene
from renderer.core.image_memory import ImageMemory
from renderer.core.workers import Workers
from renderer.ground_truth.hit_view import TracedScene
from renderer.irradiance_cache.cache import IrradianceCache
from renderer.irradiance_cache.cache_geometry import CacheConfig, CacheGeometry
from renderer.path.lights import build_lights
from renderer.path.records import make_scratch
from renderer.path.surface_tables import build_surfaces

COARSE = CacheConfig(spacing_m=0.2, coarse_spacing_m=0.3)
"""Few nodes: for scenes of some metres in which light varies slowly."""


@contextmanager
def solved(
    flat, config: CacheConfig = COARSE, *, threads: int = 1, key: int = 5, geometry: CacheGeometry | None = None, is_solved: bool = True
) -> Iterator[IrradianceCache]:
    """The cache of a scene, its coarse light solved unless not wanted."""
    lights, workers = build_lights(flat), Workers(threads)
    scratch = [make_scratch(len(lights.groups.area), 0) for _ in range(threads)]
    panes = flat.parts.portal[flat.face_part]
    with EmbreeScene(flat.mesh.vertices, flat.mesh.faces, panes=panes, watertight=False) as tree:
        room = TracedScene(flat, flat.parts.label, build_surfaces(flat), lights, tree.handle, workers, scratch, ImageMemory())
        cache = IrradianceCache(room, key, config, geometry)
        if is_solved:
            cache.solve()
        yield cache
    workers.close()


def filled(flat, config: CacheConfig = COARSE, **options) -> IrradianceCache:
    """The same with every fine node known; rays can no longer be traced."""
    with solved(flat, config, **options) as cache:
        cache.fill(np.ones(len(cache.atlas.face), np.bool_))
    return cache


def nodes_of(cache: IrradianceCache, part: int, flat, *, front: bool = True) -> np.ndarray:
    """The fine nodes of a part on the fronts (or the backs) of its triangles."""
    backs = np.zeros(len(cache.atlas.face), np.bool_)
    backs[cache.atlas.back[cache.atlas.back >= 0]] = True
    return np.flatnonzero((flat.face_part[cache.atlas.face] == part) & (backs != front))


SMALL = CameraConfig(width=32, height=24)
CACHED = RenderConfig(integrator="cached", threads=1, cache_spacing_m=0.1)


def look_up(flat, view, *, camera: CameraConfig = SMALL, layers=("radiance",), frame: int = 0, key: int = 5, **settings):
    """A frame of the cached integrator."""
    with Renderer(flat, camera, replace(CACHED, **settings), key) as renderer:
        return renderer.render(view, frame, layers)
