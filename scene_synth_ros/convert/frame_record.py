"""What goes with a frame's pixels in formats that carry everything: camera, pose, and what the ids mean."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from renderer import LAYERS
from scene_description import scene_to_json
from scene_synth_ros.convert.camera import row_time_s
from scene_synth_ros.dataset import DatasetError

if TYPE_CHECKING:
    from scene_synth_ros.dataset import Frame


def frame_record(frame: Frame) -> dict[str, Any]:
    """Return room, camera and pose of a frame as JSON values; ``frame`` is its number in the room.

    With a rolling shutter, ``row_time_s`` above 0, the pose is that of the first row.

    Raises:
        DatasetError: camera or pose was not recorded.
    """
    camera, pose = frame.camera, frame.pose
    return {
        "room": frame.room,
        "frame": frame.number,
        "camera": camera.name,
        "stamp_ns": frame.stamp_ns,
        "room_type": frame.room_type,
        "seed": frame.seed,
        "width": camera.width,
        "height": camera.height,
        "K": _rows(camera.K),
        "distortion_model": camera.model,
        "D": [float(value) for value in camera.D],
        "row_time_s": row_time_s(frame),
        "position_m": [float(value) for value in pose.position_m],
        "quaternion_xyzw": [float(value) for value in pose.quaternion_xyzw],
        "world_from_optical": _rows(frame.matrix),
    }


def id_layers(layers: tuple[str, ...]) -> tuple[str, ...]:
    """Return the layers whose pixels are ids."""
    return tuple(layer for layer in layers if layer in LAYERS and LAYERS[layer].labels is not None)


def label_tables(frame: Frame, layers: tuple[str, ...], tell: Callable[[str], None]) -> dict[str, dict[str, Any]]:
    """Return layer -> id as text -> what it means, of the layers whose pixels are ids and whose labels were recorded.

    ``tell`` gets a line for each table that is left out because it is damaged.
    """
    tables = {}
    for layer in id_layers(layers):
        if layer in frame.labelled:
            try:
                tables[layer] = {str(number): row for number, row in frame.labels(layer).items()}
            except DatasetError as error:
                tell(f"{error}; its labels are left out")
    return tables


def scene_text(frame: Frame, tell: Callable[[str], None]) -> str | None:
    """Return the description of a frame's room as JSON; None where none was recorded, or where it is damaged, which ``tell`` is told."""
    if not frame.has_scene:
        return None
    try:
        return scene_to_json(frame.scene)
    except DatasetError as error:
        tell(f"{error}; its description is left out")
        return None


def json_bytes(value: Any) -> bytes:
    """Return a value as compact JSON in UTF-8, the same bytes for the same value."""
    return json.dumps(value, ensure_ascii=False, separators=(",", ":"), allow_nan=False).encode()


def _rows(matrix: NDArray[np.float64]) -> list[list[float]]:
    return [[float(value) for value in row] for row in np.asarray(matrix)]
