"""The vocabulary of a recording: one row for each kind of topic, read in both directions.

A topic and its type say whose a stream is, its role and its layer (:func:`parse`); these say its topic, its type and its frame
(:class:`Stream`).  Whatever writes, records or reads topics takes their names from here; nothing here needs ROS, numpy or a renderer.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, NamedTuple

STRING_TYPE, CLOCK_TYPE = "std_msgs/msg/String", "rosgraph_msgs/msg/Clock"
IMAGE_TYPE, COMPRESSED_TYPE, INFO_TYPE = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage", "sensor_msgs/msg/CameraInfo"
CLOUD_TYPE, SCAN_TYPE = "sensor_msgs/msg/PointCloud2", "sensor_msgs/msg/LaserScan"
IMU_TYPE, JOINTS_TYPE = "sensor_msgs/msg/Imu", "sensor_msgs/msg/JointState"
POSE_TYPE, ODOMETRY_TYPE, PATH_TYPE = "geometry_msgs/msg/PoseStamped", "nav_msgs/msg/Odometry", "nav_msgs/msg/Path"
MAP_TYPE, MARKERS_TYPE, TF_TYPE = "nav_msgs/msg/OccupancyGrid", "visualization_msgs/msg/MarkerArray", "tf2_msgs/msg/TFMessage"
LABEL_INFO_TYPE = "vision_msgs/msg/LabelInfo"
DETECTIONS_2D_TYPE, DETECTIONS_3D_TYPE = "vision_msgs/msg/Detection2DArray", "vision_msgs/msg/Detection3DArray"

LASER = "laser"
"""Frame of the scanner (x forward, y left, z up), and its name in the topic of its pose, as a camera's."""
LIDAR = "lidar"
"""What the topics of the lidar lie below, as those of a camera."""
ESTIMATES = "/estimates"
"""What the topics of estimates lie below, in place of a camera."""
FRAME_PREFIX = r"[A-Za-z0-9_/]*"
"""Pattern of what may stand before frame names."""

