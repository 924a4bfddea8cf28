"""Exposure and sRGB against their definitions."""

import numpy as np
import pytest

from renderer.tone import encode_srgb, to_display, white_luminance


def test_srgb_is_the_standards_curve_rounded():
    linear = np.linspace(0, 1, 20001)
    exact = 255 * np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    codes = encode_srgb(linear.astype(np.float32))
    between = np.abs(exact - np.floor(exact) - 0.5) > 1e-3
    assert np.array_equal(codes[between], np.rint(exact[between]))
    assert codes.dtype == np.uint8 and len(np.unique(codes)) == 256


def test_every_code_survives_decoding():
    codes = np.arange(256)
    decoded = np.where(codes <= 10, codes / 255 / 12.92, ((codes / 255 + 0.055) / 1.055) ** 2.4)
    assert np.array_equal(encode_srgb(decoded.astype(np.float32)), codes)


def test_out_of_range_is_clipped():
    assert encode_srgb(np.array([-1, 0, 1, 7, np.inf], np.float32)).tolist() == [0, 0, 255, 255, 255]


@pytest.mark.parametrize(("ev", "white"), [(0, 1.2), (6, 76.8), (-1, 0.6), (15, 39321.6)])
def test_white_is_the_saturation_luminance(ev, white):
    assert white_luminance(ev) == pytest.approx(white)
    image = np.full((2, 3, 3), white * 0.18, np.float32)
    assert (to_display(image, ev) == 118).all()
    assert (to_display(image / 0.18 * 1.001, ev) == 255).all()
