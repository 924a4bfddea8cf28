"""The irradiance cache of one room: coarse light everywhere, and fine light at the nodes that somebody looks at.

Light is solved for coarse nodes by radiosity: each sends a hemisphere of rays once, which link it to the nodes that they hit, and light
passes along these links until it settles; that of the sun is traced from the panes on, as photons.  A fine node then gathers once from the
coarse ones (final gathering), and samples the lights itself.  It is a pure function of the scene and its own number, so it does not matter
when it is computed, or with which others.
"""

import copy
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core.color import LUMINANCE
from renderer.core.random_numbers import make_frame_key
from renderer.core.ray_packet import LANES, aligned_floats
from renderer.core.sampling import even_points
from renderer.core.workers import Pieces
from renderer.ground_truth.hit_view import TracedScene
from renderer.irradiance_cache.bright_nodes import Bright, choose_bright, light_from_bright, links_to_bright
from renderer.irradiance_cache.cache_geometry import MOST_BEHIND, CacheConfig, CacheGeometry
from renderer.irradiance_cache.caustics import CausticPhotons
from renderer.irradiance_cache.gathering import CoarseLight, gather_nodes, light_from_images
from renderer.irradiance_cache.hemisphere import DARK, Rays, make_gather_scratch
from renderer.irradiance_cache.node_direct import light_nodes
from renderer.irradiance_cache.nodes import (
    LIGHT,
    ROW,
    TOWARD,
    VALID,
    NodeLight,
    make_node_light,
    mixing_reach,
    share_noise,
    smooth_nodes,
    widen,
)
from renderer.irradiance_cache.outside import NOT_OUTSIDE
from renderer.irradiance_cache.photons import SunLight, make_photons, share_flux, trace_photons
from renderer.irradiance_cache.radiosity import Sheets, see_lights, solve_links
from renderer.irradiance_cache.screens import find_screened
from renderer.path.light_nodes import Atlas, KnownLight
from scene_description.products import matmul

_BRIGHT_SAMPLES = 1024
_TIMES, _NEAR_M = 6.0, 0.3
"""How many times the mean luminance of a room bright nodes have, and from how near their light is gathered."""
_MOST_SWEEPS = 100
_PHOTON_PIECES = 8
"""In so many pieces photons are traced, whatever the number of threads, so that sums are the same."""
_SUNLIT = np.float32(1e-3)
"""Least share of the sun at fine nodes around what it falls on."""
_STRAY_RAYS, _STRAY_SAMPLES = 16, 32
"""How many rays a place that is no node sends, and about how many points on lights it samples."""
_OPEN_M = np.float32(0.8)
"""How far coarse nodes in the open are taken to be from what surrounds them, at least."""
_STEPS_SPREAD = np.float32(2.0)
"""How widely a ray has spread that may look light up, in steps between nodes."""


class _Settled(NamedTuple):
    """Light of coarse nodes that has settled once, while what is small and bright among them is sampled.

    luminance, shining, given, by_mirrors: (n, 3) float32, what leaves nodes, cd/m2, that of it by lights alone, what falls on them by
    bright nodes, lux, and by mirrors; sheets: what passes through cloth; bright: what is sampled, in the room and outside; unsampled: the
    nodes, as numbers in ``lit``, that it is still to be sampled at.
    """

    luminance: NDArray[np.float32]
    shining: NDArray[np.float32]
    given: NDArray[np.float32]
    by_mirrors: NDArray[np.float32]
    sheets: Sheets
    bright: tuple[Bright, Bright]
    unsampled: Pieces


