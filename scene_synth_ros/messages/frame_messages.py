"""A frame as messages: one row of the layer table a stream, one namespace a stream, its own camera info in each.  No node here."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, make_dataclass
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import PointCloud2, PointField

from renderer.camera.cloud_fields import cloud_fields
from renderer.camera.config import CameraConfig
from renderer.camera.point_cloud import cloud_points
from renderer.camera.rig import mounted_path
from renderer.film.frame import Frame
from renderer.film.layer import Layer
from renderer.film.layers import LAYERS, ROWS, layers_in
from scene_description import CameraPose, Limits, SceneDescription
from scene_description.label_standards import StandardName
from scene_description.labels import LabelTable
from scene_synth_ros.messages import streams
from scene_synth_ros.messages.canonical_cdr import camera_info_cdr, image_cdr
from scene_synth_ros.messages.conversions import (
    camera_info_to_msg,
    depth_to_millimetres,
    header,
    image_to_msg,
    labels_to_msg,
    layer_encoding,
    pose_to_msg,
)
from scene_synth_ros.messages.detections import ANNOTATIONS, annotations_to_msg
from scene_synth_ros.messages.label_info import label_info_to_msg
from scene_synth_ros.messages.message_definitions import installed_class
from scene_synth_ros.messages.streams import FRAME_PREFIX, POINTS, POINTS_SENSED, ROLES, Role, Stream, camera_frames

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
class _StreamForms(_LayerSwitches):  # type: ignore[misc]
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


_OPTIONS: Mapping[str, Mapping[str, Limits]] = {
    "annotations": {
        "annotation_masks": Limits(
            description="Put masks into the annotations, run lengths in COCO's form", fixed="a run has one kind of annotations"
        )
    },
    "points_sensed": {"points_color": Limits(description="Give the points their colour, which must be rendered", fixed=_STREAMS_FIXED)},
}
"""Switch of a role -> what else there is to switch, after it."""


def _camera_switches() -> Iterator[tuple[str, object, bool]]:
    """Yield a field for each role that a camera may have, off, and those of ``_OPTIONS``."""
    for role in ROLES.values():
        if role.summary:
            yield role.switch, Annotated[bool, Limits(description=f"Publish {role.summary}", fixed=_STREAMS_FIXED)], False
            for name, limits in _OPTIONS.get(role.switch, {}).items():
                yield name, Annotated[bool, limits], False


_CameraSwitches: type = make_dataclass("_CameraSwitches", _camera_switches(), bases=(_StreamForms,), frozen=True, slots=True, kw_only=True)
"""A bool for each role of a camera, after the rest."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StreamConfig(_CameraSwitches):  # type: ignore[misc]
    """Which streams a renderer publishes, and under which names; the switch of a layer or a role of a camera has its name."""


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


class CameraRole(NamedTuple):
    """How a role of a camera is filled: the layers that a frame must have for it, and what makes its message, or None of such a frame."""

    layers: Callable[[StreamConfig, Role], tuple[str, ...]]
    make: "Callable[[FrameMessages, Frame, CameraPose, Role], object]"


def _is_enabled(config: StreamConfig, role: Role) -> bool:
    return getattr(config, role.switch) and installed_class(role.type_name) is not None


def camera_streams(config: StreamConfig, camera: CameraConfig) -> dict[Stream, tuple[str, ...]]:
    """Return the enabled ones of ``CAMERA_ROLES`` -> layers that they need, enabled or not; no depth sensor has the lens of a panorama."""
    needed = {Stream(config.camera, role): row.layers(config, role) for role, row in CAMERA_ROLES.items() if _is_enabled(config, role)}
    sensed = camera.model != "equirectangular"
    return {stream: layers for stream, layers in needed.items() if sensed or "depth_sensed" not in layers}


