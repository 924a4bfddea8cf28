"""The texture of what a ray hit: called once per lane, after the material of its part is known."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.core import embree as ray
from renderer.core import lanes as ln
from renderer.core.embree import Packet
from renderer.core.kernel import inlined, kernel
from renderer.textures import look_up as tex
from renderer.textures.look_up import Textures, evaluate_texture

_ZERO, _ONE, _HALF, _TINY = np.float32(0.0), np.float32(1.0), np.float32(0.5), np.float32(1e-20)
_GRAZING, _SHARPNESS = np.float32(0.02), np.float32(0.5)
_STEEPEST, _LOWEST_ROUGHNESS = np.float32(1.2), np.float32(0.02)
_EXPONENT, _MANTISSA = np.float32(127.0), np.float32(1.0 / 8388608.0)


@inlined
def apply_texture(textures: Textures, row: int, packet: Packet, k: int, lanes: NDArray[np.float32]) -> None:
    """Change the base colour, roughnesses, metalness and shading normal of lane k as texture ``row`` says.

    NS is the interpolated normal of the mesh on the triangle's front; WIDTH is that of the ray cone, in metres.
    """
    at = tex.FACE_SIZE * np.int64(packet.integer[ray.PRIM_ID + k])
    faces, rows = textures.faces, textures.rows
    v, w = packet.real[ray.BARY_U + k], packet.real[ray.BARY_V + k]
    per_u, per_v, turn, lean = rows[row, tex.PER_U], rows[row, tex.PER_V], rows[row, tex.COS], rows[row, tex.SIN]
    texels = abs(per_u * per_v) * np.float32(1 << (textures.layout[row, tex.WIDTH_LOG] + textures.layout[row, tex.HEIGHT_LOG]))
    cosine = max(abs(lanes[ln.COS_FRONT + k]), _GRAZING)
    width = lanes[ln.WIDTH + k]
    seen = _SHARPNESS * width * width / cosine * texels * faces[at + tex.FACE_DENSITY]
    detail = _HALF * _log2(max(seen, _ONE))
    u = faces[at + tex.FACE_U] + v * faces[at + tex.FACE_AU] + w * faces[at + tex.FACE_BU]
    v = faces[at + tex.FACE_V] + v * faces[at + tex.FACE_AV] + w * faces[at + tex.FACE_BV]
    texture = evaluate_texture(
        textures,
        row,
        (turn * u + lean * v) * per_u,
        (turn * v - lean * u) * per_v,
        detail,
        lanes[ln.BASE_R + k],
        lanes[ln.BASE_G + k],
        lanes[ln.BASE_B + k],
        lanes[ln.ROUGHNESS + k],
        lanes[ln.METALLIC + k],
    )
    lanes[ln.BASE_R + k], lanes[ln.BASE_G + k], lanes[ln.BASE_B + k] = texture.red, texture.green, texture.blue
    lanes[ln.METALLIC + k] = texture.metallic
    lanes[ln.ROUGHNESS + k] = _roughen(texture.roughness, texture.spread)
    if lanes[ln.COAT + k] > _ZERO:
        lanes[ln.COAT_ROUGHNESS + k] = _roughen(lanes[ln.COAT_ROUGHNESS + k], texture.spread)
    if rows[row, tex.SLOPE] == _ZERO or faces[at + tex.FACE_DENSITY] == _ZERO:
        return
    tx, ty, tz = faces[at + tex.FACE_TX], faces[at + tex.FACE_TY], faces[at + tex.FACE_TZ]
    sx, sy, sz = faces[at + tex.FACE_SX], faces[at + tex.FACE_SY], faces[at + tex.FACE_SZ]
    slope_u = turn * texture.slope_u - lean * texture.slope_v
    slope_v = lean * texture.slope_u + turn * texture.slope_v
    slope_u, slope_v = min(max(slope_u, -_STEEPEST), _STEEPEST), min(max(slope_v, -_STEEPEST), _STEEPEST)
    hx, hy, hz = _unit(lanes[ln.NS_X + k], lanes[ln.NS_Y + k], lanes[ln.NS_Z + k])
    lanes[ln.NS_X + k] = hx - slope_u * tx - slope_v * sx
    lanes[ln.NS_Y + k] = hy - slope_u * ty - slope_v * sy
    lanes[ln.NS_Z + k] = hz - slope_u * tz - slope_v * sz


@kernel
def _roughen(roughness: np.float32, spread: np.float32) -> np.float32:
    """Return the roughness of a surface whose slopes vary: their variance adds to that of the microfacets.

    For Beckmann's distribution alpha^2 = 2 sigma^2.
    """
    alpha = max(roughness, _LOWEST_ROUGHNESS)
    alpha *= alpha
    return min(np.sqrt(np.sqrt(alpha * alpha + spread * spread)), _ONE)


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