class IrradianceCache:
    """The light of one room at the nodes of its surfaces.

    Threading: one thread at a time.

    ``scene``: its tree is the one that light is traced in; ``geometry``: of the room before, which is taken if it differs in the brightness
    and colour of its lights only.

    Attributes:
        geometry: nodes and links; complete once solved.
        luminance, even, around, leaving: (n, 3) float32, what leaves coarse nodes, cd/m2, smoothed illuminance over pi there, lux, that by
            other surfaces alone, and what of it is reflected to most places, with what sheets let through, cd/m2: what gloss mirrors of
            lights goes elsewhere; once solved.
        source: that light as it is gathered; once solved.
        light, rows: what is known of fine nodes.
    """

    def __init__(self, scene: TracedScene, scene_key: int, config: CacheConfig, geometry: CacheGeometry | None = None) -> None:
        self._scene, self.config = scene, config
        self._memory = [make_gather_scratch(scratch) for scratch in scene.scratch]
        self._key = make_frame_key(scene_key, 0, (1,))
        fits = geometry is not None and geometry.serves(scene, self._key, config)
        self.geometry = geometry if geometry is not None and fits else CacheGeometry(scene, self._key, config)
        self.coarse, self.atlas = self.geometry.coarse, self.geometry.fine
        self._coarse_light: NodeLight | None = make_node_light(len(self.coarse.face))
        self._unlit: Pieces | None = None
        self._photons = make_photons(scene.surfaces, scene.lights.infinite, self._key)
        self._caustics: CausticPhotons | None = CausticPhotons(scene.surfaces, scene.lights, self._photons, self._key)
        self._untraced = Pieces(len(self._photons.flux), max(len(self._photons.flux) // _PHOTON_PIECES, LANES))
        self._sunlight: dict[int, SunLight] = {}
        self._sunlit = np.zeros(len(self.atlas.face), np.bool_)
        self._settled: _Settled | None = None
        self._screened = np.zeros(len(scene.lit.lights.groups.area), np.bool_)
        self.light = make_node_light(len(self.atlas.face))
        self.rows = aligned_floats(len(self.atlas.face) * ROW).reshape(-1, ROW)
        self._smooth_done = np.zeros(len(self.atlas.face), np.bool_)
        self._filled = np.zeros(len(self.atlas.face), np.bool_)

    def solve(self, cancelled: Callable[[], bool] | None = None) -> None:
        """Solve the light of coarse nodes, once; go on where a call that was cancelled has stopped.

        Raises:
            RenderCancelled: ``cancelled`` returned True.
        """
        if self._coarse_light is None or self._caustics is None:
            return
        scene, config, geometry, light, caustics = self._scene, self.config, self.geometry, self._coarse_light, self._caustics
        geometry.link(scene, self._memory, cancelled)
        chosen, samples = geometry.lit, even_points(LANES)
        if self._unlit is None:
            self._unlit = Pieces(len(chosen))
            self._screened = find_screened(scene.lit, self.coarse, chosen, self._key, scene.scratch[0])

        def compute(worker: int, piece: tuple[int, int]) -> None:
            nodes, memory = chosen[slice(*piece)], self._memory[worker]
            budget, sky = config.coarse_light_samples, geometry.sky
            light_nodes(scene.lit, self.coarse, self._key, budget, samples, nodes, sky, self._screened, True, memory.trace, light)
            light_from_images(scene.lit, self.coarse, geometry.images, self._key, nodes, memory, light)

        self._unlit.run(scene.workers, compute, cancelled)

        def trace(worker: int, piece: tuple[int, int]) -> None:
            first, bounced = np.zeros((2, len(self.coarse.face), 3), np.float32)
            self._sunlight[piece[0]] = SunLight(first, bounced, np.zeros((len(first), 2), np.float32), self._sunlit)
            trace_photons(
                scene.lit, self.coarse, self.atlas, geometry.looks, self._photons, *piece, scene.scratch[worker], self._sunlight[piece[0]]
            )

        self._untraced.run(scene.workers, trace, cancelled)

        def trace_by_gloss(worker: int, piece: tuple[int, int]) -> None:
            caustics.trace(scene.lit, self.coarse, piece[0], scene.scratch[worker])

        caustics.untraced.run(scene.workers, trace_by_gloss, cancelled)
        # What is known so far may be another's, too (:meth:`shared`): nothing of it is changed from here on.
        mirrored, of_sun = (self._caustic_light(caustics, by_sun) for by_sun in (False, True))
        light = light._replace(indirect=light.indirect + mirrored[:, :3])
        if self._settled is None:
            self._settled = self._settle(light)
        settled = self._settled

        def sample_bright(worker: int, piece: tuple[int, int]) -> None:
            nodes, scratch = chosen[slice(*piece)], scene.scratch[worker]
            for bright in settled.bright:
                light_from_bright(scene.lit, self.coarse, bright, self._key, nodes, scratch, settled.given)

        settled.unsampled.run(scene.workers, sample_bright, cancelled)
        luminance, passed = self._settle_again(settled)
        first, bounced = self._sun_at_nodes()
        looks, (shining, _), inverse_pi = geometry.looks, self._sent(first), np.float32(1.0 / np.pi)
        luminance += shining + inverse_pi * looks.albedo * bounced
        passed += self._sent(first + bounced)[1]
        light = light._replace(sun=np.column_stack([light.sun[:, :3] + first, light.sun[:, 3]]))
        self.even, self.around = (table[geometry.other] for table in self._smooth_even(luminance - settled.shining - shining, light))
        self.leaving = self.even * looks.matt + self.around * (looks.albedo - looks.matt) + passed[geometry.other]
        self.luminance = (luminance + passed)[geometry.other]
        bright = self._choose_bright(self.luminance, self.luminance)
        mirrored += of_sun
        shared = light._replace(indirect=mirrored[:, :3], direct=np.zeros_like(light.direct), toward=mirrored[:, 3:])
        by_gloss = self._smooth(shared)[geometry.other]
        self.source = CoarseLight(self.coarse, self.luminance, geometry.worth, geometry.known, *bright, geometry.images, by_gloss)
        none = np.zeros((0, 3), np.float32)
        self._photons = self._photons._replace(origins=none, directions=none, flux=none)
        self._coarse_light = self._settled = self._caustics = None
        self._sunlight = {}

    def _settle(self, light: NodeLight) -> _Settled:
        """Let light pass along all links until it settles."""
        geometry, looks = self.geometry, self.geometry.looks
        by_mirrors, luminance = np.zeros((2, len(self.coarse.face), 3), np.float32)
        see_lights(self._scene.lit.surfaces, geometry.sightings, by_mirrors)
        shining, passed = self._sent(light.direct + light.indirect + light.sun[:, :3])
        shining += looks.glow
        sheets = Sheets(geometry.behind, looks.passed, passed, passed.copy())
        given = np.zeros_like(luminance)
        solve_links(geometry.links, given, by_mirrors, looks.albedo, shining, sheets, _MOST_SWEEPS, luminance)
        bright = self._choose_bright((luminance + sheets.light)[geometry.other], (shining + passed)[geometry.other])
        unsampled = Pieces(len(geometry.lit) if any(len(nodes.point) for nodes in bright) else 0)
        return _Settled(luminance, shining, given, by_mirrors, sheets, bright, unsampled)

    def _settle_again(self, settled: _Settled) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return what leaves coarse nodes, and what sheets let through, (n, 3), cd/m2, after the bright ones are sampled.

        Few rays meet these, and those by chance.
        """
        geometry, luminance = self.geometry, settled.luminance.copy()
        sheets = settled.sheets._replace(light=settled.sheets.light.copy())
        if any(len(nodes.point) for nodes in settled.bright):
            sampled = [links_to_bright(self.coarse, nodes, geometry.links, geometry.straight) for nodes in settled.bright]
            links = np.where(sampled[0] | sampled[1], np.int32(DARK), geometry.links)
            solve_links(links, settled.given, settled.by_mirrors, geometry.looks.albedo, settled.shining, sheets, _MOST_SWEEPS, luminance)
        return luminance, sheets.light

    def _sun_at_nodes(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return what photons of the sun bring coarse nodes, lux, as ``first`` and ``bounced`` of :class:`SunLight`."""
        count = len(self.coarse.face)
        first, bounced, hits = *np.zeros((2, count, 3), np.float32), np.zeros((count, 2), np.float32)
        for _, left in sorted(self._sunlight.items()):
            first += left.first
            bounced += left.bounced
            hits += left.hits
        return self._share_flux(first, hits[:, 0]), self._share_flux(bounced, hits[:, 1])

    def _share_flux(self, lumen: NDArray[np.float32], hits: NDArray[np.float32]) -> NDArray[np.float32]:
        return share_flux(self.coarse, self.geometry.other, lumen, hits, 0.5 * self.config.coarse_spacing_m)

    def _caustic_light(self, caustics: CausticPhotons, of_sun: bool) -> NDArray[np.float32]:
        """Return what caustics bring coarse nodes, (n, 6), as ``caustics`` of :class:`CoarseLight`: those of the sun, or all others."""
        left = caustics.light(of_sun, len(self.coarse.face))
        return self._share_flux(np.column_stack([left.lumen, left.toward]), left.hits)

    def _sent(self, lux: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return the luminance (n, 3), cd/m2, of coarse nodes by lights that bring so much, and that which sheets let through of it.

        What gloss mirrors is left to caustics; there are none outside.
        """
        looks, behind, inverse_pi = self.geometry.looks, self.geometry.behind, np.float32(1.0 / np.pi)
        passed = np.where(behind[:, None] >= 0, inverse_pi * looks.passed * lux[behind], np.float32(0.0))
        return inverse_pi * np.where(self.geometry.sky.share[:, None] > 0.0, looks.albedo, looks.matt) * lux, passed

    def _choose_bright(self, luminance: NDArray[np.float32], certain: NDArray[np.float32]) -> tuple[Bright, Bright]:
        """Return what of coarse nodes in the room, and of those outside, is sampled as a light.

        Arguments are those of :func:`choose_bright`.
        """
        geometry, outside = self.geometry, self.geometry.pane >= 0
        areas = [np.where(which, geometry.shining_area, np.float32(0.0)) for which in (~outside, outside)]
        mean = (matmul(luminance.astype(np.float64), LUMINANCE) * areas[0]).sum() / max(areas[0].sum(dtype=np.float64), 1e-12)
        within, beyond = (
            choose_bright(
                luminance, certain, self.coarse._replace(area=area), _TIMES * mean, _BRIGHT_SAMPLES, _NEAR_M, geometry.pane, geometry.panes
            )
            for area in areas
        )
        return within, beyond

    def _smooth_even(self, reflected: NDArray[np.float32], light: NodeLight) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return illuminance over pi of coarse nodes (n, 3), for what is mirrored, and that by other surfaces alone.

        The noise of their few rays is shared by neighbours.

        ``reflected``: (n, 3), luminance but for glow and what lights alone bring.
        """
        albedo, lit, none = self.geometry.looks.albedo, light.direct + light.sun[:, :3], np.zeros_like(reflected)
        by_surfaces = np.divide(np.float32(np.pi) * np.maximum(reflected, np.float32(0.0)), albedo, out=none, where=albedo > 1e-3)
        # What is smoothed as a direction elsewhere is light by surfaces here.
        rows = self._smooth(light._replace(indirect=by_surfaces + light.indirect, direct=lit, toward=by_surfaces))
        return np.float32(1.0 / np.pi) * rows[:, :3], np.float32(1.0 / np.pi) * rows[:, 3:]

    def _smooth(self, light: NodeLight) -> NDArray[np.float32]:
        """Return LIGHT and TOWARD of coarse nodes, (n, 6), shared by neighbours; their other light is theirs alone.

        Few points tell what each sees of the sky, so it counts as if all saw as much.
        """
        geometry, coarse = self.geometry, self.coarse
        rows = np.zeros((len(coarse.face), ROW), np.float32)
        shared = light._replace(valid=geometry.worth, open_m=_OPEN_M * geometry.far * geometry.far, sky=np.zeros_like(light.sky))
        spacing = np.float32(self.config.coarse_spacing_m)
        smooth_nodes(geometry.beside_coarse, coarse.normal, coarse.position, spacing, np.arange(len(rows)), shared, rows)
        return np.ascontiguousarray(rows[:, LIGHT : TOWARD + 3])

    @property
    def size_bytes(self) -> int:
        """Memory that the cache holds once it is solved, its geometry included."""
        coarse = (*self.source.bright[:5], *self.source.outside[:5], self.luminance, self.even, self.around, self.leaving)
        tables = (*self.light, *coarse, self.rows, self._filled, self._smooth_done)
        return self.geometry.size_bytes + sum(array.nbytes for array in tables)

    def shared(self, scene: TracedScene) -> "IrradianceCache":
        """Return this cache for another renderer of the same room, which computes with its own threads; what nodes one knows both know."""
        other = copy.copy(self)
        other._scene, other._memory = scene, [make_gather_scratch(scratch) for scratch in scene.scratch]
        return other

    def coarse_rows(self) -> NDArray[np.float32]:
        """Return what frames may look up of coarse nodes instead, (n, ROW): all light, the sun's too, as if it came from everywhere."""
        rows = aligned_floats(len(self.even) * ROW).reshape(-1, ROW)
        rows[:] = 0.0
        rows[:, LIGHT : LIGHT + 3], rows[:, VALID] = np.float32(np.pi) * self.even, self.geometry.known
        return rows

    def fill(self, is_read: NDArray[np.bool_], cancelled: Callable[[], bool] | None = None) -> int:
        """Compute the nodes of ``is_read`` (n,) that are not known yet; return how many.

        Raises:
            RenderCancelled: ``cancelled`` returned True; what was computed stays known.
        """
        todo = np.flatnonzero(is_read & ~self._smooth_done)
        if not len(todo):
            return 0
        beside, spacing, light = self.geometry.beside_fine, np.float32(self.config.spacing_m), self.light
        before, near = int(self._filled.sum()), np.zeros(len(is_read), np.bool_)
        near[todo] = True
        self._light(near, cancelled)
        # How far around them light is mixed is known now.
        widen(beside, mixing_reach(light, todo, spacing), todo, near)
        self._light(near, cancelled)
        smooth_nodes(beside, self.atlas.normal, self.atlas.position, spacing, todo, light, self.rows)
        share_noise(self.atlas, beside, spacing, todo, light, self.rows)
        self._smooth_done[todo] = True
        return int(self._filled.sum()) - before

    def _light(self, wanted: NDArray[np.bool_], cancelled: Callable[[], bool] | None) -> None:
        """Compute what falls on fine nodes (n,) where it is not known."""
        nodes = np.flatnonzero(wanted & ~self._filled)
        scene, config, key, screened = self._scene, self.config, self._key, self._screened
        samples, rays = even_points(config.sun_samples), self._rays(config.gather_rays)

        def compute(worker: int, piece: tuple[int, int]) -> None:
            chosen, memory = nodes[slice(*piece)], self._memory[worker]
            light_nodes(
                scene.lit, self.atlas, key, config.light_samples, samples, chosen, NOT_OUTSIDE, screened, False, memory.trace, self.light
            )
            gather_nodes(scene.lit, self.atlas, self.source, rays, chosen, memory, self.light)
            self.light.sun[chosen, 3] = np.maximum(self.light.sun[chosen, 3], _SUNLIT * self._sunlit[chosen])
            self._filled[chosen] = True

        Pieces(len(nodes)).run(scene.workers, compute, cancelled)

    def light_at(self, places: Atlas, cancelled: Callable[[], bool] | None = None) -> NodeLight:
        """Return the light at places that are no nodes of the cache, by fewer rays, and not smoothed.

        Raises:
            RenderCancelled: ``cancelled`` returned True.
        """
        scene, key, rays = self._scene, self._key, self._rays(_STRAY_RAYS)
        nodes, light = np.arange(len(places.face)), make_node_light(len(places.face))

        def compute(worker: int, piece: tuple[int, int]) -> None:
            chosen, memory = nodes[slice(*piece)], self._memory[worker]
            light_nodes(
                scene.lit, places, key, _STRAY_SAMPLES, rays.pattern, chosen, NOT_OUTSIDE, self._screened, False, memory.trace, light
            )
            gather_nodes(scene.lit, places, self.source, rays, chosen, memory, light)

        Pieces(len(nodes), LANES).run(scene.workers, compute, cancelled)
        return light

    def _rays(self, count: int) -> Rays:
        """Return how a place looks around it with so many rays."""
        return Rays(self._key, even_points(count), np.float32(self.config.spacing_m), MOST_BEHIND)

    def known_light(self, cancelled: Callable[[], bool] | None = None) -> KnownLight:
        """Return the light at all fine nodes, for paths, which are computed as far as they are not known.

        Raises:
            RenderCancelled: ``cancelled`` returned True; what was computed stays known.
        """
        self.solve(cancelled)
        self.fill(np.ones(len(self.atlas.face), np.bool_), cancelled)
        light = np.empty((len(self.rows), 4), np.float32)
        light[:, :3] = np.float32(1.0 / np.pi) * (self.rows[:, LIGHT : LIGHT + 3] + self.light.sun[:, :3])
        light[:, 3] = self.rows[:, VALID]
        return KnownLight(self.atlas, light, _STEPS_SPREAD * np.float32(self.config.spacing_m))


class RoomLight:
    """The irradiance cache of one room, made when a renderer first asks for it, for all that show the room.

    Threading: one thread at a time.

    Arguments are those of :class:`IrradianceCache`.
    """

    def __init__(self, scene_key: int, config: CacheConfig, geometry: CacheGeometry | None = None) -> None:
        self.scene_key, self.config, self._geometry = scene_key, config, geometry
        self._cache: IrradianceCache | None = None

    @property
    def geometry(self) -> CacheGeometry | None:
        """Nodes and links of the cache, once it is made."""
        return self._cache.geometry if self._cache is not None else None

    def cache(self, scene: TracedScene) -> IrradianceCache:
        """Return the cache for a renderer of the room, by which it computes what is not known yet."""
        if self._cache is not None:
            return self._cache.shared(scene)
        self._cache = IrradianceCache(scene, self.scene_key, self.config, self._geometry)
        self._geometry = None
        return self._cache
