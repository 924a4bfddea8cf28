"""Whether the frames of a room are seen from within the room's air, told once a room in the log, and while it lasts in ``/diagnostics``."""

from __future__ import annotations

from collections.abc import Callable

from rclpy.impl.rcutils_logger import RcutilsLogger

from scene_description import CameraPose, SceneDescription

IN_THE_ROOM = "in the room"


class CameraPlace:
    """Follows where the camera stands.

    Threading: the rendering thread; ``now`` is replaced as a whole and may be read by any.

    Args:
        logger: of the node.

    Attributes:
        now: where the newest frame was seen from: :data:`IN_THE_ROOM`, or what ``renderer.standpoint`` says.
    """

    def __init__(self, logger: RcutilsLogger) -> None:
        self.now = IN_THE_ROOM
        self._logger = logger
        self._told = False

    def begin_room(self) -> None:
        """Forget the room before."""
        self.now, self._told = IN_THE_ROOM, False

    def take(self, scene: SceneDescription, pose: CameraPose, standpoint: Callable[[CameraPose], str]) -> None:
        """Take a frame that was rendered at ``pose``, the lens's own; ``standpoint``: of the room at work."""
        place = standpoint(pose)
        self.now = place or IN_THE_ROOM
        if place and not self._told:
            self._told = True
            x, y, z = pose.position_m
            self._logger.warning(
                f"room {scene.index}: the camera at ({x:.2f}, {y:.2f}, {z:.2f}) m is {place}; frames show what is seen from there"
            )
