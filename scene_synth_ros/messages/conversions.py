"""Core values to messages.  No node here; stamps and frames are passed in, pixels are copied in one piece."""

import json
import math
from collections.abc import Sequence

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Pose, PoseStamped, Quaternion, Transform, TransformStamped, Vector3
from nav_msgs.msg import OccupancyGrid
from numpy.typing import NDArray
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import ColorRGBA, Header, String
from visualization_msgs.msg import Marker, MarkerArray

from renderer.camera.cameras import intrinsics
from renderer.camera.config import CameraConfig
from renderer.camera.lenses import LENSES
from renderer.camera.rig import stereo_shift_m
from renderer.film.layer import Layer
from scene_description import NYU40, CameraPose, SceneDescription
from scene_description.label_standards import StandardName
from scene_description.labels import LabelTable
from scene_description.poses import (
    LINK_FROM_OPTICAL,
    Vec3,
    conjugate_quaternion,
    multiply_quaternions,
    quaternion_from_yaw,
)
from scene_description.poses import Quaternion as QuaternionXyzw
from scene_synth_ros.messages.image_reader import ENCODINGS, raw_pixels
from scene_synth_ros.messages.stamps import NANOSECONDS

ENCODING_CHANNELS: dict[str, tuple[type[np.generic], int]] = {
    name: (np.dtype(ENCODINGS[name][0]).type, ENCODINGS[name][1]) for name in ("rgb8", "mono8", "16UC1", "32FC1", "32FC2", "32FC3")
}
"""Encoding of images that this package makes -> dtype and channels."""
_ENCODINGS = {(np.dtype(dtype).name, channels): encoding for encoding, (dtype, channels) in ENCODING_CHANNELS.items()}


