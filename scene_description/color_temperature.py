"""Colour temperatures as chromaticities and linear RGB.

A colour temperature T becomes the chromaticity of a black body at T by the cubic approximation of Kim et al. (Design of advanced color
temperature control system for HDTV applications, Journal of the Korean Physical Society 41, 2002), valid from 1667 K to 25000 K, and that
becomes linear RGB with the primaries and white of ITU-R BT.709.
"""

import numpy as np
from numpy.typing import NDArray

from scene_description.products import inverse, matmul

Rgb = tuple[float, float, float]

D65_XY = (0.3127, 0.3290)
"""CIE 1931 x, y of the white of ITU-R BT.709 and sRGB."""

_PRIMARIES_XY = ((0.640, 0.330), (0.300, 0.600), (0.150, 0.060))


def black_body_chromaticity(temperature_k: float) -> tuple[float, float]:
    """Return CIE 1931 x, y of a black body, 1667 K to 25000 K (Kim et al. 2002)."""
    t = 1000.0 / temperature_k
    if temperature_k <= 4000.0:
        x = ((-0.2661239 * t - 0.2343589) * t + 0.8776956) * t + 0.179910
    else:
        x = ((-3.0258469 * t + 2.1070379) * t + 0.2226347) * t + 0.240390
    if temperature_k <= 2222.0:
        y = ((-1.1063814 * x - 1.34811020) * x + 2.18555832) * x - 0.20219683
    elif temperature_k <= 4000.0:
        y = ((-0.9549476 * x - 1.37418593) * x + 2.09137015) * x - 0.16748867
    else:
        y = ((3.0817580 * x - 5.87338670) * x + 3.75112997) * x - 0.37001483
    return x, y


def xyz_from_rgb() -> NDArray[np.float64]:
    """Return the 3x3 matrix from linear RGB of ITU-R BT.709 to CIE XYZ with Y = 1 for white; its second row weighs luminance."""
    primaries = np.array([xyz_of_xy(*xy) for xy in _PRIMARIES_XY]).T
    return np.asarray(primaries * matmul(inverse(primaries), xyz_of_xy(*D65_XY)))


def color_of_temperature(temperature_k: float) -> Rgb:
    """Return the linear RGB colour of a black body: components outside the gamut are 0, the largest is 1."""
    rgb = np.maximum(matmul(inverse(xyz_from_rgb()), xyz_of_xy(*black_body_chromaticity(temperature_k))), 0.0)
    red, green, blue = (float(c) for c in rgb / rgb.max())
    return red, green, blue


def luminance_rgb(temperature_k: float, luminance_cd_m2: float) -> Rgb:
    """Return the linear RGB luminance in cd/m2 of light with this colour temperature and (photometric) luminance."""
    color = np.array(color_of_temperature(temperature_k))
    red, green, blue = (float(c) for c in color * luminance_cd_m2 / matmul(xyz_from_rgb()[1], color))
    return red, green, blue


def xyz_of_xy(x: float, y: float) -> NDArray[np.float64]:
    """Return CIE XYZ (3,) with Y = 1 of a chromaticity."""
    return np.array([x / y, 1.0, (1.0 - x - y) / y])
