"""Rays of gloss: where the microfacet of a pixel's sample mirrors to, and how much of the light there."""

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.layers import COAT_F0
from renderer.bsdf.microfacet import sample_ggx_wm, schlick_weight, visible_share
from renderer.cached_frames import records as rec
from renderer.core import lanes as ln
from renderer.core.color import Rgb
from renderer.core.kernel import inlined
from renderer.core.random_numbers import mix_bits, unit_of

_ZERO, _HALF, _ONE, _TWO = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(2.0)
_LEAST_SHARE, _MOST_GAIN, _LOBES = np.float32(1e-6), np.float32(4.0), np.uint32(23)


@inlined
def pixel_noise(x: int, y: int, key: np.uint32) -> tuple[np.float32, np.float32]:
    """Return two numbers in [0, 1) for a pixel, far from those of its neighbours.

    Their steps are powers of the plastic number (Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences", 2018): those of any
    block of pixels, of a row, or of every second one each way are evenly spread, and no block has those of another.
    """
    column, row = np.float32(x), np.float32(y)
    a = unit_of(mix_bits(key)) + np.float32(0.7548777) * column + np.float32(0.5698403) * row
    b = unit_of(mix_bits(np.uint32(key + np.uint32(1)))) + np.float32(0.4301597) * column + np.float32(0.7548777) * row
    return a - np.floor(a), b - np.floor(b)


@inlined
def aim_more_gloss(x: int, y: int, k: int, primary: NDArray[np.float32], lanes: NDArray[np.float32]) -> None:
    """Fill MORE_AHEAD and MORE_GAIN of lane k, and AHEAD and GAIN by numbers that are spread evenly together with theirs."""
    for turn in range(rec.MORE_RAYS, -1, -1):
        aim_gloss(2 * x + (turn & 1), 2 * y + (turn >> 1), k, primary, lanes)
        if turn > 0:
            for axis in range(3):
                at = 3 * (turn - 1) + axis
                primary[rec.MORE_AHEAD + at, k], primary[rec.MORE_GAIN + at, k] = primary[rec.AHEAD + axis, k], primary[rec.GAIN + axis, k]


@inlined
def aim_gloss(x: int, y: int, k: int, primary: NDArray[np.float32], lanes: NDArray[np.float32]) -> None:
    """Fill AHEAD, the direction of lane k's mirrored ray, world, sampled among the microfacets that are seen, and GAIN.

    SHARE or UNDER is what they reflect in the mean; those that are tilted to the viewer reflect less, and some reflect into the surface.
    """
    u, v = pixel_noise(x, y, _LOBES)
    wo_x, wo_y, wo_z, alpha = lanes[ln.WO_X + k], lanes[ln.WO_Y + k], lanes[ln.WO_Z + k], primary[rec.RAY_ALPHA, k]
    wm_x, wm_y, wm_z = sample_ggx_wm(wo_x, wo_y, wo_z, alpha, u, v)
    half = wo_x * wm_x + wo_y * wm_y + wo_z * wm_z
    a, b, c = _TWO * half * wm_x - wo_x, _TWO * half * wm_y - wo_y, _TWO * half * wm_z - wo_z
    seen = visible_share(wo_z, c, alpha) if c > _ZERO else _ZERO
    lobe = rec.SHARE if alpha == primary[rec.SHOWN_ALPHA, k] else rec.UNDER
    mean = primary[lobe, k], primary[lobe + 1, k], primary[lobe + 2, k]
    red, green, blue = (
        lobe_fresnel(schlick_weight(half), mean, primary[rec.UNDER_ALPHA, k] != _ONE, k, lanes)
        if lobe == rec.SHARE
        else base_fresnel(schlick_weight(half), k, lanes)
    )
    primary[rec.GAIN, k] = min(seen * red / max(mean[0], _LEAST_SHARE), _MOST_GAIN)
    primary[rec.GAIN + 1, k] = min(seen * green / max(mean[1], _LEAST_SHARE), _MOST_GAIN)
    primary[rec.GAIN + 2, k] = min(seen * blue / max(mean[2], _LEAST_SHARE), _MOST_GAIN)
    c = max(c, np.float32(1e-3))
    primary[rec.AHEAD, k] = a * lanes[ln.TANGENT_X + k] + b * lanes[ln.BITANGENT_X + k] + c * lanes[ln.NS_X + k]
    primary[rec.AHEAD + 1, k] = a * lanes[ln.TANGENT_Y + k] + b * lanes[ln.BITANGENT_Y + k] + c * lanes[ln.NS_Y + k]
    primary[rec.AHEAD + 2, k] = a * lanes[ln.TANGENT_Z + k] + b * lanes[ln.BITANGENT_Z + k] + c * lanes[ln.NS_Z + k]


@inlined
def lobe_fresnel(schlick: np.float32, mean: Rgb, coated: bool, k: int, lanes: NDArray[np.float32]) -> Rgb:
    """Return what microfacets at a weight after Schlick reflect by a lobe that reflects ``mean`` (r, g, b); glass as in the mean.

    ``coated``: whether it is that of the coat alone.
    """
    glass = lanes[ln.TRANSMISSION + k] + lanes[ln.THIN + k] > _HALF
    coat = lanes[ln.COAT + k] * (COAT_F0 + (_ONE - COAT_F0) * schlick)
    base_r, base_g, base_b = base_fresnel(schlick, k, lanes)
    r, g, b = coat if coated else base_r + coat, coat if coated else base_g + coat, coat if coated else base_b + coat
    return mean[0] if glass else r, mean[1] if glass else g, mean[2] if glass else b


@inlined
def base_fresnel(schlick: np.float32, k: int, lanes: NDArray[np.float32]) -> Rgb:
    """Return what microfacets of metal and opaque dielectrics, under their coat, reflect (r, g, b) at a weight after Schlick."""
    rest, most = _ONE - schlick, lanes[ln.SPECULAR_F90 + k] * schlick
    return lanes[ln.SPECULAR_R + k] * rest + most, lanes[ln.SPECULAR_G + k] * rest + most, lanes[ln.SPECULAR_B + k] * rest + most
