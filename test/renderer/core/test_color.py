"""Colour: the transfer function of sRGB and the weights of luminance, against their standards."""

import numpy as np
import pytest

from renderer.core.color import LUMINANCE, linear_from_srgb, srgb_from_linear


def test_srgb_has_the_values_of_the_standard() -> None:
    encoded = np.array([0.0, 0.04045, 0.5, 1.0])
    np.testing.assert_allclose(linear_from_srgb(encoded), [0.0, 0.04045 / 12.92, 0.21404114, 1.0], rtol=1e-7)
    np.testing.assert_allclose(srgb_from_linear(np.array([0.0, 0.0031308, 0.18, 1.0])), [0.0, 0.04044994, 0.46135613, 1.0], rtol=1e-6)


def test_bytes_come_back() -> None:
    codes = np.arange(256)
    np.testing.assert_array_equal(np.round(255.0 * srgb_from_linear(linear_from_srgb(codes / 255.0))), codes)


def test_precision_is_kept_and_negative_values_are_numbers() -> None:
    assert linear_from_srgb(np.float32([0.3])).dtype == np.float32
    assert srgb_from_linear(np.array([-0.1])) == pytest.approx(-1.292)


def test_white_has_a_luminance_of_one() -> None:
    assert LUMINANCE.sum() == pytest.approx(1.0)
