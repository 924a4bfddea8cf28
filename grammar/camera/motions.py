"""The kinds of motion: what a body does in a room, and the camera's poses on it."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from grammar.camera.camera_path import CameraSpace, CameraTimes, sample_camera_path
from grammar.camera.carried import CARRIERS, carried_motion
from grammar.camera.driven import driven_motion, turned_motion
from grammar.camera.motion_config import MotionConfig
from grammar.camera.motion_plan import SECOND_NS, MotionPlan, poses_of
from grammar.camera.path_config import CameraPathConfig
from grammar.spec.rules import GrammarError
from scene_description import CameraPose, FieldError, error_line
from scene_description.kinematics import multiply
from scene_description.motion import Motion
from scene_description.motion_of_poses import link_turns, motion_of_poses
from scene_description.poses import LINK_FROM_OPTICAL
from scene_description.tum_trajectory import read_tum_trajectory

_EVEN_S = 2e-6


def _given_motion(rng: np.random.Generator, plan: MotionPlan) -> Motion:
    """Return the motion along the user's own path.

    Raises:
        GrammarError: the file is none of a trajectory.
    """
    del rng
    path = Path(plan.config.file)
    try:
        poses = read_tum_trajectory(path, GrammarError)
    except OSError as error:
        raise GrammarError(f"motion.file: {error_line(error)}") from None
    except FieldError as error:
        raise GrammarError(f"motion.file: {error}") from None
    return motion_of_poses(_even(poses), plan.config.camera_m)


def _even(poses: Sequence[CameraPose]) -> Sequence[CameraPose]:
    """Return poses that are a time apart: as they are, or on the smoothest curve through them, twice as many."""
    times = np.array([pose.stamp_ns - poses[0].stamp_ns for pose in poses]) / SECOND_NS
    even = np.linspace(0.0, times[-1], len(poses))
    if np.abs(times - even).max() < _EVEN_S:
        return poses
    from scipy.interpolate import CubicSpline  # as long to import as the rest of scipy

    values = np.hstack([np.array([pose.position_m for pose in poses]), link_turns(poses)])
    count = 2 * len(poses)  # more, so that what lies close together is not lost
    even = np.linspace(0.0, times[-1], count)
    found = CubicSpline(times, values, bc_type="natural")(even)
    optical = multiply(found[:, 3:] / np.linalg.norm(found[:, 3:], axis=1, keepdims=True), np.array([LINK_FROM_OPTICAL]))
    stamps = [poses[0].stamp_ns + round(at * SECOND_NS) for at in even.tolist()]
    return [
        CameraPose(stamp_ns=stamp, position_m=(x, y, z), orientation=(qx, qy, qz, qw))
        for stamp, (x, y, z), (qx, qy, qz, qw) in zip(stamps, found[:, :3].tolist(), optical.tolist(), strict=True)
    ]


MOTIONS: Mapping[str, Callable[[np.random.Generator, MotionPlan], Motion]] = {
    **dict.fromkeys(CARRIERS, carried_motion),
    "base": driven_motion,
    "turntable": turned_motion,
    "file": _given_motion,
}
"""Kind of motion -> what samples it; a walk has none."""


def sample_motion(
    rng: np.random.Generator, config: MotionConfig, path: CameraPathConfig, space: CameraSpace, times: CameraTimes
) -> tuple[tuple[CameraPose, ...], Motion | None]:
    """Sample how the camera moves: its poses, one a frame, and the motion of the body that carries it, None of a walk.

    Raises:
        GrammarError: the motion cannot be made: no floor for a base, a file that is none.
    """
    make = MOTIONS.get(config.kind)
    if make is None:
        return sample_camera_path(rng, path, space, times), None
    stamps = [times.start_ns + round((times.first_index + k) * SECOND_NS / times.rate_hz) for k in range(times.frames)]
    motion = make(rng, MotionPlan(config, path, space, (stamps[-1] - stamps[0]) / SECOND_NS))
    return poses_of(motion, stamps), motion
