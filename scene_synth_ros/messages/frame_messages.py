"""A frame as messages: one table row a stream, one namespace a stream, its own camera info in each.  No node here."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.camera.config import CameraConfig
from renderer.film.false_color import ids_to_color, noise_to_grey, normals_to_color
from renderer.film.frame import Frame
from renderer.film.tone import encode_srgb
from scene_description import CameraPose, Limits, SceneDescription
from scene_description.labels import instance_palette, label_palette
from scene_synth_ros.messages.conversions import (
    camera_info_to_msg,
    depth_to_millimetres,
    image_to_msg,
    instance_labels,
    labels_to_msg,
    pose_to_msg,
    semantic_labels,
)

_STREAMS_FIXED = "publishers are made at the start"


@dataclass(frozen=True, slots=True, kw_only=True)
class StreamConfig:
    """Which streams a renderer publishes, and under which names."""

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
    color: Annotated[bool, Limits(description="Publish colour", fixed=_STREAMS_FIXED)] = True
    depth: Annotated[
        bool, Limits(description="Publish depth along the optical axis; a panorama publishes range instead", fixed=_STREAMS_FIXED)
    ] = True
    range: Annotated[bool, Limits(description="Publish range, the distance along each ray", fixed=_STREAMS_FIXED)] = False
    color_noisy: Annotated[bool, Limits(description="Publish colour before denoising", fixed=_STREAMS_FIXED)] = False
    albedo: Annotated[bool, Limits(description="Publish the base colour of what is seen", fixed=_STREAMS_FIXED)] = False
    radiance: Annotated[bool, Limits(description="Publish linear colour in cd/m2", fixed=_STREAMS_FIXED)] = False
    variance: Annotated[bool, Limits(description="Publish the variance of the colour before denoising", fixed=_STREAMS_FIXED)] = False
    samples: Annotated[bool, Limits(description="Publish how many samples colour is made of", fixed=_STREAMS_FIXED)] = False
    normals: Annotated[bool, Limits(description="Publish surface normals", fixed=_STREAMS_FIXED)] = True
    semantic: Annotated[bool, Limits(description="Publish NYU40 class ids", fixed=_STREAMS_FIXED)] = True
    instance: Annotated[bool, Limits(description="Publish object ids", fixed=_STREAMS_FIXED)] = True
    color_companions: Annotated[
        bool, Limits(description="Publish image_color for streams that viewers cannot show", fixed=_STREAMS_FIXED)
    ] = True
    depth_encoding: Annotated[
        Literal["32FC1", "16UC1"], Limits(description="Depth in metres (32FC1) or millimetres (16UC1)", fixed="a bag has one encoding")
    ] = "32FC1"
    qos: Annotated[
        Literal["reliable", "deep", "latest", "sensor_data"],
        Limits(description="Named QoS profile of images, camera info and poses", fixed=_STREAMS_FIXED),
    ] = "reliable"
    lazy: Annotated[bool, Limits(description="Render only what somebody subscribes to")] = True
    publish_clock: Annotated[bool, Limits(description="Publish /clock; one renderer of a run does", fixed=_STREAMS_FIXED)] = True
    publish_pose: Annotated[bool, Limits(description="Publish the camera's pose; one renderer of a camera does", fixed=_STREAMS_FIXED)] = (
        True
    )
    publish_tf: Annotated[bool, Limits(description="Publish /tf and /tf_static where tf2_msgs is there", fixed=_STREAMS_FIXED)] = True


class Stream(NamedTuple):
    """A stream: its encoding on ``image_raw``, and how its picture for people is made from the pixels and the palettes."""

    encoding: str
    companion: Callable[[NDArray[Any], Palettes], NDArray[np.uint8]] | None


class Palettes(NamedTuple):
    """RGB tables, (n, 3) uint8: by class id and by object id of the scene."""

    semantic: NDArray[np.uint8]
    instance: NDArray[np.uint8]


_GREY = 0.18
"""Of white, what the mean of linear colour becomes in its picture."""

STREAMS: dict[str, Stream] = {
    "color": Stream("rgb8", None),
    "depth": Stream("32FC1", None),
    "range": Stream("32FC1", None),
    "normals": Stream("32FC3", lambda image, _: normals_to_color(image)),
    "semantic": Stream("mono8", lambda image, palettes: ids_to_color(image, palettes.semantic)),
    "instance": Stream("16UC1", lambda image, palettes: ids_to_color(image, palettes.instance)),
    "color_noisy": Stream("rgb8", None),
    "albedo": Stream("32FC3", lambda image, _: encode_srgb(image)),
    "radiance": Stream("32FC3", lambda image, _: encode_srgb(image * np.float32(_GREY / max(float(image.mean()), 1e-9)), "filmic")),
    "variance": Stream("32FC3", lambda image, _: np.repeat(noise_to_grey(image)[..., None], 3, axis=2)),
    "samples": Stream("16UC1", None),
}
"""Layer -> stream."""


def enabled_layers(config: StreamConfig, camera: CameraConfig) -> tuple[str, ...]:
    """Return the layers that are published; a panorama sees all around, where depth along one axis means nothing: range instead."""
    enabled = {layer for layer in STREAMS if getattr(config, layer)}
    if camera.model == "equirectangular" and "depth" in enabled:
        enabled = enabled - {"depth"} | {"range"}
    return tuple(layer for layer in STREAMS if layer in enabled)


class FrameMessages:
    """Makes the messages of frames; the same pixels, pose and configuration give the same messages.

    Args:
        config: names and encodings.
        camera: for the camera info.
    """

    def __init__(self, config: StreamConfig, camera: CameraConfig) -> None:
        self._config, self._camera = config, camera
        self.layers = enabled_layers(config, camera)
        """Enabled layers."""

    def begin_room(self, scene: SceneDescription) -> None:
        """Take the palettes and label tables of a room."""
        top = max((thing.id for thing in (*scene.room.openings, *scene.objects)), default=0)
        self.begin_palettes(
            Palettes(label_palette(), instance_palette(top + 1)), {"semantic": semantic_labels(), "instance": instance_labels(scene)}
        )

    def begin_palettes(self, palettes: Palettes, labels: Mapping[str, Mapping[int, Mapping[str, object]]]) -> None:
        """Take palettes and, for the layers that hold ids, the label tables."""
        self._palettes, self._labels = palettes, labels

    def of_frame(self, frame: Frame, pose: CameraPose, wanted: Callable[[str], bool]) -> Iterator[tuple[str, object]]:
        """Yield topic below the namespace and message, all with the stamp of the pose.

        Args:
            frame: its layers, or some of them.
            pose: of the optical frame.
            wanted: whether a picture for people, given by topic, is to be made.
        """
        if self._config.publish_pose:
            yield f"{self._config.camera}/pose", pose_to_msg(pose, self._config.world_frame)
        for layer, image in frame.layers.items():
            yield from self._of_layer(layer, image, pose.stamp_ns, wanted)

    def _of_layer(self, layer: str, image: NDArray[Any], stamp_ns: int, wanted: Callable[[str], bool]) -> Iterator[tuple[str, object]]:
        stream, base = STREAMS[layer], f"{self._config.camera}/{layer}"
        frame_id = f"{self._config.camera}_optical_frame"
        encoding, raw = stream.encoding, image
        if layer == "depth" and self._config.depth_encoding == "16UC1":
            raw, encoding = depth_to_millimetres(image), "16UC1"
        yield f"{base}/camera_info", camera_info_to_msg(self._camera, stamp_ns, frame_id)
        if layer in self._labels:
            yield f"{base}/labels", labels_to_msg(self._labels[layer], stamp_ns)
        yield f"{base}/image_raw", image_to_msg(raw, encoding, stamp_ns, frame_id)
        color = f"{base}/image_color"
        if stream.companion is not None and self._config.color_companions and wanted(color):
            yield color, image_to_msg(stream.companion(image, self._palettes), "rgb8", stamp_ns, frame_id)
