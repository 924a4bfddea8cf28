"""What does not change in a room's irradiance cache while its lights do: nodes, what stands between them, and the links among them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from renderer.core.sampling import even_points
from renderer.core.workers import PIECE, Pieces
from renderer.ground_truth.hit_view import TracedScene
from renderer.irradiance_cache.atlas import build_atlas, stand_in
from renderer.irradiance_cache.charts import DEGENERATE, Charts, find_charts, seen_from_behind
from renderer.irradiance_cache.footprints import changes_within, measure_nodes
from renderer.irradiance_cache.hemisphere import BEHIND, DARK, UNKNOWN, GatherScratch, Rays, find_mirrors
from renderer.irradiance_cache.lamp_images import find_images
from renderer.irradiance_cache.nodes import Neighbours, find_neighbours
from renderer.irradiance_cache.outside import UnderSky
from renderer.irradiance_cache.panes import Panes, before_panes, find_panes
from renderer.irradiance_cache.probing import NOTHING, OWN_BACK, Looks, find_cuts, probe, reflect_nodes
from renderer.irradiance_cache.radiosity import Links, Sightings, link_nodes, make_sightings, resolve_links
from renderer.path import surface_tables as st
from renderer.path.light_nodes import GRID, Atlas
from renderer.scene.flat_scene import FlatScene, is_same_geometry


@dataclass(frozen=True, slots=True, kw_only=True)
class CacheConfig:
    """How fine the cache is.

    spacing_m, coarse_spacing_m: metres between nodes at which frames look light up, and between those by which it is solved; gather_rays,
    coarse_rays: rays of a node, multiples of 16; light_samples, coarse_light_samples: about how many points on lights a node samples;
    sun_samples: points on the sun, a multiple of 16.
    """

    spacing_m: float = 0.03
    coarse_spacing_m: float = 0.1
    gather_rays: int = 64
    coarse_rays: int = 32
    light_samples: int = 128
    coarse_light_samples: int = 64
    sun_samples: int = 16


MOST_BEHIND = np.float32(0.25)
"""Share of a node's rays that may see the inside of something before the node counts as one within it."""
_BY_PANES = 0.5
"""Within so many metres of panes, where light changes by the width of a window bar, coarse nodes lie this much closer."""
_STEPS = 3
_PROBES = 64
_LOOK_OUT = ((1 / 3, 1 / 3, 1 / 3), (0.8, 0.1, 0.1), (0.1, 0.8, 0.1), (0.1, 0.1, 0.8))
"""Barycentric weights of the points from which one looks out of a triangle."""
_LEAST_WORTH = 0.02
_LEAST_SKY, _STEPS_OUTDOORS = 0.05, 2
"""Share of a node's rays that must meet nothing for it to be outside, and how often light is scattered there at least."""


