"""Areas and centroids of outlines that can be worked out by hand."""

import pytest

from scene_description.polygons import centroid_m, distance_outside_m, signed_area_m2

L_SHAPE = ((0.0, 0.0), (4.0, 0.0), (4.0, 2.0), (2.0, 2.0), (2.0, 4.0), (0.0, 4.0))


def test_the_area_has_the_sign_of_the_sense_of_rotation() -> None:
    assert signed_area_m2(L_SHAPE) == pytest.approx(12.0)
    assert signed_area_m2(L_SHAPE[::-1]) == pytest.approx(-12.0)


def test_the_centroid_weighs_by_area() -> None:
    # a 4 x 2 m rectangle about (2, 1) and a 2 x 2 m square about (1, 3)
    for outline in (L_SHAPE, L_SHAPE[::-1]):
        assert centroid_m(outline).tolist() == pytest.approx([(8 * 2 + 4 * 1) / 12, (8 * 1 + 4 * 3) / 12])


@pytest.mark.parametrize(
    ("point", "distance"),
    [((1.0, 3.0), 0.0), ((3.9, 1.9), 0.0), ((3.0, 3.0), 1.0), ((2.5, 3.0), 0.5), ((-3.0, -4.0), 5.0), ((5.0, 1.0), 1.0)],
)
def test_the_distance_from_an_outline_is_zero_within_it(point: tuple[float, float], distance: float) -> None:
    for outline in (L_SHAPE, L_SHAPE[::-1]):
        assert distance_outside_m(outline, *point) == pytest.approx(distance)
