"""Colours of points in pictures: what noise explains is no fault, what lies in another frame is."""

import numpy as np

from scene_synth_ros.prove.pictures import ratio_of_colors


def differences(rng: np.random.Generator, points: int, lit: float, shifted: float) -> dict[int, np.ndarray]:
    """Pictures of one sample, some of whose pixels are white and the others black, and codes more where they are of another frame."""
    return {shift: 255.0 * (rng.random(points) < lit) + (shifted if shift == 0 else 0.0) for shift in (-1, 0, 1)}


def test_a_hundred_points_of_black_and_white_noise_are_no_fault() -> None:
    ratios = [ratio_of_colors(differences(np.random.default_rng(seed), 97, 0.25, 0.0)) for seed in range(200)]
    assert max(ratios) < 1.15


def test_points_whose_colours_are_those_of_another_frame_are_a_fault_in_noise_too() -> None:
    errors = differences(np.random.default_rng(3), 2000, 0.02, 12.0)
    assert ratio_of_colors(errors) > 1.15
    assert ratio_of_colors({-1: np.full(97, 2.0), 0: np.full(97, 9.0), 1: np.full(97, 8.0)}) > 1.15
