"""Texels in blocks: each lies once, where its column and line say, and neighbours lie together."""

import numpy as np
import pytest

from renderer.core.kernel import from_python
from renderer.textures import packing

texel_place = from_python(packing.texel_place)


@pytest.mark.parametrize(("log_h", "log_w"), [(0, 0), (0, 5), (2, 6), (3, 3), (6, 1), (5, 7)])
def test_every_texel_is_found_where_it_lies_and_sides_repeat(log_h: int, log_w: int) -> None:
    height, width = 1 << log_h, 1 << log_w
    texels = np.arange(height * width).reshape(height, width)
    blocks = packing.in_blocks(texels)
    found = [[blocks[texel_place(column, line, log_w, log_h)] for column in range(-1, width + 1)] for line in range(-1, height + 1)]
    np.testing.assert_array_equal(found, np.pad(texels, 1, mode="wrap"))


def test_a_block_of_8_by_8_lies_together() -> None:
    places = [texel_place(8 + column, 16 + line, 6, 5) for line in range(8) for column in range(8)]
    assert places == list(range(places[0], places[0] + 64))
