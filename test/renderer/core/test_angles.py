"""Inverse trigonometric functions against numpy's in double precision."""

import numpy as np
from numba import njit

from renderer.core.equirectangular import arcsin, arctan2


@njit
def all_around(y, x):
    return np.array([arctan2(y[i], x[i]) for i in range(len(x))])


@njit
def of_sines(sines):
    return np.array([arcsin(sine) for sine in sines])


def test_arctangent_of_all_quadrants():
    turn = np.linspace(-np.pi, np.pi, 40001)
    for radius in (1e-12, 1.0, 1e12):
        x, y = (radius * np.cos(turn)).astype(np.float32), (radius * np.sin(turn)).astype(np.float32)
        found = all_around(y, x).astype(np.float64)
        np.testing.assert_allclose(found, np.arctan2(y.astype(np.float64), x.astype(np.float64)), atol=3e-7)
    zero, one = np.float32(0.0), np.float32(1.0)
    edges = all_around(np.array([zero, one, -one, zero, zero]), np.array([one, zero, zero, -one, zero]))
    np.testing.assert_allclose(edges, [0.0, np.pi / 2, -np.pi / 2, np.pi, 0.0], atol=1e-7)


def test_arcsine():
    sines = np.linspace(-1.0, 1.0, 20001).astype(np.float32)
    np.testing.assert_allclose(of_sines(sines), np.arcsin(sines.astype(np.float64)), atol=6e-7)
