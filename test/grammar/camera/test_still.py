"""Single pictures: where a photographer's arms reach, and the pitch that suits what there is to see."""

import math

import numpy as np
import pytest

from grammar.camera.camera_path import CameraSpace
from grammar.camera.path_config import read_camera_path_config
from grammar.camera.still import best_shot, places_in_reach
from grammar.geometry.boxes import NO_BOXES
from scene_description.share import config_path

CONFIG = read_camera_path_config(config_path("camera.yaml")).for_still(12.0)
ROOM = np.array([(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)])
BED = np.array([[1.0, 1.5, 0.0, 0.5, 1.0, 1.5, 1.0, 0.0]])
"""2 m by 3 m, along one side of the room."""


def test_the_lens_reaches_over_furniture_as_far_as_arms_do_and_into_corners() -> None:
    places = places_in_reach(ROOM, BED, 1.5, CONFIG)
    reserve_m = 0.75 * CONFIG.resolution_m
    over_bed = 2.0 + CONFIG.body_radius_m - CONFIG.still.reach_m
    assert places[:, 0].min() == pytest.approx(over_bed, abs=1.5 * CONFIG.resolution_m)
    for axis, far_m in ((0, 4.0), (1, 3.0)):
        assert far_m - places[:, axis].max() == pytest.approx(CONFIG.clearance_m + reserve_m, abs=CONFIG.resolution_m)
        assert far_m - places[:, axis].max() >= CONFIG.clearance_m


def test_without_a_place_to_stand_the_lens_goes_wherever_it_is_free() -> None:
    shelves = np.array([[2.0, 1.5, 0.0, 1.0, 2.0, 1.5, 1.0, 0.0]])
    places = places_in_reach(ROOM, shelves, 1.5, CONFIG)
    assert np.ptp(places, axis=0) == pytest.approx([4.0 - 2 * 0.14, 3.0 - 2 * 0.14], abs=0.1)
    blocks = np.array([[2.0, 1.5, 0.0, 3.0, 1.99, 1.49, 1.0, 0.0]])
    assert places_in_reach(ROOM, blocks, 1.5, CONFIG).shape == (1, 2)


@pytest.mark.parametrize(("low_m", "high_m", "sign"), [(0.0, 0.3, -1.0), (2.2, 2.5, 1.0)])
def test_the_camera_is_tilted_to_what_there_is(low_m: float, high_m: float, sign: float) -> None:
    boxes = np.array([[3.7, y, low_m, high_m, 0.2, 0.2, 1.0, 0.0] for y in (0.5, 1.0, 1.5, 2.0, 2.5)])
    views = CameraSpace(ROOM, 2.6, boxes).views(CONFIG, 1.4)
    shot = best_shot(np.random.default_rng(1), views, np.array([[0.3, 1.5]]))
    middle = float(np.median(CONFIG.still.pitches_rad))
    assert abs(math.remainder(shot.yaw_rad, 2.0 * math.pi)) < 0.4
    assert sign * (shot.pitch_rad - middle) > 0.0


def test_an_empty_room_has_a_picture() -> None:
    views = CameraSpace(ROOM, 2.6, NO_BOXES).views(CONFIG, 1.4)
    shot = best_shot(np.random.default_rng(1), views, places_in_reach(ROOM, NO_BOXES, 1.4, CONFIG))
    assert shot.pitch_rad in CONFIG.still.pitches_rad
    assert (shot.place_m > 0.0).all() and (shot.place_m < ROOM[2]).all()
