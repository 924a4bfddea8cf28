"""The look-up of a texture at a hit: filtered by the width of the ray cone, colours mixed, the shading normal tilted.

Four texels, weighted, of one level of the tile.  Between two levels a pixel's only sample mixes both (trilinear filtering); of many samples
each takes one, in proportion and evenly spread over the surface, so that their mean is the same at half the cost.  Slopes that a smaller
level averages away come back as roughness, so that a surface does not turn glossy with distance (after M. Olano and D. Baker,
"LEAN mapping", 2010).
"""

import math
from collections.abc import Hashable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core.color import linear_from_srgb
from renderer.core.kernel import inlined
from renderer.core.layout import Layout
from renderer.core.ray_packet import aligned_floats
from renderer.textures.apply import OTHER_COLORS, AppliedTexture
from renderer.textures.packing import CHANNELS, in_blocks, texel_place
from renderer.textures.tile import TextureTile

_ROW = Layout()
PER_U, PER_V = _ROW.field(), _ROW.field()  # tiles per unit of the texture coordinates
COS, SIN = _ROW.field(), _ROW.field()  # of the texture's rotation
SHIFT = _ROW.field()
CONTRAST = _ROW.field()  # 1 as drawn
SLOPE = _ROW.field()
COLORS = _ROW.field(3 * OTHER_COLORS)
ROW_SIZE = _ROW.size

_FACE = Layout()
FACE_U, FACE_V = _FACE.field(), _FACE.field()  # texture coordinates of the first corner
FACE_AU, FACE_AV = _FACE.field(), _FACE.field()  # from there to the second
FACE_BU, FACE_BV = _FACE.field(), _FACE.field()  # from there to the third
FACE_DENSITY = _FACE.field()  # units of the texture coordinates, squared, per m2; 0 where the map is flat
FACE_TX, FACE_TY, FACE_TZ = _FACE.vector()  # unit vector of the world along which u grows
FACE_SX, FACE_SY, FACE_SZ = _FACE.vector()  # the same for v
FACE_SIZE = 16
"""A cache line: more than the fields take."""

(FIRST, WIDTH_LOG, HEIGHT_LOG, LEVELS, PICTURE) = range(5)

_ZERO, _ONE, _HALF = np.float32(0.0), np.float32(1.0), np.float32(0.5)
_BYTE, _SLOPE_BYTE = np.float32(1.0 / 255.0), np.float32(1.0 / 127.0)
_LEVEL, _TWO = np.float32(128.0), np.float32(2.0)
_STEEPEST = np.float32(1.2)
_DITHER_U, _DITHER_V = np.float32(0.7548777), np.float32(0.5698403)  # of an even sequence in two dimensions
_MIXED = np.float32(0.5)
"""Share of the way between two levels over which they are mixed; nearer to one, that serves alone (known as brilinear filtering)."""
_EVEN_BYTES, _BYTE_BITS, _BITS = np.uint64(0x00FF00FF00FF00FF), np.uint64(0xFF), np.uint64(8)
_FULL, _PER_FULL = np.float32(256.0), np.float32(1.0 / 256.0)


class Textures(NamedTuple):
    """All textures of a scene, for kernels.

    part: (p,) int32, row of each part's texture, -1 for none; texels: (t,) uint64, the eight bytes of each, lowest first, levels
    ``in_blocks``; rows: (r, ROW_SIZE) float32; layout: (r, 5) int64, where a row's tile begins among the texels, logarithms of its sides,
    number of levels, whether it is a picture; linear: (256,) float32, luminance of sRGB bytes; faces: (m * FACE_SIZE,) float32, a row of
    FACE fields for each triangle of the scene, each in a cache line.
    """

    part: NDArray[np.int32]
    texels: NDArray[np.uint64]
    rows: NDArray[np.float32]
    layout: NDArray[np.int64]
    linear: NDArray[np.float32]
    faces: NDArray[np.float32]


class TextureSample(NamedTuple):
    """What a texture says at a hit: colour; roughness and metalness of the surface; slopes along the tile's u and v; spread of slopes."""

    red: np.float32
    green: np.float32
    blue: np.float32
    roughness: np.float32
    metallic: np.float32
    slope_u: np.float32
    slope_v: np.float32
    spread: np.float32


