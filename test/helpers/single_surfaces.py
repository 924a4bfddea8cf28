"""Frames of single surfaces, straight ahead, by the cached integrator."""

import numpy as np
from box_room import DARK, pose, scene
from cached_rooms import look_up

from renderer import CameraConfig

NARROW = CameraConfig(width=32, height=24, horizontal_fov_rad=0.1)
AHEAD = pose((0, 0, 0), (0, 1, 0))


def seen(*pieces, view=AHEAD, sky=DARK, **settings):
    image = look_up(scene(*pieces, sky=sky), view, camera=NARROW, **settings).radiance.astype(float)
    assert np.isfinite(image).all() and (image >= 0).all()
    return image