def layer_streams(config: StreamConfig, layer: str) -> dict[Role, Stream]:
    """Return what is published of an enabled layer beside its compressed form, by role."""
    row = LAYERS[layer]
    pictures = [streams.PICTURE] if has_companion(row) and config.color_companions else []
    labels = [streams.LABELS, streams.LABEL_INFO] if row.labels is not None else []
    roles = [streams.RAW, *pictures, streams.INFO, *labels]
    return {role: Stream(config.camera, role, layer) for role in roles if installed_class(role.type_name) is not None}


class MessageForm(NamedTuple):
    """What makes images of pixels, encoding, stamp and frame, and camera infos of camera, stamp and frame: as messages or as CDR."""

    image: Callable[[NDArray[Any], str, int, str], object]
    camera_info: Callable[[CameraConfig, int, str], object]


MESSAGES = MessageForm(image_to_msg, camera_info_to_msg)
SERIALISED = MessageForm(image_cdr, camera_info_cdr)


class FrameMessages:
    """Makes the messages of frames; the same pixels, pose and configuration give the same messages.

    Images and camera infos have the ``form`` that is asked for; nothing else is ever serialised here.

    Attributes:
        layers: enabled ones.
        camera_streams: enabled ones -> layers that they need, enabled or not.
    """

    def __init__(self, config: StreamConfig, camera: CameraConfig, form: MessageForm = MESSAGES) -> None:
        self.config, self.camera, self._form = config, camera, form
        self.layers = enabled_layers(config, camera)
        self.camera_streams = camera_streams(config, camera)
        self.frame_id = camera_frames(config.camera, config.frame_prefix).optical
        self.path: Sequence[CameraPose] = ()
        self._rows = layers_in(config.semantic_classes)
        self._streams = {layer: layer_streams(config, layer) for layer in self.layers}

    @property
    def rendered(self) -> set[str]:
        """The layers that a renderer makes for all of it."""
        return {*self.layers, *(layer for needed in self.camera_streams.values() for layer in needed)} - {ANNOTATIONS}

    def begin_room(self, scene: SceneDescription) -> None:
        """Take the label tables of a room, and its path."""
        self.path = mounted_path(self.camera, scene.camera_path, scene.motion)
        tables = {layer: self._rows[layer].labels for layer in self.layers}
        self._labels: Mapping[str, LabelTable] = {layer: table(scene) for layer, table in tables.items() if table is not None}

    def of_frame(self, frame: Frame, pose: CameraPose, wanted: Callable[[str], bool]) -> Iterator[tuple[str, object]]:
        """Yield topic below the namespace and message, all with the stamp of the pose.

        What the frame lacks is represented by what needs no pixels.  ``wanted`` says, by topic, whether what nobody must have is to be
        made.
        """
        if self.config.publish_pose:
            yield Stream(self.config.camera, streams.POSE).topic, pose_to_msg(pose, self.config.world_frame)
        for layer, image in frame.layers.items():
            if layer in self.layers:
                yield from self._of_layer(layer, image, pose.stamp_ns, wanted)
        for layer in self.layers:
            if layer not in frame.layers:
                yield from self._beside_layer(layer, pose.stamp_ns, wanted)
        for stream in self.camera_streams:
            if wanted(stream.topic):
                message = CAMERA_ROLES[stream.role].make(self, frame, pose, stream.role)
                if message is not None:
                    yield stream.topic, message

    def _beside_layer(self, layer: str, stamp_ns: int, wanted: Callable[[str], bool]) -> Iterator[tuple[str, object]]:
        """Yield what goes with a layer's images and needs no pixels."""
        topics = {role: stream.topic for role, stream in self._streams[layer].items() if wanted(stream.topic)}
        if streams.INFO in topics:
            yield topics[streams.INFO], self._form.camera_info(self.camera, stamp_ns, self.frame_id)
        if streams.LABELS in topics:
            yield topics[streams.LABELS], labels_to_msg(self._labels[layer], stamp_ns, self.config.semantic_classes)
        if streams.LABEL_INFO in topics:
            yield topics[streams.LABEL_INFO], label_info_to_msg(self._labels[layer], stamp_ns, self.frame_id)

    def _of_layer(self, layer: str, image: NDArray[Any], stamp_ns: int, wanted: Callable[[str], bool]) -> Iterator[tuple[str, object]]:
        row, of_layer = self._rows[layer], self._streams[layer]
        encoding, raw = layer_encoding(row), image
        if row.compression == "depth" and self.config.depth_encoding == "16UC1":
            raw, encoding = depth_to_millimetres(image), "16UC1"
        yield from self._beside_layer(layer, stamp_ns, lambda _: True)
        yield of_layer[streams.RAW].topic, self._form.image(raw, encoding, stamp_ns, self.frame_id)
        picture = of_layer.get(streams.PICTURE)
        if picture is not None and wanted(picture.topic):
            yield picture.topic, self._form.image(companion(row, image), picture.role.encoding, stamp_ns, self.frame_id)


