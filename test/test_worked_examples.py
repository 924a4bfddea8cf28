"""The algorithms of the worked examples on images whose depth and motion are known."""

from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from examples.orb_odometry import Equalized, Orb
from examples.stereo_matching import Block, SemiGlobal

WIDTH, HEIGHT, FOCAL_PX, BASELINE_M = 320, 240, 250.0, 0.12
K = np.array([[FOCAL_PX, 0.0, 159.5], [0.0, FOCAL_PX, 119.5], [0.0, 0.0, 1.0]])


def pattern(shift_px: int, contrast: float = 1.0) -> np.ndarray:
    """Return (height, width, 3) uint8: blots of random grey, moved to the left."""
    blots = np.random.default_rng(1).integers(0, 256, (HEIGHT // 4, WIDTH // 4 + 32), np.uint8)
    grey = cv2.resize(blots, None, fx=4, fy=4, interpolation=cv2.INTER_CUBIC)[:, shift_px : shift_px + WIDTH]
    return np.repeat((grey * contrast).astype(np.uint8)[:, :, None], 3, axis=2)


@pytest.mark.parametrize("algorithm", [SemiGlobal, Block])
def test_a_wall_that_is_seen_ten_pixels_apart_is_three_metres_away(algorithm: type) -> None:
    projection = np.zeros((3, 4))
    projection[0, 3] = -FOCAL_PX * BASELINE_M
    images = {"left/color_sensed": pattern(0), "right/color_sensed": pattern(10)}
    depth = algorithm()(SimpleNamespace(images=images, projections={"right/color_sensed": projection}))["depth"]
    assert np.nanmedian(depth) == pytest.approx(3.0, abs=0.01)
    assert np.isfinite(depth[40:200, 80:300]).mean() > 0.95


def view(shift_px: int, contrast: float = 1.0) -> SimpleNamespace:
    """Return a frame of a wall 2 m away."""
    return SimpleNamespace(images={"color_sensed": pattern(shift_px, contrast), "depth": np.full((HEIGHT, WIDTH), 2.0, np.float32)}, K=K)


@pytest.mark.parametrize("algorithm", [Orb, Equalized])
def test_the_camera_moves_by_what_the_wall_moves(algorithm: type) -> None:
    odometry = algorithm()
    np.testing.assert_array_equal(odometry(view(0))["poses"], np.eye(4))
    pose = odometry(view(12))["poses"]
    assert pose[:3, 3] == pytest.approx([12 * 2.0 / FOCAL_PX, 0.0, 0.0], abs=0.01)
    assert pose[:3, :3] == pytest.approx(np.eye(3), abs=0.01)


def test_a_dark_frame_has_no_pose_and_the_next_one_is_found_from_the_last_that_had() -> None:
    odometry = Orb()
    odometry(view(0))
    assert odometry(view(6, contrast=0.0)) is None
    assert odometry(view(12))["poses"][0, 3] == pytest.approx(12 * 2.0 / FOCAL_PX, abs=0.01)