def build_textures(
    part: NDArray[np.int32],
    applied: Sequence[AppliedTexture],
    vertices: NDArray[np.float32],
    uvs: NDArray[np.float32],
    faces: NDArray[np.uint32],
) -> Textures:
    """Return the tables of a scene; ``part``: row of ``applied`` for each part, -1 for none.  Tiles of several textures are stored once."""
    stored: dict[Hashable, tuple[TextureTile, int]] = {}
    chunks: list[NDArray[np.uint64]] = []
    total = 0
    rows, layout = np.zeros((max(len(applied), 1), ROW_SIZE), np.float32), np.zeros((max(len(applied), 1), 5), np.int64)
    for k, texture in enumerate(applied):
        if texture.tile_id not in stored:
            tile = texture.tile
            stored[texture.tile_id] = tile, total
            chunks += [in_blocks(level.view(np.uint64)[..., 0]) for level in tile.levels]
            total += tile.size_bytes // CHANNELS
        tile, start = stored[texture.tile_id]
        height, width = tile.levels[0].shape[:2]
        layout[k] = start, width.bit_length() - 1, height.bit_length() - 1, len(tile.levels), tile.picture
        turn = (math.cos(texture.rotation_rad), math.sin(texture.rotation_rad))
        slope = texture.relief * tile.steepest
        rows[k, :COLORS] = (1.0 / texture.size[0], 1.0 / texture.size[1], *turn, texture.shift, 2.0 * texture.contrast, slope)
        colors = np.asarray(texture.colors, np.float32).ravel()
        rows[k, COLORS : COLORS + len(colors)] = colors
    texels = np.concatenate(chunks) if chunks else np.zeros(1, np.uint64)
    linear = linear_from_srgb(np.arange(256) / 255.0).astype(np.float32)
    return Textures(np.ascontiguousarray(part), texels, rows, layout, linear, _face_rows(vertices, uvs, faces))


def _face_rows(vertices: NDArray[np.float32], uvs: NDArray[np.float32], faces: NDArray[np.uint32]) -> NDArray[np.float32]:
    """Return ``faces`` of ``Textures``, on a 64-byte boundary."""
    rows = aligned_floats(len(faces) * FACE_SIZE)
    table = rows.reshape(-1, FACE_SIZE)
    corner = vertices[faces].astype(np.float64)
    a, b = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    place = uvs[faces].astype(np.float64)
    (au, av), (bu, bv) = (place[:, 1] - place[:, 0]).T, (place[:, 2] - place[:, 0]).T
    flat = au * bv - av * bu
    table[:, FACE_U : FACE_V + 1] = place[:, 0]
    table[:, FACE_AU], table[:, FACE_AV], table[:, FACE_BU], table[:, FACE_BV] = au, av, bu, bv
    area = np.linalg.norm(np.cross(a, b), axis=1)
    table[:, FACE_DENSITY] = np.abs(flat) / np.maximum(area, 1e-20)
    sign = np.where(flat < 0.0, -1.0, 1.0)[:, None]
    for column, way in ((FACE_TX, a * bv[:, None] - b * av[:, None]), (FACE_SX, b * au[:, None] - a * bu[:, None])):
        table[:, column : column + 3] = sign * way / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-30)
    return rows


@inlined
def _sum_of(words: np.uint64, place: int) -> np.float32:
    """Return the 16 bits at a place, 256ths of a byte, as a number of bytes."""
    return np.float32(np.int32((words >> np.uint64(16 * place)) & np.uint64(0xFFFF))) * _PER_FULL


@inlined
def _read_texels(
    textures: Textures, row: int, u: np.float32, v: np.float32, detail: np.float32, trilinear: bool
) -> tuple[np.float32, np.float32, np.float32, np.float32, np.float32, np.float32, np.float32, np.float32]:
    """Return the eight channels of a tile at (u, v), means of four texels of one level or two; the first three of a picture are linear."""
    layout, rows = textures.layout, textures.rows
    last = layout[row, LEVELS] - 1
    # Shift every other row of tiles and wrap into the first one
    u += rows[row, SHIFT] * np.floor(v)
    u -= np.floor(u)
    v -= np.floor(v)
    detail = max(detail, _ZERO)
    level = min(int(detail), last)
    coarser = detail - np.float32(level)
    if trilinear:
        coarser = (coarser - _HALF) / _MIXED + _HALF
        level += coarser >= _ONE and level < last
    if trilinear and level < last and _ZERO < coarser < _ONE:
        fine, coarse = _read_level(textures, row, u, v, level), _read_level(textures, row, u, v, level + 1)
        return (
            fine[0] + coarser * (coarse[0] - fine[0]),
            fine[1] + coarser * (coarse[1] - fine[1]),
            fine[2] + coarser * (coarse[2] - fine[2]),
            fine[3] + coarser * (coarse[3] - fine[3]),
            fine[4] + coarser * (coarse[4] - fine[4]),
            fine[5] + coarser * (coarse[5] - fine[5]),
            fine[6] + coarser * (coarse[6] - fine[6]),
            fine[7] + coarser * (coarse[7] - fine[7]),
        )
    if not trilinear and coarser > _ZERO:
        dither = u * np.float32(1 << layout[row, WIDTH_LOG]) * _DITHER_U + v * np.float32(1 << layout[row, HEIGHT_LOG]) * _DITHER_V
        level = min(int(detail + dither - np.floor(dither)), last)
    return _read_level(textures, row, u, v, level)


