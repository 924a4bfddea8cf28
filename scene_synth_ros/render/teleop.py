"""A camera moved by hand over the free floor of a room: velocities in, poses out, never into furniture.  No ROS.

The floor is an occupancy grid (0 free, anything else not).  The camera is the axis of an upright disc that stays where the disc fits; it
slides along what it meets.
"""

import math
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_description import CameraPose, Limits
from scene_description.poses import look_at, rotation_from_quaternion

MAX_PITCH_RAD = 1.2


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveConfig:
    """How Twists on ``cmd_vel`` drive a base with two wheels (``motion.kind:=base`` and ``body.enabled``), or else the camera alone.

    The base keeps to its limits of acceleration and jerk, too, and to neither of the heights.
    """

    enabled: Annotated[
        bool,
        Limits(description="Let Twists on cmd_vel drive the base, or take over the camera, where frames come at their rate (realtime)"),
    ] = False
    max_speed_m_s: Annotated[float, Limits(ge=0.01, le=20.0, unit="m/s", description="Fastest motion, each axis")] = 1.5
    max_turn_rad_s: Annotated[float, Limits(ge=0.01, le=20.0, unit="rad/s", description="Fastest turn, yaw and pitch")] = 2.0
    acceleration_m_s2: Annotated[float, Limits(ge=0.01, le=20.0, unit="m/s2", description="Greatest acceleration of a base")] = 0.8
    jerk_m_s3: Annotated[float, Limits(ge=0.1, le=200.0, unit="m/s3", description="Greatest jerk of a base")] = 8.0
    turn_acceleration_rad_s2: Annotated[
        float, Limits(ge=0.01, le=100.0, unit="rad/s2", description="Greatest change of the turn of a base")
    ] = 3.0
    turn_jerk_rad_s3: Annotated[float, Limits(ge=0.1, le=1000.0, unit="rad/s3", description="Greatest jerk of the turn of a base")] = 30.0
    radius_m: Annotated[float, Limits(ge=0.01, le=2.0, unit="m", description="Distance kept from walls and furniture")] = 0.15
    min_height_m: Annotated[float, Limits(ge=0.05, le=10.0, unit="m", description="Lowest height of the camera")] = 0.2
    max_height_m: Annotated[
        float, Limits(ge=0.1, le=10.0, unit="m", description="Greatest height of the camera; the map knows nothing above 1.5 m")
    ] = 1.5
    timeout_s: Annotated[float, Limits(ge=0.05, le=60.0, unit="s", description="The camera stops when no Twist has come for so long")] = 0.5


class FreeFloor(NamedTuple):
    """``clearance_m`` (h, w): how far anything not free is at least from every point of a cell; row 0 at the lowest y."""

    clearance_m: NDArray[np.float64]
    resolution_m: float
    origin_m: tuple[float, float]

    @classmethod
    def from_cells(cls, cells: NDArray[np.int8], resolution_m: float, origin_m: tuple[float, float]) -> "FreeFloor":
        """Return the floor of an occupancy grid.

        The distance between two cells' centres bounds that between their points less one diagonal of a cell.
        """
        from scipy import ndimage  # a tenth of a renderer's start, and only a driven camera needs it

        framed = np.pad(cells == 0, 1, constant_values=False)
        between_centres = ndimage.distance_transform_edt(framed)[1:-1, 1:-1] * resolution_m
        return cls(np.maximum(between_centres - math.sqrt(2.0) * resolution_m, 0.0), resolution_m, origin_m)

    def fits(self, x_m: float, y_m: float, radius_m: float) -> bool:
        """Return whether a disc of this radius stands free at a point."""
        row, column = (
            math.floor((value - origin) / self.resolution_m) for value, origin in ((y_m, self.origin_m[1]), (x_m, self.origin_m[0]))
        )
        rows, columns = self.clearance_m.shape
        return 0 <= row < rows and 0 <= column < columns and bool(self.clearance_m[row, column] >= radius_m)

    def nearest(self, x_m: float, y_m: float, radius_m: float) -> tuple[float, float] | None:
        """Return the centre of the nearest cell where the disc fits, or the point itself if it fits there; None if it fits nowhere."""
        if self.fits(x_m, y_m, radius_m):
            return x_m, y_m
        rows, columns = np.nonzero(self.clearance_m >= radius_m)
        if not rows.size:
            return None
        x = self.origin_m[0] + (columns + 0.5) * self.resolution_m
        y = self.origin_m[1] + (rows + 0.5) * self.resolution_m
        best = int(np.argmin((x - x_m) ** 2 + (y - y_m) ** 2))
        return float(x[best]), float(y[best])


