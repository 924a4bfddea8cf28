"""Edges: pixels there see three more points, six where light and dark meet or something lies between pixels.

Neighbours that see the same surface light these, else they are shaded themselves, as all are of pixels that are much darker than all around
them.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.cached_frames import records as rec
from renderer.cached_frames.corners import BEHIND, BEND, NEAR, height_over, hit_distance, is_one_surface, seen_point
from renderer.cached_frames.lone_pixels import LONE, is_lone
from renderer.cached_frames.reconstruction import Picture, aligned
from renderer.cached_frames.records import CachedView, ShadeScratch
from renderer.camera.camera_rays import TILE
from renderer.camera.cameras import PosedCamera
from renderer.camera.shutter import aim_exposed_tile
from renderer.core import ray_packet as ray
from renderer.core.embree import SceneHandle, intersect16
from renderer.core.kernel import entry, inlined
from renderer.core.ray_packet import INVALID_ID, LANES, Packet
from renderer.irradiance_cache.atlas import mark_nodes
from renderer.irradiance_cache.specular import is_mirror
from renderer.path import surface_tables as st
from renderer.path.ground_truth import Hits, TracedView
from renderer.path.light_nodes import Atlas
from renderer.path.surface_tables import Surfaces

_ZERO, _ONE = np.float32(0.0), np.float32(1.0)
_AIMED = (ray.ORG_X, ray.ORG_Y, ray.ORG_Z, ray.DIR_X, ray.DIR_Y, ray.DIR_Z)
_HIT = (*_AIMED, ray.TFAR, ray.NG_X, ray.NG_Y, ray.NG_Z, ray.BARY_U, ray.BARY_V)
_CONTRAST = np.float32(0.03)
_STEP = np.float32(0.85)
"""Light of one of two pixels over the other's, at most, for an edge to lie between them in what is mirrored or seen through glass."""
FEW, MANY = 3, 6
"""How many more points a pixel sees at edges, and where one side has less than _STEP of the other's light."""
_ABREAST = 3
"""How many points of a pixel are side by side in a finer picture whose pixels they are."""
_LENT, _ASIDE = np.float32(1.0 / 3.0), np.float32(0.2)
"""How far from where a ray has hit a place that lends its light may be, in steps of nodes, and a point from its pixel's middle, squared."""
_TRIANGLE = np.array([[-0.29, 0.29], [-0.12, -0.42], [0.41, 0.13]], np.float32)
OFFSETS = np.repeat(np.concatenate([_TRIANGLE, -_TRIANGLE]), LANES, axis=1)
"""Where pixels are sampled beside their centre, (6, 32), as offsets of tiles' rays, in pixels: an even triangle, turned, about the centre,
and the one opposite."""


class EdgeSamples(NamedTuple):
    """Points beside the middles of pixels that are to be shaded, by rows of tiles, each with room for all that it may have.

    counts: (rows,) int32; hits: (rows, 12, room) float32, rays and what they hit, in the order of packets; numbers: (rows, 5, room) int32,
    the triangle, -1 for none, column and row of the pixel, of how many points that shows the mean, and which of them it is; is_read: (n,),
    nodes of the cache that they read.
    """

    counts: NDArray[np.int32]
    hits: NDArray[np.float32]
    numbers: NDArray[np.int32]
    is_read: NDArray[np.bool_]


