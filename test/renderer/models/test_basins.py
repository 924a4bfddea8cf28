"""Basins: hollows that nothing fills."""

import numpy as np
import pytest
import trimesh

from renderer.models import build_model
from renderer.models.bathroom import build_washbasin


@pytest.mark.parametrize("style", ["drawers", "doors", "vessel"])
def test_from_above_one_sees_the_bottom_of_the_bowl(style: str) -> None:
    """Nine centimetres below the rim, and a closed solid's underside below it."""
    basin = build_washbasin(np.random.default_rng(3), (0.5, 0.9, 1.0), style)["basin"]
    assert not isinstance(basin, list)
    solid = trimesh.Trimesh(basin.vertices, basin.faces, process=False)
    middle = solid.bounds[:, :2].mean(axis=0) + np.array([0.01, 0.02])
    places = solid.ray.intersects_location([[*middle, 2.0]], [[0.0, 0.0, -1.0]])[0]
    heights = np.sort(places[:, 2])[::-1]
    assert heights[0] == pytest.approx(0.86 - 0.09, abs=0.004) and len(heights) == 2 and solid.volume > 0.0


@pytest.mark.parametrize(("generator", "style"), [("storage_tub", "lidded"), ("lunch_box", "box")])
def test_what_may_be_of_clear_plastic_is_hollow(generator: str, style: str) -> None:
    """A solid one would show images of what is around, by total reflection, instead of what is behind."""
    body = build_model(generator, style, 3, (0.4, 0.5, 0.3))["body"]
    solid = trimesh.Trimesh(body.vertices, body.faces)
    assert 0.02 < solid.volume / solid.convex_hull.volume < 0.25
