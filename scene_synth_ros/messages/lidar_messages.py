"""Sweeps of a lidar as point clouds.  No node here.

Points are in the lidar's frame as it is when their ray is cast; none of them is moved to where it was at the stamp.  Fields as those of
drivers: x, y, z (m), intensity, time (s after the stamp), and ring, the number of the beam from the lowest on, or line of a lidar without
rings; with two returns, which of both a point is.
"""

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import PointCloud2, PointField

from renderer.lidar.lidar import Sweep
from renderer.lidar.sweep_config import LidarConfig
from scene_synth_ros.messages import streams
from scene_synth_ros.messages.conversions import header
from scene_synth_ros.messages.streams import Stream

LIDAR_POINTS, LIDAR_IDEAL = Stream("", streams.LIDAR_POINTS).topic, Stream("", streams.LIDAR_IDEAL).topic

_TYPES = {"<f4": PointField.FLOAT32, "<u2": PointField.UINT16, "|u1": PointField.UINT8}
_WORD = 4


def sweep_to_msg(sweep: Sweep, config: LidarConfig, stamp_ns: int, frame_id: str) -> PointCloud2:
    """Return what the lidar reads, by time: a point for each return."""
    ray, which = np.nonzero(np.isfinite(sweep.ranges))
    fields = {"intensity": sweep.intensities[ray, which], **_fields(sweep, config, ray)}
    if config.returns == "dual":
        fields["return"] = (which + 1).astype(np.uint8)
    return _cloud(sweep.rays.directions[ray], sweep.ranges[ray, which], fields, stamp_ns, frame_id)


def ideal_sweep_to_msg(sweep: Sweep, config: LidarConfig, stamp_ns: int, frame_id: str) -> PointCloud2:
    """Return where the rays meet the first surface, without intensity."""
    (ray,) = np.nonzero(np.isfinite(sweep.ideal))
    return _cloud(sweep.rays.directions[ray], sweep.ideal[ray], _fields(sweep, config, ray), stamp_ns, frame_id)


def _fields(sweep: Sweep, config: LidarConfig, ray: NDArray[np.int64]) -> dict[str, NDArray[np.generic]]:
    lines, times = sweep.rays.lines[ray], sweep.rays.times_s[ray].astype(np.float32)
    return {"time": times, "ring": lines} if config.pattern == "spinning" else {"time": times, "line": lines.astype(np.uint8)}


def _cloud(
    directions: NDArray[np.float64], ranges: NDArray[np.float32], more: dict[str, NDArray[np.generic]], stamp_ns: int, frame_id: str
) -> PointCloud2:
    """Return points with further fields, each at the next place in memory; a point takes whole words."""
    places = directions * ranges[:, None].astype(np.float64)
    fields: dict[str, NDArray[np.generic]] = {axis: places[:, i].astype(np.float32) for i, axis in enumerate("xyz")}
    fields |= more
    ends = np.cumsum([values.itemsize for values in fields.values()]).tolist()
    offsets = [0, *ends[:-1]]
    size = ends[-1] + -ends[-1] % _WORD
    formats = [values.dtype.newbyteorder("<").str for values in fields.values()]
    points = np.zeros(len(ranges), np.dtype({"names": list(fields), "formats": formats, "offsets": offsets, "itemsize": size}))
    for name, values in fields.items():
        points[name] = values
    message = PointCloud2(header=header(stamp_ns, frame_id), height=1, width=len(points), is_dense=True)
    message.fields = [
        PointField(name=name, offset=offset, datatype=_TYPES[code], count=1)
        for name, offset, code in zip(fields, offsets, formats, strict=True)
    ]
    message.point_step, message.row_step = size, size * len(points)
    message.data.frombytes(points.tobytes())
    return message
