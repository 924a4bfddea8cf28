"""Images that share one block of memory, and blocks that are used again."""

import numpy as np
import pytest

from renderer.core.image_memory import ImageMemory


@pytest.mark.parametrize("height", [3, 2000])
def test_images_of_one_block_are_apart_contiguous_and_on_lines_of_the_cache(height):
    wanted = [((height, 5, 3), np.float32), ((0, 5), np.uint8), ((height, 700), np.uint16), ((height, 7), np.uint8)]
    images = ImageMemory().empty(wanted)
    assert [(image.shape, image.dtype) for image in images] == [(shape, np.dtype(dtype)) for shape, dtype in wanted]
    for number, image in enumerate(images):
        assert image.flags.c_contiguous and image.flags.writeable and image.ctypes.data % 64 == 0
        image.fill(number)
    for number, image in enumerate(images):
        assert (image == number).all()


def address(images):
    return images[0].ctypes.data


def test_memory_is_used_again_when_no_image_of_it_is_left():
    memory, wanted = ImageMemory(), [((480, 640), np.float32), ((480, 640, 3), np.float32)]
    first, second = memory.empty(wanted), memory.empty(wanted)
    was_first, was_second = address(first), address(second)
    assert was_first != was_second
    kept = first[1][5:, ::2]
    kept.fill(7.0)
    del first
    third = memory.empty(wanted)
    assert address(third) not in (was_first, was_second)
    del second
    assert address(memory.empty(wanted)) == was_second
    del kept
    again = [memory.empty(wanted), memory.empty(wanted)]
    assert {address(images) for images in again} == {was_first, was_second}


def test_what_lives_is_never_handed_out_and_other_sizes_are_given_back():
    memory, small, large = ImageMemory(), [((100, 100), np.uint8)], [((900, 900), np.uint8)]
    kept = memory.empty(small)[0]
    kept.fill(1)
    memory.empty(small)
    assert len(memory._blocks) == 2
    memory.empty(large)[0].fill(2)
    assert len(memory._blocks) == 2  # the small one that is free is gone
    memory.empty(small)[0].fill(3)
    assert (kept == 1).all() and len(memory._blocks) == 2


def test_few_blocks_are_kept_however_many_images_live():
    memory = ImageMemory()
    images = [memory.empty([((8, 8), np.uint8)])[0] for _ in range(40)]
    for number, image in enumerate(images):
        image.fill(number)
    assert len(memory._blocks) == 16 and all((image == number).all() for number, image in enumerate(images))
