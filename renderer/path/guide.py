"""The guide: from which directions light arrives at each place of a scene, known beforehand, so that paths look there on purpose.

Places are *cells*: what lies in one voxel of space and faces along one axis of the world.  The hemisphere about a cell's mean normal has
bins, alike by the cosine law: those of the unit square from which :func:`renderer.core.sampling.sample_cosine_hemisphere` maps.  A bin's
weight is a guess of the light that arrives there by way of other surfaces (:mod:`renderer.path.guide_probes`), and never 0.

A diffuse hit samples a share of its rays from its cell's bins, the others from the BSDF.  The pdf of a direction is that of both together
(one-sample model of multiple importance sampling, Veach 1997, section 9.2.4), so guesses decide about noise only.  Cells and bins are in
place of the mixtures of Vorba et al. 2014 and the trees of Müller et al. 2017 ("Practical Path Guiding for Efficient Light-Transport
Simulation"); nothing is learned on the way, so that what a path does depends on the scene alone.

Guided paths end by what they are still expected to find: as probably as that falls behind what was expected at their first cell (the idea
of adjoint-driven Russian roulette, Vorba and Křivánek 2016, without its splitting).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core import lanes as ln
from renderer.core.color import LUMINANCE
from renderer.core.kernel import inlined, kernel
from renderer.core.lanes import lane_count
from renderer.core.random_numbers import mix_bits
from renderer.core.ray_packet import LANES
from renderer.core.sampling import Vector, invert_cosine_hemisphere, sample_cosine_hemisphere

SPACING_M = np.float32(0.3)
"""Edge of a voxel."""
EDGE = 16
"""Bins along the sides of the square."""
WEIGHTS = 4 + 16 + 64 + 256
"""Of a cell: the bins and, in rows before them, their sums by 2 x 2, 4 x 4 and 8 x 8."""
_FINEST = np.int32(WEIGHTS - EDGE * EDGE)
_SHARE = np.float32(0.6)
"""Of a diffuse hit's rays, sampled from its cell's bins."""
_OFFSET, _REACH = np.float32(0.318), 256
"""Where voxels begin, in voxels, so that no round number is a border; voxels from the origin to where they repeat."""
_ZERO, _ONE, _TINY = np.float32(0.0), np.float32(1.0), np.float32(1e-30)
_RED, _GREEN, _BLUE = (np.float32(weight) for weight in LUMINANCE)
_INVERSE_PI = np.float32(1.0 / np.pi)
_BELOW_ONE = np.float32(0.99999994)


class Guide(NamedTuple):
    """Cells of a scene, for kernels; none where nothing is guided.

    keys, rows: (h,) int32, a hash table of cells' keys, -1 where free, and their rows, h a power of two; frame: (9 g,) float32, unit
    tangent, bitangent and normal of each cell, world; weights: (WEIGHTS g,) float32, the bins of each with a mean of 1, their sums before
    them; light: (g,) float32, luminance that arrives by way of other surfaces in the mean, cd/m2.
    """

    keys: NDArray[np.int32]
    rows: NDArray[np.int32]
    frame: NDArray[np.float32]
    weights: NDArray[np.float32]
    light: NDArray[np.float32]


NO_GUIDE = Guide(np.full(1, -1, np.int32), np.full(1, -1, np.int32), *(np.zeros(0, np.float32) for _ in range(3)))
"""Guides nobody."""


@inlined
def cell_key(x: np.float32, y: np.float32, z: np.float32, nx: np.float32, ny: np.float32, nz: np.float32) -> int:
    """Return the number >= 0 of the cell that a point with this normal belongs to; numbers repeat after 512 voxels."""
    ax, ay, az = abs(nx), abs(ny), abs(nz)
    if ax >= ay and ax >= az:
        side = 0 if nx >= _ZERO else 1
    elif ay >= az:
        side = 2 if ny >= _ZERO else 3
    else:
        side = 4 if nz >= _ZERO else 5
    i = int(np.floor(x / SPACING_M + _OFFSET)) + _REACH & 511
    j = int(np.floor(y / SPACING_M + _OFFSET)) + _REACH & 511
    k = int(np.floor(z / SPACING_M + _OFFSET)) + _REACH & 511
    return ((i * 512 + j) * 512 + k) * 8 + side


@inlined
def find_row(guide: Guide, key: int) -> int:
    """Return the row of the cell with this key; -1 if there is none."""
    last = len(guide.keys) - 1
    at = int(mix_bits(np.uint32(key))) & last
    while guide.keys[at] != key and guide.keys[at] >= 0:
        at = at + 1 & last
    return int(guide.rows[at])


@inlined
def find_hit_row(guide: Guide, lanes: NDArray[np.float32], k: int) -> int:
    """Return the row of the cell that lane k has hit; -1 if there is none."""
    key = cell_key(lanes[ln.P_X + k], lanes[ln.P_Y + k], lanes[ln.P_Z + k], lanes[ln.NG_X + k], lanes[ln.NG_Y + k], lanes[ln.NG_Z + k])
    return find_row(guide, key)


@inlined
def diffuse_throughput(lanes: NDArray[np.float32], k: int) -> np.float32:
    """Return the luminance that light of 1 cd/m2 all around lane k's hit brings by the diffuse lobe, cd/m2."""
    red = _RED * lanes[ln.BETA_R + k] * lanes[ln.DIFFUSE_R + k]
    green = _GREEN * lanes[ln.BETA_G + k] * lanes[ln.DIFFUSE_G + k]
    blue = _BLUE * lanes[ln.BETA_B + k] * lanes[ln.DIFFUSE_B + k]
    return np.float32(red + green + blue)


