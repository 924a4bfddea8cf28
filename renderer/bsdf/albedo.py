"""How much light microfacet surfaces reflect in all: tables by angle and roughness, which make layers conserve energy.

Single scattering on rough microfacets loses light; what is missing is given back by a further lobe (Kulla and Conty, "Revisiting Physically
Based Shading at Imageworks", SIGGRAPH courses 2017) or, for glass, by scaling (Turquin, "Practical multiple scattering compensation for
microfacet models", 2019).  Both need the *directional albedo*: the share of light from one direction that a lobe reflects.

Tables are indexed by the square roots of the cosine and of alpha, each in ``STEPS`` steps over [0, 1].
"""

import functools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import kernel_cache.elementary as el
from scene_description.products import matmul

STEPS = 32
MIN_ALPHA = 1e-3
"""Floor of the microfacet distribution's alpha: a blur of less than half a pixel at ordinary sizes, and no infinite densities."""
_TURNS, _TILTS = 24, 64
_MIN_COSINE = 1e-4
_TURN = 0.5 * (np.arange(_TURNS) + 0.5) / _TURNS
"""Half a turn, as views lie in the plane y = 0."""
_TILT = (np.arange(_TILTS) + 0.5) / _TILTS
_NODES = tuple(item.ravel() for item in np.meshgrid(_TURN, 1.0 - el.power(_TILT, 3)))
_WEIGHTS = np.repeat(3.0 * _TILT**2 / _TILTS, _TURNS) / _TURNS
_WEIGHTS /= _WEIGHTS.sum()
"""Nodes lie closer where microfacets tilt most: the tails of GGX matter."""
_CELLS = (np.arange(STEPS) / (STEPS - 1)) ** 2
_ALPHAS = np.maximum(_CELLS, MIN_ALPHA)
_VIEWS = np.maximum(_CELLS, _MIN_COSINE)[:, None]
"""Cosines of the views, (STEPS, 1)."""


class Albedos(NamedTuple):
    """Tables for kernels: ``reflected`` as :func:`reflected_table` has it; ``glass`` rows of :func:`glass_table`."""

    reflected: NDArray[np.float32]
    glass: NDArray[np.float32]


def _visible_normals(alpha: np.float64) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return for each view its cosines to visible microfacet normals, nodes of ``_WEIGHTS`` (Heitz 2018), and their z; (STEPS, q) each."""
    u, v = _NODES
    sine = np.sqrt(1.0 - _VIEWS**2)
    length = np.sqrt((sine * alpha) ** 2 + _VIEWS**2)
    x, z = sine * alpha / length, _VIEWS / length
    height = (1.0 - v) * (1.0 + z) - z
    radius = np.sqrt(np.maximum(1.0 - height**2, 0.0))
    half_x, half_y, half_z = (radius * el.cos(2 * np.pi * u) + x) * alpha, radius * el.sin(2 * np.pi * u) * alpha, height + z
    length = np.sqrt(half_x**2 + half_y**2 + half_z**2)
    half_z /= length
    return sine * (half_x / length) + _VIEWS * half_z, half_z


def _mask(cosine: NDArray[np.float64], alpha: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return Smith's Lambda for GGX."""
    square = np.maximum(cosine**2, 1e-12)
    return 0.5 * (np.sqrt(1.0 + alpha**2 * (1.0 - square) / square) - 1.0)


def fresnel_dielectric(cosine: NDArray[np.float64], eta: float) -> NDArray[np.float64]:
    """Return the reflectance of a dielectric boundary for unpolarised light; ``eta``: index beyond it over index before it."""
    square = eta * eta - 1.0 + cosine**2
    g = np.sqrt(np.maximum(square, 0.0))
    parallel = (cosine * (g + cosine) - 1.0) / (cosine * (g - cosine) + 1.0)
    return np.where(square <= 0.0, 1.0, 0.5 * ((g - cosine) / (g + cosine)) ** 2 * (1.0 + parallel**2))


@functools.cache
def reflected_table() -> NDArray[np.float32]:
    """Return (STEPS alphas, STEPS cosines + 1, 3): albedo at reflectance 1, its part by Schlick's fifth power, and that of sheen.

    The last column holds the means over the cosine-weighted hemisphere.
    """
    table = np.zeros((STEPS, STEPS + 1, 3))
    for row, alpha in enumerate(_ALPHAS):
        wo_dot_wm, half_z = _visible_normals(alpha)
        out, before = 2.0 * wo_dot_wm * half_z - _VIEWS, 1.0 + _mask(_VIEWS, alpha)
        shadow = np.where(out > 0.0, before / (before + _mask(out, alpha)), 0.0)
        table[row, :-1, 0] = matmul(shadow, _WEIGHTS)
        table[row, :-1, 1] = matmul(shadow * el.power(1.0 - wo_dot_wm, 5), _WEIGHTS)
    table[:, :-1, 2] = _sheen_albedo()
    fine = np.linspace(0.0, 1.0, 4097)[:-1] + 0.5 / 4096
    places, roots = np.sqrt(fine), np.sqrt(_CELLS)
    for row in range(STEPS):
        for kind in range(3):
            table[row, -1, kind] = (2.0 * fine * np.interp(places, roots, table[row, :-1, kind])).mean()
    return np.ascontiguousarray(table, np.float32)


def _sheen_albedo() -> NDArray[np.float64]:
    """Return the albedo of the lobe (1 - cos)^5 of the angle between view and half vector (Burley, SIGGRAPH courses 2012)."""
    middles = (np.arange(128) + 0.5) / 128
    u, v = (item.ravel() for item in np.meshgrid(middles, middles))
    cosine = np.sqrt(1.0 - _VIEWS**2) * (np.sqrt(u) * el.cos(np.pi * v)) + _VIEWS * np.sqrt(1.0 - u)
    wo_dot_wm = np.sqrt(np.clip(0.5 * (1.0 + cosine), 0.0, 1.0))
    return np.asarray(np.pi * (el.power(1.0 - wo_dot_wm, 5)).mean(-1))


@functools.lru_cache(maxsize=64)
def glass_table(ior: float) -> NDArray[np.float32]:
    """Return (2, STEPS alphas, STEPS cosines): albedo of rough glass, reflection and refraction together, from outside and from inside."""
    table = np.zeros((2, STEPS, STEPS))
    for row, alpha in enumerate(_ALPHAS):
        wo_dot_wm, half_z = _visible_normals(alpha)
        out, before = 2.0 * wo_dot_wm * half_z - _VIEWS, _mask(_VIEWS, alpha)
        reflected = np.where(out > 0.0, (1.0 + before) / (1.0 + before + _mask(out, alpha)), 0.0)
        for side, eta in enumerate((ior, 1.0 / ior)):
            share = fresnel_dielectric(wo_dot_wm, eta)
            beyond = np.sqrt(np.maximum(1.0 - (1.0 - wo_dot_wm**2) / eta**2, 0.0))
            through = half_z * (wo_dot_wm / eta - beyond) - _VIEWS / eta
            refracted = np.where(through < 0.0, 1.0 / (1.0 + _mask(through, alpha)), 0.0)
            table[side, row] = matmul(share * reflected + (1.0 - share) * refracted, _WEIGHTS)
    return np.ascontiguousarray(table, np.float32)
