"""Probes: what the guide knows beforehand.  Rays from each cell look once around it, and light passes between cells until it settles.

A probe is a path of its own that ends at the first matt surface.  What it gathers there by sampling lights, and on its way by mirrors and
glass, is the light that it brings; to this comes what that surface's cell reflects of the light that arrives there by way of others, which
all probes together determine (radiosity, Goral et al. 1984, with the rays of gathering).  Light that sampling lights finds from the cell
itself is none of the guide's.
"""

import threading
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core import lanes as ln
from renderer.core import ray_packet as ray
from renderer.core.color import LUMINANCE
from renderer.core.kernel import entry, inlined
from renderer.core.lanes import count_chosen
from renderer.core.packing import pack, pack_slots
from renderer.core.random_numbers import mix_bits, unit_of
from renderer.core.ray_packet import LANES
from renderer.core.workers import Pieces, Workers
from renderer.path import queues as qu
from renderer.path.direct_light import flush_shadow_rays, sample_lights, weigh_lights
from renderer.path.emission import add_emission
from renderer.path.generation import generate_ray_samples, intersect_closest
from renderer.path.guide import EDGE, Guide, aim_from, diffuse_throughput, find_hit_row
from renderer.path.guide_cells import CellPoints, make_cells
from renderer.path.queues import ROW, WAVE
from renderer.path.records import Film, LitScene, Scratch
from renderer.path.scattering import build_bsdfs, spawn_rays
from renderer.path.sun_patches import weigh_patches
from renderer.path.surfaces import evaluate_surfaces, lift_height
from renderer.scene.flat_scene import FlatScene

_MOST_SEGMENTS, _SWEEPS = 4, 24
"""Of a probe by way of mirrors and glass; how often light passes between cells."""
_EVEN = 0.25
"""Of a bin's weight, the part that is alike for all bins of a cell."""
_BLUR = 0.5
"""Of a bin's square, the part that is the mean of the bins around it: a probe in each has seen only so much."""
_DARKEST = np.float32(0.25)
"""Of the mean light of all cells, what each is taken to have at least, so that no path ends for a probe's bad luck."""
_PIECE = 32
"""Cells that a worker probes at a time."""
_MISSED, _BLOCKED = -1, -2
_MATT = np.float32(0.4)
"""Least probability of the diffuse lobe where a probe ends."""
_ZERO, _ONE, _TINY = np.float32(0.0), np.float32(1.0), np.float32(1e-30)
_INFINITE = np.float32(np.inf)
_RED, _GREEN, _BLUE = (np.float32(weight) for weight in LUMINANCE)
_NO_FILM = Film(*(np.zeros((0, 0, depth), np.float32) for depth in (3, 3, 6, 3, 3, 2, 3)))


class Probes(NamedTuple):
    """What the probes of g cells have found, one in each of WAVE bins, all (g, WAVE).

    given: float32, luminance that sampling lights has found, cd/m2; links: int32, row of the cell where the probe ended, -1 where none
    did, -2 where the probe was blocked by the cell's own surface; weights: float32, luminance that it brings of 1 cd/m2 around that cell.
    """

    given: NDArray[np.float32]
    links: NDArray[np.int32]
    weights: NDArray[np.float32]


class RoomGuide:
    """The guide of one scene, built when it is first asked for; a pure function of the scene.

    Threading: guards itself, so renderers of the same scene may share one.
    """

    def __init__(self, flat: FlatScene) -> None:
        self._flat, self._lock = flat, threading.Lock()
        self._begun: tuple[Guide, CellPoints, Probes, Pieces] | None = None
        self._guide: Guide | None = None

    def read(self, scene: LitScene, scratch: Sequence[Scratch], workers: Workers, cancelled: Callable[[], bool] | None = None) -> Guide:
        """Return the guide; go on where a call that was cancelled has stopped.

        ``scratch``: of each worker, as of :func:`renderer.path.records.make_scratch` for this scene.

        Raises:
            RenderCancelled: ``cancelled`` returned True.
        """
        with self._lock:
            if self._guide is None:
                guide, points, probes, left = self._begun = self._begun or self._begin()

                def probe(worker: int, cells: tuple[int, int]) -> None:
                    probe_cells(scene, guide, points, *cells, scratch[worker], _NO_FILM, probes)

                left.run(workers, probe, cancelled)
                self._guide, self._begun = _weighed(guide, probes), None
            return self._guide

    def _begin(self) -> tuple[Guide, CellPoints, Probes, Pieces]:
        guide, points = make_cells(self._flat)
        size = (len(guide.light), WAVE)
        probes = Probes(np.zeros(size, np.float32), np.zeros(size, np.int32), np.zeros(size, np.float32))
        return guide, points, probes, Pieces(len(guide.light), _PIECE)


