"""The base of a room that velocities drive, frame by frame."""

from collections.abc import Callable, Sequence

import numpy as np

from renderer.body.driving import BaseDriver, DriveLimits
from renderer.body.obstacles import Obstacles
from renderer.camera.config import CameraConfig
from renderer.camera.rig import CarriedPath
from renderer.geometry.mesh import Mesh
from scene_description import CameraPose, SceneDescription
from scene_description.motion import Motion
from scene_synth_ros.messages.driven_base import frame_path, frame_spacing_ns, horizon_s, rig_of
from scene_synth_ros.messages.frame_messages import StreamConfig
from scene_synth_ros.messages.frame_settings import DrivePart
from scene_synth_ros.messages.senses import Senses
from scene_synth_ros.render.teleop import DriveConfig, Velocity

_STEP_M = 0.025
"""What wheels climb: rugs and thresholds are lower."""
_MAST_M = 0.05
"""How much higher than the highest of its sensors a robot is."""
_NS = 1e-9


def can_be_driven(scene: SceneDescription, senses: Senses) -> bool:
    """Return whether a room's camera is on a base with wheels that is told of here."""
    return senses.tells_body and scene.motion is not None and scene.motion.drive is not None and scene.motion.kind == "base"


class DrivenBase:
    """Drives a base from frame to frame; until a velocity comes it stands where its path begins.

    Threading: the rendering thread.

    Attributes:
        motion: what is known of it, from before the frame before until all has ended that begins by the frame.
        part: what the newest frame tells of it.
    """

    def __init__(
        self, scene: SceneDescription, mesh: Callable[[], Mesh], camera: CameraConfig, streams: StreamConfig, senses: Senses
    ) -> None:
        assert scene.motion is not None
        self._scene, self._mesh, self._camera, self._streams, self._senses = scene, mesh, camera, streams, senses
        self._driver: BaseDriver | None = None
        self._start_ns = self._before_ns = scene.camera_path[0].stamp_ns
        self._horizon_s = horizon_s(scene, camera, streams, senses)
        self._told = 0
        self.motion: Motion = scene.motion
        self.part: DrivePart | None = None

    def advance(self, stamp_ns: int, velocity: Callable[[float], Velocity], config: DriveConfig) -> CameraPose:
        """Go on to a frame; return where the camera's rig is then.

        ``velocity``: returns that which holds, given how much time (s) has passed; ``config``: its limits count from the first frame on.
        """
        if self._driver is None:
            limits = DriveLimits(*(getattr(config, name) for name in DriveLimits._fields))
            self._driver = BaseDriver(self.motion, limits, self._obstacles())
        driver, asked = self._driver, velocity((stamp_ns - self._before_ns) * _NS)
        driver.drive((stamp_ns - self._start_ns) * _NS + self._horizon_s, asked.forward_m_s, asked.yaw_rad_s)
        imu_s = max(self._senses.imu.clock_offset_s, 0.0) + 2.0 / self._senses.imu.rate_hz
        since_ns = min(self._before_ns, stamp_ns - frame_spacing_ns(self._scene)) - self._start_ns
        self.motion = driver.motion_since(since_ns * _NS - imu_s - 0.1)
        self.part = DrivePart(
            first=self._told, distances_m=tuple(driver.distances_m[self._told :]), headings_rad=tuple(driver.headings_rad[self._told :])
        )
        self._told, self._before_ns = len(driver.distances_m), stamp_ns
        return self.rig.at(stamp_ns)

    @property
    def rig(self) -> CarriedPath:
        """Where the camera's rig goes, as far as it is known."""
        return rig_of(self._scene, self.motion)

    def camera_path(self, stamp_ns: int) -> Sequence[CameraPose]:
        """Return the camera's path about a frame."""
        return frame_path(self._scene, self._camera, self._streams, self.motion, stamp_ns)

    def _obstacles(self) -> Obstacles:
        assert self._scene.motion is not None
        tops = [self._scene.motion.camera_m[2], *(sense.mount_m[2] for sense in (self._senses.imu, self._senses.lidar) if sense.enabled)]
        outline = np.array(self._scene.room.polygon_m, np.float64)
        return Obstacles.between(self._mesh(), outline, _STEP_M, max(tops) + _MAST_M)
