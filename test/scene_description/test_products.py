"""Products in one order against numpy's own, and matrices whose inverse is known."""

import numpy as np
import pytest

from scene_description.products import determinant, dot, inverse, matmul, norm

RNG = np.random.default_rng(5)


@pytest.mark.parametrize(
    ("first", "second"),
    [
        *[((3,), (3,)), ((3, 3), (3,)), ((3,), (3, 2)), ((50, 3), (3, 3)), ((4, 20), (20, 30))],
        *[((9,), (9,)), ((7, 1, 3), (7, 3, 3)), ((0, 3), (3, 3))],
    ],
)
def test_a_product_has_the_shape_and_the_values_of_numpys(first: tuple[int, ...], second: tuple[int, ...]) -> None:
    a, b = RNG.normal(size=first), RNG.normal(size=second)
    found = matmul(a, b)
    assert np.shape(found) == np.shape(a @ b)
    np.testing.assert_allclose(found, a @ b, rtol=1e-12, atol=1e-12)


def test_terms_are_added_from_the_first_to_the_last() -> None:
    large = 2.0**53
    assert dot([large, 1.0, 1.0], [1.0, 1.0, 1.0]) == large
    assert dot([1.0, 1.0, large], [1.0, 1.0, 1.0]) == large + 2.0
    assert matmul(np.array([[1.0, 1.0, large]], np.float32), np.ones((3, 1), np.float32)).dtype == np.float32


def test_inverse_and_determinant_of_a_known_matrix() -> None:
    matrix = np.array([[2.0, 0.0, 1.0], [0.0, 4.0, 0.0], [1.0, 0.0, 1.0]])
    assert determinant(matrix) == 4.0
    assert inverse(matrix).tolist() == [[1.0, 0.0, -1.0], [0.0, 0.25, 0.0], [-1.0, 0.0, 2.0]]
    assert norm((3.0, 4.0, 12.0)) == 13.0


def test_a_product_with_a_vector_has_the_wider_type_of_the_two() -> None:
    rows, weights = np.full((5, 3), 0.1, np.float32), np.array([0.3, 0.5, 0.2])
    for product in (dot(rows, weights), matmul(rows, weights), dot(weights, rows), dot(rows, weights.tolist())):
        assert product.dtype == np.float64
        np.testing.assert_array_equal(product, dot(rows.astype(np.float64), weights))
