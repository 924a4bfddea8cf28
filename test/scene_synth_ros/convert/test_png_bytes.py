"""PNG files, read by Pillow and OpenCV."""

import io

import cv2
import numpy as np
import pytest
from PIL import Image

from scene_synth_ros.convert.png_bytes import png_bytes


@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (5, 1), (13, 17), (1, 1, 3), (13, 17, 3)])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_pixels_come_back(shape, dtype):
    if len(shape) == 3 and dtype == np.uint16:
        shape = (*shape[:2],)
    pixels = np.random.default_rng(1).integers(0, np.iinfo(dtype).max, shape, dtype, endpoint=True)
    data = png_bytes(pixels)
    with Image.open(io.BytesIO(data)) as picture:
        picture.verify()
    with Image.open(io.BytesIO(data)) as picture:
        assert picture.mode == ("RGB" if len(shape) == 3 else "I;16" if dtype == np.uint16 else "L")
        np.testing.assert_array_equal(np.asarray(picture), pixels)
    read = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    np.testing.assert_array_equal(read[..., ::-1] if read.ndim == 3 else read, pixels)


def test_a_view_of_an_array_is_written_as_it_looks():
    pixels = np.arange(240, dtype=np.uint16).reshape(12, 20)[::2, ::-1]
    with Image.open(io.BytesIO(png_bytes(pixels))) as picture:
        np.testing.assert_array_equal(np.asarray(picture), pixels)
