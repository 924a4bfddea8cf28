"""Layers as pictures for people."""

import numpy as np

from renderer.film.false_color import depth_to_color, ids_to_color, normals_to_color
from scene_description.labels import label_palette


def test_normals_for_people() -> None:
    normals = np.array([[[1, 0, 0], [0, -1, 0], [0, 0, -1], [0, 0, 0]]], np.float32)
    assert normals_to_color(normals).tolist() == [[[255, 128, 128], [128, 0, 128], [128, 128, 0], [0, 0, 0]]]


def test_ids_for_people_are_the_standard_colours() -> None:
    assert ids_to_color(np.array([[4, 0]], np.uint8), label_palette()).tolist() == [[[255, 187, 120], [0, 0, 0]]]


def test_depth_for_people_runs_from_near_to_far_and_is_black_without_a_hit() -> None:
    color = depth_to_color(np.array([[0.0, 5.0, 9.0, np.inf, np.nan]], np.float32), 5.0)
    assert color[0, 0].tolist() == [48, 18, 59]
    assert color[0, 1].tolist() == color[0, 2].tolist() == [122, 5, 3]
    assert color[0, 3].tolist() == color[0, 4].tolist() == [0, 0, 0]
