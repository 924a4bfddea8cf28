"""The irradiance cache of one room: coarse light everywhere, and fine light at the nodes that somebody looks at.

Light is solved for coarse nodes by radiosity: each sends a hemisphere of rays once, which link it to the nodes that they hit, and light
passes along these links until it settles.  A fine node then gathers once from the coarse ones (final gathering), and samples the lights
itself.  It is a pure function of the scene and its own number, so it does not matter when it is computed, or with which others.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.cache.atlas import Atlas, build_atlas, stand_in
from renderer.cache.charts import Charts, find_charts
from renderer.cache.config import CacheConfig
from renderer.cache.gathering import choose_bright, gather_nodes
from renderer.cache.hemisphere import BEHIND, make_gather_scratch
from renderer.cache.node_direct import light_nodes
from renderer.cache.node_light import NodeLight, make_node_light
from renderer.cache.node_surfaces import probe_insides, reflect_nodes
from renderer.cache.partitions import find_cuts
from renderer.cache.radiosity import link_nodes, resolve_links, solve_links
from renderer.cache.smoothing import REACH, ROW, places, smooth_nodes, widen
from renderer.core.embree import LANES, SceneHandle, aligned_floats
from renderer.core.random_numbers import make_frame_key
from renderer.core.workers import Workers
from renderer.path.lights import Lights
from renderer.path.records import Scratch
from renderer.path.surface_tables import Surfaces
from renderer.scene.flat_scene import FlatScene

_PIECE = 1024
_SWEEPS = 24
_STEPS = 3
_PROBES = 64
_LEAST_WORTH = 0.02
_OPEN_M = np.float32(0.8)
"""How far coarse nodes in the open are taken to be from what surrounds them, at least."""
_MOST_BEHIND = np.float32(0.25)


class IrradianceCache:
    """The light of one room at the nodes of its surfaces."""

    def __init__(
        self,
        flat: FlatScene,
        surfaces: Surfaces,
        lights: Lights,
        tree: SceneHandle,
        workers: Workers,
        scratch: Sequence[Scratch],
        scene_key: int,
        config: CacheConfig,
    ) -> None:
        self._surfaces, self._lights, self._tree, self._workers, self._scratch = surfaces, lights, tree, workers, scratch
        self.config = config
        self._found = [make_gather_scratch() for _ in scratch]
        self._key = make_frame_key(scene_key, 0, (1,))
        charts = find_charts(flat.mesh, flat.face_part, len(flat.parts.label))
        one_sided = charts.closed | (flat.parts.object_id == 0) | self._is_hollow(flat, charts)
        self.coarse = build_atlas(flat.mesh, flat.face_part, charts, one_sided, config.coarse_spacing_m)
        self.atlas = build_atlas(flat.mesh, flat.face_part, charts, one_sided, config.spacing_m)
        self._place, self.grids = places(self.atlas)
        for atlas, grids in ((self.coarse, places(self.coarse)[1]), (self.atlas, self.grids)):
            self._find_cuts(atlas, grids)
        self.luminance = self._solve()
        self.light = make_node_light(len(self.atlas.face))
        self.rows = aligned_floats(len(self.atlas.face) * ROW).reshape(-1, ROW)
        self._smooth_done = np.zeros(len(self.atlas.face), np.bool_)
        self._filled = np.zeros(len(self.atlas.face), np.bool_)

    def _is_hollow(self, flat: FlatScene, charts: Charts) -> NDArray[np.bool_]:
        """Return which open parts (p,) are solids that lack a hidden side: from within, one sees mostly the backs of their own faces."""
        count = len(charts.closed)
        faces = np.flatnonzero((charts.area > 0.0) & ~charts.closed[flat.face_part])
        order = faces[np.lexsort((-charts.area[faces], flat.face_part[faces]))]
        start = np.searchsorted(flat.face_part[order], np.arange(count))
        faces = order[np.arange(len(order)) - start[flat.face_part[order]] < _PROBES]
        corners = flat.mesh.vertices.astype(np.float64)[flat.mesh.faces[faces]]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
        inside, part = np.zeros(len(faces), np.bool_), np.ascontiguousarray(flat.face_part[faces])
        origin = (corners.mean(axis=1) - 1e-4 * normal).astype(np.float32)
        if len(faces):
            probe_insides(self._tree, origin, (-normal).astype(np.float32), part, flat.face_part, self._scratch[0], inside)
        weight = charts.area[faces]
        return np.bincount(part, weight * inside, count) > 0.5 * np.maximum(np.bincount(part, weight, count), 1e-12)

    def _find_cuts(self, atlas: Atlas, grids: NDArray[np.int32]) -> None:
        def find(worker: int, piece: tuple[int, int]) -> None:
            find_cuts(self._tree, atlas, grids, self._scratch[worker], *piece)

        self._workers.run(find, _pieces(len(grids)))

    def _solve(self) -> NDArray[np.float32]:
        config, atlas = self.config, self.coarse
        count = len(atlas.face)
        albedo, glow = np.zeros((count, 3), np.float32), np.zeros((count, 3), np.float32)
        light = make_node_light(count)
        links, at = np.zeros((count, config.coarse_rays), np.int32), np.zeros((count, 3, config.coarse_rays), np.float32)
        far, seen = np.zeros(count, np.float32), np.zeros((count, 3), np.float32)
        everything = np.arange(count)
        hemisphere, samples = even_points(config.coarse_rays), even_points(LANES)
        spacing = np.float32(config.coarse_spacing_m)

        def compute(worker: int, piece: tuple[int, int]) -> None:
            scratch, tables = self._scratch[worker], (self._surfaces, self._lights)
            reflect_nodes(self._tree, atlas, *tables, spacing, scratch, albedo, glow, *piece)
            light_nodes(self._tree, atlas, *tables, self._key, config.coarse_light_samples, samples, everything, scratch, light, *piece)
            link_nodes(
                self._tree, atlas, *tables, self._key, hemisphere, scratch, self._found[worker], links, at, far, seen, spacing, *piece
            )

        self._workers.run(compute, _pieces(count))
        valid = (links == BEHIND).mean(axis=1) <= _MOST_BEHIND
        self.worth = np.where(valid, far + _LEAST_WORTH, 0.0).astype(np.float32)

        def resolve(worker: int, piece: tuple[int, int]) -> None:
            resolve_links(atlas, self.worth, at, self._found[worker], links, *piece)

        self._workers.run(resolve, _pieces(count))
        other = np.zeros(count, np.int32)
        stand_in(atlas.cells, atlas.grid, valid, _STEPS, other)
        luminance = np.zeros((count, 3), np.float32)
        solve_links(links, light.direct + light.indirect + light.sun[:, :3], seen, albedo, glow, _SWEEPS, luminance)
        self.even = self._smooth_even(luminance - glow, albedo, light, far)[other]
        self.leaving = self.even * albedo
        luminance = luminance[other]
        # Nodes within things shine by those that stand in for them.
        shining = atlas._replace(area=np.where(valid, np.bincount(other, atlas.area, count), 0.0).astype(np.float32))
        self.bright = choose_bright(luminance, shining, 6.0, 32, 0.3)
        self.coarse_light, self.albedo, self.links = light, albedo, links
        return luminance

    def _smooth_even(
        self, reflected: NDArray[np.float32], albedo: NDArray[np.float32], light: NodeLight, far: NDArray[np.float32]
    ) -> NDArray[np.float32]:
        """Return illuminance over pi of coarse nodes (n, 3), for what is mirrored: the noise of their few rays shared by neighbours.

        ``reflected``: (n, 3), luminance without glow; ``far``: (n,), the share of a node's surroundings that is not close by.
        """
        atlas, count = self.coarse, len(far)
        lit = light.direct + light.sun[:, :3]
        total = np.divide(np.float32(np.pi) * reflected, albedo, out=np.zeros_like(reflected), where=albedo > 1e-3)
        around = make_node_light(count)._replace(indirect=total - lit, direct=lit, valid=self.worth, open_m=_OPEN_M * far * far)
        rows = np.zeros((count, ROW), np.float32)
        smooth_nodes(atlas.grid, *places(atlas), np.float32(self.config.coarse_spacing_m), np.arange(count), around, rows)
        return np.asarray(rows[:, :3] * np.float32(1.0 / np.pi))

    @property
    def size_bytes(self) -> int:
        """Memory that the cache holds."""
        tables = (*self.coarse, *self.coarse_light, *self.atlas, *self.light, *self.bright[:4], self.albedo, self.links)
        return _size(
            *tables,
            self.luminance,
            self.worth,
            self.even,
            self.leaving,
            self.rows,
            self._filled,
            self._smooth_done,
            self._place,
            self.grids,
        )

    def fill(self, wanted: NDArray[np.bool_], cancelled: Callable[[], bool] | None = None) -> int:
        """Compute the nodes of ``wanted`` (n,) that are not known yet; return how many."""
        todo = np.flatnonzero(wanted & ~self._smooth_done)
        if not len(todo):
            return 0
        near = np.zeros(len(wanted), np.bool_)
        near[todo] = True
        widen(self.atlas.grid, self._place, self.grids, REACH, todo, near)
        nodes = np.flatnonzero(near & ~self._filled)
        config, atlas = self.config, self.atlas
        hemisphere, samples = even_points(config.gather_rays), even_points(config.sun_samples)

        def compute(worker: int, piece: tuple[int, int]) -> None:
            scratch, tables = self._scratch[worker], (self._surfaces, self._lights)
            light_nodes(self._tree, atlas, *tables, self._key, config.light_samples, samples, nodes, scratch, self.light, *piece)
            gather_nodes(
                self._tree,
                atlas,
                self.coarse,
                self.luminance,
                self.worth,
                self.bright,
                *tables,
                self._key,
                hemisphere,
                _MOST_BEHIND,
                np.float32(config.spacing_m),
                nodes,
                scratch,
                self._found[worker],
                self.light,
                *piece,
            )

        self._workers.run(compute, _pieces(len(nodes)), cancelled)
        self._filled[nodes] = True
        smooth_nodes(self.atlas.grid, self._place, self.grids, np.float32(self.config.spacing_m), todo, self.light, self.rows)
        self._smooth_done[todo] = True
        return len(nodes)


def _size(*arrays: NDArray[Any]) -> int:
    return sum(array.nbytes for array in arrays)


def _pieces(count: int) -> list[tuple[int, int]]:
    return [(first, min(first + _PIECE, count)) for first in range(0, count, _PIECE)]


def even_points(count: int) -> NDArray[np.float32]:
    """Return ``count`` points of the unit square, (count, 2) float32, spread evenly: blocks of 16 lie close together.

    Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences" (2018).
    """
    steps = np.arange(1, count + 1)[:, None] * np.array([0.7548776662466927, 0.5698402909980532])
    points = steps % 1.0
    blocks = max(count // LANES, 1)
    rows = max(1, int(np.sqrt(blocks)))
    order = np.lexsort((points[:, 1], (points[:, 0] * rows).astype(int)))
    return np.ascontiguousarray(points[order], np.float32)
