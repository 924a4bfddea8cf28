"""Several ways of light in one pixel: flying pixels, and corners against a numerical integral."""

import numpy as np
import pytest
from box_room import quad
from sensor_scenes import WIDE, plate, read, wall

QUIET = {"noise_floor_m": 0.0, "noise_growth_per_m": 0.0, "grazing_noise": 0.0, "lateral_noise_px": 0.0}
LIGHT_MPS = 299_792_458.0


def test_pixels_fly_between_foreground_and_background():
    pieces = [wall(1.6), plate(1.3, (0.0031, -2.0), (3.0, 2.0))]  # the edge lies within column 160
    sensed, _ = read(pieces, WIDE, model="kinect_v2", baseline_m=0.0, multipath=0.0, **QUIET)
    away = np.minimum(abs(sensed[120] - 1.6), abs(sensed[120] - 1.3))
    assert list(np.flatnonzero(away > 0.02)) == [160] and 1.33 < sensed[120, 160] < 1.57


def test_a_pixel_whose_returns_cancel_is_invalid():
    gap = LIGHT_MPS / (4.0 * 80e6)  # half a period
    pieces = [wall(1.0 + gap), plate(1.0, (0.0031, -2.0), (3.0, 2.0), color=(0.15, 0.15, 0.15))]
    sensed, _ = read(pieces, WIDE, model="kinect_v2", baseline_m=0.0, multipath=0.0, **QUIET)
    assert np.isnan(sensed[120, 160]) and np.isfinite(sensed[120, [158, 162]]).all()
    sensed, _ = read(pieces, WIDE, model="kinect_v2", baseline_m=0.0, multipath=0.0, min_coherence=0.0, **QUIET)
    assert np.isfinite(sensed[120, 160])


def corner_shift(point, camera, frequency_hz, reflectance, frame):
    """The range error at a point of a wall at x = 2 by light from a side wall at y = -0.8, by sums over that wall's squares."""
    half_x, half_y = 0.5 * frame[0] / camera.focal_length_px, 0.5 * frame[1] / camera.focal_length_px
    edge = 0.005
    x, z = np.meshgrid(np.arange(0.0, 2.0, edge) + edge / 2, np.arange(-1.5, 1.5, edge) + edge / 2, indexing="ij")
    q = np.stack([x, np.full_like(x, -0.8), z], axis=-1)
    seen = (0.8 < half_x * x) & (abs(z) < half_y * x)
    to_eye, to_point = np.linalg.norm(q, axis=-1), np.linalg.norm(q - point, axis=-1)
    received = reflectance * (0.8 / to_eye) / to_eye**2  # of the side wall's points, sent on evenly
    form = (point[0] - q[..., 0]) / to_point * (q[..., 1] - point[1]).__abs__() / to_point / (np.pi * to_point**2)
    distance = np.linalg.norm(point)
    direct = (point[0] / distance) / distance**2
    phase = 4 * np.pi * frequency_hz / LIGHT_MPS * 0.5 * (to_eye + to_point - distance)
    total = 1.0 + np.sum(np.where(seen, received * form / direct * edge**2, 0.0) * np.exp(1j * phase))
    return np.angle(total) * LIGHT_MPS / (4 * np.pi * frequency_hz)


@pytest.mark.parametrize("column", [180, 215, 235])
def test_a_corner_is_bent_as_the_integral_over_the_other_wall_says(column):
    side = quad((0.0, -0.8, -1.5), (2.0, 0.0, 0.0), (0.0, 0.0, 3.0), color=(0.8, 0.8, 0.8), roughness=1.0)
    back = quad((2.0, -0.8, -1.5), (0.0, 3.0, 0.0), (0.0, 0.0, 3.0), color=(0.8, 0.8, 0.8), roughness=1.0)
    sensed, true = read([side, back], WIDE, model="kinect_v2", baseline_m=0.0, **QUIET)
    u = (column + 0.5 - 160.0) / WIDE.focal_length_px
    expected = corner_shift(np.array([2.0, -2.0 * u, 0.0]), WIDE, 80e6, 0.8, (320, 240)) / np.sqrt(1.0 + u * u)
    shift = np.mean((sensed - true)[100:140, column])
    assert expected > 0.013 and shift == pytest.approx(expected, rel=0.07)
    plain, true = read([side, back], WIDE, model="kinect_v2", baseline_m=0.0, multipath=0.0, **QUIET)
    assert np.abs(plain - true)[110:130, column].max() < 1e-4
