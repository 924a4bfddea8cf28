"""Pieces of BSDFs in a local frame with the shading normal along z: Fresnel terms, the GGX distribution, its microfacet normals."""

import numpy as np

from renderer.core.kernel import inlined
from renderer.core.sampling import Vector, cos_sin_two_pi

_ZERO, _ONE, _TWO, _HALF, _TINY = np.float32(0.0), np.float32(1.0), np.float32(2.0), np.float32(0.5), np.float32(1e-30)
_PI = np.float32(np.pi)


@inlined
def fresnel_dielectric(cosine: np.float32, eta: np.float32) -> np.float32:
    """Return the reflectance of a dielectric boundary for unpolarised light.

    ``cosine`` >= 0 lies between ray and normal; ``eta``: index of refraction beyond the boundary over that before it.
    """
    square = eta * eta - _ONE + cosine * cosine
    g = np.sqrt(square if square > _ZERO else _ZERO)
    across = (g - cosine) / (g + cosine + _TINY)
    along = (cosine * (g + cosine) - _ONE) / (cosine * (g - cosine) + _ONE)
    reflectance = _HALF * across * across * (_ONE + along * along)
    return reflectance if square > _ZERO else _ONE


@inlined
def fresnel_thin_dielectric(cosine: np.float32, ior: np.float32) -> np.float32:
    """Return the reflectance of a clear pane, all reflections inside it summed: 2 F / (1 + F)."""
    once = fresnel_dielectric(cosine, ior)
    return _TWO * once / (_ONE + once)


@inlined
def schlick_weight(cosine: np.float32) -> np.float32:
    """Return (1 - cosine)^5, by which reflectance rises to grazing angles: the weight of F90 - F0 (Schlick 1994)."""
    base = _ONE - cosine
    base = base if base > _ZERO else _ZERO
    square = base * base
    return square * square * base


@inlined
def schlick_albedo(f0: np.float32, f90: np.float32, albedo: np.float32, schlick: np.float32) -> np.float32:
    """Return what microfacets reflect whose Fresnel term is Schlick's, from ``f0`` at normal incidence to ``f90`` at grazing.

    ``albedo``: what they reflect if all is 1; ``schlick``: the part of that which Schlick's weight lets count.
    """
    reflected: np.float32 = f0 * (albedo - schlick) + f90 * schlick
    return reflected


@inlined
def ggx_d(x: np.float32, y: np.float32, z: np.float32, alpha: np.float32) -> np.float32:
    """Return D, GGX's density of microfacet normals (x, y, z) (Walter et al. 2007)."""
    square = alpha * alpha
    t = (x * x + y * y) / square + z * z
    return _ONE / (_PI * square * t * t)


@inlined
def ggx_g1_root(cosine: np.float32, alpha: np.float32) -> np.float32:
    """Return sqrt(alpha^2 + (1 - alpha^2) cosine^2), of which Smith's masking G1 = 2 cosine / (cosine + root) is made."""
    square = alpha * alpha
    root: np.float32 = np.sqrt(square + (_ONE - square) * cosine * cosine)
    return root


@inlined
def visible_share(wo_z: np.float32, wi_z: np.float32, alpha: np.float32) -> np.float32:
    """Return what of GGX's microfacets that one side sees the other does, too: G2 / G1, for cosines > 0 with the normal."""
    root = ggx_g1_root(wo_z, alpha)
    share: np.float32 = wi_z * (wo_z + root) / (wi_z * root + wo_z * ggx_g1_root(wi_z, alpha))
    return share


@inlined
def sample_ggx_wm(x: np.float32, y: np.float32, z: np.float32, alpha: np.float32, u: np.float32, v: np.float32) -> Vector:
    """Return a microfacet normal wm that is visible from wo = (x, y, z), z > 0: density G1 D max(0, wo . wm) / z.

    The density is that of Heitz, "Sampling the GGX Distribution of Visible Normals" (JCGT 7(4), 2018); the map from the unit square that of
    Dupuy and Benyoub, "Sampling Visible GGX Normals with Spherical Caps" (2023).
    """
    sx, sy = alpha * x, alpha * y
    scale = _ONE / np.sqrt(sx * sx + sy * sy + z * z)
    sx, sy, sz = sx * scale, sy * scale, z * scale
    cosine, sine = cos_sin_two_pi(u)
    height = (_ONE - v) * (_ONE + sz) - sz
    radius = _ONE - height * height
    radius = np.sqrt(radius if radius > _ZERO else _ZERO)
    wm_x, wm_y, wm_z = alpha * (radius * cosine + sx), alpha * (radius * sine + sy), height + sz
    wm_z = wm_z if wm_z > _TINY else _TINY
    scale = _ONE / np.sqrt(wm_x * wm_x + wm_y * wm_y + wm_z * wm_z)
    return wm_x * scale, wm_y * scale, wm_z * scale
