"""Probes: what the guide knows beforehand.  Rays from each cell look once around it, and light passes between cells until it settles.

A probe is a path of its own that ends at the first matt surface.  What it gathers there by sampling lights, and on its way by way of mirrors
and glass, is the light that it brings; to this comes what that surface's cell reflects of the light that arrives there by way of others,
which all probes together determine (radiosity, Goral et al. 1984, with the rays of gathering).  Light that sampling lights finds from the
cell itself is none of the guide's.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from renderer.core import embree as ray
from renderer.core import lanes as ln
from renderer.core.color import LUMINANCE
from renderer.core.embree import LANES
from renderer.core.kernel import entry, inlined
from renderer.core.lanes import count_chosen
from renderer.core.packing import pack, pack_slots
from renderer.core.random_numbers import mix_bits
from renderer.core.sampling import coordinate_system, sample_cosine_hemisphere
from renderer.path import queues as qu
from renderer.path.direct_light import flush_shadow_rays, sample_lights, weigh_lights
from renderer.path.emission import add_emission
from renderer.path.generation import generate_ray_samples, intersect_closest
from renderer.path.guide import Guide, cell_key, find_row
from renderer.path.queues import ROW, WAVE
from renderer.path.records import Film, LitScene, Scratch
from renderer.path.scattering import build_bsdfs, spawn_rays
from renderer.path.sun_patches import weigh_patches
from renderer.path.surfaces import evaluate_surfaces, lift_height
from renderer.scene.flat_scene import FlatScene
from renderer.core.workers import Workers

KNOBS = {"share": 0.6, "cut": 1.0, "least": 0.05, "jitter": 0.0, "edge": 16, "floor": 0.25, "blur": 0.5, "dim": 0.25}
SPACING_M, POINTS_PER_CELL, FEWEST = 0.3, 64, 3
_MOST_SEGMENTS, _SWEEPS = 4, 24
_FLOOR = 0.25
"""Of a bin's weight, the part that is alike for all bins of a cell."""
_ZERO, _ONE, _TINY = np.float32(0.0), np.float32(1.0), np.float32(1e-30)
_RED, _GREEN, _BLUE = (np.float32(weight) for weight in LUMINANCE)
_INFINITE = np.float32(np.inf)
_MATT = np.float32(0.4)
_TO_UNIT = np.float32(2.0**-24)


def build_guide(flat: FlatScene, scene: LitScene, scratch, workers: Workers, cancelled=None) -> Guide:
    points, normals = _spread_points(flat)
    guide, order, start = _make_cells(points, normals)
    count = len(guide.light)
    given, links, weights = (np.zeros((count, WAVE), kind) for kind in (np.float32, np.int32, np.float32))
    points, normals = points[order], normals[order]

    def probe(worker: int, piece: tuple[int, int]) -> None:
        probe_cells(scene, guide, points, normals, start, *piece, scratch[worker], _NO_FILM, given, links, weights)

    workers.run(probe, [(first, min(first + 32, count)) for first in range(0, count, 32)], cancelled)
    return _weighed(guide, given, links, weights)


_NO_FILM = Film(*(np.zeros((0, 0, depth), np.float32) for depth in (3, 3, 6, 3, 3, 2, 3)))