_PART = re.compile(r"[A-Za-z0-9_]{1,100}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Role:
    """One kind of topic.

    Attributes:
        name: how its topics end, below what they are of.
        type_name: of its messages.
        of: what has one: each layer of a camera, each camera, or the run.
        frame: that headers name: the optical one of the camera, the world's, the scanner's, the inertial measurement unit's, the lidar's or
            that of odometry; empty of messages without a header.
        encoding: of its images; empty where the layer decides, and of other messages.
        latched: late subscribers get the last message.
        own_stamps: messages come at a rate of their own, or once a room, and not with every frame; a scanner's pose does, too.
        made_of: name of the role of whose messages a recording makes these; empty where they are recorded as they come.
        switch: parameter below ``streams.`` that publishes it; empty where something else decides.
        summary: of the switch, after "Publish"; empty of a switch that belongs to another role, too.
    """

    name: str
    type_name: str
    of: Literal["layer", "camera", "run"] = "layer"
    frame: Literal["optical", "world", "laser", "imu", "lidar", "odom", ""] = "optical"
    encoding: str = ""
    latched: bool = False
    own_stamps: bool = False
    made_of: str = ""
    switch: str = ""
    summary: str = ""


RAW = Role(name="image_raw", type_name=IMAGE_TYPE)
COMPRESSED = Role(name="image_raw/compressed", type_name=COMPRESSED_TYPE)
COMPRESSED_DEPTH = Role(name="image_raw/compressedDepth", type_name=COMPRESSED_TYPE)
PICTURE = Role(name="image_color", type_name=IMAGE_TYPE, encoding="rgb8")
COMPRESSED_PICTURE = Role(name="image_color/compressed", type_name=COMPRESSED_TYPE, encoding="rgb8")
INFO = Role(name="camera_info", type_name=INFO_TYPE)
LABELS = Role(name="labels", type_name=STRING_TYPE, frame="", latched=True)
LABEL_INFO = Role(name="label_info", type_name=LABEL_INFO_TYPE, latched=True, made_of="labels")

POSE = Role(name="pose", type_name=POSE_TYPE, of="camera", frame="world", switch="publish_pose")
ANNOTATIONS = Role(
    name="annotations", type_name=STRING_TYPE, of="camera", frame="", switch="annotations",
    summary="boxes, key points and relations of the objects in each frame",
)  # fmt: skip
DETECTIONS_2D = Role(name="detections_2d", type_name=DETECTIONS_2D_TYPE, of="camera", made_of="annotations", switch="annotations")
DETECTIONS_3D = Role(name="detections_3d", type_name=DETECTIONS_3D_TYPE, of="camera", made_of="annotations", switch="annotations")
POINTS = Role(name="points", type_name=CLOUD_TYPE, of="camera", switch="points", summary="points: the view as an organised cloud, with ids")
POINTS_SENSED = Role(
    name="points_sensed", type_name=CLOUD_TYPE, of="camera", switch="points_sensed",
    summary="points_sensed: the same cloud of what depth_sensor reads",
)  # fmt: skip

SCENE = Role(name="scene", type_name=STRING_TYPE, of="run", frame="", latched=True)
MARKERS = Role(name="markers", type_name=MARKERS_TYPE, of="run", frame="world", latched=True)
MAP = Role(name="map", type_name=MAP_TYPE, of="run", frame="world", latched=True)
SETTINGS = Role(name="settings", type_name=STRING_TYPE, of="run", frame="", latched=True)
SCAN = Role(name="scan", type_name=SCAN_TYPE, of="run", frame="laser", own_stamps=True)
SCAN_IDEAL = Role(name="scan_ideal", type_name=SCAN_TYPE, of="run", frame="laser", own_stamps=True)
LIDAR_POINTS = Role(name=f"{LIDAR}/points", type_name=CLOUD_TYPE, of="run", frame="lidar", own_stamps=True)
LIDAR_IDEAL = Role(name=f"{LIDAR}/points_ideal", type_name=CLOUD_TYPE, of="run", frame="lidar", own_stamps=True)
IMU_DATA = Role(name="imu/data", type_name=IMU_TYPE, of="run", frame="imu", own_stamps=True)
IMU_IDEAL = Role(name="imu/ideal", type_name=IMU_TYPE, of="run", frame="imu", own_stamps=True)
ODOM = Role(name="odom", type_name=ODOMETRY_TYPE, of="run", frame="odom", own_stamps=True)
ODOM_IDEAL = Role(name="odom/ideal", type_name=ODOMETRY_TYPE, of="run", frame="odom", own_stamps=True)
JOINT_STATES = Role(name="joint_states", type_name=JOINTS_TYPE, of="run", frame="", own_stamps=True)
ROBOT_DESCRIPTION = Role(name="robot_description", type_name=STRING_TYPE, of="run", frame="", latched=True, own_stamps=True)
CLOCK = Role(name="clock", type_name=CLOCK_TYPE, of="run", frame="")
TF = Role(name="tf", type_name=TF_TYPE, of="run", frame="")
TF_STATIC = Role(name="tf_static", type_name=TF_TYPE, of="run", frame="", latched=True)

ROLES: Mapping[str, Role] = {
    role.name: role
    for role in (
        RAW, COMPRESSED, COMPRESSED_DEPTH, PICTURE, COMPRESSED_PICTURE, INFO, LABELS, LABEL_INFO,
        POSE, ANNOTATIONS, DETECTIONS_2D, DETECTIONS_3D, POINTS, POINTS_SENSED,
        SCENE, MARKERS, MAP, SETTINGS, SCAN, SCAN_IDEAL,
        LIDAR_POINTS, LIDAR_IDEAL, IMU_DATA, IMU_IDEAL, ODOM, ODOM_IDEAL, JOINT_STATES, ROBOT_DESCRIPTION, CLOCK, TF, TF_STATIC,
    )
}  # fmt: skip
"""Name -> role, every row of the vocabulary."""

IMAGE_FORMS = (RAW, COMPRESSED, COMPRESSED_DEPTH)
"""The roles of a layer's image, in the order in which readers take them."""
TRANSPORTS = ("", "/compressed", "/compressedDepth")
"""What image_transport appends to an image's topic, in the same order; nothing first."""


class CameraFrames(NamedTuple):
    """``link``: x forward, y left, z up; ``optical``: x right, y down, z forward (REP 103)."""

    link: str
    optical: str


def camera_frames(camera: str, prefix: str = "") -> CameraFrames:
    """Return the frames of a camera; the prefix stands before them as it is, as that of robot_state_publisher does (``robot1/``)."""
    return CameraFrames(f"{prefix}{camera}_link", f"{prefix}{camera}_optical_frame")


def laser_frame(prefix: str) -> str:
    """Return the scanner's frame; the prefix stands before it as before those of cameras."""
    return f"{prefix}{LASER}"


class Stream(NamedTuple):
    """What one topic carries.

    Attributes:
        base: what the topic lies below: of a camera or a layer the camera, with its namespace where the topic has it
            (``/synth/camera``); else the namespace.  ``/`` is the root; empty where the topic is relative.
        role: what it carries.
        layer: whose; empty unless the role is of a layer.
    """

    base: str
    role: Role
    layer: str = ""

    @property
    def topic(self) -> str:
        """The name of the topic."""
        below = f"{self.layer}/{self.role.name}" if self.layer else self.role.name
        return f"{self.base}{below}" if self.base in ("", "/") else f"{self.base}/{below}"

    @property
    def camera(self) -> str:
        """The camera's name without its namespace."""
        return self.base.rpartition("/")[2]

    @property
    def has_own_stamps(self) -> bool:
        """Whether its messages come at a rate of their own, and not with every frame."""
        return self.role.own_stamps or (self.role is POSE and self.camera == LASER)

    def beside(self, role: Role) -> "Stream":
        """Return the stream of another role of the same layer or camera."""
        return Stream(self.base, role, self.layer if role.of == "layer" else "")

    def is_of(self, camera: str) -> bool:
        """Return whether this is of a camera, given by its name alone or with its namespace."""
        return camera in (self.base, self.camera)

    def frame_id(self, prefix: str, world: str = "map") -> str:
        """Return the frame that headers name, empty for none; ``prefix`` stands before the camera's and the scanner's."""
        own = {"laser": laser_frame(prefix), "imu": f"{prefix}imu_link", "lidar": f"{prefix}lidar_link", "odom": f"{prefix}odom"}
        frames = {"": "", "world": world, "optical": camera_frames(self.camera, prefix).optical, **own}
        return frames[self.role.frame]


@lru_cache(maxsize=4096)
def parse(topic: str, type_name: str = "") -> Stream | None:
    """Return what a topic carries.

    None where no row has the topic's end with its type (any type where none is given), or where a part of the name is not 1 to 100 letters,
    digits and underscores: names come from files, and parts become names of files, of layers, of cameras.
    """
    parts = topic.split("/")[topic.startswith("/") :]
    if not all(map(_PART.fullmatch, parts)):
        return None
    for length in (2, 1):
        role = ROLES.get("/".join(parts[-length:]))
        if role is not None and type_name in ("", role.type_name):
            base, layer = parts[:-length], ""
            if role.of == "layer":
                if not base:
                    return None
                layer = base.pop()
            return Stream("/" * topic.startswith("/") + "/".join(base), role, layer)
    return None


def find_streams(types: Mapping[str, str], *roles: Role) -> dict[str, Stream]:
    """Return topic -> stream of those topics (name -> type) that carry one of some roles, in their order."""
    streams = {topic: parse(topic, kind) for topic, kind in types.items()}
    return {topic: stream for topic, stream in streams.items() if stream is not None and stream.role in roles}


def find_images(types: Mapping[str, str]) -> dict[Stream, str]:
    """Return image of a layer, its role always ``RAW`` -> its topic, by form and name; of several forms the first of ``IMAGE_FORMS``."""
    found: dict[Stream, str] = {}
    for role in IMAGE_FORMS:
        for topic, stream in sorted(find_streams(types, role).items()):
            found.setdefault(stream.beside(RAW), topic)
    return found


def untransported(topic: str) -> str:
    """Return the topic of the image that a compressed topic is of; empty if the name is that of none."""
    base, _, transport = topic.rpartition("/")
    return base if f"/{transport}" in TRANSPORTS[1:] else ""


def derived_streams(topic: str) -> list[Stream]:
    """Return what a recording makes of the messages of a topic: LabelInfo of labels, detections of annotations."""
    stream = parse(topic)
    return [] if stream is None else [stream.beside(role) for role in ROLES.values() if role.made_of == stream.role.name]


def source_topic(topic: str) -> str:
    """Return the topic of whose messages a recording makes those of this one; empty if it records them as they come."""
    stream = parse(topic)
    return stream.beside(ROLES[stream.role.made_of]).topic if stream is not None and stream.role.made_of else ""


def has_own_stamps(topic: str) -> bool:
    """Return whether the messages of a topic come at a rate of their own, and not with every frame."""
    stream = parse(topic)
    return stream is not None and stream.has_own_stamps