@entry
def probe_cells(
    scene: LitScene, guide: Guide, points: CellPoints, first: int, end: int, scratch: Scratch, film: Film, probes: Probes
) -> None:
    """Fill ``probes`` of cells [first, end); ``film`` takes nothing."""
    surfaces, lights = scene.surfaces, scene.lights
    for cell in range(first, end):
        count = _start_probes(guide, points, cell, scratch, probes.links)
        here, ahead, waiting = scratch.here, scratch.ahead, 0
        for depth in range(_MOST_SEGMENTS):
            queued = 0
            for begin in range(0, count, LANES):
                intersect_closest(scene.tree, here, begin, count, False, scratch)
                evaluate_surfaces(scene, False, False, _INFINITE, scratch)
                add_emission(_INFINITE, False, scratch)
                weigh_lights(lights, scratch)
                kinds = build_bsdfs(surfaces, True, scratch)
                _end_at_matt(guide, cell, scratch, probes)
                if len(lights.patches) > 0:
                    weigh_patches(lights.patches, scratch)
                generate_ray_samples(lights, depth, np.uint32(0), True, False, scratch)
                waiting = sample_lights(scene, kinds, depth + 1, _INFINITE, waiting, (0, 0), scratch, film)
                queued = spawn_rays(scene, kinds, False, False, queued, ahead, scratch)
            scratch.traced[0] += count
            count = queued
            if count == 0:
                break
            here, ahead = ahead, here
        flush_shadow_rays(scene.tree, waiting, scratch)
        for slot in range(WAVE):
            red, green, blue = scratch.light[slot], scratch.light[WAVE + slot], scratch.light[2 * WAVE + slot]
            probes.given[cell, slot] = _RED * red + _GREEN * green + _BLUE * blue


