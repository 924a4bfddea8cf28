"""The daylit sky as an equirectangular map: clear, overcast or between.

Clear: A. J. Preetham, P. Shirley and B. Smits, "A Practical Analytic Model for Daylight" (SIGGRAPH 1999), appendix A.2: luminance and
chromaticity of each direction by the five-parameter formula of Perez, coefficients linear in turbidity.  Overcast: the CIE standard
overcast sky, of luminance (1 + 2 sin elevation) / 3 of the zenith's, with the horizontal illuminance 300 lx + 21000 lx sin(sun's elevation)
of Krochmann and Seidl ("Quantitative data on daylight for illuminating engineering", Lighting Research and Technology 6, 1974).  Between
them luminances mix by cloud cover, and the sun keeps its uncovered share.  The clear sky is scaled so that at turbidity 2.5 its horizontal
illuminance is the 800 lx + 15500 lx sqrt(sin(sun's elevation)) of the IES (Recommended Practice for the Calculation of Daylight
Availability, 1984): the formulas alone are too bright, at low sun by twice and more.  Below the horizon lies level, matt ground, lit by
both.

The sun below the atmosphere, in the three display primaries: outside it is a black body of 5772 K (IAU 2015 resolution B3) that brings
127.5 klx at the mean distance (IES, Recommended Practice for the Calculation of Daylight Availability, 1984).  Air takes light out by
wavelength, along the air mass of Kasten and Young ("Revised optical air mass tables and approximation formula", 1989): Rayleigh's
scattering exp(-0.008735 m L^-4.08) and aerosols exp(-b m L^-1.3), b = 0.04608 T - 0.04586, L in micrometres and T the turbidity, as
Preetham, Shirley and Smits give them; ozone, water and mixed gases, a few per cent, are left out.  Colours by the analytic matching
functions of Wyman, Sloan and Shirley ("Simple Analytic Approximations to the CIE XYZ Color Matching Functions", JCGT 2(2), 2013).
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import kernel_cache.elementary as el
from renderer.core.arrays import Array
from renderer.core.color import LUMINANCE
from renderer.core.equirectangular import map_directions, pixel_solid_angles
from scene_description.color_temperature import luminance_rgb, xyz_from_rgb
from scene_description.products import inverse, matmul, norm
from scene_description.types import Daylight

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
    rayleigh = el.exp(-0.008735 * mass * el.power(micrometres, -4.08))
    aerosols = el.exp(-(0.04608 * turbidity - 0.04586) * mass * el.power(micrometres, -1.3))
    spectrum = el.power(_WAVELENGTHS_NM, -5.0) / el.expm1(_SECOND_CONSTANT_NM_K / (_WAVELENGTHS_NM * _TEMPERATURE_K))
    matching = matching_functions(_WAVELENGTHS_NM)
    scale = EXTRATERRESTRIAL_LX / distance_au**2 / matmul(matching[1], spectrum)
    rgb = matmul(inverse(xyz_from_rgb()), matmul(matching, spectrum * rayleigh * aerosols) * scale)
    return np.asarray(np.maximum(rgb, 0.0))


def matching_functions(wavelengths_nm: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the CIE 1931 colour matching functions x, y, z (3, n) at wavelengths (n,)."""

    def lobe(peak: float, middle: float, left: float, right: float) -> NDArray[np.float64]:
        away = wavelengths_nm - middle
        return np.asarray(peak * el.exp(-0.5 * (away / np.where(away < 0.0, left, right)) ** 2))

    return np.stack(
        [
            lobe(1.056, 599.8, 37.9, 31.0) + lobe(0.362, 442.0, 16.0, 26.7) + lobe(-0.065, 501.1, 20.4, 26.2),
            lobe(0.821, 568.8, 46.9, 40.5) + lobe(0.286, 530.9, 16.3, 31.1),
            lobe(1.217, 437.0, 11.8, 36.0) + lobe(0.681, 459.0, 26.0, 13.8),
        ]
    )


ROWS, COLUMNS = 96, 384
LOWEST_SUN_RAD = math.radians(1.0)
"""Below this elevation the formulas, made for the day, are taken at it."""

PLAIN_TURBIDITY = 2.5

_OVERCAST_K = 6500.0

# Preetham et al. 1999: rows A to E of (slope, constant) against turbidity, for Y, x and y.
_PEREZ = np.array(
    [
        [[0.1787, -1.4630], [-0.3554, 0.4275], [-0.0227, 5.3251], [0.1206, -2.5771], [-0.0670, 0.3703]],
        [[-0.0193, -0.2592], [-0.0665, 0.0008], [-0.0004, 0.2125], [-0.0641, -0.8989], [-0.0033, 0.0452]],
        [[-0.0167, -0.2608], [-0.0950, 0.0092], [-0.0079, 0.2102], [-0.0441, -1.6537], [-0.0109, 0.0529]],
    ]
)
# Chromaticity of the zenith: rows by power of turbidity from 2 down, columns by power of the sun's zenith angle from 3 down.
_ZENITH_X = np.array([[0.00166, -0.00375, 0.00209, 0.0], [-0.02903, 0.06377, -0.03202, 0.00394], [0.11693, -0.21196, 0.06052, 0.25886]])
_ZENITH_Y = np.array([[0.00275, -0.00610, 0.00317, 0.0], [-0.04214, 0.08970, -0.04153, 0.00516], [0.15346, -0.26756, 0.06670, 0.26688]])