@inlined
def _read_level(
    textures: Textures, row: int, u: np.float32, v: np.float32, level: int
) -> tuple[np.float32, np.float32, np.float32, np.float32, np.float32, np.float32, np.float32, np.float32]:
    """Return the eight channels of a level of a tile at (u, v), each in [0, 1), means of four texels."""
    layout, texels, linear = textures.layout, textures.texels, textures.linear
    picture = layout[row, PICTURE] != 0
    log_w, log_h = layout[row, WIDTH_LOG], layout[row, HEIGHT_LOG]
    offset = layout[row, FIRST]
    for step in range(level):
        offset += 1 << (max(log_w - step, 0) + max(log_h - step, 0))
    # Weigh the four texels round the place
    w, h = max(log_w - level, 0), max(log_h - level, 0)
    x, y = u * np.float32(1 << w) - _HALF, v * np.float32(1 << h) - _HALF
    fx, fy = np.floor(x), np.floor(y)
    x, y = x - fx, y - fy
    column, line = int(fx), int(fy)
    # Weights in 256ths, of sum 256, so that all eight channels are added in 16 bits each, four of a word at a time.
    right, over = int(x * _FULL + _HALF), int(y * _FULL + _HALF)
    both = (right * over + 128) >> 8
    even = odd = np.uint64(0)
    a0 = a1 = a2 = _ZERO
    for corner in range(4):
        weight = both if corner == 3 else over - both if corner == 2 else right - both if corner == 1 else 256 - right - over + both
        word = texels[offset + texel_place(column + (corner & 1), line + (corner >> 1), w, h)]
        even += (word & _EVEN_BYTES) * np.uint64(weight)
        odd += ((word >> _BITS) & _EVEN_BYTES) * np.uint64(weight)
        if picture:
            share = np.float32(weight)
            a0 += share * linear[np.int32(word & _BYTE_BITS)]
            a1 += share * linear[np.int32((word >> _BITS) & _BYTE_BITS)]
            a2 += share * linear[np.int32((word >> (_BITS + _BITS)) & _BYTE_BITS)]
    if picture:
        a0, a1, a2 = a0 * _PER_FULL, a1 * _PER_FULL, a2 * _PER_FULL
    else:
        a0, a1, a2 = _sum_of(even, 0), _sum_of(odd, 0), _sum_of(even, 1)
    a3, a4, a5, a6, a7 = _sum_of(odd, 1), _sum_of(even, 2), _sum_of(odd, 2), _sum_of(even, 3), _sum_of(odd, 3)
    return a0, a1, a2, a3, a4, a5, a6, a7


@inlined
def evaluate_texture(
    textures: Textures,
    row: int,
    u: np.float32,
    v: np.float32,
    detail: np.float32,
    color: tuple[np.float32, np.float32, np.float32],
    roughness: np.float32,
    metallic: np.float32,
    trilinear: bool,
) -> TextureSample:
    """Return a texture at tile coordinates (u, v), at level ``detail`` (0 is full size), over a surface of this colour and roughness.

    ``trilinear``: two levels are mixed, else it takes one by chance.
    """
    rows, (red, green, blue) = textures.rows, color
    contrast, slope = rows[row, CONTRAST], rows[row, SLOPE]
    a0, a1, a2, a3, a4, a5, a6, a7 = _read_texels(textures, row, u, v, detail, trilinear)
    if textures.layout[row, PICTURE] != 0:
        red, green, blue = a0, a1, a2
        roughness, metallic = roughness * a4 * _BYTE, metallic * a3 * _BYTE
    else:
        # Mix the texture's colours by their weights, shaded, and the surface's own by the rest
        b0, b1, b2 = a0 * _BYTE * contrast, a1 * _BYTE * contrast, a2 * _BYTE * contrast
        total = max(b0 + b1 + b2, _ONE)
        b0, b1, b2 = b0 / total, b1 / total, b2 / total
        shade = max(_ONE + contrast * (a3 * _BYTE * _TWO - _ONE), _ZERO)
        rest = max(_ONE - b0 - b1 - b2, _ZERO)
        red = min(shade * (rest * red + b0 * rows[row, COLORS] + b1 * rows[row, COLORS + 3] + b2 * rows[row, COLORS + 6]), _ONE)
        green = min(shade * (rest * green + b0 * rows[row, COLORS + 1] + b1 * rows[row, COLORS + 4] + b2 * rows[row, COLORS + 7]), _ONE)
        blue = min(shade * (rest * blue + b0 * rows[row, COLORS + 2] + b1 * rows[row, COLORS + 5] + b2 * rows[row, COLORS + 8]), _ONE)
        roughness += a4 * _BYTE * _TWO - _ONE
    slope_u, slope_v = (a5 - _LEVEL) * _SLOPE_BYTE * slope, (a6 - _LEVEL) * _SLOPE_BYTE * slope
    spread = min(a7 * _BYTE * slope, _STEEPEST)
    return TextureSample(red, green, blue, roughness, metallic, slope_u, slope_v, spread)
