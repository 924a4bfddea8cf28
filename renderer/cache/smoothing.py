"""Smoothing of gathered light over the grids of flat charts: far where the surroundings are far, not at all in corners."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.cache.atlas import GRID, Atlas
from renderer.cache.node_light import NodeLight
from renderer.core.kernel import entry
from renderer.core.layout import Layout

_ZERO, _ONE, _TINY = np.float32(0.0), np.float32(1.0), np.float32(1e-20)
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


def places(atlas: Atlas) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Return the place in ``index`` of each node, (n,) int32, -1 for those on no grid, and the grids (c, 3): first place, width, height."""
    place = np.full(len(atlas.face), -1, np.int32)
    used = np.flatnonzero(atlas.grid >= 0)
    place[atlas.grid[used]] = used
    twins = np.flatnonzero(atlas.back >= 0)
    place[atlas.back[twins]] = -1
    grids = np.unique(atlas.cells[atlas.cells[:, 3] == GRID][:, :3], axis=0)
    return place, np.ascontiguousarray(grids)


@entry
def widen(
    index: NDArray[np.int32],
    place: NDArray[np.int32],
    grids: NDArray[np.int32],
    reach: int,
    nodes: NDArray[np.int64],
    wanted: NDArray[np.bool_],
) -> None:
    """Mark all that lie within ``reach`` steps of the nodes on their grids."""
    for i in range(len(nodes)):
        if place[nodes[i]] < 0:
            continue
        offset, width, height = _grid_of(grids, place[nodes[i]])
        row, column = (place[nodes[i]] - offset) // width, (place[nodes[i]] - offset) % width
        for y in range(max(row - reach, 0), min(row + reach, height - 1) + 1):
            for x in range(max(column - reach, 0), min(column + reach, width - 1) + 1):
                node = index[offset + y * width + x]
                if node >= 0:
                    wanted[node] = True


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
    index: NDArray[np.int32],
    place: NDArray[np.int32],
    grids: NDArray[np.int32],
    spacing_m: np.float32,
    nodes: NDArray[np.int64],
    light: NodeLight,
    rows: NDArray[np.float32],
) -> None:
    """Fill ``rows`` (n, ROW) of the nodes, with the means of ``light.indirect`` and ``toward`` around them.

    Neighbours count the less the farther they are, up to a share of the distance to what surrounds both (as records of an irradiance cache
    do, Ward et al., "A Ray Tracing Solution for Diffuse Interreflection", 1988).
    """
    for i in range(len(nodes)):
        node = nodes[i]
        r, g, b, total = light.indirect[node, 0], light.indirect[node, 1], light.indirect[node, 2], _ONE
        tx, ty, tz = light.toward[node, 0], light.toward[node, 1], light.toward[node, 2]
        if place[node] >= 0 and light.valid[node] > _ZERO:
            offset, width, height = _grid_of(grids, place[node])
            row, column = (place[node] - offset) // width, (place[node] - offset) % width
            reach_m = _SHARE * light.open_m[node]
            reach = min(int(reach_m / spacing_m), REACH)
            for y in range(max(row - reach, 0), min(row + reach, height - 1) + 1):
                for x in range(max(column - reach, 0), min(column + reach, width - 1) + 1):
                    other = index[offset + y * width + x]
                    if other < 0 or other == node or light.valid[other] == _ZERO:
                        continue
                    far = spacing_m * np.sqrt(np.float32((x - column) * (x - column) + (y - row) * (y - row)))
                    weight = _ONE - far / max(min(reach_m, _SHARE * light.open_m[other]), np.float32(1e-6))
                    if weight > _ZERO:
                        r, g, b = (
                            r + weight * light.indirect[other, 0],
                            g + weight * light.indirect[other, 1],
                            b + weight * light.indirect[other, 2],
                        )
                        tx += weight * light.toward[other, 0]
                        ty += weight * light.toward[other, 1]
                        tz += weight * light.toward[other, 2]
                        total += weight
        row = rows[node]
        row[LIGHT] = r / total + light.direct[node, 0]
        row[LIGHT + 1] = g / total + light.direct[node, 1]
        row[LIGHT + 2] = b / total + light.direct[node, 2]
        row[TOWARD], row[TOWARD + 1], row[TOWARD + 2] = tx / total, ty / total, tz / total
        row[SUN], row[VALID] = light.sun[node, 3], light.valid[node]
        lamps = light.direct[node, 0] + light.direct[node, 1] + light.direct[node, 2]
        row[LAMPS] = lamps / max(row[LIGHT] + row[LIGHT + 1] + row[LIGHT + 2], _TINY)
