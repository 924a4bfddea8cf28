"""What formula-based devices share: which neighbours a surface goes on to, how noise grows, how much light returns.

Random numbers of a pixel depend on the frame's key, the pixel and the purpose only.
"""

import numpy as np

from renderer.camera.cameras import PosedCamera
from renderer.core.kernel import kernel
from renderer.core.random_numbers import mix_bits
from renderer.sensors.beams import Beams
from renderer.sensors.devices import Device

AXIAL, LATERAL_X, LATERAL_Y, SIGNAL, LEFT_IMAGE, RIGHT_IMAGE = range(1, 7)
"""Purposes: each has numbers of its own."""

_TO_UNIT, _GOLDEN, _OTHER = 2.0**-32, np.uint32(0x9E3779B9), np.uint32(0x68E31DA4)


@kernel
def even(key: np.uint32, pixel: int, purpose: int) -> float:
    """Return an even number in (0, 1)."""
    seed = mix_bits(np.uint32(mix_bits(np.uint32(pixel)) ^ np.uint32(key + np.uint32(np.uint32(purpose) * _GOLDEN))))
    return (float(seed) + 0.5) * _TO_UNIT


@kernel
def normal(key: np.uint32, pixel: int, purpose: int) -> float:
    """Return a standard normal number (Box and Muller 1958)."""
    seed = mix_bits(np.uint32(mix_bits(np.uint32(pixel)) ^ np.uint32(key + np.uint32(np.uint32(purpose) * _GOLDEN))))
    u, v = (float(seed) + 0.5) * _TO_UNIT, float(mix_bits(np.uint32(seed ^ _OTHER))) * _TO_UNIT
    number: float = np.sqrt(-2.0 * np.log(u)) * np.cos(2.0 * np.pi * v)
    return number


@kernel
def smooth_normal(key: np.uint32, x: int, y: int, width: int, spacing: int, purpose: int) -> float:
    """Return a standard normal number that pixels of an image ``width`` wide nearly share within ``spacing`` pixels; up to 1 none do.

    It is interpolated between those of a lattice.  Weights are those of a cubic step, divided by their length, so that the variance is one
    in every pixel.
    """
    if spacing <= 1:
        return float(normal(key, y * width + x, purpose))
    left, above = x // spacing, y // spacing
    s, t = (x - left * spacing + 0.5) / spacing, (y - above * spacing + 0.5) / spacing
    s, t = s * s * (3.0 - 2.0 * s), t * t * (3.0 - 2.0 * t)
    total = 0.0
    for row in range(2):
        for column in range(2):
            weight = (s if column else 1.0 - s) * (t if row else 1.0 - t)
            total += weight * normal(key, (above + row) * width + left + column, purpose)
    length = ((1.0 - s) * (1.0 - s) + s * s) * ((1.0 - t) * (1.0 - t) + t * t)
    return float(total / np.sqrt(length))


_STEP_M, _STEP_SHARE = 0.01, 0.01
_SOFTNESS = 0.15
"""Relative standard deviation of the signal that the threshold is compared with."""


@kernel
def axial_deviation(device: Device, depth: float, angle: float, reflectance: float) -> float:
    """Return the standard deviation of depth, in metres, at an angle of incidence below pi / 2."""
    away = depth - device.noise_quietest_m
    tilt = angle / max(0.5 * np.pi - angle, 1e-3)
    sigma = device.noise_floor_m + device.noise_growth_per_m * away * away
    sigma += device.grazing_noise * depth**device.grazing_exponent * tilt * tilt
    if device.noise_reflectance > 0.0:
        sigma *= np.sqrt(device.noise_reflectance / max(reflectance, 1e-4))
    return float(sigma)


@kernel
def pixel_plane(camera: PosedCamera, x: int, y: int) -> tuple[float, float]:
    """Return where the ray through a pixel's centre meets the plane z = 1 of the optical frame."""
    if len(camera.bearings):
        return float(camera.bearings[y + 1, x + 1, 0]), float(camera.bearings[y + 1, x + 1, 1])
    focal = float(camera.focal_px)
    return (x + 0.5 - 0.5 * camera.width) / focal, (y + 0.5 - 0.5 * camera.height) / focal


@kernel
def goes_on(camera: PosedCamera, beams: Beams, x: int, y: int, other_x: int, other_y: int) -> bool:
    """Return whether the plane that is seen in one pixel is what another pixel sees, within 1 cm and 1 % of depth."""
    depth = beams.distance[y, x] * beams.z[y, x]
    other = beams.distance[other_y, other_x] * beams.z[other_y, other_x]
    if not (np.isfinite(depth) and np.isfinite(other)):
        return bool(np.isfinite(depth) == np.isfinite(other))
    nx, ny, nz = beams.normal[y, x, 0], beams.normal[y, x, 1], beams.normal[y, x, 2]
    u, v = pixel_plane(camera, x, y)
    other_u, other_v = pixel_plane(camera, other_x, other_y)
    facing = nx * other_u + ny * other_v + nz
    expected = depth * (nx * u + ny * v + nz) / facing if facing < -1e-6 else depth
    return bool(abs(other - expected) < _STEP_M + _STEP_SHARE * depth)


@kernel
def seen_pixel(camera: PosedCamera, device: Device, beams: Beams, x: int, y: int, spacing: int, key: np.uint32) -> tuple[int, int]:
    """Return the pixel whose beam is read in place of a pixel's own: by lateral noise, another one where surfaces end.

    ``spacing``: of pixels whose noise is alike, as of :func:`smooth_normal`.
    """
    cosine = beams.cosine[y, x]
    angle = np.arccos(min(cosine, 1.0)) if cosine > 0.0 else 0.0
    sigma = device.lateral_noise_px + device.lateral_grazing_px * angle / max(0.5 * np.pi - angle, 0.05)
    other_x = x + int(np.floor(sigma * smooth_normal(key, x, y, camera.width, spacing, LATERAL_X) + 0.5))
    other_y = y + int(np.floor(sigma * smooth_normal(key, x, y, camera.width, spacing, LATERAL_Y) + 0.5))
    other_x, other_y = min(max(other_x, 0), camera.width - 1), min(max(other_y, 0), camera.height - 1)
    return (x, y) if goes_on(camera, beams, x, y, other_x, other_y) else (other_x, other_y)


@kernel
def signal(beams: Beams, x: int, y: int) -> float:
    """Return how much of the device's light returns to a pixel; white that faces the device 1 m away returns 1."""
    distance = max(beams.distance[y, x], 1e-3)
    return float(beams.lit[y, x] * beams.reflectance[y, x] * beams.cosine[y, x] / (distance * distance))


@kernel
def is_read(device: Device, strength: float, cosine: float, wavers: float) -> bool:
    """Return whether a signal is strong enough, which wavers by a standard normal number, not too strong, and not too oblique."""
    enough = strength * (1.0 + _SOFTNESS * wavers) >= device.signal_min
    return bool(enough and strength <= device.signal_max and cosine >= np.cos(device.max_angle_rad))


@kernel
def within_range(device: Device, depth: float) -> float:
    """Return a depth, or what stands for it beyond the device's range (REP 117): -inf too near, +inf too far."""
    if depth < device.min_range_m:
        return -np.inf
    return np.inf if depth > device.max_range_m else depth
