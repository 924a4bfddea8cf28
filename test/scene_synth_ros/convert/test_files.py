"""Depth in steps; pictures that were recorded as files are copied."""

import io

import cv2
import numpy as np
import pytest
from PIL import Image

from renderer.files.image_io import encode_image
from scene_synth_ros.convert.files import beyond_note, depth_steps, png_bytes, write_picture

PIXELS = np.arange(6 * 8 * 3, dtype=np.uint8).reshape(6, 8, 3)


def test_depth_is_rounded_and_what_is_not_known_is_nought():
    depth = np.array([[0.0, 0.00049, 0.0006, 1.2345], [65.5351, 65.5356, np.inf, np.nan], [-1.0, 70.0, 2.0, 0.001]], np.float32)
    found = depth_steps(depth, 1000.0)
    assert found.stored.dtype == np.uint16 and found.beyond == 2
    np.testing.assert_array_equal(found.stored, [[0, 0, 1, 1234], [65535, 0, 0, 0], [0, 0, 2000, 1]])
    assert beyond_note("x", 0, 1000.0) == ()
    assert beyond_note("x", 3, 5000.0) == ("x: 3 pixels lie beyond 13.1 m, the largest depth that it stores; they have none there",)


class Frame(dict):
    def __init__(self, file):
        super().__init__(color=PIXELS)
        self.encoded = lambda layer: file


@pytest.mark.parametrize("form", ["png", "jpeg"])
def test_files_are_copied(tmp_path, form):
    file = encode_image(PIXELS, form, quality=70)
    name = write_picture(Frame((file, form)), "color", tmp_path / "0001.5")
    assert name == ("0001.5.png" if form == "png" else "0001.5.jpg") and (tmp_path / name).read_bytes() == file


@pytest.mark.parametrize("recorded", [None, (encode_image(PIXELS, "jpeg"), "jpeg")])
def test_pixels_become_png_where_there_is_no_file_that_the_format_takes(tmp_path, recorded):
    name = write_picture(Frame(recorded), "color", tmp_path / "a", jpeg=False)
    assert name == "a.png"
    np.testing.assert_array_equal(np.asarray(Image.open(io.BytesIO((tmp_path / name).read_bytes()))), PIXELS)


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