@inlined
def look_up_guide(guide: Guide, lanes: NDArray[np.float32]) -> None:
    """Fill CELL, SHARE and EXPECTED; at a path's first cell FIRST_EXPECTED too."""
    for k in range(LANES):
        lanes[ln.CELL + k], lanes[ln.SHARE + k], lanes[ln.EXPECTED + k] = -_ONE, _ZERO, -_ONE
        matt = (lanes[ln.CONTINUES + k] * lanes[ln.PR_DIFFUSE + k] > _ZERO) & (lanes[ln.PR_GLASS + k] == _ZERO)
        if matt and lanes[ln.HIT + k] > _ZERO:
            row = find_hit_row(guide, lanes, k)
            if row >= 0:
                lanes[ln.CELL + k], lanes[ln.SHARE + k] = np.float32(row), _SHARE * lanes[ln.PR_DIFFUSE + k]
                expected = guide.light[row] / lanes[ln.PR_DIFFUSE + k] * diffuse_throughput(lanes, k)
                lanes[ln.EXPECTED + k] = expected
                if lanes[ln.FIRST_EXPECTED + k] == _ZERO:
                    lanes[ln.FIRST_EXPECTED + k] = expected


@inlined
def least_survival(expected: np.float32, first_expected: np.float32, deep: bool) -> np.float32:
    """Return the least probability to survive of a guided path: what it is expected to find over what it was at first.

    ``expected``: below 0 where no cell tells; such paths go on until they are ``deep``.
    """
    untold = _ZERO if deep else _ONE
    return expected / (first_expected if first_expected > _TINY else _TINY) if expected >= _ZERO else untold


@kernel
def sample_guide(guide: Guide, lanes: NDArray[np.float32]) -> None:
    """Replace WI by a direction from the cell's bins in the lanes whose random number is below SHARE."""
    frame = guide.frame
    for k in range(LANES):
        if not lanes[ln.U_GUIDE + k] < lanes[ln.SHARE + k]:
            continue
        row = int(lanes[ln.CELL + k])
        u, v = warp(guide, row, lanes[ln.U_BSDF_0 + k], lanes[ln.U_BSDF_1 + k])
        x, y, z = aim_from(frame, row, u, v)
        lanes[ln.WI_X + k] = x * lanes[ln.TANGENT_X + k] + y * lanes[ln.TANGENT_Y + k] + z * lanes[ln.TANGENT_Z + k]
        lanes[ln.WI_Y + k] = x * lanes[ln.BITANGENT_X + k] + y * lanes[ln.BITANGENT_Y + k] + z * lanes[ln.BITANGENT_Z + k]
        lanes[ln.WI_Z + k] = x * lanes[ln.NS_X + k] + y * lanes[ln.NS_Y + k] + z * lanes[ln.NS_Z + k]