def make_edge_samples(height: int, width: int, nodes: int) -> EdgeSamples:
    """Return room for those of a picture with a cache of so many nodes; memory is taken as it is filled."""
    rows, room = -(-height // TILE), MANY * LANES * -(-width // TILE)
    numbers = np.empty((rows, 5, room), np.int32)
    return EdgeSamples(np.zeros(rows, np.int32), np.empty((rows, len(_HIT), room), np.float32), numbers, np.zeros(nodes, np.bool_))


@inlined
def _differ(image: NDArray[np.float32], x: int, y: int, u: int, v: int) -> bool:
    """Return whether two pixels differ by more than the eye can tell."""
    for channel in range(3):
        here, there = image[y, x, channel], image[v, u, channel]
        if abs(here - there) > _CONTRAST * max(here, there):
            return True
    return False


@inlined
def _points_beside(surfaces: Surfaces, view: TracedView, image: NDArray[np.float32], x: int, y: int) -> int:
    """Return how many more points a pixel is to see.

    It is some if one beside, above or below sees another part, or the same bent or farther away, in other light.  A gap in something is no
    farther away than its depth: there it is so that much less light comes from one of them.  Between slats and other things before each
    other something else may show, however alike their light.
    """
    hits, (height, width) = view.hits, view.distance.shape
    here, points = hits.face[y, x], 0
    if here >= 0 and _shows_other(surfaces, here) and _is_step(hits, image, x, y):
        points = MANY
    for side in range(4):
        u, v = x + (side == 0) - (side == 1), y + (side == 2) - (side == 3)
        if u < 0 or v < 0 or u >= width or v >= height:
            continue
        there = hits.face[v, u]
        if here == there:
            continue
        other = here < 0 or there < 0 or surfaces.face_part[here] != surfaces.face_part[there]
        if not other and _is_behind(surfaces, view, x, y, u, v):
            points = MANY
        elif _differ(image, x, y, u, v):
            least, most = min(image[y, x, 1], image[v, u, 1]), max(image[y, x, 1], image[v, u, 1])
            if other or least < LONE * most or _is_apart(surfaces, view, x, y, u, v):
                points = MANY if least < _STEP * most else max(points, FEW)
    return points


@inlined
def _is_apart(surfaces: Surfaces, view: TracedView, x: int, y: int, u: int, v: int) -> bool:
    """Return whether two pixels see a part that is turned or steps back between them; what is flat and seen aslant does neither."""
    if aligned(surfaces, view.hits.face[y, x], view.hits.face[v, u]) < BEND:
        return True
    if abs(view.distance[v, u] - view.distance[y, x]) <= NEAR * view.distance[y, x]:
        return False
    squared, over_here, over_there = _heights(surfaces, view, x, y, u, v)
    return bool(max(over_here * over_here, over_there * over_there) > BEHIND * squared)


@inlined
def _is_behind(surfaces: Surfaces, view: TracedView, x: int, y: int, u: int, v: int) -> bool:
    """Return whether one of two pixels sees what lies behind the surface at the other.

    On one surface both points lie on the same side of each other's tangent planes, or in these; of slats one beyond another one does not.
    """
    squared, over_here, over_there = _heights(surfaces, view, x, y, u, v)
    return bool((over_here * over_there < _ZERO) & (min(over_here * over_here, over_there * over_there) > BEHIND * squared))


@inlined
def _heights(surfaces: Surfaces, view: TracedView, x: int, y: int, u: int, v: int) -> tuple[np.float32, np.float32, np.float32]:
    """Return the squared way between what two pixels see, m2, and how high each lies over the tangent plane of the other, metres."""
    (here, normal_here), (there, normal_there) = seen_point(surfaces, view, x, y), seen_point(surfaces, view, u, v)
    squared, over_here = height_over(here, normal_here, there)
    _, over_there = height_over(there, normal_there, here)
    return squared, over_here, over_there


@inlined
def _has_missed(missed: NDArray[np.bool_], x: int, y: int) -> bool:
    """Return whether something lies at one of the corners of a pixel that none of the pixels there sees."""
    left, above = max(x - 1, 0), max(y - 1, 0)
    return bool(missed[y, x] | missed[y, left] | missed[above, x] | missed[above, left])


@inlined
def _is_step(hits: Hits, image: NDArray[np.float32], x: int, y: int) -> bool:
    """Return whether one of the eight pixels around shows the same triangle in clearly other light: an edge in a mirror or behind glass."""
    height, width, _ = image.shape
    for v in range(max(y - 1, 0), min(y + 2, height)):
        for u in range(max(x - 1, 0), min(x + 2, width)):
            least, most = min(image[y, x, 1], image[v, u, 1]), max(image[y, x, 1], image[v, u, 1])
            if hits.face[v, u] == hits.face[y, x] and least < _STEP * most:
                return True
    return False


@entry
def smooth_edges(
    shown: CachedView,
    memory: ShadeScratch,
    picture: Picture,
    smooth: NDArray[np.float32],
    missed: NDArray[np.bool_],
    samples: EdgeSamples,
    first: int,
    step: int,
) -> None:
    """Fill rows of tiles ``first``, ``first + step``, ... of ``smooth``: a picture's light, its share at edges, and some more rays.

    Each of these takes its share of the light of the pixel nearby that sees the same surface; where none does, on mirrors and glass, and in
    pixels that are much darker than all around them, it becomes one of ``samples``, and the nodes around it are marked there.  ``missed``:
    what lies between pixels, as of :func:`renderer.cached_frames.corners.look_between`.
    """
    scene, view, image = shown.scene, shown.traced, picture.light
    height, width, _ = image.shape
    packet, queue = memory.trace.rays, memory.edges
    for row in range(first * TILE, height, step * TILE):
        samples.counts[row // TILE] = 0
        for column in range(0, width, TILE):
            edges, steps = _copy_tile(scene.surfaces, missed, view, column, row, image, smooth)
            if edges == 0:
                continue
            queued = _aim_edges(view.camera, column, row, edges, steps, packet, queue)
            for begin in range(0, queued, LANES):
                count = min(LANES, queued - begin)
                _trace_edges(scene.tree, begin, count, packet, queue)
                for k in range(count):
                    pixel = int(queue[6, begin + k])
                    y, x = row + pixel // TILE, column + pixel % TILE
                    points = 1 + (MANY if steps >> pixel & 1 else FEW)
                    found, u, v = _alike(scene.surfaces, view, x, y, k, packet)
                    other = found and view.hits.face[v, u] >= 0 and _shows_other(scene.surfaces, view.hits.face[v, u])
                    near = found and _is_near(view, x, y, u, v, hit_distance(packet, k), _LENT * shown.tables.spacing_m)
                    if near and not other and not is_lone(image, x, y):
                        for channel in range(3):
                            smooth[y, x, channel] += image[v, u, channel] / np.float32(points)
                    else:
                        _add_sample(shown.tables.fine, x, y, int(queue[7, begin + k]), points, k, packet, samples)


@inlined
def _shows_other(surfaces: Surfaces, face: int) -> bool:
    """Return whether a triangle is a mirror or clear glass, which show other things beside the middle of a pixel."""
    materials, row = surfaces.materials, surfaces.face_part[face] * st.ROW_SIZE
    return bool(is_mirror(materials, row) | (materials[row + st.TRANSMISSION] > st.CLEAR))


@inlined
def _copy_tile(
    surfaces: Surfaces,
    missed: NDArray[np.bool_],
    view: TracedView,
    column: int,
    row: int,
    image: NDArray[np.float32],
    smooth: NDArray[np.float32],
) -> tuple[int, int]:
    """Copy a tile's pixels, their share of those that are to see more points; return which are, and which many, a bit each."""
    height, width, _ = image.shape
    edges = steps = 0
    for y in range(row, min(row + TILE, height)):
        for x in range(column, min(column + TILE, width)):
            many = is_lone(image, x, y) or _has_missed(missed, x, y)
            points = MANY if many else _points_beside(surfaces, view, image, x, y)
            if points > 0:
                edges |= 1 << ((y - row) * TILE + x - column)
            if points == MANY:
                steps |= 1 << ((y - row) * TILE + x - column)
            for channel in range(3):
                smooth[y, x, channel] = image[y, x, channel] / np.float32(1 + points)
    return edges, steps


@inlined
def _trace_edges(tree: SceneHandle, begin: int, count: int, packet: Packet, queue: NDArray[np.float32]) -> None:
    """Trace ``count`` rays of the queue, from ``begin`` on."""
    real, integer, alive = packet.real, packet.integer, packet.alive
    for k in range(LANES):
        alive[k] = -1 if k < count else 0
        for field in range(6):
            real[_AIMED[field] + k] = queue[field, begin + k]
        real[ray.TNEAR + k], real[ray.TFAR + k] = _ZERO, np.inf
        real[ray.NG_X + k], real[ray.NG_Y + k], real[ray.NG_Z + k] = _ZERO, _ZERO, _ZERO
        integer[ray.GEOM_ID + k] = INVALID_ID
    intersect16(alive.ctypes.data, tree.address, real.ctypes.data, tree.coherent)


@inlined
def _aim_edges(camera: PosedCamera, column: int, row: int, edges: int, steps: int, packet: Packet, queue: NDArray[np.float32]) -> int:
    """Fill ``queue`` (8, 96) with origin and direction of the rays of a tile's edge pixels, pixel and point; return how many there are.

    ``steps``: which of ``edges`` see many points.
    """
    queued = 0
    for sample in range(MANY if steps else FEW):
        asking = edges if sample < FEW else steps
        aim_exposed_tile(camera, column, row, OFFSETS[sample], packet)
        for k in range(LANES):
            if asking >> k & 1 and packet.alive[k] != 0:
                for field in range(6):
                    queue[field, queued] = packet.real[_AIMED[field] + k]
                queue[6, queued], queue[7, queued] = np.float32(k), np.float32(sample)
                queued += 1
    return queued


@inlined
def _alike(surfaces: Surfaces, view: TracedView, x: int, y: int, k: int, packet: Packet) -> tuple[bool, int, int]:
    """Return whether (x, y) or one of its eight neighbours sees the surface that ray k has hit, and which does (column, row)."""
    hits = view.hits
    face = int(packet.integer[ray.PRIM_ID + k]) if packet.integer[ray.GEOM_ID + k] != INVALID_ID else -1
    if hits.face[y, x] == face:
        return True, x, y
    height, width = hits.face.shape
    best, column, row = np.float32(np.inf), x, y
    for v in range(max(y - 1, 0), min(y + 2, height)):
        for u in range(max(x - 1, 0), min(x + 2, width)):
            there = hits.face[v, u]
            value = np.float32((u - x) * (u - x) + (v - y) * (v - y))
            if there != face:
                if face < 0 or not is_one_surface(surfaces, view, u, v, k, packet):
                    continue
                value += np.float32(4.0)
            if value < best:
                best, column, row = value, u, v
    return bool(best < np.float32(np.inf)), column, row


@inlined
def _is_near(view: TracedView, x: int, y: int, u: int, v: int, far: np.float32, most_m: np.float32) -> bool:
    """Return whether pixel (u, v) sees a place that is no farther than that from where a ray of pixel (x, y) has hit, ``far`` away."""
    if view.hits.face[v, u] < 0:
        return True
    aside, ahead = far / view.camera.focal_px, view.distance[v, u] - far
    squared = (np.float32((u - x) * (u - x) + (v - y) * (v - y)) + _ASIDE) * aside * aside + ahead * ahead
    return bool(squared <= most_m * most_m)


@inlined
def _add_sample(atlas: Atlas, x: int, y: int, point: int, points: int, k: int, packet: Packet, samples: EdgeSamples) -> None:
    """Let ray k, ``point`` of the ``points`` of pixel (x, y), be shaded later, with the light of nodes that are marked."""
    row = y // TILE
    i = samples.counts[row]
    samples.counts[row] = i + 1
    real, face = packet.real, np.int32(-1)
    if packet.integer[ray.GEOM_ID + k] != INVALID_ID:
        face = np.int32(packet.integer[ray.PRIM_ID + k])
        mark_nodes(atlas, int(face), real[ray.BARY_U + k], real[ray.BARY_V + k], -1, samples.is_read)
    for field in range(len(_HIT)):
        samples.hits[row, field, i] = real[_HIT[field] + k]
    samples.numbers[row, 0, i], samples.numbers[row, 1, i], samples.numbers[row, 2, i] = face, x, y
    samples.numbers[row, 3, i], samples.numbers[row, 4, i] = points, point


@inlined
def load_samples(samples: EdgeSamples, row: int, begin: int, memory: ShadeScratch) -> None:
    """Write 16 samples of a row of tiles into the packet, as Embree has left them, from number ``begin`` on; rays without one are off."""
    packet = memory.trace.rays
    for k in range(LANES):
        i = min(begin + k, samples.counts[row] - 1)
        for field in range(len(_HIT)):
            packet.real[_HIT[field] + k] = samples.hits[row, field, i]
        face = samples.numbers[row, 0, i] if begin + k == i else np.int32(-1)
        packet.integer[ray.PRIM_ID + k] = np.uint32(face)
        packet.integer[ray.GEOM_ID + k] = np.uint32(0) if face >= 0 else INVALID_ID
        packet.alive[k] = -1 if begin + k == i else 0
        # Noise is that of a finer picture's pixels, so that the samples of one, and of neighbours, are evenly spread.
        point = samples.numbers[row, 4, i]
        memory.pixels[0, k] = _ABREAST * samples.numbers[row, 1, i] + point % _ABREAST
        memory.pixels[1, k] = MANY // _ABREAST * samples.numbers[row, 2, i] + point // _ABREAST


@inlined
def add_samples(samples: EdgeSamples, row: int, begin: int, primary: NDArray[np.float32], image: NDArray[np.float32]) -> None:
    """Add the share of the samples that are shaded, from number ``begin`` on, to their pixels' light."""
    for k in range(min(LANES, samples.counts[row] - begin)):
        x, y = samples.numbers[row, 1, begin + k], samples.numbers[row, 2, begin + k]
        for channel in range(3):
            # One ray stands for the coat and what lies under it.
            share = primary[rec.SHARE + channel, k] + (primary[rec.UNDER + channel, k] if primary[rec.UNDER_ALPHA, k] < _ONE else _ZERO)
            seen = share * primary[rec.SEEN + channel, k] if primary[rec.ALPHA, k] != _ZERO else _ZERO
            light = primary[rec.LIGHT + channel, k] + primary[rec.LAMPS + channel, k] + seen
            image[y, x, channel] += light / np.float32(samples.numbers[row, 3, begin + k])
