"""Point clouds made of a frame's layers.  No node here."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from numpy.typing import NDArray
from sensor_msgs.msg import PointCloud2

from renderer.camera.config import CameraConfig
from renderer.camera.point_cloud import cloud_points
from scene_description.types import CameraPose
from scene_synth_ros.messages.cloud_messages import CLOUDS, cloud_to_msg


def cloud_of_layers(
    camera: CameraConfig,
    pose: CameraPose,
    path: Sequence[CameraPose],
    layers: Mapping[str, NDArray[Any]],
    name: str,
    color: bool,
    frame_id: str,
) -> PointCloud2:
    """Return a cloud of a frame's ``cloud_layers``, organised as its images are, in the optical frame at the pose's stamp."""
    distance = CLOUDS[name]
    seen = {"color": layers["color"] if color else None, "label": layers["semantic"], "instance": layers["instance"]}
    points = cloud_points(camera, pose, path, layers[distance], along_ray=distance == "range", **seen)
    return cloud_to_msg(points, color, pose.stamp_ns, frame_id)
