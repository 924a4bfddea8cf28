"""Rolling shutters: the rows of a picture are seen from the poses of their own times, where most formats have one pose a frame."""

from __future__ import annotations

from collections.abc import Mapping

from scene_synth_ros.convert.errors import ConvertError
from scene_synth_ros.dataset import Frame


def row_time_s(frame: Frame) -> float:
    """Return the time from row to row of the camera of a frame; 0 for a global shutter, and where no settings were recorded."""
    camera = (frame.settings or {}).get("camera")
    told = camera.get("row_time_s") if isinstance(camera, Mapping) else None
    return float(told) if isinstance(told, int | float) else 0.0


def refuse_rolling_shutter(frame: Frame, camera: str, form: str) -> None:
    """Refuse a camera whose frames have no single pose.

    Raises:
        ConvertError: its shutter rolls.
    """
    told = row_time_s(frame)
    if told:
        raise ConvertError(
            f"{form}: camera {camera}: expected a global shutter, as each frame has one pose, got {told:g} s a row;"
            " record with camera.row_time_s 0, or choose --to tum, euroc or coco"
        )


def shutter_notes(frame: Frame, camera: str, form: str) -> dict[str, None]:
    """Return the line that tells of a rolling shutter, for formats of trajectories, which have no place for the time a row."""
    told = row_time_s(frame)
    if not told:
        return {}
    line = f"{form}: camera {camera}: the shutter takes {told:g} s a row, which the format does not tell; poses are the first row's"
    return {line: None}
