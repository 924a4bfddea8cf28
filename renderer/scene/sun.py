"""Light of the sun below the atmosphere, in the three display primaries.

Outside the atmosphere the sun is a black body of 5772 K (IAU 2015 resolution B3) that brings 127.5 klx at the mean distance (IES,
Recommended Practice for the Calculation of Daylight Availability, 1984).  Air takes light out by wavelength, along the air mass of Kasten
and Young ("Revised optical air mass tables and approximation formula", 1989): Rayleigh's scattering exp(-0.008735 m L^-4.08) and aerosols
exp(-b m L^-1.3), b = 0.04608 T - 0.04586, L in micrometres and T the turbidity, as Preetham, Shirley and Smits give them ("A Practical
Analytic Model for Daylight", 1999); ozone, water and mixed gases, a few per cent, are left out.  Colours by the analytic matching functions
of Wyman, Sloan and Shirley ("Simple Analytic Approximations to the CIE XYZ Color Matching Functions", JCGT 2(2), 2013).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from scene_description.color_temperature import xyz_from_rgb

ANGULAR_RADIUS_RAD = math.radians(0.533 / 2.0)
"""Of the sun's disc, at the mean distance."""

VERSINE = 1.0 - math.cos(ANGULAR_RADIUS_RAD)
SOLID_ANGLE_SR = 2.0 * math.pi * VERSINE

EXTRATERRESTRIAL_LX = 127_500.0
_TEMPERATURE_K = 5772.0
_SECOND_CONSTANT_NM_K = 1.438777e7
_WAVELENGTHS_NM = np.arange(380.0, 781.0, 5.0)


def air_mass(elevation_rad: float) -> float:
    """Return the relative optical air mass at an elevation of at least 0."""
    degrees = math.degrees(max(elevation_rad, 0.0))
    return 1.0 / (math.sin(math.radians(degrees)) + 0.50572 * math.pow(degrees + 6.07995, -1.6364))


def sun_illuminance_lx(elevation_rad: float, turbidity: float, distance_au: float = 1.0) -> NDArray[np.float64]:
    """Return the illuminance (3,) of the direct sun on a plane that faces it, linear RGB in lux; outside the gamut components are 0.

    ``turbidity``: 2 is very clear, 3 clear, 6 hazy; ``distance_au``: of the sun, which sends no light from below the horizon.
    """
    if elevation_rad <= 0.0:
        return np.zeros(3)
    mass, micrometres = air_mass(elevation_rad), _WAVELENGTHS_NM / 1000.0
    rayleigh = np.exp(-0.008735 * mass * micrometres**-4.08)
    aerosols = np.exp(-(0.04608 * turbidity - 0.04586) * mass * micrometres**-1.3)
    spectrum = _WAVELENGTHS_NM**-5.0 / np.expm1(_SECOND_CONSTANT_NM_K / (_WAVELENGTHS_NM * _TEMPERATURE_K))
    matching = matching_functions(_WAVELENGTHS_NM)
    scale = EXTRATERRESTRIAL_LX / distance_au**2 / (matching[1] @ spectrum)
    rgb = np.linalg.solve(xyz_from_rgb(), matching @ (spectrum * rayleigh * aerosols) * scale)
    return np.asarray(np.maximum(rgb, 0.0))


def matching_functions(wavelengths_nm: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the CIE 1931 colour matching functions x, y, z (3, n) at wavelengths (n,)."""

    def lobe(peak: float, middle: float, left: float, right: float) -> NDArray[np.float64]:
        away = wavelengths_nm - middle
        return np.asarray(peak * np.exp(-0.5 * (away / np.where(away < 0.0, left, right)) ** 2))

    return np.stack(
        [
            lobe(1.056, 599.8, 37.9, 31.0) + lobe(0.362, 442.0, 16.0, 26.7) + lobe(-0.065, 501.1, 20.4, 26.2),
            lobe(0.821, 568.8, 46.9, 40.5) + lobe(0.286, 530.9, 16.3, 31.1),
            lobe(1.217, 437.0, 11.8, 36.0) + lobe(0.681, 459.0, 26.0, 13.8),
        ]
    )
