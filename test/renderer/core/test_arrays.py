"""Images that share one block of memory."""

import numpy as np
import pytest

from renderer.core.arrays import empty_together


@pytest.mark.parametrize("height", [3, 2000])
def test_images_of_one_block_are_apart_contiguous_and_on_lines_of_the_cache(height):
    wanted = [((height, 5, 3), np.float32), ((0, 5), np.uint8), ((height, 700), np.uint16), ((height, 7), np.uint8)]
    images = empty_together(wanted)
    assert [(image.shape, image.dtype) for image in images] == [(shape, np.dtype(dtype)) for shape, dtype in wanted]
    for number, image in enumerate(images):
        assert image.flags.c_contiguous and image.flags.writeable and image.ctypes.data % 64 == 0
        image.fill(number)
    for number, image in enumerate(images):
        assert (image == number).all()