@inlined
def aim_from(frame: NDArray[np.float32], row: int, u: np.float32, v: np.float32) -> Vector:
    """Return the unit direction, world, of a point of the square of a cell's bins."""
    s, t, n = sample_cosine_hemisphere(u, v)
    at = 9 * row
    x = s * frame[at] + t * frame[at + 3] + n * frame[at + 6]
    y = s * frame[at + 1] + t * frame[at + 4] + n * frame[at + 7]
    z = s * frame[at + 2] + t * frame[at + 5] + n * frame[at + 8]
    return x, y, z


@inlined
def warp(guide: Guide, row: int, u: np.float32, v: np.float32) -> tuple[np.float32, np.float32]:
    """Return the point of the unit square that the weights of a cell take (u, v) to (McCool and Harwood, "Probability Trees", 1997)."""
    weights, width = guide.weights, 2
    i, j, begin = 0, 0, row * WEIGHTS
    while width <= EDGE:
        i, j = 2 * i, 2 * j
        at = begin + i * width + j
        a, b = weights[at], weights[at + 1]
        c, d = weights[at + width], weights[at + width + 1]
        low, high = a + b, c + d
        u *= low + high
        if u < low:
            u /= low
        else:
            u, i, a, b, low = (u - low) / high, i + 1, c, d, high
        v *= low
        if v < a:
            v /= a
        else:
            v, j = (v - a) / b, j + 1
        u, v = min(u, _BELOW_ONE), min(v, _BELOW_ONE)
        begin += width * width
        width *= 2
    scale = _ONE / np.float32(EDGE)
    return min((np.float32(i) + u) * scale, _BELOW_ONE), min((np.float32(j) + v) * scale, _BELOW_ONE)


@kernel
def mix_guide_pdf(guide: Guide, lanes: NDArray[np.float32]) -> None:
    """Turn PDF, of sampling WI otherwise, into that of sampling it so or from the bins, whichever is chosen."""
    frame, weights, edge = guide.frame, guide.weights, np.float32(EDGE)
    for k in range(lane_count(lanes)):
        cell = lanes[ln.CELL + k]
        row = np.int32(cell if cell > _ZERO else _ZERO)
        wx, wy, wz = lanes[ln.WI_X + k], lanes[ln.WI_Y + k], lanes[ln.WI_Z + k]
        x = wx * lanes[ln.TANGENT_X + k] + wy * lanes[ln.BITANGENT_X + k] + wz * lanes[ln.NS_X + k]
        y = wx * lanes[ln.TANGENT_Y + k] + wy * lanes[ln.BITANGENT_Y + k] + wz * lanes[ln.NS_Y + k]
        z = wx * lanes[ln.TANGENT_Z + k] + wy * lanes[ln.BITANGENT_Z + k] + wz * lanes[ln.NS_Z + k]
        at = np.int32(9) * row
        s = x * frame[at] + y * frame[at + 1] + z * frame[at + 2]
        t = x * frame[at + 3] + y * frame[at + 4] + z * frame[at + 5]
        n = x * frame[at + 6] + y * frame[at + 7] + z * frame[at + 8]
        u, v = invert_cosine_hemisphere(s, t)
        weight = weights[row * np.int32(WEIGHTS) + _FINEST + np.int32(u * edge) * np.int32(EDGE) + np.int32(v * edge)]
        pdf, share = weight * (n if n > _ZERO else _ZERO) * _INVERSE_PI, lanes[ln.SHARE + k]
        mixed = lanes[ln.PDF + k] + share * (pdf - lanes[ln.PDF + k])
        lanes[ln.PDF + k] = mixed if share > _ZERO else lanes[ln.PDF + k]
