"""Point clouds of frames as messages.  No node here."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import PointCloud2, PointField

from renderer.camera.cloud_fields import cloud_fields
from scene_synth_ros.messages.conversions import header

CLOUDS = {"points": "range", "points_sensed": "depth_sensed"}
"""Name of a cloud below ``<camera>/``, and of its switch in ``streams`` -> the layer that says how far its points are."""


def cloud_layers(name: str, color: bool) -> tuple[str, ...]:
    """Return the layers that a cloud is made of."""
    return (CLOUDS[name], "semantic", "instance", *(("color",) if color else ()))


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