def _spread_points(flat: FlatScene) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return points (n, 3) and unit normals (n, 3), evenly over all surfaces (Roberts' R2 sequence)."""
    corners = flat.mesh.vertices.astype(np.float64)[flat.mesh.faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(cross, axis=1)
    area = np.cumsum(0.5 * length)
    number = np.arange(int(np.ceil(area[-1] / SPACING_M**2 * POINTS_PER_CELL)))
    face = np.searchsorted(area, (number + 0.5) / len(number) * area[-1]).clip(0, len(area) - 1)
    u, v = (0.5 + number * 0.7548776662466927) % 1.0, (0.5 + number * 0.5698402909980532) % 1.0
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    points = corners[face, 0] + u[:, None] * (corners[face, 1] - corners[face, 0]) + v[:, None] * (corners[face, 2] - corners[face, 0])
    return points.astype(np.float32), (cross[face] / np.maximum(length[face, None], 1e-30)).astype(np.float32)


def _make_cells(points, normals):
    keys = np.zeros(len(points), np.int32)
    number_cells(np.float32(SPACING_M), points, normals, keys)
    unique, inverse, counts = np.unique(keys, return_inverse=True, return_counts=True)
    row = np.where(counts >= FEWEST, np.cumsum(counts >= FEWEST) - 1, -1)
    unique, cell = unique[counts >= FEWEST], row[inverse]
    chosen = np.flatnonzero(cell >= 0)
    order = chosen[np.argsort(cell[chosen], kind="stable")]
    start = np.searchsorted(cell[order], np.arange(len(unique) + 1)).astype(np.int64)
    mean = np.stack([np.bincount(cell[order], normals[order, axis], len(unique)) for axis in range(3)], axis=1)
    mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-30)
    size = 1 << int(2 * len(unique) + 1).bit_length()
    table = np.full((2, size), -1, np.int32)
    fill_table(unique.astype(np.int32), *table)
    frame = np.zeros((len(unique), 9), np.float32)
    fill_frames(mean.astype(np.float32), frame)
    K = KNOBS
    return Guide(np.float32(SPACING_M), *(np.float32(K[n]) for n in ("share", "cut", "least", "jitter")), K["edge"], 0, *table, frame.reshape(-1), np.ones(84, np.float32), np.zeros(len(unique), np.float32)), order, start


@entry
def number_cells(spacing_m, points, normals, keys) -> None:
    for i in range(len(points)):
        keys[i] = cell_key(spacing_m, points[i, 0], points[i, 1], points[i, 2], normals[i, 0], normals[i, 1], normals[i, 2])


@entry
def fill_table(unique, keys, rows) -> None:
    last = len(keys) - 1
    for row in range(len(unique)):
        at = int(mix_bits(np.uint32(unique[row]))) & last
        while keys[at] >= 0:
            at = at + 1 & last
        keys[at], rows[at] = unique[row], row


@entry
def fill_frames(normals, frame) -> None:
    for i in range(len(normals)):
        x, y, z = normals[i, 0], normals[i, 1], normals[i, 2]
        frame[i, 0], frame[i, 1], frame[i, 2], frame[i, 3], frame[i, 4], frame[i, 5] = coordinate_system(x, y, z)
        frame[i, 6], frame[i, 7], frame[i, 8] = x, y, z


@entry
def probe_cells(scene, guide, points, normals, start, first, end, scratch, film, given, links, weights) -> None:
    surfaces, lights, lanes = scene.surfaces, scene.lights, scratch.lanes
    for cell in range(first, end):
        count = _start_probes(guide, points, normals, start, cell, scratch, links)
        here, ahead, waiting = scratch.here, scratch.ahead, 0
        for depth in range(_MOST_SEGMENTS):
            queued = 0
            for begin in range(0, count, LANES):
                intersect_closest(scene.tree, here, begin, count, False, scratch)
                evaluate_surfaces(scene, False, _INFINITE, scratch)
                add_emission(_INFINITE, False, scratch)
                weigh_lights(lights, scratch)
                kinds = build_bsdfs(surfaces, True, scratch)
                _end_at_matt(guide, cell, scratch, links, weights)
                for k in range(LANES):
                    lanes[ln.SHARE + k], lanes[ln.CELL + k], lanes[ln.HOPE + k] = _ZERO, -_ONE, -_ONE
                if len(lights.patches) > 0:
                    weigh_patches(lights.patches, scratch)
                generate_ray_samples(lights, depth, np.uint32(0), True, True, scratch)
                waiting = sample_lights(scene, kinds, depth + 1, _INFINITE, waiting, (0, 0), scratch, film)
                queued = spawn_rays(surfaces, lights, scene.guide, kinds, False, False, queued, ahead, scratch)
            scratch.traced[0] += count
            count = queued
            if count == 0:
                break
            here, ahead = ahead, here
        flush_shadow_rays(scene.tree, waiting, scratch)
        for slot in range(WAVE):
            given[cell, slot] = _RED * scratch.light[slot] + _GREEN * scratch.light[WAVE + slot] + _BLUE * scratch.light[2 * WAVE + slot]


@inlined
def _start_probes(guide, points, normals, start, cell, scratch, links) -> int:
    """Queue a ray through each of 4 parts of each bin; return how many leave the surface they start on."""
    rays, lanes, state, frame = scratch.rays, scratch.lanes, scratch.here.state, guide.frame
    for slot in range(9 * WAVE):
        scratch.light[slot] = _ZERO
    queued, among = 0, start[cell + 1] - start[cell]
    for block in range(0, WAVE, LANES):
        for k in range(LANES):
            slot = block + k
            seed = mix_bits(np.uint32(cell * WAVE + slot))
            scratch.seeds[slot] = seed
            scratch.lane_slot[k] = slot
            one, two, three = mix_bits(np.uint32(seed + np.uint32(1))), mix_bits(np.uint32(seed + np.uint32(2))), mix_bits(np.uint32(seed + np.uint32(3)))
            i = start[cell] + np.int64(one) * among // 4294967296
            column, row = slot // 16, slot % 16
            u = (np.float32(column) + np.float32(two >> np.uint32(8)) * _TO_UNIT) / np.float32(16.0)
            v = (np.float32(row) + np.float32(three >> np.uint32(8)) * _TO_UNIT) / np.float32(16.0)
            s, t, n = sample_cosine_hemisphere(u, v)
            dx = s * frame[9 * cell + 0] + t * frame[9 * cell + 3] + n * frame[9 * cell + 6]
            dy = s * frame[9 * cell + 1] + t * frame[9 * cell + 4] + n * frame[9 * cell + 7]
            dz = s * frame[9 * cell + 2] + t * frame[9 * cell + 5] + n * frame[9 * cell + 8]
            nx, ny, nz = normals[i, 0], normals[i, 1], normals[i, 2]
            x, y, z = points[i, 0], points[i, 1], points[i, 2]
            lift = lift_height(x, y, z)
            rays.real[ray.ORG_X + k], rays.real[ray.ORG_Y + k], rays.real[ray.ORG_Z + k] = x + lift * nx, y + lift * ny, z + lift * nz
            rays.real[ray.DIR_X + k], rays.real[ray.DIR_Y + k], rays.real[ray.DIR_Z + k] = dx, dy, dz
            leaves = dx * nx + dy * ny + dz * nz > _ZERO
            lanes[ln.SPAWNED + k] = _ONE if leaves else _ZERO
            links[cell, slot] = -1 if leaves else -2
            at = queued + k
            state[qu.BETA_R + at] = state[qu.BETA_G + at] = state[qu.BETA_B + at] = _ONE
            state[qu.WIDTH + at], state[qu.SPREAD + at], state[qu.OUTSIDE + at] = _ZERO, _ONE, _ZERO
            state[qu.REFERENCE + at] = _ZERO
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
def _end_at_matt(guide, cell, scratch, links, weights) -> None:
    lanes = scratch.lanes
    for k in range(LANES):
        if scratch.rays.alive[k] != 0 and lanes[ln.HIT + k] > _ZERO and lanes[ln.PR_DIFFUSE + k] > _MATT:
            lanes[ln.CONTINUES + k] = _ZERO
            key = cell_key(
                guide.spacing_m,
                lanes[ln.P_X + k],
                lanes[ln.P_Y + k],
                lanes[ln.P_Z + k],
                lanes[ln.NG_X + k],
                lanes[ln.NG_Y + k],
                lanes[ln.NG_Z + k],
            )
            slot = scratch.lane_slot[k]
            links[cell, slot] = find_row(guide, key)
            weights[cell, slot] = (
                _RED * lanes[ln.BETA_R + k] * lanes[ln.DIFFUSE_R + k]
                + _GREEN * lanes[ln.BETA_G + k] * lanes[ln.DIFFUSE_G + k]
                + _BLUE * lanes[ln.BETA_B + k] * lanes[ln.DIFFUSE_B + k]
            )


def _weighed(guide, given, links, weights):
    left = links >= -1
    count = np.maximum(left.sum(axis=1), 1)
    linked = np.where(links >= 0, weights, np.float32(0.0))
    light = np.zeros(len(given), np.float32)
    for _ in range(_SWEEPS):
        arriving = given + linked * light[np.maximum(links, 0)]
        light = (arriving * left).sum(axis=1, dtype=np.float32) / count.astype(np.float32)
    mean_light = light.mean()
    light = np.maximum(light, np.float32(KNOBS['dim'] * mean_light)) + np.float32(1e-20)
    K, edge = KNOBS, KNOBS["edge"]
    bins = np.where(left, arriving, 0.0).astype(np.float64) ** 2
    f = 16 // edge
    bins = bins.reshape(-1, edge, f, edge, f).mean(axis=(2, 4))
    if K["blur"]:
        around = np.pad(bins, ((0, 0), (1, 1), (1, 1)), mode="edge")
        near = sum(around[:, a : a + edge, b : b + edge] for a in range(3) for b in range(3)) / 9.0
        bins = (1.0 - K["blur"]) * bins + K["blur"] * near
    bins = np.sqrt(bins)
    mean = bins.mean(axis=(1, 2), keepdims=True)
    level = K["floor"] + (1.0 - K["floor"]) * np.where(mean > 0.0, bins / np.maximum(mean, 1e-30), 1.0)
    levels = [level]
    while levels[0].shape[1] > 2:
        half = levels[0].shape[1] // 2
        levels.insert(0, levels[0].reshape(-1, half, 2, half, 2).sum(axis=(2, 4)))
    table = np.concatenate([level.reshape(len(given), -1) for level in levels], axis=1)
    return guide._replace(weights=np.ascontiguousarray(table, np.float32).reshape(-1), light=light, size=table.shape[1])