def _annotation(maker: FrameMessages, frame: Frame, pose: CameraPose, role: Role) -> object:
    return None if frame.annotations is None else annotations_to_msg(role, frame.annotations, maker.frame_id)


def _cloud(maker: FrameMessages, frame: Frame, pose: CameraPose, role: Role) -> object:
    if not set(maker.camera_streams[Stream(maker.config.camera, role)]) <= frame.layers.keys():
        return None
    return cloud_of_layers(maker.camera, pose, maker.path, frame.layers, role, maker.config.points_color, maker.frame_id)


CLOUDS = {POINTS: "range", POINTS_SENSED: "depth_sensed"}
"""Role of a cloud -> the layer that says how far its points are."""


def cloud_layers(role: Role, color: bool) -> tuple[str, ...]:
    """Return the layers that a cloud is made of."""
    return (CLOUDS[role], "semantic", "instance", *(("color",) if color else ()))


def cloud_of_layers(
    camera: CameraConfig,
    pose: CameraPose,
    path: Sequence[CameraPose],
    layers: Mapping[str, NDArray[Any]],
    role: Role,
    color: bool,
    frame_id: str,
) -> PointCloud2:
    """Return a cloud of a frame's ``cloud_layers``, organised as its images are, in the optical frame at the pose's stamp."""
    distance = CLOUDS[role]
    values = {"color": layers["color"] if color else None, "label": layers["semantic"], "instance": layers["instance"]}
    points = cloud_points(camera, pose, path, layers[distance], along_ray=distance == "range", **values)
    return cloud_to_msg(points, color, pose.stamp_ns, frame_id)


def cloud_to_msg(points: NDArray[np.uint8], color: bool, stamp_ns: int, frame_id: str) -> PointCloud2:
    """Return points with label and instance, and with rgb if ``color``, as ``cloud_points`` makes them, as a message."""
    places = cloud_fields(color=color, label=True, instance=True)
    message = PointCloud2(header=header(stamp_ns, frame_id), height=points.shape[0], width=points.shape[1], is_dense=False)
    message.fields = [PointField(name=name, offset=4 * i, datatype=PointField.FLOAT32, count=1) for i, name in enumerate("xyz")]
    for name, datatype in (("rgb", PointField.FLOAT32), ("label", PointField.UINT16), ("instance", PointField.UINT16)):
        offset = getattr(places, name)
        if offset >= 0:
            message.fields.append(PointField(name=name, offset=offset, datatype=datatype, count=1))
    message.point_step, message.row_step = places.size, places.size * points.shape[1]
    message.data.frombytes(points.data.cast("B"))
    return message


CAMERA_ROLES: Mapping[Role, CameraRole] = {
    **dict.fromkeys(
        (streams.ANNOTATIONS, streams.DETECTIONS_2D, streams.DETECTIONS_3D), CameraRole(lambda config, role: (ANNOTATIONS,), _annotation)
    ),
    **dict.fromkeys(CLOUDS, CameraRole(lambda config, role: cloud_layers(role, config.points_color), _cloud)),
}
"""Role of a camera -> how it is filled, in the order in which they are published; its pose comes with every frame."""
