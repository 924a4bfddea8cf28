"""A frame as messages: one row of the layer table a stream, one namespace a stream, its own camera info in each.  No node here."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, make_dataclass
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.camera.config import CameraConfig
from renderer.camera.rig import mounted_path
from renderer.film.frame import Frame
from renderer.film.layer import Layer
from renderer.film.layers import LAYERS, ROWS, layers_in
from scene_description import CameraPose, Limits, SceneDescription
from scene_description.label_standards import StandardName
from scene_description.labels import LabelTable
from scene_synth_ros.messages.camera_frames import FRAME_PREFIX, camera_frames
from scene_synth_ros.messages.canonical_cdr import camera_info_cdr, image_cdr
from scene_synth_ros.messages.cloud_messages import CLOUDS, cloud_layers
from scene_synth_ros.messages.conversions import (
    camera_info_to_msg,
    depth_to_millimetres,
    image_to_msg,
    labels_to_msg,
    layer_encoding,
    pose_to_msg,
)
from scene_synth_ros.messages.detections import ANNOTATION_MESSAGES
from scene_synth_ros.messages.label_info import LabelInfo, label_info_to_msg
from scene_synth_ros.messages.layer_clouds import cloud_of_layers

_STREAMS_FIXED = "publishers are made at the start"


@dataclass(frozen=True, slots=True, kw_only=True)
class _StreamNames:
    camera: Annotated[
        str,
        Limits(
            min_length=1,
            max_length=80,
            pattern=r"[A-Za-z][A-Za-z0-9_]*",
            description="Camera name in topics and frames",
            fixed=_STREAMS_FIXED,
        ),
    ] = "camera"
    world_frame: Annotated[str, Limits(min_length=1, max_length=100, description="Frame of poses", fixed=_STREAMS_FIXED)] = "map"


_LayerSwitches: type = make_dataclass(
    "_LayerSwitches",
    [(row.name, Annotated[bool, Limits(description=f"Publish {row.summary}", fixed=_STREAMS_FIXED)], row.published) for row in ROWS],
    bases=(_StreamNames,),
    frozen=True,
    slots=True,
    kw_only=True,
)
"""A bool for each layer, after the names."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StreamConfig(_LayerSwitches):  # type: ignore[misc]
    """Which streams a renderer publishes, and under which names; a layer's switch has the layer's name."""

    color_companions: Annotated[
        bool, Limits(description="Publish image_color for streams that viewers cannot show", fixed=_STREAMS_FIXED)
    ] = True
    depth_encoding: Annotated[
        Literal["32FC1", "16UC1"], Limits(description="Depth in metres (32FC1) or millimetres (16UC1)", fixed="a bag has one encoding")
    ] = "32FC1"
    semantic_classes: Annotated[
        StandardName, Limits(description="Standard of the class ids of the semantic layer", fixed="a bag has one standard")
    ] = "nyu40"
    qos: Annotated[
        Literal["reliable", "deep", "latest", "sensor_data"],
        Limits(description="Named QoS profile of images, camera info and poses", fixed=_STREAMS_FIXED),
    ] = "reliable"
    lazy: Annotated[bool, Limits(description="Render only what somebody subscribes to")] = True
    publish_clock: Annotated[bool, Limits(description="Publish /clock; one renderer of a run does", fixed=_STREAMS_FIXED)] = True
    publish_pose: Annotated[bool, Limits(description="Publish the camera's pose; one renderer of a camera does", fixed=_STREAMS_FIXED)] = (
        True
    )
    frame_prefix: Annotated[
        str,
        Limits(
            max_length=100,
            pattern=FRAME_PREFIX,
            description="Stands before the camera's frames, as of robot_state_publisher: robot1/",
            fixed=_STREAMS_FIXED,
        ),
    ] = ""
    publish_tf: Annotated[bool, Limits(description="Publish /tf and /tf_static where tf2_msgs is there", fixed=_STREAMS_FIXED)] = True
    annotations: Annotated[
        bool, Limits(description="Publish boxes, key points and relations of the objects in each frame", fixed=_STREAMS_FIXED)
    ] = False
    annotation_masks: Annotated[
        bool, Limits(description="Put masks into the annotations, run lengths in COCO's form", fixed="a run has one kind of annotations")
    ] = False
    points: Annotated[bool, Limits(description="Publish points: the view as an organised cloud, with ids", fixed=_STREAMS_FIXED)] = False
    points_sensed: Annotated[
        bool, Limits(description="Publish points_sensed: the same cloud of what depth_sensor reads", fixed=_STREAMS_FIXED)
    ] = False
    points_color: Annotated[bool, Limits(description="Give the points their colour, which must be rendered", fixed=_STREAMS_FIXED)] = False


def has_companion(layer: Layer) -> bool:
    """Return whether viewers cannot show the raw image, so that a picture of it goes with it: ids, several numbers a pixel."""
    return layer.labels is not None or (layer.dtype == "float32" and layer.channels > 1)


def companion(layer: Layer, image: NDArray[Any]) -> NDArray[np.uint8]:
    """Return the picture of a layer that :func:`has_companion`, as (height, width, 3) uint8."""
    picture = layer.picture.of(image)
    return picture if picture.ndim == 3 else np.repeat(picture[..., None], 3, axis=2)


def enabled_layers(config: StreamConfig, camera: CameraConfig) -> tuple[str, ...]:
    """Return the layers that are published; a panorama sees all around, where depth along one axis means nothing: range instead."""
    enabled = {layer for layer in LAYERS if getattr(config, layer)}
    if camera.model == "equirectangular" and "depth" in enabled:
        enabled = enabled - {"depth"} | {"range"}
    if camera.model == "equirectangular":
        enabled.discard("depth_sensed")
    return tuple(layer for layer in LAYERS if layer in enabled)


