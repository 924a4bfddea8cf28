"""The material stage: what is seen is the material, textured or plain."""

import numpy as np

from renderer.material_sheet import material_sheet, render_material, stage
from renderer.scene.scene_check import check_scene
from scene_description import Material, Texture


def test_a_material_is_seen_in_its_colour_and_its_pattern() -> None:
    plain = Material(id="red", family="paint", base_color=(0.7, 0.05, 0.05))
    image = render_material(plain, 32, 8, 1).astype(np.float64)
    red = (image[..., 0] > 2.0 * image[..., 1]) & (image[..., 0] > 40)
    assert 0.2 < red.mean() < 0.8
    texture = Texture(generator="gingham", scale_m=0.2, colors=((0.02, 0.02, 0.02),))
    checked = render_material(Material(id="c", family="cloth", base_color=(0.7, 0.05, 0.05), texture=texture), 32, 8, 1)
    assert np.abs(checked.astype(np.float64) - image)[red].mean() > 15.0
    assert material_sheet([plain], 2, 16, 1).shape == (16, 32, 3)
    check_scene(stage(plain))