class Velocity(NamedTuple):
    """A Twist in the camera's own upright frame: forward, left, up (m/s), yaw to the left, pitch down (rad/s), as REP 103 has them."""

    forward_m_s: float = 0.0
    left_m_s: float = 0.0
    up_m_s: float = 0.0
    pitch_rad_s: float = 0.0
    yaw_rad_s: float = 0.0


class DriveState(NamedTuple):
    """Where the driven camera is: position (m), yaw about z, pitch (positive looks down)."""

    x_m: float
    y_m: float
    z_m: float
    yaw_rad: float
    pitch_rad: float


def start_drive(pose: CameraPose, floor: FreeFloor, config: DriveConfig) -> DriveState | None:
    """Return the state nearest to a pose; None if the room has no floor where the disc fits."""
    place = floor.nearest(pose.position_m[0], pose.position_m[1], config.radius_m)
    if place is None:
        return None
    ahead = rotation_from_quaternion(pose.orientation)[:, 2]
    pitch = -math.asin(max(-1.0, min(1.0, float(ahead[2]))))
    height = _clip(pose.position_m[2], config.min_height_m, config.max_height_m)
    yaw = math.atan2(float(ahead[1]), float(ahead[0]))
    return DriveState(*place, height, yaw, _clip(pitch, -MAX_PITCH_RAD, MAX_PITCH_RAD))


def drive(state: DriveState, velocity: Velocity, seconds: float, floor: FreeFloor, config: DriveConfig) -> DriveState:
    """Return the state after moving for some seconds, in steps of half a cell at most."""
    speed, turn = config.max_speed_m_s, config.max_turn_rad_s
    forward, left, up = (_clip(value, -speed, speed) for value in velocity[:3])
    pitch_rate, yaw_rate = (_clip(value, -turn, turn) for value in velocity[3:])
    steps = max(1, math.ceil(math.hypot(forward, left) * seconds / (0.5 * floor.resolution_m)))
    dt = seconds / steps
    x, y, z, yaw, pitch = state
    for _ in range(steps):
        yaw += yaw_rate * dt
        dx = (forward * math.cos(yaw) - left * math.sin(yaw)) * dt
        dy = (forward * math.sin(yaw) + left * math.cos(yaw)) * dt
        for step_x, step_y in ((dx, dy), (dx, 0.0), (0.0, dy)):
            if floor.fits(x + step_x, y + step_y, config.radius_m):
                x, y = x + step_x, y + step_y
                break
    z = _clip(z + up * seconds, config.min_height_m, max(config.min_height_m, config.max_height_m))
    pitch = _clip(pitch + pitch_rate * seconds, -MAX_PITCH_RAD, MAX_PITCH_RAD)
    return DriveState(x, y, z, math.remainder(yaw, math.tau), pitch)


def drive_pose(state: DriveState, stamp_ns: int) -> CameraPose:
    """Return the optical pose of a state."""
    x, y, z, yaw, pitch = state
    target = (x + math.cos(yaw) * math.cos(pitch), y + math.sin(yaw) * math.cos(pitch), z - math.sin(pitch))
    return CameraPose(stamp_ns=stamp_ns, position_m=(x, y, z), orientation=look_at((x, y, z), target))


def _clip(value: float, low: float, high: float) -> float:
    """Return a value within bounds; what is no number is 0."""
    return max(low, min(high, value)) if math.isfinite(value) else 0.0