def zenith_yxy(sun_elevation_rad: float, turbidity: float) -> tuple[float, float, float]:
    """Return luminance in cd/m2 and chromaticity x, y of the zenith of a clear sky."""
    angle = 0.5 * math.pi - max(sun_elevation_rad, LOWEST_SUN_RAD)
    chi = (4.0 / 9.0 - turbidity / 120.0) * (math.pi - 2.0 * angle)
    luminance = (4.0453 * turbidity - 4.9710) * math.tan(chi) - 0.2155 * turbidity + 2.4192
    powers, clear = np.array([math.pow(angle, 3), angle**2, angle, 1.0]), np.array([turbidity**2, turbidity, 1.0])
    return 1000.0 * max(luminance, 0.0), float(matmul(matmul(clear, _ZENITH_X), powers)), float(matmul(matmul(clear, _ZENITH_Y), powers))


def clear_sky_rgb(directions: Array, sun_direction: Array, turbidity: float) -> Array:
    """Return luminance RGB (n, 3) in cd/m2 of a clear sky towards unit directions (n, 3) with z >= 0."""
    elevation = max(math.asin(float(np.clip(sun_direction[2], -1.0, 1.0))), LOWEST_SUN_RAD)
    cosine = np.maximum(directions[:, 2], 0.01)
    toward = np.clip(matmul(directions, sun_direction), -1.0, 1.0)
    from_sun = el.arccos(toward)
    values = []
    for row, zenith in zip(_PEREZ, zenith_yxy(elevation, turbidity), strict=True):
        a, b, c, d, e = matmul(row, np.array([turbidity, 1.0]))
        here = (1.0 + a * el.exp(b / cosine)) * (1.0 + c * el.exp(d * from_sun) + e * toward**2)
        angle = 0.5 * math.pi - elevation
        above = (1.0 + a * math.exp(b)) * (1.0 + c * math.exp(d * angle) + e * math.cos(angle) ** 2)
        values.append(zenith * here / above)
    luminance, x, y = values
    luminance, y = np.maximum(luminance, 0.0), np.maximum(y, 0.05)
    xyz = np.stack([x / y * luminance, luminance, (1.0 - x - y) / y * luminance], axis=-1)
    return np.asarray(np.maximum(matmul(xyz, inverse(xyz_from_rgb()).T), 0.0))


def overcast_sky_rgb(directions: Array, sun_elevation_rad: float) -> Array:
    """Return luminance RGB (n, 3) in cd/m2 of the CIE overcast sky; its horizontal illuminance is 7 pi / 9 of the zenith's luminance."""
    illuminance = 300.0 + 21_000.0 * math.sin(max(sun_elevation_rad, 0.0))
    zenith = np.array(luminance_rgb(_OVERCAST_K, illuminance * 9.0 / (7.0 * math.pi)))
    return np.asarray((1.0 + 2.0 * np.maximum(directions[:, 2:], 0.0)) / 3.0 * zenith)


class SkyAndSun(NamedTuple):
    """``table`` and ``sun`` of ``renderer.scene.flat_scene.Sky``."""

    table: NDArray[np.float32]
    sun: NDArray[np.float32]


def gradient_map(zenith: NDArray[np.float32], horizon: NDArray[np.float32], ground: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the map (ROWS, COLUMNS, 3) of a sky that is told by its luminance (3,) at the zenith, at the horizon and below it."""
    up = map_directions(ROWS, COLUMNS)[..., 2:]
    return np.where(up < 0.0, ground, horizon + up * (zenith - horizon)).astype(np.float32)


def daylight_map(daylight: Daylight) -> SkyAndSun:
    """Return ``table`` and ``sun`` of ``renderer.scene.flat_scene.Sky`` for a state of the daylight."""
    toward_sun = np.array(daylight.sun_direction) / norm(daylight.sun_direction)
    elevation = math.asin(float(toward_sun[2]))
    directions = map_directions(ROWS, COLUMNS).reshape(-1, 3)
    cover, half = daylight.cloud_cover, ROWS // 2 * COLUMNS
    upper = directions[:half]
    onto_level = (np.repeat(pixel_solid_angles(ROWS, COLUMNS)[: ROWS // 2], COLUMNS) * upper[:, 2])[:, None]
    plain = float(matmul((clear_sky_rgb(upper, toward_sun, PLAIN_TURBIDITY) * onto_level).sum(axis=0), LUMINANCE))
    scale = (800.0 + 15_500.0 * math.sqrt(math.sin(max(elevation, LOWEST_SUN_RAD)))) / plain
    clear = scale * clear_sky_rgb(upper, toward_sun, daylight.turbidity)
    sky = (1.0 - cover) * clear + cover * overcast_sky_rgb(upper, elevation)
    beam = (1.0 - cover) * sun_illuminance_lx(elevation, daylight.turbidity, daylight.sun_distance_au)
    sky = sky if daylight.sky_scale is None else daylight.sky_scale * sky
    beam = beam if daylight.sun_scale is None else daylight.sun_scale * beam
    on_ground = (sky * onto_level).sum(axis=0) + beam * max(math.sin(elevation), 0.0)
    ground = np.array(daylight.ground_color) * on_ground / math.pi
    table = np.concatenate([sky, np.broadcast_to(ground, (len(directions) - half, 3))]).reshape(ROWS, COLUMNS, 3)
    sun = np.array([*toward_sun, VERSINE, *(beam / SOLID_ANGLE_SR)]) if beam.any() else np.zeros(0)
    return SkyAndSun(np.ascontiguousarray(table, np.float32), np.ascontiguousarray(sun, np.float32))
