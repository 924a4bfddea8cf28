"""The points that the pixels of a view have hit, in the optical frame at the frame's stamp.

With a rolling shutter the rays of a row are cast at the row's own time, from where the camera is by then.  Depth and range are measured
from there; the points are carried back into the frame of the stamp, so that they lie on the surfaces of a room that stands still.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from renderer.camera.cameras import PosedCamera, pose_camera
from renderer.camera.cloud_fields import cloud_fields
from renderer.camera.config import CameraConfig
from renderer.camera.shutter import carry_back, in_motion
from renderer.core.errors import RenderError
from renderer.core.kernel import entry
from scene_description.types import CameraPose

_ZERO, _ONE, _HALF, _NAN = np.float32(0.0), np.float32(1.0), np.float32(0.5), np.float32(np.nan)


def cloud_points(
    camera: CameraConfig,
    pose: CameraPose,
    path: Sequence[CameraPose],
    distance: NDArray[np.float32],
    *,
    along_ray: bool,
    color: NDArray[np.uint8] | None = None,
    label: NDArray[np.generic] | None = None,
    instance: NDArray[np.generic] | None = None,
) -> NDArray[np.uint8]:
    """Return the points of a view, (height, width, size of a point) uint8, laid out as :func:`cloud_fields` says.

    ``path``: what the camera moves along, for its shutter; ``distance``: (height, width), any image of depth or range, ideal or sensed, in
    metres; what is 0 or not finite is no hit; ``along_ray``: it is range, the length of the ray; else depth, its part along the optical
    axis at the time of the row; ``color``: (height, width, 3); ``label``, ``instance``: (height, width), ids below 65,536.

    Points without a hit have NaN for x, y and z, and keep colour and ids.  rgb holds 0x00RRGGBB in the bits of a float32, as PCL has it.

    Raises:
        RenderError: an image has another size than the camera, or the pose is faulty.
    """
    size = (camera.height, camera.width)
    for name, image in (("distance", distance), ("color", color), ("label", label), ("instance", instance)):
        if image is not None and image.shape[:2] != size:
            raise RenderError(f"point cloud: {name}: expected an image of {size[1]} x {size[0]} pixels, got shape {image.shape}")
    fields = cloud_fields(color=color is not None, label=label is not None, instance=instance is not None)
    points = np.zeros((*size, fields.size), np.uint8)
    view = in_motion(pose_camera(camera, pose), camera, pose, path)
    _fill_points(view, np.ascontiguousarray(distance, np.float32), along_ray, points.view(np.float32))
    if color is not None:
        red, green, blue = (color[..., i].astype(np.uint32) for i in range(3))
        points.view(np.uint32)[..., fields.rgb // 4] = red << 16 | green << 8 | blue
    for place, ids in ((fields.label, label), (fields.instance, instance)):
        if ids is not None:
            points.view(np.uint16)[..., place // 2] = ids
    return points


@entry
def _fill_points(camera: PosedCamera, distance: NDArray[np.float32], along_ray: bool, points: NDArray[np.float32]) -> None:
    """Write x, y and z of the hits, or NaN, in the first three numbers of ``points`` (height, width, numbers of a point)."""
    lens, scale = len(camera.bearings) > 0, _ONE / camera.focal_px
    for row in range(camera.height):
        for column in range(camera.width):
            x = (np.float32(column) + _HALF - _HALF * np.float32(camera.width)) * scale
            y = (np.float32(row) + _HALF - _HALF * np.float32(camera.height)) * scale
            z = _ONE
            if lens:
                bearing = camera.bearings[row + 1, column + 1]
                x, y, z = bearing[0], bearing[1], bearing[2]
            t = distance[row, column] / (np.sqrt(x * x + y * y + z * z) if along_ray else z)
            x, y, z = t * x, t * y, t * z
            if not (t > _ZERO and np.isfinite(t)):
                x, y, z = _NAN, _NAN, _NAN
            elif camera.row_step > _ZERO:
                x, y, z = carry_back(camera, row, x, y, z)
            points[row, column, 0], points[row, column, 1], points[row, column, 2] = x, y, z