class CacheGeometry:
    """The nodes of a room, and the links among the coarse ones.

    All of it depends on the triangles, on materials, and on which triangles shine at all; not on how bright the lights are, or of which
    colour.  Rooms that are the same in that share it once it is complete (:meth:`serves`).

    Threading: one thread at a time completes it; then it is only read.

    Attributes:
        coarse, fine: nodes at which light is solved, and at which frames look it up.
        beside_coarse, beside_fine: which of these lie beside each other.
        links: (n, s) int32, coarse nodes that rays of coarse nodes end at, DARK, ESCAPED, BEHIND or UNKNOWN; straight: (n, s) bool, whether
            they do by no mirror or pane that mirrors.
        images: lamps as flat mirrors and panes show them; sightings: rays that see other lights by mirrors.
        sky: what coarse nodes that are seen outside by panes see of the sky; others see nothing of it.
        worth: (n,) float32, 0 for coarse nodes that :attr:`known` rules out, little where nearly all is close by.
        far: (n,) float32, the share of a coarse node's surroundings that is not close by.
        other: (n,) int32, the coarse node that stands in for each; known: (n,) bool, whether that lies within nothing
            and something around it is not close by.
        lit: coarse nodes that lamps and the sun are sampled at; what falls on others, within things, is of no use to any.
        shining_area: (n,) float32, m2 of the coarse nodes that are sampled as lights if they are bright, 0 for those within things, whose
            area nobody sees, where rays go on, and outside where nobody in the room sees them.
        panes: of windows; pane: (n,) int32, the one by which those of them that are outside are seen, -1 in the room.
        looks: what the surfaces of coarse nodes do with light; behind: (n,) int32, the coarse node on the other side of their sheet, -1
            for none.
        complete: whether :meth:`link` has ended.
    """

    def __init__(self, scene: TracedScene, key: np.uint32, config: CacheConfig) -> None:
        """Place the nodes.

        ``scene``: its tree is the one that light is traced in; ``key``: of the links' random numbers.
        """
        flat = scene.flat
        self._flat, self._shines = flat, scene.lights.face_group >= 0
        self._key, self._config = key, config
        charts = find_charts(flat.mesh, flat.face_part)
        charts.face_chart[_find_outer(scene, charts)] = DEGENERATE
        hidden = charts.closed & ~seen_from_behind(flat.mesh, charts, _doubtful(scene, charts))
        sheets = flat.materials.diffuse_transmission[flat.parts.material] > 0.0
        # Light goes on between the two faces of cloth, too.
        one_sided = ((flat.parts.object_id == 0) | (_is_hollow(scene, charts) & ~sheets))[flat.face_part]
        one_sided |= hidden & ~sheets[flat.face_part]
        self.panes = find_panes(flat)
        near = _near_panes(flat, charts, self.panes)
        coarse_m = np.where(near, _BY_PANES, 1.0) * config.coarse_spacing_m
        laid: dict[int, tuple[Atlas, Neighbours]] = {}

        def lay(_: int, level: int) -> None:
            spacing_m = (coarse_m, config.spacing_m)[level]
            atlas = build_atlas(flat.mesh, flat.face_part, charts, one_sided, spacing_m, self.panes)
            laid[level] = atlas, find_neighbours(atlas)
            _cut_at_panes(self.panes, atlas, laid[level][1].grids)

        scene.workers.run(lay, range(2))
        (self.coarse, self.beside_coarse), (self.fine, self.beside_fine) = laid[0], laid[1]
        measure_nodes(self.coarse, flat.mesh, charts.area, changes_within(self.coarse, near), key)
        # Fine nodes are only lit.
        self.fine = self.fine._replace(area=np.zeros(0, np.float32))
        count, rays = len(self.coarse.face), config.coarse_rays
        self.looks = Looks(*np.zeros((4, count, 3), np.float32))
        self.behind = self.coarse.back.copy()
        front = np.flatnonzero(self.behind >= 0)
        self.behind[self.behind[front]] = front
        self.links, self.straight = np.zeros((count, rays), np.int32), np.zeros((count, rays), np.bool_)
        self.far = np.zeros(count, np.float32)
        self.sky = UnderSky(np.zeros(count, np.float32), np.zeros((count, 3), np.float32))
        at, outdoors = np.zeros((count, 3, rays), np.float32), np.zeros((count, rays), np.bool_)
        self._links = Links(self.links, at, outdoors, self.straight, self.far, self.sky)
        self._sightings: dict[int, Sightings] = {}
        mirrors, panes = find_mirrors(scene.surfaces, self.coarse)
        self.images = find_images(flat, self._shines, mirrors | panes, self.coarse.cells[:, 0])
        self._uncut = [(atlas, Pieces(_count_charts(atlas))) for atlas in (self.coarse, self.fine)]
        self._unlinked, self._unresolved = Pieces(count), Pieces(count)
        self.complete = False

    def link(self, scene: TracedScene, memory: Sequence[GatherScratch], cancelled: Callable[[], bool] | None = None) -> None:
        """Find what stands between nodes, and link the coarse ones; go on where a call that was cancelled has stopped.

        ``scene``: as it was placed in; ``memory``: of each thread; ``cancelled``: as of ``Renderer.render``.

        Raises:
            RenderCancelled: ``cancelled`` returned True.
        """
        if self.complete:
            return
        coarse, config, scratch, workers = self.coarse, self._config, scene.scratch, scene.workers
        for (atlas, pieces), beside in zip(self._uncut, (self.beside_coarse, self.beside_fine), strict=True):
            pieces.run(workers, partial(_find_cuts, scene, atlas, beside.grids), cancelled)
        rays = Rays(self._key, even_points(config.coarse_rays), np.float32(config.coarse_spacing_m), MOST_BEHIND)

        def compute(worker: int, piece: tuple[int, int]) -> None:
            reflect_nodes(scene.lit, coarse, rays.far_m, scratch[worker], self.looks, *piece)
            room = make_sightings(PIECE * len(rays.pattern))
            rows = link_nodes(scene.lit, coarse, rays, self.images, memory[worker], self._links, room, *piece)
            self._sightings[piece[0]] = Sightings(room.node_part[:rows].copy(), room.sights[:rows].copy())

        self._unlinked.run(workers, compute, cancelled)
        in_sheets = self.looks.passed.any(axis=1)
        # What sees the sky lies within nothing, whatever of the room's walls it sees from behind.
        stands_free = ((self.links == BEHIND).mean(axis=1) <= MOST_BEHIND) | (self.sky.share > _LEAST_SKY)
        valid = stands_free & ((self.far > 0.0) | in_sheets)
        self.worth = np.where(valid, self.far + _LEAST_WORTH, 0.0).astype(np.float32)

        def resolve(worker: int, piece: tuple[int, int]) -> None:
            resolve_links(coarse, self.worth, self._links, memory[worker], *piece)

        self._unresolved.run(workers, resolve, cancelled)
        # Of nodes in gaps on flat surfaces, those that see others which see out of them are lit by these.
        in_gaps = np.flatnonzero(stands_free & ~valid & (coarse.cells[coarse.face, 3] == GRID))
        for _ in range(_STEPS):
            valid[in_gaps] |= (valid[self.links[in_gaps]] & (self.links[in_gaps] >= 0)).any(axis=1)
        self.worth[in_gaps] = np.where(valid[in_gaps], np.float32(_LEAST_WORTH), np.float32(0.0))
        self.sky.share[:] *= _find_outdoors(self._links, before_panes(self.panes, coarse.position) < 0.0)
        self.pane = _find_pane(self._links, self.sky.share > 0.0, coarse.position, self.panes)
        self.links[(self.links == BEHIND) & (self.sky.share > 0.0)[:, None]] = DARK
        self.other = stand_in(coarse.cells, coarse.grid, valid, _STEPS)
        # Nodes within things, or in gaps so deep that they see only each other, shine by those that stand in for them; rays that end
        # where there are none tell nothing.
        self.known = valid[self.other]
        np.copyto(self.links, np.where(self.known[self.links], self.other[self.links], UNKNOWN), where=self.links >= 0)
        through = (self.behind >= 0) & self.looks.passed[self.behind].any(axis=1)
        self.lit = np.flatnonzero(valid | through)
        seen = (self.sky.share == 0.0) | (self.pane >= 0)
        shines = valid & (self.far > 0.0) & seen & ~_sends_rays_on(scene, coarse)
        self.shining_area = np.where(shines, coarse.area, np.float32(0.0))
        in_order = [make_sightings(0), *(self._sightings[first] for first in sorted(self._sightings))]
        node_part, sights = [piece.node_part for piece in in_order], [piece.sights for piece in in_order]
        self.sightings = Sightings(np.concatenate(node_part), np.concatenate(sights))
        del self._links, self._sightings
        self.complete = True

    def serves(self, scene: TracedScene, key: np.uint32, config: CacheConfig) -> bool:
        """Return whether it is complete, and that which the cache of a room with these lights needs."""
        same = self.complete and (key, config) == (self._key, self._config)
        return same and np.array_equal(scene.lights.face_group >= 0, self._shines) and is_same_geometry(scene.flat, self._flat)

    @property
    def size_bytes(self) -> int:
        """Memory that it holds once it is complete."""
        tables = (*self.coarse, *self.fine, *self.beside_coarse[2:], *self.beside_fine[2:], self.links, self.straight, *self.sightings)
        known = (self.behind, self.far, self.worth, self.other, self.known, self.lit, self.shining_area, *self.sky, self.pane)
        return sum(array.nbytes for array in (*tables, *self.looks, *known))


