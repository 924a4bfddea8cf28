"""Names of a camera's frames."""

from __future__ import annotations

from typing import NamedTuple

FRAME_PREFIX = r"[A-Za-z0-9_/]*"
"""Pattern of what may stand before frame names."""


class CameraFrames(NamedTuple):
    """``link``: x forward, y left, z up; ``optical``: x right, y down, z forward (REP 103)."""

    link: str
    optical: str


def camera_frames(camera: str, prefix: str = "") -> CameraFrames:
    """Return the frames of a camera; the prefix stands before them as it is, as that of robot_state_publisher does (``robot1/``)."""
    return CameraFrames(f"{prefix}{camera}_link", f"{prefix}{camera}_optical_frame")
