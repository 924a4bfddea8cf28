"""Poses: known rotations, round trips, the two camera frames."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scene_description.poses import (
    LINK_FROM_OPTICAL,
    Quaternion,
    conjugate_quaternion,
    look_at,
    multiply_quaternions,
    quaternion_from_rotation,
    quaternion_from_yaw,
    rotation_from_quaternion,
    world_from_optical,
)

X, Y, Z = np.eye(3)

directions = st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: math.hypot(*q) > 0.1)


def unit(q: tuple[float, ...]) -> Quaternion:
    a, b, c, d = (item / math.hypot(*q) for item in q)
    return (a, b, c, d)


@pytest.mark.parametrize(
    ("yaw_rad", "x_goes_to"), [(0.0, X), (math.pi / 2, Y), (math.pi, -X), (-math.pi / 2, -Y), (math.pi / 6, [math.sqrt(0.75), 0.5, 0.0])]
)
def test_yaw_turns_the_front_counter_clockwise(yaw_rad: float, x_goes_to: object) -> None:
    rotation = rotation_from_quaternion(quaternion_from_yaw(yaw_rad))
    np.testing.assert_allclose(rotation @ X, x_goes_to, atol=1e-15)
    np.testing.assert_allclose(rotation @ Z, Z, atol=1e-15)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_half_turns_are_found_from_their_matrices(axis: int) -> None:
    matrix = -np.eye(3)
    matrix[axis, axis] = 1.0
    expected = np.zeros(4)
    expected[axis] = 1.0
    np.testing.assert_allclose(np.abs(quaternion_from_rotation(matrix)), expected, atol=1e-15)


@given(directions)
def test_quaternion_and_matrix_round_trip(q: tuple[float, ...]) -> None:
    rotation = rotation_from_quaternion(unit(q))
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(rotation) == pytest.approx(1.0)
    back = quaternion_from_rotation(rotation)
    assert back[3] >= 0.0
    np.testing.assert_allclose(rotation_from_quaternion(back), rotation, atol=1e-12)


@given(directions, directions)
def test_product_composes_and_conjugate_inverts(a: tuple[float, ...], b: tuple[float, ...]) -> None:
    p, q = unit(a), unit(b)
    product = rotation_from_quaternion(multiply_quaternions(p, q))
    np.testing.assert_allclose(product, rotation_from_quaternion(p) @ rotation_from_quaternion(q), atol=1e-12)
    np.testing.assert_allclose(multiply_quaternions(p, conjugate_quaternion(p)), (0.0, 0.0, 0.0, 1.0), atol=1e-12)


def test_optical_axes_lie_in_the_link_as_rep_103_says() -> None:
    link_from_optical = rotation_from_quaternion(LINK_FROM_OPTICAL)
    np.testing.assert_allclose(link_from_optical @ Z, X, atol=1e-15)
    np.testing.assert_allclose(link_from_optical @ X, -Y, atol=1e-15)
    np.testing.assert_allclose(link_from_optical @ Y, -Z, atol=1e-15)


def test_looking_along_x_is_the_link_at_rest() -> None:
    along_x = look_at((1.0, 2.0, 3.0), (5.0, 2.0, 3.0))
    np.testing.assert_allclose(rotation_from_quaternion(along_x), rotation_from_quaternion(LINK_FROM_OPTICAL))


@given(st.tuples(*[st.floats(-5.0, 5.0)] * 3), st.tuples(*[st.floats(-5.0, 5.0)] * 3))
def test_look_at_points_forward_with_a_level_horizon(eye: tuple[float, float, float], target: tuple[float, float, float]) -> None:
    if math.dist(eye[:2], target[:2]) < 1e-3:
        return
    right, down, forward = rotation_from_quaternion(look_at(eye, target)).T
    direction = np.subtract(target, eye)
    np.testing.assert_allclose(forward, direction / np.linalg.norm(direction), atol=1e-9)
    assert abs(right[2]) < 1e-9
    assert down[2] < 0.0


@pytest.mark.parametrize("target", [(0.0, 0.0, 0.0), (0.0, 0.0, 2.0)])
def test_look_at_refuses_directions_without_horizon(target: tuple[float, float, float]) -> None:
    with pytest.raises(ValueError, match="no horizon"):
        look_at((0.0, 0.0, 0.0), target)


def test_world_from_optical_moves_points_in_front_of_the_camera() -> None:
    matrix = world_from_optical((1.0, 2.0, 1.5), look_at((1.0, 2.0, 1.5), (1.0, 5.0, 1.5)))
    np.testing.assert_allclose(matrix @ (0.0, 0.0, 2.0, 1.0), (1.0, 4.0, 1.5, 1.0), atol=1e-12)
    np.testing.assert_allclose(matrix @ (0.5, 0.25, 0.0, 1.0), (1.5, 2.0, 1.25, 1.0), atol=1e-12)