def _near_panes(flat: FlatScene, charts: Charts, panes: Panes) -> NDArray[np.bool_]:
    """Return which triangles (m,) lie right before or behind a pane: such as do with all of their chart."""
    before = before_panes(panes, flat.mesh.vertices[flat.mesh.faces].reshape(-1, 3))
    near = np.asarray(~np.isnan(before).reshape(-1, 3).any(axis=1))
    on_chart = charts.face_chart >= 0
    far = np.bincount(charts.face_chart[on_chart], ~near[on_chart], len(charts.normal)) > 0
    near[on_chart] &= ~far[charts.face_chart[on_chart]]
    return near


def _cut_at_panes(panes: Panes, atlas: Atlas, grids: NDArray[np.int32]) -> None:
    """Let panes cut the way between nodes of a grid that lie on both sides of one, as on the flanks of a window's frame.

    ``grids``: (c, 3), as of :class:`renderer.irradiance_cache.nodes.Neighbours`.
    """
    before = np.append(before_panes(panes, atlas.position), np.nan)[atlas.grid]
    near = np.flatnonzero(~np.isnan(before))
    offset, width, height = grids[np.searchsorted(grids[:, 0], near, side="right") - 1].astype(np.int64).T
    row, column = np.divmod(near - offset, width)
    for way, (within, step) in enumerate(((column + 1 < width, 1), (row + 1 < height, width))):
        here, there = before[near], before[np.where(within, near + step, near)]
        crosses = ~np.isnan(there) & ((here < 0.0) != (there < 0.0))
        atlas.cuts[near[crosses], way] = here[crosses] / (here - there)[crosses]


