"""The renderer node's own parameters."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from renderer import CameraConfig, DepthSensorConfig, RenderConfig, SensorConfig
from renderer.body.config import BodyConfig, ImuConfig, WheelsConfig
from renderer.lidar.config import ScanConfig
from renderer.lidar.sweep_config import LidarConfig
from scene_description import FieldError, Limits
from scene_synth_ros.messages.frame_messages import StreamConfig
from scene_synth_ros.messages.image_codec import LiveCompression
from scene_synth_ros.messages.senses import senses_of
from scene_synth_ros.messages.streams import LASER, LIDAR
from scene_synth_ros.render.teleop import DriveConfig
from scene_synth_ros.suite.parameters import Groups, ParameterError

_SHARE_FIXED = "the rooms of a run are shared once"


@dataclass(frozen=True, slots=True, kw_only=True)
class RendererNodeConfig:
    """How a renderer keeps pace, which rooms are its own, and where its user's models are."""

    realtime: Annotated[
        bool, Limits(description="Publish frames at their rate by the wall clock and skip late ones, instead of as fast as can be")
    ] = False
    expected_recorders: Annotated[
        int,
        Limits(ge=0, le=100, description="Recorders whose subscriptions it waits for before it says ready", fixed="peers are counted once"),
    ] = 0
    frames_ahead: Annotated[
        int,
        Limits(ge=1, le=1000, description="Frames that may be published beyond what the slowest recorder has taken, within the QoS depth"),
    ] = 8
    share_count: Annotated[int, Limits(ge=1, le=100, description="Renderers that share the rooms by index", fixed=_SHARE_FIXED)] = 1
    share_index: Annotated[
        int, Limits(ge=0, le=99, description="This one renders the rooms whose index leaves this remainder", fixed=_SHARE_FIXED)
    ] = 0
    frames_held: Annotated[
        int, Limits(ge=1, le=10_000, description="Frames of a shared room that may wait in memory until its turn comes")
    ] = 64
    catalog_dir: Annotated[
        str, Limits(max_length=1000, description="Folder of the user's models; empty: none", fixed="files are read from one folder")
    ] = ""
    autostart: Annotated[bool, Limits(description="Configure and activate at the start", fixed="it is used at the start only")] = True
    exit_when_done: Annotated[bool, Limits(description="End the process when the grammar node has finished")] = False


RENDERER_GROUPS: dict[str, type] = {
    "": RendererNodeConfig,
    "camera": CameraConfig,
    "render": RenderConfig,
    "streams": StreamConfig,
    "compressed": LiveCompression,
    "drive": DriveConfig,
    "sensor": SensorConfig,
    "depth_sensor": DepthSensorConfig,
    "scan": ScanConfig,
    "body": BodyConfig,
    "imu": ImuConfig,
    "wheels": WheelsConfig,
    "lidar": LidarConfig,
}
"""Prefix of a renderer's parameters -> dataclass that defines them."""


def refuse_contradictions(owner: str, values: Groups) -> None:
    """Refuse what is fixed at the start and does not go together.

    Raises:
        ParameterError: a share of the rooms that is none, a camera called as a scanner, or a sensor without its body.
    """
    own: RendererNodeConfig = values[""]
    if own.share_index >= own.share_count:
        raise ParameterError(f"{owner}: parameter share_index: expected less than share_count = {own.share_count}, got {own.share_index}")
    camera = values["streams"].camera
    if camera in (LASER, LIDAR) and (values["scan"].enabled or camera == LIDAR):
        raise ParameterError(f"{owner}: parameter streams.camera: expected another name than a scanner's, got '{camera}'")
    try:
        senses_of(values).check()
    except FieldError as error:
        raise ParameterError(f"{owner}: parameter {error}") from None


def catalog_folder(owner: str, values: Groups) -> Path | None:
    """Return the folder of the user's models of a renderer, None for none.

    Raises:
        ParameterError: it is no folder.
    """
    config: RendererNodeConfig = values[""]
    folder = Path(config.catalog_dir) if config.catalog_dir else None
    if folder is not None and not folder.is_dir():
        raise ParameterError(f"{owner}: parameter catalog_dir: expected a folder, got '{folder}'")
    return folder
