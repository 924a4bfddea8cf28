"""Points of a frame in the next: relief and thin parts that lie between pixels are no fault, depth that is off is."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scene_synth_ros.dataset.camera import Camera
from scene_synth_ros.prove.film import Pair, follow, look

WIDTH, HEIGHT, FOCAL = 64, 48, 55.0
WALL_M, OUT_M, WIDE_M = 2.0, 0.06, 0.01
CAMERA = Camera(
    name="c", frame_id="f", width=WIDTH, height=HEIGHT, model="plumb_bob", D=np.zeros(0), R=np.eye(3), P=np.zeros((3, 4)),
    K=np.array([[FOCAL, 0.0, 31.5], [0.0, FOCAL, 23.5], [0.0, 0.0, 1.0]]),
)  # fmt: skip
SPOTS = np.stack(np.meshgrid(np.arange(2, WIDTH - 2), np.arange(2, HEIGHT - 2)), axis=-1).reshape(-1, 2)


def wall(x_m: float, between_m: float) -> dict[str, np.ndarray[Any, Any]]:
    """What a camera at ``x_m`` sees of a wall, left of 1 cm of object 3, with upright rods, object 2, before it, so far from each other."""
    aside = (np.arange(WIDTH) - CAMERA.K[0, 2]) / FOCAL
    rod = np.mod(5.0 + x_m + aside * (WALL_M - OUT_M), between_m) < WIDE_M
    depth = np.where(rod, WALL_M - OUT_M, WALL_M)
    instance = np.where(rod, 2, np.where(x_m + aside * WALL_M < 0.01, 3, 1))
    return {"depth": np.tile(depth, (HEIGHT, 1)), "instance": np.tile(instance.astype(np.uint16), (HEIGHT, 1))}


def pair(one: dict[str, np.ndarray[Any, Any]], two: dict[str, np.ndarray[Any, Any]], step_m: float) -> Pair:
    poses = ((np.array([x, 0.0, 0.0]), Rotation.identity()) for x in (0.0, step_m))
    first, second = (look(CAMERA, 0, pose, SPOTS, shown) for pose, shown in zip(poses, (one, two), strict=True))
    return follow(CAMERA, first, second, two)


@pytest.mark.parametrize("step_m", [0.004, 0.013, 0.021])
def test_rods_that_fall_between_pixels_are_not_before_the_wall_behind_them(step_m: float) -> None:
    found = pair(wall(0.0, 0.147), wall(step_m, 0.147), step_m)
    assert len(found.before) > 1000 and not found.before.any()


@pytest.mark.parametrize("step_m", [0.004, 0.013, 0.021])
def test_a_point_beside_a_border_may_be_of_either_object(step_m: float) -> None:
    found = pair(wall(0.0, 1e6), wall(step_m, 1e6), step_m)
    assert found.strange is not None and len(found.strange) > 1000 and not found.strange.any()


def test_depth_that_is_off_and_objects_that_are_swapped_are_found() -> None:
    right, step_m = wall(0.013, 0.147), 0.013
    far = pair(wall(0.0, 0.147), {**right, "depth": 1.02 * right["depth"]}, step_m)
    assert far.before.mean() > 0.5
    swapped = pair(wall(0.0, 0.147), {**right, "instance": right["instance"] + 10}, step_m)
    assert swapped.strange is not None and swapped.strange.all()
