"""Dark rough surfaces, of which gloss is most of the light: it comes from nearly everywhere, not from where a mirror would show it."""

import numpy as np
import pytest
from box_room import box, pose, quad, scene
from cached_rooms import look_up

from renderer import CameraConfig, RenderConfig, Renderer

CAMERA = CameraConfig(width=32, height=24, horizontal_fov_rad=0.3)
TRACED = RenderConfig(samples_per_pixel=256, max_depth=8, threads=2)


@pytest.mark.parametrize("roughness", [0.76, 0.85, 0.95])
@pytest.mark.parametrize("eye", [(1.4, 0.2, 0.8), (-1.4, 0.2, 0.8), (0.0, 0.2, 1.6)], ids=["the lamp's side", "opposite", "above"])
def test_dark_cloth_shows_a_lamp_on_every_side(roughness: float, eye: tuple[float, float, float]) -> None:
    """Gloss is more than half of its light; on the lamp's side it shows that from the back of the lobe."""
    lamp = quad((1.0, -0.4, 1.8), (0, 0.8, 0), (0.4, 0, 0), emission=(500.0,) * 3, object_id=2)
    cloth = quad((-0.3, -0.3, 0.01), (0.6, 0, 0), (0, 0.6, 0), object_id=3, color=(0.01,) * 3, roughness=roughness, ior=1.5)
    flat = scene(box((-2, -2, 0), (2, 2, 2.5), inside=True, object_id=0, color=(0.05,) * 3), lamp, cloth)
    view = pose(eye, (0, 0, 0.01))
    cached = look_up(flat, view, camera=CAMERA, layers=("radiance", "instance"))
    with Renderer(flat, CAMERA, TRACED, 5) as renderer:
        traced = renderer.render(view, 0, ("radiance",)).radiance
    seen = cached.layers["instance"] == 3
    assert 0.95 < cached.radiance[seen].mean() / traced[seen].mean() < 1.05
    bends = np.diff(cached.radiance[..., 1], n=2, axis=1)[seen[:, 2:] & seen[:, :-2]]
    assert np.abs(bends).mean() < 0.01 * cached.radiance[seen].mean(), "without the noise of rays"