def _find_outdoors(links: Links, beyond: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which nodes (n,) are seen by panes, lie ``beyond`` (n,) one, or are seen by others that do, and see the sky themselves."""
    ends, under_sky = links.ends, links.escaped.share > _LEAST_SKY
    seen = beyond.copy()
    seen[ends[links.outdoors & (ends >= 0)]] = True
    for _ in range(_STEPS_OUTDOORS):
        beside = ends[seen & under_sky]
        seen[beside[beside >= 0]] = True
    return seen & under_sky


def _find_pane(links: Links, outside: NDArray[np.bool_], position: NDArray[np.float32], panes: Panes) -> NDArray[np.int32]:
    """Return the pane (n,) nearest to each node that is ``outside`` (n,) and met by a ray that has left by a pane, -1 for others."""
    pane = np.full(len(position), -1, np.int32)
    met = np.unique(links.ends[links.outdoors & (links.ends >= 0)])
    seen = met[outside[met]]
    if len(panes.part):
        pane[seen] = ((position[seen, None] - panes.middle) ** 2).sum(axis=2).argmin(axis=1)
    return pane


def _sends_rays_on(scene: TracedScene, atlas: Atlas) -> NDArray[np.bool_]:
    """Return which nodes (n,) lie on mirrors or clear glass, from which rays go on (:func:`renderer.irradiance_cache.hemisphere.follow`).

    What they show is what those rays see; their own light must not be counted beside it.
    """
    rows = scene.surfaces.materials.reshape(-1, st.ROW_SIZE)[scene.flat.face_part[atlas.face]]
    clear = (rows[:, st.TRANSMISSION] > 0.5) & (rows[:, st.PORTAL] == 0.0)
    return np.asarray(find_mirrors(scene.surfaces, atlas)[0][atlas.face] | clear)


def _count_charts(atlas: Atlas) -> int:
    """Return how many grids lie on flat charts: those of strips come after them."""
    return len(np.unique(atlas.cells[atlas.cells[:, 3] == GRID, 0]))


def _find_cuts(scene: TracedScene, atlas: Atlas, grids: NDArray[np.int32], worker: int, piece: tuple[int, int]) -> None:
    find_cuts(scene.tree, atlas, grids, scene.scratch[worker], *piece)


def _doubtful(scene: TracedScene, charts: Charts) -> NDArray[np.bool_]:
    """Return which triangles (m,) of closed bodies have something else behind them than their body's inside."""
    faces, found = np.flatnonzero(charts.closed & (charts.area > 0.0)), np.zeros(len(charts.closed), np.bool_)
    found[faces] = ~_see_own_back(scene, faces)
    return found


def _see_own_back(scene: TracedScene, faces: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return for which triangles (f,) one sees the back of their own part's surface, from their middle straight inward."""
    return np.asarray(_probe_along(scene, faces, np.full(3, 1.0 / 3.0), -1.0) == OWN_BACK)


def _find_outer(scene: TracedScene, charts: Charts) -> NDArray[np.bool_]:
    """Return which triangles (m,) are the outer side of floor, walls and ceiling, which nobody sees.

    They lie on charts of the shell before which there is nothing, though there is before others of their part.
    """
    flat, face_chart = scene.flat, charts.face_chart
    faces = np.flatnonzero((flat.parts.object_id[flat.face_part] == 0) & (face_chart >= 0))
    meets = np.zeros(len(faces), np.bool_)
    for shares in _LOOK_OUT:
        meets |= _probe_along(scene, faces, np.array(shares), 1.0) != NOTHING
    by_chart = np.bincount(face_chart[faces], meets, len(charts.normal)) > 0
    by_part = np.bincount(flat.face_part[faces], meets, len(flat.parts.label)) > 0
    found = np.zeros(len(face_chart), np.bool_)
    found[faces] = ~by_chart[face_chart[faces]] & by_part[flat.face_part[faces]]
    return found


def _probe_along(scene: TracedScene, faces: NDArray[np.int64], shares: NDArray[np.float64], side: float) -> NDArray[np.int8]:
    """Return what rays meet (f,) that begin on triangles (f,), at barycentric ``shares`` (3,), along ``side`` times the normal."""
    flat = scene.flat
    corners = flat.mesh.vertices.astype(np.float64)[flat.mesh.faces[faces]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal *= side / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    met, part = np.zeros(len(faces), np.int8), np.ascontiguousarray(flat.face_part[faces])
    origin = ((corners * shares[:, None]).sum(axis=1) + 1e-4 * normal).astype(np.float32)
    if len(faces):
        probe(scene.tree, origin, normal.astype(np.float32), part, flat.face_part, scene.scratch[0], met)
    return met


def _is_hollow(scene: TracedScene, charts: Charts) -> NDArray[np.bool_]:
    """Return which parts (p,) have open bodies that are solids without a hidden side: from within, one sees mostly backs of their faces."""
    flat, count = scene.flat, len(scene.flat.parts.label)
    faces = np.flatnonzero((charts.area > 0.0) & ~charts.closed)
    order = faces[np.lexsort((-charts.area[faces], flat.face_part[faces]))]
    start = np.searchsorted(flat.face_part[order], np.arange(count))
    faces = order[np.arange(len(order)) - start[flat.face_part[order]] < _PROBES]
    part, inside = flat.face_part[faces], _see_own_back(scene, faces)
    weight = charts.area[faces]
    return np.bincount(part, weight * inside, count) > 0.5 * np.maximum(np.bincount(part, weight, count), 1e-12)
