"""The motion of a base that velocities drive, by what the settings of its frames tell of it; and how far ahead it must be known."""

from collections.abc import Sequence

from renderer.body.driving import whole_motion
from renderer.camera.config import CameraConfig
from renderer.camera.rig import CarriedPath, carried_rig, driven_path
from scene_description import CameraPose, SceneDescription
from scene_description.motion import DEGREE, Motion
from scene_description.strict import FieldError
from scene_synth_ros.messages.frame_messages import StreamConfig
from scene_synth_ros.messages.frame_settings import DrivePart, FrameSettings
from scene_synth_ros.messages.room_body import Way
from scene_synth_ros.messages.senses import Senses

_LOOK_AHEAD = ("flow", "occlusion")
"""Layers that tell of the frame after."""
_ROUNDING_S = 0.002
"""What is cast between two poses of a thousandth of a second needs the second, too."""


def frame_spacing_ns(scene: SceneDescription) -> int:
    """Return the time from frame to frame."""
    path = scene.camera_path
    return path[1].stamp_ns - path[0].stamp_ns if len(path) > 1 else 100_000_000


def horizon_s(scene: SceneDescription, camera: CameraConfig, streams: StreamConfig, senses: Senses) -> float:
    """Return how long after a frame the motion must be known when the frame is made: until all that begins by then has ended."""
    ends_s = [(camera.height - 1) * camera.row_time_s + 0.5 * camera.shutter_s]
    ends_s += [senses.scan.sweep_s] if senses.scan.enabled else []
    ends_s += [1.0 / senses.lidar.rate_hz] if senses.lidar.enabled else []
    ends_s += [-senses.imu.clock_offset_s] if senses.imu.enabled else []
    ends_s += [frame_spacing_ns(scene) * 1e-9] if _looks_ahead(streams) else []
    return max(ends_s) + _ROUNDING_S


def frame_path(scene: SceneDescription, camera: CameraConfig, streams: StreamConfig, motion: Motion, stamp_ns: int) -> Sequence[CameraPose]:
    """Return the camera's poses at a frame and where it is a frame before and, if a layer asks for it, after."""
    rig, spacing_ns = rig_of(scene, motion), frame_spacing_ns(scene)
    before = [stamp_ns - spacing_ns] if stamp_ns - spacing_ns >= rig.start_ns else []
    after = [stamp_ns + spacing_ns] if _looks_ahead(streams) else []
    return driven_path(camera, rig, [*before, stamp_ns, *after])


def rig_of(scene: SceneDescription, motion: Motion) -> CarriedPath:
    """Return where the rig of a room goes that a motion carries."""
    return carried_rig(scene.camera_path, motion)


def _looks_ahead(streams: StreamConfig) -> bool:
    return any(getattr(streams, layer) for layer in _LOOK_AHEAD)


class DrivenRooms:
    """Puts together how the bases of rooms were driven, from the settings of all frames, in any order."""

    def __init__(self) -> None:
        self._parts: dict[str, dict[int, DrivePart]] = {}
        self._stamps: dict[str, set[int]] = {}
        self._motions: dict[str, Motion] = {}

    def take(self, settings: FrameSettings) -> None:
        """Take the settings of a frame."""
        if settings.drive is not None:
            self._motions.pop(settings.scene, None)
            self._parts.setdefault(settings.scene, {})[settings.drive.first] = settings.drive
            self._stamps.setdefault(settings.scene, set()).add(settings.stamp_ns)

    def __contains__(self, scene_id: str) -> bool:
        """Return whether a room's base was driven."""
        return scene_id in self._parts

    def way(self, scene: SceneDescription) -> Way | None:
        """Return how the body of a driven room moved; None of any other.

        Raises:
            FieldError: frames are missing that told of it, or tell what does not go together.
        """
        return Way(self.motion(scene), self.stamps_ns(scene.id), driven=True) if scene.id in self else None

    def stamps_ns(self, scene_id: str) -> list[int]:
        """Return the stamps of the frames of a driven room."""
        return sorted(self._stamps[scene_id])

    def motion(self, scene: SceneDescription) -> Motion:
        """Return the motion of a driven room.

        Raises:
            FieldError: frames are missing that told of it, or tell what does not go together.
        """
        if scene.id not in self._motions:
            self._motions[scene.id] = self._whole(scene)
        return self._motions[scene.id]

    def _whole(self, scene: SceneDescription) -> Motion:
        distances: list[float] = []
        headings: list[float] = []
        for first, part in sorted(self._parts[scene.id].items()):
            if first != len(distances) or len(part.distances_m) != len(part.headings_rad):
                raise FieldError(f"{scene.id}: drive", f"control points from {len(distances)} on, of both curves", f"those from {first} on")
            distances += part.distances_m
            headings += part.headings_rad
        if scene.motion is None or scene.motion.drive is None or len(distances) <= DEGREE:
            raise FieldError(f"{scene.id}: drive", f"a motion on wheels and {DEGREE + 1} control points", f"{len(distances)} of them")
        return whole_motion(scene.motion, distances, headings)
