"""Wear: where its layers lie, what they do there, and that wide cones see the mean."""

from dataclasses import replace

import numpy as np
import pytest
from numba import njit

from renderer.core import lanes as ln
from renderer.core.ray_packet import LANES
from renderer.textures import wear as wr
from renderer.textures.wear import Wear, tabulate_wear
from scene_description import WearLayer

GRIME = WearLayer(
    pattern="cloud", size_m=1.6, low_m=0.0, high_m=0.1, fade_m=0.1, faces="side", color=(0.1, 0.1, 0.1), strength=0.8, roughness=0.2
)
apply_wear = wr.apply_wear


@njit
def worn(wear, amount, lanes, points, normal, width):
    rows = np.zeros((len(points), 2), np.float32)
    for i in range(len(points)):
        for axis in range(3):
            lanes[ln.P_X + LANES * axis], lanes[ln.NG_X + LANES * axis] = points[i, axis], normal[axis]
            lanes[ln.BASE_R + LANES * axis] = np.float32(0.9)
        lanes[ln.ROUGHNESS], lanes[ln.METALLIC], lanes[ln.WIDTH] = np.float32(0.5), np.float32(0.0), width
        apply_wear(wear, amount, 0, lanes)
        rows[i, 0], rows[i, 1] = lanes[ln.BASE_R], lanes[ln.ROUGHNESS]
    return rows


def looks(layer: WearLayer, heights: np.ndarray, normal=(1.0, 0.0, 0.0), width=1e-4, amount=1.0) -> np.ndarray:
    """Base colour and roughness of 0.9 and 0.5 after wear, at points on a strip of wall, by height (h, n, 2)."""
    along = np.linspace(-3.0, 3.0, 3000)
    points = np.array([(0.4, y, z) for z in heights for y in along], np.float32)
    found = worn(
        tabulate_wear((layer,)), np.float32(amount), np.zeros(ln.LANES_SIZE, np.float32), points, np.float32(normal), np.float32(width)
    )
    return found.reshape(len(heights), len(along), 2)


def test_a_layer_lies_between_its_heights_on_the_faces_it_is_for() -> None:
    color = looks(GRIME, np.array([0.05, 0.15, 0.25]))[..., 0]
    assert color[0].mean() < 0.85 and color[0].mean() < color[1].mean() < 0.9
    np.testing.assert_allclose(color[2], 0.9)
    np.testing.assert_allclose(looks(GRIME, np.array([0.05]), (0.0, 0.0, 1.0))[..., 0], 0.9)
    np.testing.assert_allclose(looks(GRIME, np.array([0.05]), amount=0.0)[..., 0], 0.9)


def test_colour_and_roughness_change_by_one_coverage() -> None:
    found = looks(GRIME, np.array([0.05]))[0].astype(np.float64)
    covered = (found[:, 1] - 0.5) / 0.2
    np.testing.assert_allclose(found[:, 0], 0.9 - 0.8 * 0.8 * covered, atol=1e-5)
    assert covered.min() >= 0.0 and covered.max() <= 1.0 and covered.std() > 0.1


def test_wide_cones_see_the_mean_of_the_pattern() -> None:
    mean = tabulate_wear((GRIME,)).layers[0, wr.MEAN]
    np.testing.assert_allclose(looks(GRIME, np.array([0.05]), width=1.0)[..., 0], 0.9 - 0.8 * 0.8 * mean, atol=1e-4)


@pytest.mark.parametrize("roughest", [0.4, 0.6])
def test_traces_on_gloss_leave_rough_surfaces_alone(roughest: float) -> None:
    found = looks(replace(GRIME, roughest=roughest), np.array([0.05]))[0, :, 1]
    assert (found.max() > 0.5) == (roughest > 0.5)


def test_new_rooms_have_no_layers() -> None:
    assert isinstance(tabulate_wear(()), Wear) and len(tabulate_wear(()).layers) == 0
