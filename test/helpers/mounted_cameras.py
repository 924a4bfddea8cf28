"""Two lenses, and cameras with them on a body."""

import cv2
import numpy as np

from scene_synth_ros.convert.camera import Lens
from scene_synth_ros.convert.formats.rig import MountedCamera

PINHOLE = Lens("pinhole", 480, 360, 342.5, 343.0, 239.5, 179.5, ())
FISHEYE = Lens("kannala_brandt", 480, 360, 142.5, 143.0, 239.5, 179.5, (0.1, 0.02, -0.003, 0.0004))


def mounted(lens: Lens, x: float) -> MountedCamera:
    turn = cv2.Rodrigues(np.array([0.1, -0.2, 0.3]))[0]
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn, turn @ (x, 0.0, 0.0) + (0.02, 0.06, 0.0)
    return MountedCamera(lens, matrix, 20.0)
