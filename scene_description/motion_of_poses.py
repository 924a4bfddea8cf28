"""The motion through given poses of a camera, even in time."""

from collections.abc import Sequence

import numpy as np

from scene_description.kinematics import Floats, conjugate, multiply, rotate
from scene_description.motion import Motion
from scene_description.poses import LINK_FROM_OPTICAL
from scene_description.types import CameraPose, SceneDescription

_ROUNDS = 300
"""Each takes at most 0.867 of the error, so all of them leave nothing of a float64."""
_BEYOND = 2


def motion_of_poses(poses: Sequence[CameraPose], camera_m: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Motion:
    """Return the motion whose camera goes through poses that are a time apart; before and after them it rests.

    ``camera_m``: place of the camera in the body, which looks along with it.
    """
    turns, places = link_turns(poses), np.array([pose.position_m for pose in poses])
    places = places - rotate(turns, np.array([camera_m]))
    spacing_s = (poses[-1].stamp_ns - poses[0].stamp_ns) * 1e-9 / (len(poses) - 1) if len(poses) > 1 else 1.0
    values = np.hstack([places, turns])
    controls = _controls(values if len(poses) > 1 else np.repeat(values, 2, axis=0)).tolist()
    return Motion(
        kind="file",
        spacing_s=spacing_s,
        positions_m=tuple((x, y, z) for x, y, z, *_ in controls),
        turns=tuple((x, y, z, w) for *_, x, y, z, w in controls),
        camera_m=camera_m,
    )


def motion_of(scene: SceneDescription) -> Motion:
    """Return how the body that carries a room's camera moves: as the room says, else through the poses of its frames."""
    return scene.motion or motion_of_poses(scene.camera_path)


def link_turns(poses: Sequence[CameraPose]) -> Floats:
    """Return the orientations (n, 4) of the links of a camera, which look along x; each on the side of the one before."""
    link = multiply(np.array([pose.orientation for pose in poses]), conjugate(np.array([LINK_FROM_OPTICAL])))
    unit = link / np.sqrt((link * link).sum(axis=1, keepdims=True))
    side = np.cumprod(np.concatenate([[1.0], np.where((unit[1:] * unit[:-1]).sum(axis=1) < 0.0, -1.0, 1.0)]))
    return np.asarray(unit * side[:, None])


def _controls(values: Floats) -> Floats:
    """Return the control points of the curve of degree 5 through values (n, k) at its knots: (n + 4, k).

    They are found by adding what is missing again and again, which converges, as the curve through values takes between 0.133 and 1 of each
    of their frequencies.  Beyond its ends the curve is taken to go on as if turned about them.
    """
    before = 2.0 * values[:1] - values[_BEYOND:0:-1] if len(values) > _BEYOND else np.repeat(values[:1], _BEYOND, axis=0)
    after = 2.0 * values[-1:] - values[-2 : -2 - _BEYOND : -1] if len(values) > _BEYOND else np.repeat(values[-1:], _BEYOND, axis=0)
    aims = np.concatenate([before, values, after])
    controls = aims.copy()
    for _ in range(_ROUNDS):
        first, last = 2.0 * controls[:1], 2.0 * controls[-1:]
        wide = np.concatenate([first - controls[2:0:-1], controls, last - controls[-2:-4:-1]])
        curve = (wide[:-4] + 26.0 * wide[1:-3] + 66.0 * wide[2:-2] + 26.0 * wide[3:-1] + wide[4:]) / 120.0
        controls += aims - curve
    return controls
