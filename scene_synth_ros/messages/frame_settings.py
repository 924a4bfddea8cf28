"""What a frame was rendered with, as JSON beside every frame: enough to make its pixels again from the scene and the pose."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

from renderer.body.config import NO_BODY, NO_IMU, NO_WHEELS, BodyConfig, ImuConfig, WheelsConfig
from renderer.camera.config import CameraConfig, SensorConfig
from renderer.film.tone import Exposure
from renderer.lidar.config import NO_SCAN, ScanConfig
from renderer.lidar.sweep_config import NO_LIDAR, LidarConfig
from renderer.path.config import RenderConfig
from renderer.renderer import IDEAL, IDEAL_DEPTH
from renderer.sensors.devices import DepthSensorConfig
from scene_description import Limits
from scene_description.color_temperature import D65_XY
from scene_description.strict import from_json, to_mapping
from scene_synth_ros.messages.frame_messages import StreamConfig
from scene_synth_ros.messages.rig_frames import RigFrame
from scene_synth_ros.messages.senses import Senses

MAX_TEXT_LENGTH = 400_000
_LEFT_OUT = ("frame_prefix", "annotations", "annotation_masks", "points", "points_sensed", "points_color")
Coordinate = Annotated[float, Limits(ge=0.01, le=1.0)]


Controls = Annotated[tuple[Annotated[float, Limits(ge=-1e6, le=1e6)], ...], Limits(max_length=5_000)]


@dataclass(frozen=True, slots=True, kw_only=True)
class DrivePart:
    """How a base goes on that is driven: control points of its motion (``renderer.body.driving``) that no frame before has told.

    ``first``: number of the first of them, from the room's beginning on.
    """

    first: Annotated[int, Limits(ge=0, le=2**40)]
    distances_m: Controls
    headings_rad: Controls


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameSettings:
    """Settings of a frame: stamp, id of the scene, index that keys the noise, exposure, white and black used, and the configurations.

    ``sent``: topics that have stamps of their own, below the namespace -> stamp of the last message that went out before this frame.
    ``frames``: those that are fixed to a body, and known to the renderer.
    ``asked``: the frame is the answer to a request of its pose, so simulated time does not pass with it.
    ``drive``: what became known of the motion of a base that velocities drive; None of any other.
    """

    stamp_ns: Annotated[int, Limits(ge=0, le=2**62, unit="ns")]
    scene: Annotated[str, Limits(min_length=1, max_length=120)]
    frame: Annotated[int, Limits(ge=0, le=2**63 - 1)]
    exposure_ev100: Annotated[float, Limits(ge=-1000.0, le=1000.0, unit="EV")]
    camera: CameraConfig
    render: RenderConfig
    streams: StreamConfig
    sensor: SensorConfig = IDEAL
    depth_sensor: DepthSensorConfig = IDEAL_DEPTH
    white_xy: tuple[Coordinate, Coordinate] = D65_XY
    black: Annotated[float, Limits(ge=0.0, le=0.5)] = 0.0
    scan: ScanConfig = NO_SCAN
    body: BodyConfig = NO_BODY
    imu: ImuConfig = NO_IMU
    wheels: WheelsConfig = NO_WHEELS
    lidar: LidarConfig = NO_LIDAR
    frames: Annotated[tuple[RigFrame, ...], Limits(max_length=64)] = ()
    sent: Annotated[Mapping[str, int], Limits(max_length=64)] = field(default_factory=dict)
    asked: bool = False
    drive: DrivePart | None = None

    @property
    def exposure(self) -> Exposure:
        """Return exposure value, white and black together."""
        return Exposure(self.exposure_ev100, self.white_xy, self.black)

    @property
    def senses(self) -> Senses:
        """Return what is sensed beside frames."""
        return Senses(self.scan, self.body, self.imu, self.wheels, self.lidar)


def settings_to_json(settings: FrameSettings) -> str:
    """Return the JSON text; NYU40 class ids, an ideal depth sensor, and of streams what is empty or off by default, are left out."""
    data: dict[str, Any] = to_mapping(settings)
    if settings.streams.semantic_classes == "nyu40":
        del data["streams"]["semantic_classes"]
    for name in _LEFT_OUT:
        if not getattr(settings.streams, name):
            del data["streams"][name]
    if not settings.scan.enabled:
        del data["scan"]
    if not settings.body.enabled:
        del data["body"], data["frames"]
    for name in ("imu", "wheels", "lidar"):
        if not getattr(settings, name).enabled:
            del data[name]
    if not (settings.scan.enabled or settings.senses.tells_body):
        del data["sent"]
    if not settings.asked:
        del data["asked"]
    if settings.depth_sensor == IDEAL_DEPTH:
        del data["depth_sensor"]
    return json.dumps(data, separators=(",", ":"))


def settings_from_json(text: str) -> FrameSettings:
    """Read settings.

    Raises:
        FieldError: the text is no JSON of settings; one line with the field's path.
    """
    return from_json(FrameSettings, text, "settings", MAX_TEXT_LENGTH)
