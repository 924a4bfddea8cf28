"""Lobes of lanes before lamps: how wide they are, which microfacets mirror what lies somewhere, and what these reflect."""

import numpy as np
from numpy.typing import NDArray

from renderer.cached_frames import records as rec
from renderer.cached_frames.gloss_rays import lobe_fresnel
from renderer.cached_frames.lobe_shares import to_world
from renderer.cached_frames.records import SHARP
from renderer.core import lanes as ln
from renderer.core.color import Rgb
from renderer.core.kernel import inlined
from renderer.core.sampling import Vector

_ZERO, _ONE, _LEAST_COSINE, _TINY = np.float32(0.0), np.float32(1.0), np.float32(0.05), np.float32(1e-20)


@inlined
def lobe_width(k: int, gloss: NDArray[np.float32]) -> np.float32:
    """Return the width of GGX of lane k; that of the lobe under a coat, if there is one."""
    under_alpha, alpha = gloss[rec.LOBE_UNDER_ALPHA + k], gloss[rec.LOBE_ALPHA + k]
    return under_alpha if under_alpha < _ONE else max(alpha, SHARP)


@inlined
def coat_width(k: int, gloss: NDArray[np.float32]) -> np.float32:
    """Return the width of GGX of lane k's outer lobe, or that of the one under it where that one alone shows lamps."""
    alpha = gloss[rec.LOBE_ALPHA + k]
    return alpha if alpha >= SHARP else lobe_width(k, gloss)


@inlined
def from_hit(balls: NDArray[np.float32], i: int, k: int, lanes: NDArray[np.float32]) -> Vector:
    """Return the way, metres, from lane k's hit to the middle of row i."""
    return balls[i, 0] - lanes[ln.P_X + k], balls[i, 1] - lanes[ln.P_Y + k], balls[i, 2] - lanes[ln.P_Z + k]


@inlined
def shown_radius_squared(balls: NDArray[np.float32], i: int, offset: Vector, squared: np.float32) -> np.float32:
    """Return the squared radius, m2, of the disc that row i, nothing flat, shows along an offset of that squared length."""
    x, y, z = offset
    form = balls[i, 8] * x * x + balls[i, 9] * y * y + balls[i, 10] * z * z
    form += np.float32(2.0) * (balls[i, 11] * x * y + balls[i, 12] * x * z + balls[i, 13] * y * z)
    shown: np.float32 = np.sqrt(max(form / squared, _ZERO))
    return shown


@inlined
def aim_facets(
    offset: Vector, distance: np.float32, k: int, lanes: NDArray[np.float32], gloss: NDArray[np.float32]
) -> tuple[np.float32, np.float32]:
    """Fill BALL_X to BALL_Z and BALL_HALF of lane k; return the cosines of the microfacets that mirror what lies there, and of the view."""
    lx, ly, lz = offset[0] / distance, offset[1] / distance, offset[2] / distance
    wo_x, wo_y, wo_z = to_world((lanes[ln.WO_X + k], lanes[ln.WO_Y + k], lanes[ln.WO_Z + k]), k, lanes)
    hx, hy, hz = lx + wo_x, ly + wo_y, lz + wo_z
    length = hx * hx + hy * hy + hz * hz
    scale = _ONE / np.sqrt(length if length > _TINY else _TINY)
    facet = (hx * lanes[ln.NS_X + k] + hy * lanes[ln.NS_Y + k] + hz * lanes[ln.NS_Z + k]) * scale
    half = (hx * lx + hy * ly + hz * lz) * scale
    facet, half = facet if facet > _LEAST_COSINE else _LEAST_COSINE, half if half > _LEAST_COSINE else _LEAST_COSINE
    gloss[rec.BALL_X + k], gloss[rec.BALL_Y + k], gloss[rec.BALL_Z + k], gloss[rec.BALL_HALF + k] = lx, ly, lz, half
    return facet, half


@inlined
def ball_cosine(k: int, lanes: NDArray[np.float32], gloss: NDArray[np.float32]) -> np.float32:
    """Return the cosine of the direction to a ball, of lane k."""
    x, y, z = gloss[rec.BALL_X + k], gloss[rec.BALL_Y + k], gloss[rec.BALL_Z + k]
    cosine: np.float32 = x * lanes[ln.NS_X + k] + y * lanes[ln.NS_Y + k] + z * lanes[ln.NS_Z + k]
    return cosine


@inlined
def outer_fresnel(schlick: np.float32, k: int, lanes: NDArray[np.float32], gloss: NDArray[np.float32]) -> Rgb:
    """Return what microfacets of lane k's outer lobe reflect at a weight after Schlick."""
    mean = gloss[rec.LOBE_R + k], gloss[rec.LOBE_G + k], gloss[rec.LOBE_B + k]
    return lobe_fresnel(schlick, mean, gloss[rec.LOBE_UNDER_ALPHA + k] != _ONE, k, lanes)