@inlined
def _start_probes(guide: Guide, points: CellPoints, cell: int, scratch: Scratch, links: NDArray[np.int32]) -> int:
    """Queue a ray through each bin, from one of the cell's points; return how many leave the surface they start on."""
    rays, lanes, state = scratch.rays, scratch.lanes, scratch.here.state
    for slot in range(9 * WAVE):
        scratch.light[slot] = _ZERO
    queued, first, among = 0, points.start[cell], points.start[cell + 1] - points.start[cell]
    for block in range(0, WAVE, LANES):
        for k in range(LANES):
            slot, at = block + k, queued + k
            seed = mix_bits(np.uint32(cell * WAVE + slot))
            scratch.seeds[slot], scratch.lane_slot[k] = seed, slot
            one, two, three = mix_bits(seed + np.uint32(1)), mix_bits(seed + np.uint32(2)), mix_bits(seed + np.uint32(3))
            i = first + np.int64(one) * among // 4294967296
            u = (np.float32(slot // EDGE) + unit_of(two)) / np.float32(EDGE)
            v = (np.float32(slot % EDGE) + unit_of(three)) / np.float32(EDGE)
            dx, dy, dz = aim_from(guide.frame, cell, u, v)
            nx, ny, nz = points.normals[i, 0], points.normals[i, 1], points.normals[i, 2]
            x, y, z = points.points[i, 0], points.points[i, 1], points.points[i, 2]
            lift = lift_height(x, y, z)
            rays.real[ray.ORG_X + k], rays.real[ray.ORG_Y + k], rays.real[ray.ORG_Z + k] = x + lift * nx, y + lift * ny, z + lift * nz
            rays.real[ray.DIR_X + k], rays.real[ray.DIR_Y + k], rays.real[ray.DIR_Z + k] = dx, dy, dz
            leaves = dx * nx + dy * ny + dz * nz > _ZERO
            lanes[ln.SPAWNED + k] = _ONE if leaves else _ZERO
            links[cell, slot] = _MISSED if leaves else _BLOCKED
            state[qu.BETA_R + at] = state[qu.BETA_G + at] = state[qu.BETA_B + at] = _ONE
            state[qu.WIDTH + at], state[qu.SPREAD + at] = _ZERO, _ONE
            state[qu.FIRST_EXPECTED + at], state[qu.OUTSIDE + at] = _ZERO, _ZERO
            # As if sampling lights were sure to find what this ray meets.
            state[qu.RAY_PDF + at], state[qu.PREV_IMPORTANCE + at] = _ONE, _TINY
            state[qu.PREV_NS_X + at], state[qu.PREV_NS_Y + at], state[qu.PREV_NS_Z + at] = dx, dy, dz
        for axis in range(3):
            pack(rays.real, ray.ORG_X + LANES * axis, lanes, ln.SPAWNED, state, qu.ORG_X + ROW * axis + queued)
            pack(rays.real, ray.DIR_X + LANES * axis, lanes, ln.SPAWNED, state, qu.DIR_X + ROW * axis + queued)
        pack_slots(scratch.lane_slot, lanes, ln.SPAWNED, scratch.here.slot, queued)
        queued += count_chosen(lanes, ln.SPAWNED)
    return queued


@inlined
def _end_at_matt(guide: Guide, cell: int, scratch: Scratch, probes: Probes) -> None:
    """End the probes of a packet that have hit matt surfaces, and note where."""
    lanes = scratch.lanes
    for k in range(LANES):
        if scratch.rays.alive[k] != 0 and lanes[ln.HIT + k] > _ZERO and lanes[ln.PR_DIFFUSE + k] > _MATT:
            lanes[ln.CONTINUES + k] = _ZERO
            slot = scratch.lane_slot[k]
            probes.links[cell, slot] = find_hit_row(guide, lanes, k)
            probes.weights[cell, slot] = diffuse_throughput(lanes, k)


def _weighed(guide: Guide, probes: Probes) -> Guide:
    """Return the guide with the light that settles between its cells."""
    count = len(guide.light)
    if not count:
        return guide
    left = probes.links > _BLOCKED
    linked = np.where(probes.links >= 0, probes.weights, np.float32(0.0))
    most = np.maximum(left.sum(axis=1), 1).astype(np.float32)
    arriving: NDArray[np.floating] = probes.given
    light: NDArray[np.float32] = np.zeros(count, np.float32)
    for _ in range(_SWEEPS):
        arriving = probes.given + linked * light[np.maximum(probes.links, 0)]
        light = (arriving * left).sum(axis=1, dtype=np.float32) / most
    light = np.maximum(light, _DARKEST * light.mean()) + _TINY
    # Weights go as the root of the light's square, as noise does.
    squares = (np.where(left, arriving, 0.0).astype(np.float64) ** 2).reshape(count, EDGE, EDGE)
    around = np.pad(squares, ((0, 0), (1, 1), (1, 1)), mode="edge")
    near = sum(around[:, i : i + EDGE, j : j + EDGE] for i in range(3) for j in range(3)) / 9.0
    bins = np.sqrt((1.0 - _BLUR) * squares + _BLUR * near)
    mean = bins.mean(axis=(1, 2), keepdims=True)
    levels = [_EVEN + (1.0 - _EVEN) * np.where(mean > 0.0, bins / np.maximum(mean, 1e-30), 1.0)]
    while (width := levels[0].shape[1] // 2) > 1:
        levels.insert(0, levels[0].reshape(count, width, 2, width, 2).sum(axis=(2, 4)))
    table = np.concatenate([level.reshape(count, -1) for level in levels], axis=1)
    return guide._replace(weights=table.astype(np.float32).reshape(-1), light=light)
