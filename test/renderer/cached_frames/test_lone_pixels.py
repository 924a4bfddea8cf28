"""Dark pixels among lighter ones are told from lines and patches, and lifted."""

import numpy as np
import pytest

from renderer.cached_frames.lone_pixels import is_lone, lift_lone
from renderer.core.kernel import from_python


@pytest.mark.parametrize(("dark", "found"), [(1, True), (2, True), (3, False)])
def test_dark_pixels_are_lone_with_one_other_beside_them(dark, found):
    image = np.full((3, 6, 3), 10, np.float32)
    image[1, 1 : 1 + dark] = 3
    assert bool(from_python(is_lone)(image, 1 if dark < 3 else 2, 1)) == found


def test_a_dark_pixel_among_lighter_ones_is_lifted_and_a_dark_line_is_not():
    image = np.full((8, 9, 3), (12, 10, 8), np.float32)
    image[2, 3], image[2, 2], image[5:7, 6] = 0, (5, 4, 3), 0
    expected = image.copy()
    expected[2, 3] = 0.6 * image[2, 2]
    for first in (1, 0):
        lift_lone(image, first, 2)
    np.testing.assert_allclose(image, expected, rtol=1e-6)
