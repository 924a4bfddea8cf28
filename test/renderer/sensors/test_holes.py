"""What a pattern camera errs in is alike within its window: noise of variance one, holes in blobs, and no lone pixels."""

import numpy as np
import pytest
from scipy import ndimage
from sensor_scenes import NARROW, plate, read, wall

from renderer.core.kernel import from_python
from renderer.sensors.specks import remove_specks
from renderer.sensors.surfaces_seen import AXIAL, normal, smooth_normal

_BLOB = np.ones((3, 3))


def field(spacing: int, key: int = 7, size: int = 240) -> np.ndarray:
    number = from_python(smooth_normal)
    return np.array([[number(np.uint32(key), x, y, size, spacing, AXIAL) for x in range(size)] for y in range(size)])


@pytest.mark.parametrize("spacing", [1, 6])
def test_noise_has_the_variance_one_in_every_pixel_and_is_alike_within_the_spacing(spacing: int) -> None:
    numbers = field(spacing)
    assert abs(numbers.mean()) < 0.1 and numbers.std() == pytest.approx(1.0, abs=0.06)
    for x in range(spacing):  # no pixel of the lattice's cells is quieter than another
        assert numbers[:, x::spacing].std() == pytest.approx(1.0, abs=0.12)
    beside, apart = (
        np.corrcoef(numbers[:, :-1].ravel(), numbers[:, 1:].ravel())[0, 1],
        np.corrcoef(numbers[:, :-12].ravel(), numbers[:, 12:].ravel())[0, 1],
    )
    assert (beside > 0.85 if spacing > 1 else abs(beside) < 0.03) and abs(apart) < 0.1
    assert from_python(smooth_normal)(np.uint32(7), 5, 9, 240, 1, AXIAL) == from_python(normal)(np.uint32(7), 9 * 240 + 5, AXIAL)


def test_a_surface_that_is_nearly_too_dark_is_lost_in_blobs() -> None:
    sensed, _ = read([wall(2.0)], NARROW, model="kinect_v1", signal_min=0.125)  # half white at 2 m returns an eighth
    holes = np.isnan(sensed)
    _, count = ndimage.label(holes, _BLOB)
    assert 0.2 < holes.mean() < 0.8
    assert holes.sum() / count > 40.0
    alone = ndimage.convolve(holes.astype(int), _BLOB.astype(int), mode="nearest")
    assert not (holes & (alone == 1)).any()


def test_edges_leave_few_holes_and_noise_about_local_planes_is_less_than_the_whole() -> None:
    sensed, true = read([wall(2.0), plate(1.0, (0.0, -0.2), (0.2, 0.2))], NARROW, model="kinect_v1")
    _, count = ndimage.label(np.isnan(sensed), _BLOB)
    assert count <= 12
    sensed, true = read([wall(1.0)], NARROW, model="kinect_v1")
    rows, columns = np.mgrid[0:15, 0:15]
    plane = np.column_stack([rows.ravel(), columns.ravel(), np.ones(225)])
    left = []
    for y in range(20, sensed.shape[0] - 40, 20):
        for x in range(60, sensed.shape[1] - 80, 20):
            patch = sensed[y : y + 15, x : x + 15].ravel()
            left.append((patch - plane @ np.linalg.lstsq(plane, patch, rcond=None)[0]).std())
    whole = np.nanstd((sensed - true)[10:-10, 60:-60])
    assert 0.6 < np.median(left) / whole < 0.95


def test_the_majority_decides_and_the_nearest_fills() -> None:
    read_depth = np.full((8, 9), np.nan, np.float32)
    read_depth[:, :4] = np.arange(4, dtype=np.float32) + 1.0
    read_depth[3, 2], read_depth[5, 7] = np.nan, 9.0
    result = np.empty_like(read_depth)
    remove_specks(read_depth, 3, result, 0, 1)
    assert np.isnan(result[:, 5:]).all() and result[3, 2] == 3.0
    assert np.array_equal(np.isnan(result[:, :4]), np.zeros((8, 4), bool)) and (result[:, 0] == 1.0).all()
    halves = np.empty_like(read_depth)
    for first in range(2):
        remove_specks(read_depth, 3, halves, first, 2)
    assert halves.tobytes() == result.tobytes()
