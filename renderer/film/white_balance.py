"""White balance: which light looks white, and how colours seen under it are carried over to the display's white.

Chromatic adaptation after von Kries in Bradford's cone space (K. M. Lam, "Metamerism and Colour Constancy", 1985; the matrix is that of the
ICC profile specification, annex E).  A camera's automatic balance leaves some of a light's tint, so that lamplight still looks warm: gains
are raised to a power, the degree of adaptation.
"""

import numpy as np
from numpy.typing import NDArray

import kernel_cache.elementary as el
from scene_description.color_temperature import D65_XY, black_body_chromaticity, xyz_from_rgb, xyz_of_xy
from scene_description.products import inverse, matmul

Chromaticity = tuple[float, float]
"""CIE 1931 x, y."""

AUTO_DEGREE = 0.8
"""How much of a metered light's tint is taken away; the rest stays, as in photographs."""

_BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])
_STEPS_PER_OCTAVE = 16
_MOST_OCTAVES = 3.0


def adaptation(white_xy: Chromaticity, degree: float = 1.0) -> NDArray[np.float64]:
    """Return the matrix (3, 3) on linear RGB that shows light of chromaticity ``white_xy`` as display white, of the same luminance.

    Args:
        white_xy: chromaticity of the light.
        degree: 1 shows it as exactly white, 0 changes nothing, between them part of the tint stays.
    """
    rgb_to_xyz = xyz_from_rgb()
    to_cone = matmul(_BRADFORD, rgb_to_xyz)
    gains = matmul(_BRADFORD, xyz_of_xy(*D65_XY)) / matmul(_BRADFORD, xyz_of_xy(*white_xy))
    return np.asarray(matmul(inverse(to_cone), el.power(gains[:, None], degree) * to_cone))


def chromaticity(rgb: NDArray[np.float64]) -> Chromaticity:
    """Return x, y of a linear RGB colour (3,) with a positive sum."""
    x, y, z = matmul(xyz_from_rgb(), rgb)
    return float(x / (x + y + z)), float(y / (x + y + z))


def partly_adapted(white_xy: Chromaticity, degree: float) -> Chromaticity:
    """Return the chromaticity that must be shown as white to take away this degree of the tint of ``white_xy``."""
    cone = matmul(_BRADFORD, xyz_of_xy(*white_xy)) / matmul(_BRADFORD, xyz_of_xy(*D65_XY))
    x, y, z = matmul(inverse(_BRADFORD), el.power(cone, degree) * matmul(_BRADFORD, xyz_of_xy(*D65_XY)))
    return float(x / (x + y + z)), float(y / (x + y + z))


def white_of_kelvin(temperature_k: float) -> Chromaticity:
    """Return the chromaticity of a black body at a temperature."""
    return black_body_chromaticity(temperature_k)


def metered_white(radiance: NDArray[np.float32], albedo: NDArray[np.float32]) -> Chromaticity:
    """Return the chromaticity of the light that falls on what is seen: the median over pixels of radiance over base colour.

    That is what a white card shows at these places, reflections from coloured walls included.  Lamps, glass, near black and what is
    unlit say nothing of the light and are left out; where nothing else is seen, the answer is the display's white.  Ratios of channels
    are rounded to 1/16 octave, and kept within three octaves of each other.

    ``radiance``, ``albedo``: (n, 3), linear, and base colour, 1 for lamps and glass.
    """
    lit = radiance.astype(np.float64)
    base = albedo.astype(np.float64)
    usable = (base.min(axis=1) > 0.04) & (base.min(axis=1) < 0.97) & (lit.min(axis=1) > 1e-4)
    if not usable.any():
        return D65_XY
    octaves = el.log2(lit[usable] / base[usable])
    tint = np.median(octaves[:, [0, 2]] - octaves[:, [1]], axis=0)
    red, blue = np.clip(np.rint(tint * _STEPS_PER_OCTAVE) / _STEPS_PER_OCTAVE, -_MOST_OCTAVES, _MOST_OCTAVES)
    return chromaticity(np.array([2.0**red, 1.0, 2.0**blue]))
