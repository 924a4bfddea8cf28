"""The texture of what a ray hit: called once per lane, after the plain look of its part is known."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.core.embree import BARY_U, BARY_V, LANES, PRIM_ID, Packet
from renderer.core.kernel import inlined, kernel
from renderer.core.lanes import BASE_R, COSINE, METALLIC, ROUGHNESS, SHADE_X, SHADE_Y, SHADE_Z, WIDTH
from renderer.textures.look_up import (
    COS,
    FACE_AU,
    FACE_AV,
    FACE_BU,
    FACE_BV,
    FACE_DENSITY,
    FACE_SIZE,
    FACE_SX,
    FACE_SY,
    FACE_SZ,
    FACE_TX,
    FACE_TY,
    FACE_TZ,
    FACE_U,
    FACE_V,
    HEIGHT_LOG,
    PER_U,
    PER_V,
    SIN,
    SLOPE,
    WIDTH_LOG,
    Textures,
    look_up,
)

_ZERO, _ONE, _HALF, _TINY = np.float32(0.0), np.float32(1.0), np.float32(0.5), np.float32(1e-20)
_GRAZING, _SHARPNESS = np.float32(0.02), np.float32(0.5)
_STEEPEST, _LOWEST_ROUGHNESS = np.float32(1.2), np.float32(0.02)
_EXPONENT, _MANTISSA = np.float32(127.0), np.float32(1.0 / 8388608.0)


@inlined
def apply_texture(textures: Textures, row: int, packet: Packet, k: int, lanes: NDArray[np.float32]) -> None:
    """Change the base colour, roughness, metalness and shading normal of lane k as texture ``row`` says.

    SHADE is the interpolated normal of the mesh on the triangle's front; WIDTH is the footprint's in metres.
    """
    at = FACE_SIZE * np.int64(packet.integer[PRIM_ID + k])
    faces, rows = textures.faces, textures.rows
    v, w = packet.real[BARY_U + k], packet.real[BARY_V + k]
    per_u, per_v, turn, lean = rows[row, PER_U], rows[row, PER_V], rows[row, COS], rows[row, SIN]
    texels = abs(per_u * per_v) * np.float32(1 << (textures.layout[row, WIDTH_LOG] + textures.layout[row, HEIGHT_LOG]))
    cosine = max(abs(lanes[COSINE + k]), _GRAZING)
    width = lanes[WIDTH + k]
    seen = _SHARPNESS * width * width / cosine * texels * faces[at + FACE_DENSITY]
    detail = _HALF * _log2(max(seen, _ONE))
    u = faces[at + FACE_U] + v * faces[at + FACE_AU] + w * faces[at + FACE_BU]
    v = faces[at + FACE_V] + v * faces[at + FACE_AV] + w * faces[at + FACE_BV]
    look = look_up(
        textures,
        row,
        (turn * u + lean * v) * per_u,
        (turn * v - lean * u) * per_v,
        detail,
        lanes[BASE_R + k],
        lanes[BASE_R + LANES + k],
        lanes[BASE_R + 2 * LANES + k],
        lanes[ROUGHNESS + k],
        lanes[METALLIC + k],
    )
    lanes[BASE_R + k], lanes[BASE_R + LANES + k], lanes[BASE_R + 2 * LANES + k] = look.red, look.green, look.blue
    lanes[METALLIC + k] = look.metallic
    rough = max(look.roughness, _LOWEST_ROUGHNESS)
    rough *= rough
    # The slopes' variance adds to that of the microfacets: alpha^2 = 2 sigma^2 for Beckmann's distribution.
    rough = np.sqrt(np.sqrt(rough * rough + look.spread * look.spread))
    lanes[ROUGHNESS + k] = min(rough, _ONE)
    if rows[row, SLOPE] == _ZERO or faces[at + FACE_DENSITY] == _ZERO:
        return
    tx, ty, tz = faces[at + FACE_TX], faces[at + FACE_TY], faces[at + FACE_TZ]
    sx, sy, sz = faces[at + FACE_SX], faces[at + FACE_SY], faces[at + FACE_SZ]
    slope_u = turn * look.slope_u - lean * look.slope_v
    slope_v = lean * look.slope_u + turn * look.slope_v
    slope_u, slope_v = min(max(slope_u, -_STEEPEST), _STEEPEST), min(max(slope_v, -_STEEPEST), _STEEPEST)
    hx, hy, hz = _unit(lanes[SHADE_X + k], lanes[SHADE_Y + k], lanes[SHADE_Z + k])
    lanes[SHADE_X + k] = hx - slope_u * tx - slope_v * sx
    lanes[SHADE_Y + k] = hy - slope_u * ty - slope_v * sy
    lanes[SHADE_Z + k] = hz - slope_u * tz - slope_v * sz


@kernel
def _unit(x: np.float32, y: np.float32, z: np.float32) -> tuple[np.float32, np.float32, np.float32]:
    scale = _ONE / max(np.sqrt(x * x + y * y + z * z), _TINY)
    return x * scale, y * scale, z * scale


@kernel
def _log2(x: np.float32) -> np.float32:
    """Return the binary logarithm of x >= 1 to 0.09: exact at powers of two, straight between; the same on every processor."""
    bits = np.float32(x).view(np.int32)
    logarithm: np.float32 = np.float32(bits) * _MANTISSA - _EXPONENT
    return logarithm
