"""Nodes of an atlas: the light that falls on them, where they stand, and how neighbours on a grid share gathered light."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.reflectance import WIDE, Reflector, diffuse_reflector, whole_reflector
from renderer.core import lanes as ln
from renderer.core.color import LUMINANCE
from renderer.core.kernel import entry, inlined
from renderer.core.layout import Layout
from renderer.core.random_numbers import mix_bits, unit_of
from renderer.core.ray_packet import LANES
from renderer.irradiance_cache.places import count_up
from renderer.irradiance_cache.specular import is_clear
from renderer.path import surface_tables as st
from renderer.path.light_nodes import CORNERS, STRIP, Atlas
from renderer.path.records import Scratch
from renderer.path.surface_tables import Surfaces
from renderer.path.surfaces import lift_height


class NodeLight(NamedTuple):
    """Light that falls on n nodes, float32.

    indirect, direct: (n, 3), illuminance in lux, by other surfaces and the sky in panes, and by lamps, as far as it counts for the diffuse
    base, at coarse nodes for all that scatters (:func:`scatterer_of`); sun: (n, 4), that by the sun, and which share of it arrives;
    toward: (n, 3), luminance of the light times its direction, world, over the illuminance of indirect and direct; valid: (n,), 1, less
    where nearly all is close by, 0 within an object; open_m: (n,), harmonic mean distance of what surrounds the node, metres; sky: (n,),
    luminance of what of ``indirect`` the sky in panes sends directly, lux.
    """

    indirect: NDArray[np.float32]
    direct: NDArray[np.float32]
    sun: NDArray[np.float32]
    toward: NDArray[np.float32]
    valid: NDArray[np.float32]
    open_m: NDArray[np.float32]
    sky: NDArray[np.float32]


def make_node_light(count: int) -> NodeLight:
    """Return light of so many nodes, all dark."""
    color = (count, 3)
    return NodeLight(*(np.zeros(shape, np.float32) for shape in (color, color, (count, 4), color, count, count, count)))


_ZERO, _HALF, _ONE, _TINY = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(1e-20)
_RED, _GREEN, _BLUE = (np.float32(weight) for weight in LUMINANCE)


@inlined
def stand_on(atlas: Atlas, node: int, scratch: Scratch) -> None:
    """Let all lanes be hits at one node."""
    lanes = scratch.lanes
    x, y, z = atlas.position[node, 0], atlas.position[node, 1], atlas.position[node, 2]
    nx, ny, nz = atlas.normal[node, 0], atlas.normal[node, 1], atlas.normal[node, 2]
    lift = lift_height(x, y, z)
    for k in range(LANES):
        lanes[ln.P_X + k], lanes[ln.P_Y + k], lanes[ln.P_Z + k] = x + lift * nx, y + lift * ny, z + lift * nz
        lanes[ln.NG_X + k], lanes[ln.NG_Y + k], lanes[ln.NG_Z + k] = nx, ny, nz
        lanes[ln.NS_X + k], lanes[ln.NS_Y + k], lanes[ln.NS_Z + k] = nx, ny, nz
        lanes[ln.HIT + k], lanes[ln.OUTSIDE + k] = _ONE, _ZERO


@inlined
def reflector_of(surfaces: Surfaces, face: int, whole: bool) -> Reflector:
    """Return what of the light on a triangle counts: all that its surface reflects, or what its diffuse base does.  Metal reflects all."""
    materials, row = surfaces.materials, surfaces.face_part[face] * st.ROW_SIZE
    ior = materials[row + st.IOR] if materials[row + st.METALLIC] < _HALF else _ONE
    roughness = materials[row + st.ROUGHNESS]
    if not whole:
        return diffuse_reflector(ior, roughness, surfaces.albedos.reflected)
    base = _RED * materials[row + st.BASE] + _GREEN * materials[row + st.BASE + 1] + _BLUE * materials[row + st.BASE + 2]
    coat = materials[row + st.COAT] if ior > _ONE else _ZERO
    return whole_reflector(base, ior, roughness, coat, materials[row + st.COAT_ROUGHNESS], surfaces.albedos.reflected)


@inlined
def scatters_all(materials: NDArray[np.float32], row: int) -> bool:
    """Return whether all that the part reflects counts as scattered: it is so rough that it has no other lobe, or clear glass."""
    return bool((materials[row + st.ROUGHNESS] >= WIDE) & (materials[row + st.COAT] == _ZERO)) or is_clear(materials, row)


@inlined
def scatterer_of(surfaces: Surfaces, face: int) -> Reflector:
    """Return what counts of the light on a triangle for what its surface scatters."""
    return reflector_of(surfaces, face, scatters_all(surfaces.materials, surfaces.face_part[face] * st.ROW_SIZE))


@inlined
def unit_hash(node: int, key: np.uint32) -> tuple[np.float32, np.float32]:
    """Return two numbers in [0, 1) that belong to a node."""
    first = mix_bits(np.uint32(mix_bits(np.uint32(node)) ^ key))
    second = mix_bits(np.uint32(first + np.uint32(0x9E3779B9)))
    return unit_of(first), unit_of(second)


@inlined
def turned(u: np.float32, shift: np.float32) -> np.float32:
    """Return u + shift within [0, 1)."""
    sum_ = u + shift
    return sum_ - _ONE if sum_ >= _ONE else sum_


@inlined
def arriving(lanes: NDArray[np.float32], k: int) -> tuple[np.float32, np.float32, np.float32, np.float32, np.float32]:
    """Return 1 / LIGHT_PDF, the unit direction TO_LIGHT, and its cosine to NS."""
    x, y, z = lanes[ln.TO_LIGHT_X + k], lanes[ln.TO_LIGHT_Y + k], lanes[ln.TO_LIGHT_Z + k]
    scale = _ONE / np.sqrt(max(x * x + y * y + z * z, _TINY))
    x, y, z = x * scale, y * scale, z * scale
    cosine = max(x * lanes[ln.NS_X + k] + y * lanes[ln.NS_Y + k] + z * lanes[ln.NS_Z + k], _ZERO)
    return _ONE / lanes[ln.LIGHT_PDF + k], x, y, z, cosine


_ROW = Layout()
LIGHT = _ROW.field(3)  # illuminance but for the sun's, lux
TOWARD = _ROW.field(3)  # as in ``NodeLight``
SUN = _ROW.field()  # the share of the sun that arrives
VALID = _ROW.field()
LAMPS = _ROW.field()  # share of the illuminance that lamps send directly
ROW = _ROW.size
"""Numbers of a node that frames look up."""

REACH = 4
"""Most steps between nodes whose light is mixed."""
_SHARE = np.float32(0.35)
"""How far away those are at most whose light is mixed, over the harmonic mean distance of what surrounds both."""
_TURNED = np.float32(0.2)
"""One less the cosine between the normals of nodes of a bent surface, from which on they have nothing in common."""
_ALIKE, _WEIGHT = np.float32(0.3), np.float32(0.6)
_MOST_TIMES = np.float32(1.25)


class Neighbours(NamedTuple):
    """Which nodes lie beside each other on a surface, for kernels.

    grid, back: as of :class:`renderer.path.light_nodes.Atlas`; place: (n,) int32, where in ``grid`` each node is, or the one on whose other
    side it is, -1 for those on no grid; grids: (c, 3) int32, first place, width and height of each; start: (n + 1,) int32, where in
    ``near``, (e,) int32, those begin that share a triangle with a node on no chart, or come next to it along one, itself among them.
    """

    grid: NDArray[np.int32]
    back: NDArray[np.int32]
    place: NDArray[np.int32]
    grids: NDArray[np.int32]
    start: NDArray[np.int32]
    near: NDArray[np.int32]


def find_neighbours(atlas: Atlas) -> Neighbours:
    """Return them for the nodes of an atlas."""
    count = len(atlas.face)
    place = np.full(count, -1, np.int32)
    used, twins = np.flatnonzero(atlas.grid >= 0), np.flatnonzero(atlas.back >= 0)
    place[atlas.grid[used]] = used
    place[atlas.back[twins]] = place[twins]
    grids = np.unique(atlas.cells[atlas.cells[:, 3] >= STRIP][:, :3], axis=0)
    corners = atlas.cells[atlas.cells[:, 3] == CORNERS][:, :3].astype(np.int64)
    pairs = np.concatenate([*(corners[:, [a, b]] for a in range(3) for b in range(3)), _pairs_along(atlas)])
    behind = atlas.back[pairs]
    pairs = np.concatenate([pairs, behind[(behind >= 0).all(axis=1)]])
    keys = np.sort(pairs[:, 0] * count + pairs[:, 1])
    node, near = np.divmod(keys[np.diff(keys, prepend=-1) > 0], count)
    start = np.concatenate([[0], np.cumsum(np.bincount(node, minlength=count))])
    return Neighbours(atlas.grid, atlas.back, place, np.ascontiguousarray(grids), start.astype(np.int32), near.astype(np.int32))


def _pairs_along(atlas: Atlas) -> NDArray[np.int64]:
    """Return which nodes (e, 2) come next to each other in and across rows of large curved triangles, both ways, and each beside itself."""
    first, width, height = np.unique(atlas.cells[atlas.cells[:, 3] == STRIP][:, :3].astype(np.int64), axis=0).T
    size = width * height
    whose, step = np.repeat(np.arange(len(first)), size), count_up(size)
    at, of = first[whose] + step, width[whose]
    next_in_row, above = at[(step + 1) % of != 0], step < size[whose] - of
    ends = np.concatenate([np.column_stack([next_in_row, next_in_row + 1]), np.column_stack([at[above], (at + of)[above]])])
    one_way = atlas.grid[np.concatenate([ends, np.column_stack([at, at])])].astype(np.int64)
    return np.concatenate([one_way, one_way[:, ::-1]])[(np.concatenate([one_way, one_way]) >= 0).all(axis=1)]


def mixing_reach(light: NodeLight, nodes: NDArray[np.int64], spacing_m: np.float32) -> NDArray[np.int64]:
    """Return how many steps away those are whose light is mixed with that of ``nodes`` (i,): one at least, none of those within things."""
    steps = np.clip(_SHARE * light.open_m[nodes] / spacing_m, 1, REACH).astype(np.int64)
    return np.where(light.valid[nodes] > 0.0, steps, 0)


@entry
def widen(beside: Neighbours, reaches: NDArray[np.int64], nodes: NDArray[np.int64], is_read: NDArray[np.bool_]) -> None:
    """Mark all that lie within ``reaches`` (i,) steps of the ``nodes`` (i,) on their grids, and two triangles from those on none."""
    grid, back, place, grids, start, near = beside
    for i in range(len(nodes)):
        node = nodes[i]
        if start[node] < start[node + 1] or place[node] < 0:
            for k in range(start[node], start[node + 1] if reaches[i] > 0 else start[node]):
                for m in range(start[near[k]], start[near[k] + 1]):
                    is_read[near[m]] = True
            continue
        offset, width, height = _grid_of(grids, place[node])
        row, column, reach = (place[node] - offset) // width, (place[node] - offset) % width, reaches[i]
        behind = grid[place[node]] != node
        for y in range(max(row - reach, 0), min(row + reach, height - 1) + 1):
            for x in range(max(column - reach, 0), min(column + reach, width - 1) + 1):
                other = grid[offset + y * width + x]
                if other >= 0 and (not behind or back[other] >= 0):
                    is_read[back[other] if behind else other] = True


@entry
def _grid_of(grids: NDArray[np.int32], place: int) -> tuple[int, int, int]:
    low, high = 0, len(grids) - 1
    while low < high:
        middle = (low + high + 1) >> 1
        if grids[middle, 0] <= place:
            low = middle
        else:
            high = middle - 1
    return grids[low, 0], grids[low, 1], grids[low, 2]


@entry
def smooth_nodes(
    beside: Neighbours,
    normal: NDArray[np.float32],
    position: NDArray[np.float32],
    spacing_m: np.float32,
    nodes: NDArray[np.int64],
    light: NodeLight,
    rows: NDArray[np.float32],
) -> None:
    """Fill ``rows`` (n, ROW) of the nodes, with the means of ``light.indirect`` and ``toward`` around them.

    Neighbours count the less the farther they are, up to a share of the distance to what surrounds both (as records of an irradiance cache
    do, Ward et al., "A Ray Tracing Solution for Diffuse Interreflection", 1988), on bent surfaces the less the more they are turned, and
    the less the more of the sky one of them sees, so that its shadows stay.
    ``normal``, ``position``: (n, 3), world, metres.
    """
    grid, back, place, grids, start, near = beside
    for i in range(len(nodes)):
        node, total = nodes[i], _ONE
        row = rows[node]
        for axis in range(3):
            row[LIGHT + axis], row[TOWARD + axis] = light.indirect[node, axis], light.toward[node, axis]
        reach_m = _SHARE * light.open_m[node]
        if light.valid[node] == _ZERO:
            pass
        elif start[node] < start[node + 1]:
            # Two triangles away, by every way there.
            for k in range(start[node], start[node + 1]):
                for m in range(start[near[k]], start[near[k] + 1]):
                    other, squared, cosine = near[m], _ZERO, _ZERO
                    for axis in range(3):
                        between = position[other, axis] - position[node, axis]
                        squared += between * between
                        cosine += normal[other, axis] * normal[node, axis]
                    alike = max(_ONE - (_ONE - cosine) / _TURNED, _ZERO)
                    alike *= _alike(light, node, other)
                    total += _add_node(light, other, alike * _nearness(light, other, np.sqrt(squared), reach_m), row)
        elif place[node] >= 0:
            # On a grid, and not within an object: neighbours share, as far as what surrounds both is far.
            offset, width, height = _grid_of(grids, place[node])
            line, column = (place[node] - offset) // width, (place[node] - offset) % width
            reach, behind = min(int(reach_m / spacing_m), REACH), grid[place[node]] != node
            for y in range(max(line - reach, 0), min(line + reach, height - 1) + 1):
                for x in range(max(column - reach, 0), min(column + reach, width - 1) + 1):
                    other = grid[offset + y * width + x]
                    other = back[other] if behind and other >= 0 else other
                    if other >= 0 and other != node:
                        far = spacing_m * np.sqrt(np.float32((x - column) * (x - column) + (y - line) * (y - line)))
                        weight = _alike(light, node, other) * _nearness(light, other, far, reach_m)
                        total += _add_node(light, other, weight, row)
        # What frames look up of the node; lamps' light is not smoothed, so that shadows stay sharp.
        for axis in range(3):
            row[LIGHT + axis] = row[LIGHT + axis] / total + light.direct[node, axis]
            row[TOWARD + axis] /= total
        row[SUN], row[VALID] = light.sun[node, 3], light.valid[node]
        lamps = light.direct[node, 0] + light.direct[node, 1] + light.direct[node, 2]
        row[LAMPS] = lamps / max(row[LIGHT] + row[LIGHT + 1] + row[LIGHT + 2], _TINY)


@inlined
def _nearness(light: NodeLight, other: int, far_m: np.float32, reach_m: np.float32) -> np.float32:
    """Return the weight of a node that is so far away, 0 beyond ``reach_m`` or its own reach, and of one within an object."""
    if light.valid[other] == _ZERO:
        return _ZERO
    nearness: np.float32 = max(_ONE - far_m / max(min(reach_m, _SHARE * light.open_m[other]), np.float32(1e-6)), _ZERO)
    return nearness


@inlined
def _alike(light: NodeLight, node: int, other: int) -> np.float32:
    """Return 1 where two nodes have as much light of the sky in panes, 0 where that differs by _ALIKE of their light or more."""
    r = light.indirect[node, 0] + light.direct[node, 0] + light.indirect[other, 0] + light.direct[other, 0]
    g = light.indirect[node, 1] + light.direct[node, 1] + light.indirect[other, 1] + light.direct[other, 1]
    b = light.indirect[node, 2] + light.direct[node, 2] + light.indirect[other, 2] + light.direct[other, 2]
    both = _RED * r + _GREEN * g + _BLUE * b
    alike: np.float32 = max(_ONE - abs(light.sky[node] - light.sky[other]) / max(_HALF * _ALIKE * both, _TINY), _ZERO)
    return alike


@inlined
def _add_node(light: NodeLight, node: int, weight: np.float32, row: NDArray[np.float32]) -> np.float32:
    """Add ``indirect`` and ``toward`` of a node by a weight to LIGHT and TOWARD of a row; return the weight."""
    for axis in range(3):
        row[LIGHT + axis] += weight * light.indirect[node, axis]
        row[TOWARD + axis] += weight * light.toward[node, axis]
    return weight


def share_noise(
    atlas: Atlas,
    neighbours: Neighbours,
    spacing_m: np.float32,
    nodes: NDArray[np.int64],
    light: NodeLight,
    rows: NDArray[np.float32],
) -> None:
    """Fill LIGHT, TOWARD and LAMPS of ``rows`` (n, ROW) of those ``nodes`` (i,) that are close to other surfaces.

    The four nodes beside one on its grid count the less the more their gathered light differs, not at all from 30 % on, nor where something
    stands between (the bilateral filter of Tomasi and Manduchi, "Bilateral Filtering for Gray and Color Images", 1998): the noise of a
    gather is a tenth, shadows where things touch are deeper.  A node is no brighter than _MOST_TIMES the brightest but one of these: else
    a ray that meets something small and bright by chance would leave a spot.
    """
    place, grids = neighbours.place, neighbours.grids
    on_grid = (place[nodes] >= 0) & (atlas.grid[place[nodes]] == nodes)
    chosen = nodes[on_grid & (light.valid[nodes] > 0.0) & (light.open_m[nodes] < spacing_m / _SHARE)]
    at = place[chosen]
    if not len(at):
        return
    offset, width, height = grids[np.searchsorted(grids[:, 0], at, side="right") - 1].T
    column, row = (at - offset) % width, (at - offset) // width
    # Beside: whether there is a place, which, and where the way there begins in ``cuts``.
    beside = (
        (column + 1 < width, at + 1, at, 0),
        (column > 0, at - 1, at - 1, 0),
        (row + 1 < height, at + width, at, 1),
        (row > 0, at - width, at - width, 1),
    )
    others = [np.where(within, atlas.grid[np.where(within, there, at)], -1) for within, there, _, _ in beside]
    passes = [
        (other >= 0) & (light.valid[other] > 0.0) & np.isnan(atlas.cuts[np.where(within, begin, at), way])
        for other, (within, _, begin, way) in zip(others, beside, strict=True)
    ]
    here = _luminance(light.indirect[chosen])
    around = [_luminance(light.indirect[other]) for other in others]
    next_to_most = np.sort([np.where(passing, lit, np.inf) for passing, lit in zip(passes, around, strict=True)], axis=0)[2]
    own = np.minimum(_MOST_TIMES * next_to_most / np.maximum(here, _TINY), 1.0)[:, None].astype(np.float32)
    total, shared, toward = np.ones(len(at), np.float32), own * light.indirect[chosen], light.toward[chosen].copy()
    here *= own[:, 0]
    for other, passing, lit in zip(others, passes, around, strict=True):
        weight = _WEIGHT * np.maximum(1.0 - np.abs(lit - here) / (_ALIKE * np.maximum(np.maximum(lit, here), _TINY)), 0.0)
        weight = np.where(passing, weight, 0.0).astype(np.float32)
        total += weight
        shared += weight[:, None] * light.indirect[other]
        toward += weight[:, None] * light.toward[other]
    rows[chosen, LIGHT : LIGHT + 3] = shared / total[:, None] + light.direct[chosen]
    rows[chosen, TOWARD : TOWARD + 3] = toward / total[:, None]
    lamps = light.direct[chosen, 0] + light.direct[chosen, 1] + light.direct[chosen, 2]
    lit = rows[chosen, LIGHT] + rows[chosen, LIGHT + 1] + rows[chosen, LIGHT + 2]
    rows[chosen, LAMPS] = lamps / np.maximum(lit, _TINY)


def _luminance(color: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.asarray(_RED * color[:, 0] + _GREEN * color[:, 1] + _BLUE * color[:, 2], np.float32)
