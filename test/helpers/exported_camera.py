"""Projects world points with OpenCV through the camera that an export tells."""

from typing import Any

import cv2
import numpy as np
from convert_bag import Truth

from renderer.camera.cameras import project


def pixel_error(truth: Truth, k: Any, model: str, distortion: Any, world_from_optical: Any) -> float:
    """Return how far, at most, points of the world seen in a frame fall from their pixels (px), of at least 50 points."""
    pixels, points = truth.points()
    ahead = project(truth.config, truth.pose, points)[:, 2] > 0.05
    back = np.linalg.inv(np.asarray(world_from_optical, np.float64))
    turn, matrix = cv2.Rodrigues(back[:3, :3])[0], np.asarray(k, np.float64).reshape(3, 3)
    numbers = np.asarray(distortion, np.float64)
    lens = {"plumb_bob": cv2.projectPoints, "rational_polynomial": cv2.projectPoints, "equidistant": cv2.fisheye.projectPoints}[model]
    length = 4 if model == "equidistant" else len(numbers)
    told = lens(points[ahead][:, None], turn, back[:3, 3], matrix, numbers[:length])[0][:, 0]
    assert ahead.sum() >= 50
    return float(np.linalg.norm(told - pixels[ahead], axis=1).max())
