"""Point clouds made of a frame's layers.  No node here."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import PointCloud2, PointField

from renderer.camera.cloud_fields import cloud_fields
from renderer.camera.config import CameraConfig
from renderer.camera.point_cloud import cloud_points
from scene_description.types import CameraPose
from scene_synth_ros.messages.conversions import header
from scene_synth_ros.messages.streams import POINTS, POINTS_SENSED, Role

CLOUDS = {POINTS: "range", POINTS_SENSED: "depth_sensed"}
"""Role of a cloud -> the layer that says how far its points are."""


def cloud_layers(role: Role, color: bool) -> tuple[str, ...]:
    """Return the layers that a cloud is made of."""
    return (CLOUDS[role], "semantic", "instance", *(("color",) if color else ()))


def cloud_of_layers(
    camera: CameraConfig,
    pose: CameraPose,
    path: Sequence[CameraPose],
    layers: Mapping[str, NDArray[Any]],
    role: Role,
    color: bool,
    frame_id: str,
) -> PointCloud2:
    """Return a cloud of a frame's ``cloud_layers``, organised as its images are, in the optical frame at the pose's stamp."""
    distance = CLOUDS[role]
    values = {"color": layers["color"] if color else None, "label": layers["semantic"], "instance": layers["instance"]}
    points = cloud_points(camera, pose, path, layers[distance], along_ray=distance == "range", **values)
    return cloud_to_msg(points, color, pose.stamp_ns, frame_id)


def cloud_to_msg(points: NDArray[np.uint8], color: bool, stamp_ns: int, frame_id: str) -> PointCloud2:
    """Return points with label and instance, and with rgb if ``color``, as ``cloud_points`` makes them, as a message."""
    places = cloud_fields(color=color, label=True, instance=True)
    message = PointCloud2(header=header(stamp_ns, frame_id), height=points.shape[0], width=points.shape[1], is_dense=False)
    message.fields = [PointField(name=name, offset=4 * i, datatype=PointField.FLOAT32, count=1) for i, name in enumerate("xyz")]
    for name, datatype in (("rgb", PointField.FLOAT32), ("label", PointField.UINT16), ("instance", PointField.UINT16)):
        offset = getattr(places, name)
        if offset >= 0:
            message.fields.append(PointField(name=name, offset=offset, datatype=datatype, count=1))
    message.point_step, message.row_step = places.size, places.size * points.shape[1]
    message.data.frombytes(memoryview(points).cast("B"))
    return message
