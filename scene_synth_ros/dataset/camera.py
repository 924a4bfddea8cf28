"""The camera of a frame, as its ``sensor_msgs/CameraInfo`` says, and its pose, read without ROS."""

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_synth_ros.messages import poses
from scene_synth_ros.messages.cdr import CdrReader

_STAMP_SIZE = 12
"""Bytes of encapsulation header and stamp, before what is the same in every frame."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Camera:
    """A camera: pixel (column, row) of a point (x, y, z) in its optical frame is K (x/z, y/z, 1), before distortion.

    Attributes:
        name: as in topics, with its namespace.
        frame_id: its optical frame (x right, y down, z forward).
        width: pixels.
        height: pixels.
        K: (3, 3) float64; zero for a panorama.  Pixel centres are at whole numbers.
        model: of the distortion: ``plumb_bob``, ``rational_polynomial``, ``equidistant``, or the name of another lens.
        D: (n,) float64, its coefficients.
        R: (3, 3) float64, rectification.
        P: (3, 4) float64, projection; tells the baseline of a stereo camera: P[0, 3] = -fx * baseline (m).
    """

    name: str
    frame_id: str
    width: int
    height: int
    K: NDArray[np.float64]
    model: str
    D: NDArray[np.float64]
    R: NDArray[np.float64]
    P: NDArray[np.float64]

    @property
    def fx(self) -> float:
        """Focal length along x (pixels)."""
        return float(self.K[0, 0])

    @property
    def fy(self) -> float:
        """Focal length along y (pixels)."""
        return float(self.K[1, 1])

    @property
    def cx(self) -> float:
        """Column of the principal point."""
        return float(self.K[0, 2])

    @property
    def cy(self) -> float:
        """Row of the principal point."""
        return float(self.K[1, 2])


class Pose(NamedTuple):
    """A pose: position (3,) float64 in metres, unit quaternion (4,) float64 in the order x, y, z, w; ``world``: the frame it is in."""

    position_m: NDArray[np.float64]
    quaternion_xyzw: NDArray[np.float64]
    world: str = "map"


def read_camera(name: str, data: bytes | memoryview) -> Camera:
    """Return the camera that a serialised CameraInfo describes; the same object for equal ones.

    Raises:
        CdrReadError: the message is cut off.
    """
    return _read_camera(name, bytes(data[:4]), bytes(data[_STAMP_SIZE:]))


@lru_cache(maxsize=64)
def _read_camera(name: str, encapsulation: bytes, after_stamp: bytes) -> Camera:
    reader = CdrReader(encapsulation + bytes(8) + after_stamp)
    frame_id, height, width = reader.header().frame_id, reader.number("I"), reader.number("I")
    model = reader.text()
    return _camera(name, frame_id, width, height, model, *(tuple(reader.numbers("d", count)) for count in (reader.number("I"), 9, 9, 12)))


@lru_cache(maxsize=64)
def _camera(name: str, frame_id: str, width: int, height: int, model: str, *numbers: tuple[float, ...]) -> Camera:
    """Return the camera of equal values, which messages may tell with other bytes: what pads them is not defined."""
    D, K, R, P = map(_read_only, numbers)
    return Camera(
        name=name,
        frame_id=frame_id,
        width=width,
        height=height,
        K=K.reshape(3, 3),
        model=model,
        D=D,
        R=R.reshape(3, 3),
        P=P.reshape(3, 4),
    )


def _read_only(numbers: tuple[float, ...]) -> NDArray[np.float64]:
    array = np.array(numbers, np.float64)
    array.flags.writeable = False
    return array


def read_pose(data: bytes | memoryview) -> Pose:
    """Return what a serialised PoseStamped says.

    Raises:
        PoseReadError: the message is cut off.
    """
    pose = poses.read_pose(data)
    return Pose(np.array(pose.position_m, np.float64), np.array(pose.quaternion, np.float64), pose.parent)
