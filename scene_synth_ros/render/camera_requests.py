"""Poses that are asked for and velocities that arrive while a room is rendered."""

import math
import threading
import time
from collections import deque

import numpy as np
from geometry_msgs.msg import PoseStamped, Twist
from nav_msgs.msg import OccupancyGrid

from scene_description import CameraPose
from scene_description.strict import FieldError, shorten
from scene_synth_ros.messages.stamps import NANOSECONDS
from scene_synth_ros.render.teleop import DriveConfig, DriveState, FreeFloor, Velocity, drive, drive_pose, start_drive

MAX_WAITING = 100
MAX_COORDINATE_M = 1000.0
MAX_CELLS = 16_000_000


class CameraRequests:
    """Where the camera shall be besides its path.

    Threading: the executor's thread brings poses, maps and velocities (``ask``, ``take_map``, ``take_twist``) and replaces
    ``drive_config``; the rendering thread takes poses and drives.  One lock guards the poses that wait, the floor, the velocity and the
    state of the driven camera.
    """

    def __init__(self, world_frame: str, drive_config: DriveConfig) -> None:
        self._world_frame = world_frame
        self.drive_config = drive_config
        self._lock = threading.Lock()
        self._poses: deque[CameraPose] = deque()
        self._floor: FreeFloor | None = None
        self._velocity, self._velocity_at = Velocity(), -math.inf
        self._velocity_age_s = math.inf
        self._state: DriveState | None = None

    def ask(self, message: PoseStamped) -> None:
        """Take a pose; stamp 0 leaves the stamp to the renderer.

        Raises:
            FieldError: it is not in the world frame, no pose, or too many wait.
        """
        frame = message.header.frame_id
        if frame not in ("", self._world_frame):
            raise FieldError("pose asked for", f"frame_id '{self._world_frame}' or none", shorten(frame))
        p, q = message.pose.position, message.pose.orientation
        numbers = (p.x, p.y, p.z, q.x, q.y, q.z, q.w)
        length = math.sqrt(sum(value * value for value in numbers[3:]))
        if not all(math.isfinite(value) and abs(value) <= MAX_COORDINATE_M for value in numbers) or abs(length - 1.0) > 0.01:
            raise FieldError("pose asked for", f"a position within {MAX_COORDINATE_M:g} m and a unit quaternion", shorten(numbers))
        stamp_ns = message.header.stamp.sec * NANOSECONDS + message.header.stamp.nanosec
        if stamp_ns < 0:
            raise FieldError("pose asked for", "a stamp of at least 0", f"{stamp_ns} ns")
        x, y, z, w = (value / length for value in numbers[3:])
        with self._lock:
            if len(self._poses) >= MAX_WAITING:
                raise FieldError("pose asked for", f"at most {MAX_WAITING} waiting", f"{MAX_WAITING + 1}")
            self._poses.append(CameraPose(stamp_ns=stamp_ns, position_m=numbers[:3], orientation=(x, y, z, w)))

    def next_pose(self) -> CameraPose | None:
        """Return the pose that has waited longest."""
        with self._lock:
            return self._poses.popleft() if self._poses else None

    @property
    def waiting(self) -> bool:
        """Whether a pose waits."""
        return bool(self._poses)

    def take_map(self, message: OccupancyGrid) -> None:
        """Take the free floor of the room.

        Raises:
            FieldError: it is too large, or its sizes contradict each other.
        """
        info = message.info
        if not (
            0 < info.width * info.height == len(message.data) <= MAX_CELLS and math.isfinite(info.resolution) and info.resolution > 0.0
        ):
            got = f"{info.width} x {info.height}, {len(message.data)} cells of {info.resolution:g} m"
            raise FieldError("scene/map", f"width x height cells, at most {MAX_CELLS}", got)
        cells = np.frombuffer(message.data, np.int8).reshape(info.height, info.width)
        floor = FreeFloor.from_cells(cells, float(info.resolution), (info.origin.position.x, info.origin.position.y))
        with self._lock:
            self._floor = floor

    def take_twist(self, message: Twist) -> None:
        """Take a velocity; it holds until the next one or until it times out."""
        if self.drive_config.enabled:
            with self._lock:
                self._velocity = Velocity(message.linear.x, message.linear.y, message.linear.z, message.angular.y, message.angular.z)
                self._velocity_at, self._velocity_age_s = time.monotonic(), 0.0

    def begin_room(self) -> None:
        """Let the camera follow the path of a new room until a Twist comes."""
        with self._lock:
            self._state = None
            self._velocity_at, self._velocity_age_s = -math.inf, math.inf

    def velocity(self, seconds: float) -> Velocity:
        """Return the velocity that holds, by simulated time, of which so much has passed since it was asked for last."""
        with self._lock:
            held = self._velocity_age_s < self.drive_config.timeout_s
            self._velocity_age_s += seconds
            return self._velocity if held else Velocity()

    @property
    def driven(self) -> bool:
        """Whether the camera is off its path because it was driven, or a Twist asks for it."""
        return self.drive_config.enabled and (self._state is not None or self._is_fresh())

    def driven_pose(self, pose: CameraPose, seconds: float) -> CameraPose:
        """Return where the camera is after ``seconds`` of driving, with the stamp of ``pose``; ``pose`` itself if it is not driven."""
        with self._lock:
            if not self.drive_config.enabled or self._floor is None or (self._state is None and not self._is_fresh()):
                return pose
            state = self._state or start_drive(pose, self._floor, self.drive_config)
            if state is None:
                return pose
            velocity = self._velocity if self._is_fresh() else Velocity()
            self._state = drive(state, velocity, seconds, self._floor, self.drive_config)
            return drive_pose(self._state, pose.stamp_ns)

    def _is_fresh(self) -> bool:
        return time.monotonic() - self._velocity_at < self.drive_config.timeout_s
