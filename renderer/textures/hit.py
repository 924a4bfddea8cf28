"""The texture of what a ray hit: called once per lane, after the plain look of its part is known."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.embree import BARY_U, BARY_V, LANES, PRIM_ID, Packet
from renderer.kernel import kernel
from renderer.records import BASE_R, COSINE, METALLIC, ROUGHNESS, SHADE_X, SHADE_Y, SHADE_Z, WIDTH
from renderer.textures.look_up import COS, HEIGHT_LOG, PER_U, PER_V, SIN, SLOPE, WIDTH_LOG, Textures, look_up

_ZERO, _ONE, _HALF, _TINY = np.float32(0.0), np.float32(1.0), np.float32(0.5), np.float32(1e-20)
_GRAZING, _SHARPNESS = np.float32(0.02), np.float32(0.5)
_STEEPEST, _LOWEST_ROUGHNESS = np.float32(1.2), np.float32(0.02)
_EXPONENT, _MANTISSA = np.float32(127.0), np.float32(1.0 / 8388608.0)


@kernel
def apply_texture(textures: Textures, row: int, packet: Packet, k: int, lanes: NDArray[np.float32]) -> None:
    """Change the base colour, roughness, metalness and shading normal of lane k as texture ``row`` says.

    SHADE is the interpolated normal of the mesh on the triangle's front; WIDTH is the footprint's in metres.
    """
    face = packet.integer[PRIM_ID + k]
    i, j, m = textures.faces[face, 0], textures.faces[face, 1], textures.faces[face, 2]
    points, uvs, rows = textures.vertices, textures.uvs, textures.rows
    v, w = packet.real[BARY_U + k], packet.real[BARY_V + k]
    u0, v0 = uvs[i, 0], uvs[i, 1]
    au, av, bu, bv = uvs[j, 0] - u0, uvs[j, 1] - v0, uvs[m, 0] - u0, uvs[m, 1] - v0
    ax, ay, az = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
    bx, by, bz = points[m, 0] - points[i, 0], points[m, 1] - points[i, 1], points[m, 2] - points[i, 2]
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    twice_flat = au * bv - av * bu
    area = np.sqrt(nx * nx + ny * ny + nz * nz)
    per_u, per_v, turn, lean = rows[row, PER_U], rows[row, PER_V], rows[row, COS], rows[row, SIN]
    texels = abs(twice_flat) * abs(per_u * per_v) * np.float32(1 << (textures.layout[row, WIDTH_LOG] + textures.layout[row, HEIGHT_LOG]))
    cosine = max(abs(lanes[COSINE + k]), _GRAZING)
    width = lanes[WIDTH + k]
    seen = _SHARPNESS * width * width / cosine * texels / max(area, _TINY)
    detail = _HALF * _log2(max(seen, _ONE))
    u, v = u0 + v * au + w * bu, v0 + v * av + w * bv
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
    if rows[row, SLOPE] == _ZERO or twice_flat == _ZERO:
        return
    inverse = _ONE / twice_flat
    tx, ty, tz = _unit((ax * bv - bx * av) * inverse, (ay * bv - by * av) * inverse, (az * bv - bz * av) * inverse)
    sx, sy, sz = _unit((bx * au - ax * bu) * inverse, (by * au - ay * bu) * inverse, (bz * au - az * bu) * inverse)
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
