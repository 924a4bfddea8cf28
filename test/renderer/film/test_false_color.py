"""Layers as pictures for people."""

import numpy as np
from sample_scene import sample_scene

from renderer.film.false_color import (
    NO_SHARE,
    angle_to_grey,
    classes_to_color,
    depth_to_color,
    exposed_to_color,
    noise_to_grey,
    normals_to_color,
    objects_to_color,
    share_to_grey,
)
from scene_description.labels import instance_labels, instance_palette


def test_normals_for_people() -> None:
    normals = np.array([[[1, 0, 0], [0, -1, 0], [0, 0, -1], [0, 0, 0]]], np.float32)
    assert normals_to_color(normals).tolist() == [[[255, 128, 128], [128, 0, 128], [128, 128, 0], [0, 0, 0]]]


def test_ids_for_people_are_the_standard_colours() -> None:
    assert classes_to_color(np.array([[4, 0]], np.uint8)).tolist() == [[[255, 187, 120], [0, 0, 0]]]


def test_every_object_id_has_a_colour_and_no_object_is_black() -> None:
    ids = np.array([[0, 1, 65_535]], np.uint16)
    assert objects_to_color(ids).tolist() == [[[0, 0, 0], *instance_palette(65_536)[[1, 65_535]].tolist()]]
    assert instance_labels(sample_scene())[3]["color"] == objects_to_color(np.array([[3]], np.uint16))[0, 0].tolist()


def test_the_mean_of_linear_colour_is_shown_as_middle_grey() -> None:
    assert (exposed_to_color(np.full((2, 3, 3), 731.0, np.float32)) == 118).all(), "0.18 in sRGB"
    assert (exposed_to_color(np.zeros((2, 3, 3), np.float32)) == 0).all()


def test_noise_is_shown_as_deviation_and_one_sample_as_black() -> None:
    variance = np.zeros((1, 200, 3), np.float32)
    variance[0, 100:] = 4.0
    variance[0, 50:100] = 1.0
    assert noise_to_grey(variance)[0, [0, 60, 150]].tolist() == [0, 128, 255]
    assert (noise_to_grey(np.full((2, 2, 3), np.nan, np.float32)) == 0).all()


def test_depth_for_people_runs_from_near_to_far_and_is_black_without_a_hit() -> None:
    color = depth_to_color(np.array([[0.0, 5.0, 9.0, np.inf, np.nan]], np.float32), 5.0)
    assert color[0, 0].tolist() == [48, 18, 59]
    assert color[0, 1].tolist() == color[0, 2].tolist() == [122, 5, 3]
    assert color[0, 3].tolist() == color[0, 4].tolist() == [0, 0, 0]


def test_shares_run_from_black_to_white_and_what_is_none_is_blue() -> None:
    assert share_to_grey(np.array([[0.0, 0.5, 1.0, np.nan]], np.float32)).tolist() == [[[0] * 3, [128] * 3, [255] * 3, [40, 60, 140]]]


def test_angles_are_black_head_on_and_white_at_a_right_angle() -> None:
    grey = angle_to_grey(np.array([[0.0, np.pi / 4, np.pi / 2, np.nan]], np.float32))
    assert grey[0, :3].tolist() == [[0, 0, 0], [128, 128, 128], [255, 255, 255]] and grey[0, 3].tolist() == list(NO_SHARE)
