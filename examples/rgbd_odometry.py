"""RGB-D odometry of Open3D, for ``scene_synth evaluate``: what the camera and the depth sensor read, from frame to frame.

scene_synth evaluate BAG --task poses --algorithm examples/rgbd_odometry.py:Hybrid

``Color`` aligns colours (Steinbruecker, Sturm and Cremers, ICCV Workshops 2011), ``Hybrid`` colours and depths (Park, Zhou and Koltun,
ICCV 2017).  Both start each step from rest, and take one that does not converge, or leaps, as rest.  Needs the extra ``examples``.
"""

import os

import numpy as np

os.environ.setdefault("OMP_NUM_THREADS", "1")  # small images are slower on several threads; read when Open3D is loaded
import open3d as o3d

FARTHEST_M = 5.0
LONGEST_STEP_M, GREATEST_TURN_RAD = 0.6, 0.5
OPTION = o3d.pipelines.odometry.OdometryOption(depth_min=0.4, depth_max=FARTHEST_M, depth_diff_max=0.07)


def plausible(motion):
    """Say whether a hand or a robot may have moved the camera so between two frames."""
    turn_rad = np.arccos(np.clip((np.trace(motion[:3, :3]) - 1.0) / 2.0, -1.0, 1.0))
    return np.linalg.norm(motion[:3, 3]) < LONGEST_STEP_M and turn_rad < GREATEST_TURN_RAD


class Odometry:
    """Poses of one room, in the frame of its first view."""

    inputs = ("color_sensed", "depth_sensed")
    jacobian = o3d.pipelines.odometry.RGBDOdometryJacobianFromHybridTerm

    def __init__(self):
        """Begin a room."""
        self.pose, self.before = np.eye(4), None

    def __call__(self, frame):
        """Return the pose of the camera's optical frame in that of the first view."""
        depth = frame.images["depth_sensed"]
        depth = np.where(np.isfinite(depth) & (depth > 0.0), depth, 0.0).astype(np.float32)
        now = o3d.geometry.RGBDImage.create_from_color_and_depth(
            o3d.geometry.Image(np.ascontiguousarray(frame.images["color_sensed"])),
            o3d.geometry.Image(depth),
            depth_scale=1.0,
            depth_trunc=FARTHEST_M,
        )
        if self.before is not None:
            k = frame.K
            lens = o3d.camera.PinholeCameraIntrinsic(frame.width, frame.height, k[0, 0], k[1, 1], k[0, 2], k[1, 2])
            converged, before_from_now, _ = o3d.pipelines.odometry.compute_rgbd_odometry(
                now, self.before, lens, np.eye(4), self.jacobian(), OPTION
            )
            if converged and plausible(before_from_now):
                self.pose = self.pose @ before_from_now
        self.before = now
        return {"poses": self.pose}


class Color(Odometry):
    """Colours alone: what is textured pulls the images together."""

    jacobian = o3d.pipelines.odometry.RGBDOdometryJacobianFromColorTerm


class Hybrid(Odometry):
    """Colours and depths: shapes hold what has no texture."""