def time_to_msg(stamp_ns: int) -> Time:
    """Return integer nanoseconds as a message."""
    return Time(sec=stamp_ns // NANOSECONDS, nanosec=stamp_ns % NANOSECONDS)


def clock_to_msg(stamp_ns: int) -> Clock:
    """Return the simulated time as ``/clock`` wants it."""
    return Clock(clock=time_to_msg(stamp_ns))


def header(stamp_ns: int, frame_id: str) -> Header:
    """Return a header."""
    return Header(stamp=time_to_msg(stamp_ns), frame_id=frame_id)


def layer_encoding(layer: Layer) -> str:
    """Return the encoding that a layer's dtype and channels ask for."""
    return _ENCODINGS[layer.dtype, layer.channels]


def image_step(image: NDArray[np.generic], encoding: str) -> int:
    """Return how many bytes a row of an image has in an encoding, a key of ``ENCODING_CHANNELS``.

    Raises:
        ValueError: dtype, channels or memory layout do not fit the encoding.
    """
    dtype, channels = ENCODING_CHANNELS[encoding]
    shape_channels = image.shape[2] if image.ndim == 3 else 1
    if image.dtype != dtype or shape_channels != channels or not image.flags.c_contiguous:
        raise ValueError(f"image for {encoding}: expected contiguous {np.dtype(dtype)} x {channels}, got {image.dtype} x {shape_channels}")
    return int(image.shape[1] * channels * np.dtype(dtype).itemsize)


def image_to_msg(image: NDArray[np.generic], encoding: str, stamp_ns: int, frame_id: str) -> Image:
    """Return an image as a message.

    It is (height, width) or (height, width, channels), C-contiguous, of the dtype of its encoding, a key of ``ENCODING_CHANNELS``.

    Raises:
        ValueError: dtype, channels or memory layout do not fit the encoding.
    """
    step = image_step(image, encoding)
    message = Image(header=header(stamp_ns, frame_id), height=image.shape[0], width=image.shape[1], encoding=encoding, is_bigendian=0)
    message.step = step
    message.data.frombytes(image.data.cast("B"))
    return message


def msg_to_image(message: Image) -> NDArray[np.generic]:
    """Return the pixels of a message as a read-only view, (height, width) or (height, width, channels).

    Raises:
        CodecError: the encoding is unknown, or the data is too short.
    """
    view = raw_pixels(message.encoding, message.height, message.width, message.data, message.step)
    view.flags.writeable = False
    return view


def depth_to_millimetres(depth_m: NDArray[np.float32]) -> NDArray[np.uint16]:
    """Return depth as 16UC1: whole millimetres, 0 where there is no hit or where it lies beyond 65.535 m (REP 118)."""
    with np.errstate(invalid="ignore"):
        millimetres = np.where(np.isfinite(depth_m), np.rint(depth_m * 1000.0), 0.0)
    return np.where(millimetres > 65535.0, 0.0, millimetres).astype(np.uint16)


def camera_info_to_msg(camera: CameraConfig, stamp_ns: int, frame_id: str) -> CameraInfo:
    """Return the camera info of a lens, pixel centres at integers, as image_geometry has them.

    A camera that sits right of or below its rig's middle tells so in P, as the second camera of a stereo pair does.
    A panorama has no matrix in CameraInfo: K and P are zero, as for every uncalibrated camera, and the model's name says what it is.
    """
    lens, (fx, fy, cx, cy) = LENSES[camera.model], intrinsics(camera)
    message = CameraInfo(header=header(stamp_ns, frame_id), width=camera.width, height=camera.height, distortion_model=lens.ros_name)
    length = 5 if lens.ros_name == "plumb_bob" else lens.coefficients
    message.d = [*camera.distortion, *(0.0,) * (length - len(camera.distortion))]
    if camera.model == "equirectangular":
        return message
    message.k = [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]
    message.r = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
    right_m, down_m = stereo_shift_m(camera)
    message.p = [fx, 0.0, cx, -fx * right_m + 0.0, 0.0, fy, cy, -fy * down_m + 0.0, 0.0, 0.0, 1.0, 0.0]
    return message


def pose_to_msg(pose: CameraPose, frame_id: str) -> PoseStamped:
    """Return the pose of the optical frame in the world frame ``frame_id``."""
    return PoseStamped(header=header(pose.stamp_ns, frame_id), pose=_pose(pose.position_m, pose.orientation))


def transform_to_msg(stamp_ns: int, parent: str, child: str, place_m: Vec3, rotation: QuaternionXyzw) -> TransformStamped:
    """Return the pose of a frame in another as a transform."""
    (x, y, z), (qx, qy, qz, qw) = place_m, rotation
    transform = Transform(translation=Vector3(x=x, y=y, z=z), rotation=Quaternion(x=qx, y=qy, z=qz, w=qw))
    return TransformStamped(header=header(stamp_ns, parent), child_frame_id=child, transform=transform)


def link_from_optical_to_msg(stamp_ns: int, link: str, optical: str) -> TransformStamped:
    """Return the transform camera link -> optical frame (x right, y down, z forward), which never changes (REP 103)."""
    return transform_to_msg(stamp_ns, link, optical, (0.0, 0.0, 0.0), LINK_FROM_OPTICAL)


def world_from_link_to_msg(pose: CameraPose, world: str, link: str) -> TransformStamped:
    """Return the transform world -> camera link (x forward, y left, z up) of an optical pose."""
    rotation = multiply_quaternions(pose.orientation, conjugate_quaternion(LINK_FROM_OPTICAL))
    return transform_to_msg(pose.stamp_ns, world, link, pose.position_m, rotation)


def labels_to_msg(labels: LabelTable, stamp_ns: int, standard: StandardName = "nyu40") -> String:
    """Return an id table as JSON: ``{"stamp": {"sec", "nanosec"}, "standard", "labels": {"<id>": {...}}}``; ``nyu40`` is not told."""
    stamp = {"sec": stamp_ns // NANOSECONDS, "nanosec": stamp_ns % NANOSECONDS}
    told = {} if standard == "nyu40" else {"standard": standard}
    return String(data=json.dumps({"stamp": stamp, **told, "labels": {str(key): value for key, value in labels.items()}}))


def occupancy_to_msg(
    cells: NDArray[np.int8], resolution_m: float, origin_m: tuple[float, float], stamp_ns: int, frame_id: str
) -> OccupancyGrid:
    """Return a grid (row 0 at the lowest y; 0 free, 100 occupied, -1 unknown) as a message."""
    message = OccupancyGrid(header=header(stamp_ns, frame_id))
    message.info.map_load_time = time_to_msg(stamp_ns)
    message.info.resolution = resolution_m
    message.info.height, message.info.width = cells.shape
    message.info.origin.position = Point(x=origin_m[0], y=origin_m[1], z=0.0)
    message.data.frombytes(np.ascontiguousarray(cells).data.cast("B"))
    return message


def scene_to_markers(scene: SceneDescription, stamp_ns: int, frame_id: str) -> MarkerArray:
    """Return boxes and names of the objects, the openings and the floor outline, for RViz and Foxglove.

    The first marker deletes those of the room before.
    """
    markers = [Marker(header=header(stamp_ns, frame_id), action=Marker.DELETEALL)]
    for thing in scene.objects:
        x, y, z = thing.position_m
        pose = _pose((x, y, z + 0.5 * thing.size_m[2]), quaternion_from_yaw(thing.yaw_rad))
        markers.append(_box_marker(scene, stamp_ns, frame_id, thing.id, thing.label, pose, thing.size_m))
        markers.append(_text_marker(stamp_ns, frame_id, thing.id, thing.category, (x, y, z + thing.size_m[2] + 0.08)))
    for opening in scene.room.openings:
        a, b = (scene.room.polygon_m[(opening.wall + i) % len(scene.room.polygon_m)] for i in (0, 1))
        yaw = math.atan2(b[1] - a[1], b[0] - a[0])
        along = opening.offset_m + 0.5 * opening.width_m
        center = (a[0] + along * math.cos(yaw), a[1] + along * math.sin(yaw), opening.sill_m + 0.5 * opening.height_m)
        size = (opening.width_m, 0.05, opening.height_m)
        markers.append(_box_marker(scene, stamp_ns, frame_id, opening.id, opening.label, _pose(center, quaternion_from_yaw(yaw)), size))
        markers.append(_text_marker(stamp_ns, frame_id, opening.id, opening.category, center))
    outline = Marker(header=header(stamp_ns, frame_id), ns="room", id=0, type=Marker.LINE_STRIP, action=Marker.ADD)
    outline.scale.x = 0.03
    outline.color = ColorRGBA(r=0.2, g=0.2, b=0.2, a=1.0)
    outline.pose.orientation.w = 1.0
    outline.points = [Point(x=x, y=y, z=0.0) for x, y in (*scene.room.polygon_m, scene.room.polygon_m[0])]
    markers.append(outline)
    return MarkerArray(markers=markers)


def _pose(position_m: Sequence[float], orientation: Sequence[float]) -> Pose:
    x, y, z = map(float, position_m)
    qx, qy, qz, qw = map(float, orientation)
    return Pose(position=Point(x=x, y=y, z=z), orientation=Quaternion(x=qx, y=qy, z=qz, w=qw))


def _box_marker(
    scene: SceneDescription, stamp_ns: int, frame_id: str, marker_id: int, label: int, pose: Pose, size_m: Sequence[float]
) -> Marker:
    marker = Marker(header=header(stamp_ns, frame_id), ns="objects", id=marker_id, type=Marker.CUBE, action=Marker.ADD, pose=pose)
    marker.scale = Vector3(x=float(size_m[0]), y=float(size_m[1]), z=float(size_m[2]))
    red, green, blue = (channel / 255.0 for channel in NYU40[label].color)
    marker.color = ColorRGBA(r=red, g=green, b=blue, a=0.55)
    return marker


def _text_marker(stamp_ns: int, frame_id: str, marker_id: int, text: str, position_m: Sequence[float]) -> Marker:
    marker = Marker(header=header(stamp_ns, frame_id), ns="names", id=marker_id, type=Marker.TEXT_VIEW_FACING, action=Marker.ADD)
    marker.pose = _pose(position_m, (0.0, 0.0, 0.0, 1.0))
    marker.scale.z = 0.12
    marker.color = ColorRGBA(r=1.0, g=1.0, b=1.0, a=1.0)
    marker.text = text.replace("_", " ")
    return marker
