"""Small things stand by themselves: the middle of their mass is above what they stand on."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull, QhullError

from grammar.small_things.rules import read_small_things
from grammar.spec.categories import read_categories
from renderer.models import MODELS, build_model
from scene_description.share import config_path

CATEGORIES = read_categories(config_path("categories.yaml"))
THINGS = read_small_things(config_path("small_things.yaml"), CATEGORIES).things
HELD = {
    "air_grille", "broom", "calendar", "coat", "double_socket", "fuse_box", "garden_tools", "guitar", "hanging_bag", "hose_reel",
    "intercom", "key_rack", "photo_wall", "plugged_socket", "poster", "scarf", "smoke_detector", "socket", "thermostat", "tool_board",
    "umbrella", "wall_basket", "wall_hooks", "wall_mirror", "wall_plates", "wall_shelf",
}  # fmt: skip
"""They hang, lean on walls, or are built into them."""
TILT, INSIDE_M = 0.08, 0.003
"""What comes to the floor by so small a turn belongs to the foot."""
STANDING = sorted({name for name, thing in THINGS.items() if name in MODELS and name not in HELD})


@pytest.mark.parametrize("name", STANDING)
def test_the_middle_of_the_mass_is_above_the_foot(name: str) -> None:
    for style in MODELS[name].styles:
        mass, moment, low = 0.0, np.zeros(3), []
        for mesh in build_model(name, style, 1, THINGS[name].size_m).values():
            corners = mesh.vertices[mesh.faces].astype(np.float64)
            volumes = np.linalg.det(corners)
            mass, moment = mass + volumes.sum(), moment + (volumes[:, None] * corners.sum(axis=1) / 4.0).sum(axis=0)
            low.append(mesh.vertices[mesh.vertices[:, 2] < 0.5 * TILT * max(THINGS[name].size_m[:2]), :2])
        try:
            foot = ConvexHull(np.concatenate(low))
        except QhullError:
            pytest.fail(f"{name} {style} stands on a point or a line")
        inside = -(foot.equations[:, :2] @ (moment / mass)[:2] + foot.equations[:, 2]).max()
        assert inside > INSIDE_M, f"{name} {style}: its middle is {1e3 * inside:.0f} mm within its foot"
