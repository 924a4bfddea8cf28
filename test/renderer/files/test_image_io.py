"""PNG files, read back."""

import numpy as np
import pytest
from PIL import Image

from renderer.core.errors import RenderError
from renderer.files.image_io import write_png


@pytest.mark.parametrize(("dtype", "shape"), [("uint8", (5, 7)), ("uint8", (5, 7, 3)), ("uint16", (5, 7))])
def test_files_hold_the_same_numbers(tmp_path, dtype, shape):
    image = np.random.default_rng(2).integers(0, np.iinfo(dtype).max, shape, dtype, endpoint=True)
    write_png(tmp_path / "image.png", image)
    assert np.array_equal(np.array(Image.open(tmp_path / "image.png")), image)


@pytest.mark.parametrize(("dtype", "shape"), [("float32", (5, 7)), ("uint16", (5, 7, 3)), ("uint8", (5, 7, 4)), ("uint8", (0, 7))])
def test_other_images_are_refused(tmp_path, dtype, shape):
    with pytest.raises(RenderError, match="expected uint8 or uint16"):
        write_png(tmp_path / "image.png", np.zeros(shape, dtype))
    assert not (tmp_path / "image.png").exists()