def enabled_clouds(config: StreamConfig, camera: CameraConfig) -> tuple[str, ...]:
    """Return the clouds that are published; no depth sensor has the lens of a panorama."""
    sensed = camera.model != "equirectangular"
    return tuple(name for name in CLOUDS if getattr(config, name) and (sensed or name != "points_sensed"))


def cloud_topics(config: StreamConfig, camera: CameraConfig) -> dict[str, tuple[str, ...]]:
    """Return topic of each enabled cloud, below the namespace -> layers that it is made of, enabled or not."""
    names = enabled_clouds(config, camera)
    return {f"{config.camera}/{name}": cloud_layers(name, config.points_color) for name in names}


class MessageForm(NamedTuple):
    """What makes images of pixels, encoding, stamp and frame, and camera infos of camera, stamp and frame: as messages or as CDR."""

    image: Callable[[NDArray[Any], str, int, str], object]
    camera_info: Callable[[CameraConfig, int, str], object]


MESSAGES = MessageForm(image_to_msg, camera_info_to_msg)
SERIALISED = MessageForm(image_cdr, camera_info_cdr)


class FrameMessages:
    """Makes the messages of frames; the same pixels, pose and configuration give the same messages.

    Args:
        config: names and encodings.
        camera: for the camera info.
        form: of images and camera infos; nothing else is ever serialised here.
    """

    def __init__(self, config: StreamConfig, camera: CameraConfig, form: MessageForm = MESSAGES) -> None:
        self._config, self._camera, self._form = config, camera, form
        self.layers = enabled_layers(config, camera)
        """Enabled layers."""
        self._rows = layers_in(config.semantic_classes)
        self.clouds = cloud_topics(config, camera)
        """Topic of each enabled cloud -> layers that it is made of, enabled or not."""
        self._path: Sequence[CameraPose] = ()

    def begin_room(self, scene: SceneDescription) -> None:
        """Take the label tables of a room, and its path."""
        self._path = mounted_path(self._camera, scene.camera_path)
        tables = {layer: self._rows[layer].labels for layer in self.layers}
        self.begin_labels({layer: table(scene) for layer, table in tables.items() if table is not None})

    def begin_labels(self, labels: Mapping[str, LabelTable]) -> None:
        """Take the label tables of the layers that hold ids."""
        self._labels = labels

    def of_frame(self, frame: Frame, pose: CameraPose, wanted: Callable[[str], bool]) -> Iterator[tuple[str, object]]:
        """Yield topic below the namespace and message, all with the stamp of the pose.

        Args:
            frame: its layers, or some of them; the others are represented by what needs no pixels.
            pose: of the optical frame.
            wanted: whether a picture for people, or what goes with a layer that the frame lacks, given by topic, are to be made.
        """
        if self._config.publish_pose:
            yield f"{self._config.camera}/pose", pose_to_msg(pose, self._config.world_frame)
        for layer, image in frame.layers.items():
            if layer in self.layers:
                yield from self._of_layer(layer, image, pose.stamp_ns, wanted)
        for topic, layers in self.clouds.items():
            if set(layers) <= frame.layers.keys() and wanted(topic):
                name, color = topic.rpartition("/")[2], self._config.points_color
                yield topic, cloud_of_layers(self._camera, pose, self._path, frame.layers, name, color, self._frame_id)
        for layer in self.layers:
            if layer not in frame.layers:
                yield from self._beside_layer(layer, pose.stamp_ns, wanted)
        if frame.annotations is not None:
            for name, row in ANNOTATION_MESSAGES.items():
                if wanted(f"{self._config.camera}/{name}"):
                    yield f"{self._config.camera}/{name}", row.make(frame.annotations, self._frame_id)

    @property
    def _frame_id(self) -> str:
        return camera_frames(self._config.camera, self._config.frame_prefix).optical

    def _beside_layer(self, layer: str, stamp_ns: int, wanted: Callable[[str], bool]) -> Iterator[tuple[str, object]]:
        """Yield what goes with a layer's images and needs no pixels."""
        info, labels, classes = (f"{self._config.camera}/{layer}/{name}" for name in ("camera_info", "labels", "label_info"))
        if wanted(info):
            yield info, self._form.camera_info(self._camera, stamp_ns, self._frame_id)
        if layer in self._labels and wanted(labels):
            yield labels, labels_to_msg(self._labels[layer], stamp_ns, self._config.semantic_classes)
        if layer in self._labels and LabelInfo is not None and wanted(classes):
            yield classes, label_info_to_msg(self._labels[layer], stamp_ns, self._frame_id)

    def _of_layer(self, layer: str, image: NDArray[Any], stamp_ns: int, wanted: Callable[[str], bool]) -> Iterator[tuple[str, object]]:
        row, base, frame_id = self._rows[layer], f"{self._config.camera}/{layer}", self._frame_id
        encoding, raw = layer_encoding(row), image
        if row.compression == "depth" and self._config.depth_encoding == "16UC1":
            raw, encoding = depth_to_millimetres(image), "16UC1"
        yield from self._beside_layer(layer, stamp_ns, lambda _: True)
        yield f"{base}/image_raw", self._form.image(raw, encoding, stamp_ns, frame_id)
        color = f"{base}/image_color"
        if has_companion(row) and self._config.color_companions and wanted(color):
            yield color, self._form.image(companion(row, image), "rgb8", stamp_ns, frame_id)
