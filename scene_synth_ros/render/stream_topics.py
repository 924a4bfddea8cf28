"""The topics of one camera, its scanner and its body: the renderer's publishers are made of them, and so are bags written offline."""

from collections.abc import Iterator
from copy import copy
from typing import NamedTuple

from rclpy.qos import QoSProfile

from renderer.camera.config import CameraConfig
from renderer.film.layers import LAYERS
from scene_synth_ros.messages import streams
from scene_synth_ros.messages.body_messages import body_streams
from scene_synth_ros.messages.frame_messages import StreamConfig, camera_streams, enabled_layers, layer_streams
from scene_synth_ros.messages.image_codec import compressed_topic
from scene_synth_ros.messages.message_definitions import installed_class
from scene_synth_ros.messages.scan_messages import SCAN_STREAMS
from scene_synth_ros.messages.senses import Senses
from scene_synth_ros.messages.streams import Stream, parse
from scene_synth_ros.suite.qos import BURST_DEPTH, CLOUD_DEPTH, PROFILES, latched_qos, stream_qos

TFMessage = installed_class(streams.TF.type_name)
CLOCK, SETTINGS = Stream("/", streams.CLOCK).topic, Stream("~", streams.SETTINGS).topic
TF, TF_STATIC = Stream("/", streams.TF).topic, Stream("/", streams.TF_STATIC).topic
_OWN_QOS = {streams.CLOCK: stream_qos(BURST_DEPTH), streams.TF: stream_qos(BURST_DEPTH), streams.TF_STATIC: latched_qos()}
"""Of what is not of one camera."""


class StreamTopic(NamedTuple):
    """A topic: its name below the namespace, its type and QoS, and the layers that must be rendered for who subscribes to it."""

    name: str
    message_type: type
    qos: QoSProfile
    layers: frozenset[str] = frozenset()


def stream_topics(config: StreamConfig, camera: CameraConfig, senses: Senses) -> dict[str, StreamTopic]:
    """Return name -> topic, in the order in which they are published first; those whose messages have no package here are left out.

    ``ANNOTATIONS`` stands among the layers for what is told of objects.  Camera info and labels need no pixels.
    """
    profile = PROFILES[config.qos]
    topics = {}
    for stream, layers in _published(config, camera, senses):
        role, message_type = stream.role, installed_class(stream.role.type_name)
        if message_type is not None:
            qos = _OWN_QOS.get(role, latched_qos(profile.depth) if role.latched else profile)
            if role.own_stamps and not role.latched:
                qos = copy(qos)
                qos.depth = CLOUD_DEPTH if role.type_name == streams.CLOUD_TYPE else BURST_DEPTH
            topics[stream.topic] = StreamTopic(stream.topic, message_type, qos, frozenset(layers))
    return topics


def _published(config: StreamConfig, camera: CameraConfig, senses: Senses) -> Iterator[tuple[Stream, tuple[str, ...]]]:
    """Yield every stream, and the layers that must be rendered for it."""
    if config.publish_clock:
        yield Stream("/", streams.CLOCK), ()
    if config.publish_pose:
        yield Stream(config.camera, streams.POSE), ()
    yield Stream("~", streams.SETTINGS), ()
    for layer in enabled_layers(config, camera):
        for role, stream in layer_streams(config, layer).items():
            if role is streams.INFO and LAYERS[layer].compression:
                compressed = parse(compressed_topic(stream.beside(streams.RAW).topic))
                assert compressed is not None
                yield compressed, (layer,)
            yield stream, (layer,) if role in (streams.RAW, streams.PICTURE) else ()
    yield from camera_streams(config, camera).items()
    for stream in (*(SCAN_STREAMS if senses.scan.enabled else ()), *body_streams(senses)):
        yield stream, ()
    for role in (streams.TF, streams.TF_STATIC) if config.publish_tf else ():
        yield Stream("/", role), ()
