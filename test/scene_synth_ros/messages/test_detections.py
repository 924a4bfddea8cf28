"""Detections made of annotations, against rclpy's own serialisation and two independent decoders."""

import json

import mcap_ros2.decoder
import numpy as np
import pytest
from box_room import pose
from box_scene import annotated, crate
from mcap.records import Schema
from rclpy.serialization import deserialize_message, serialize_message
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from std_msgs.msg import String

from renderer import CameraConfig
from scene_description.annotations import FrameAnnotations, annotations_to_json
from scene_description.labels import NYU40
from scene_description.poses import rotation_from_quaternion
from scene_synth_ros.messages.detections import (
    ANNOTATION_MESSAGES,
    AnnotationsReadError,
    encode_detections,
    read_annotations,
)
from scene_synth_ros.messages.message_definitions import message_class, message_definition
from scene_synth_ros.messages.stamps import stamp_ns
from scene_synth_ros.messages.streams import ANNOTATIONS, DETECTIONS_2D, DETECTIONS_3D, ROLES, derived_streams, parse, source_topic

STRING, TOPIC, FRAME = "std_msgs/msg/String", "/synth/eye/annotations", "eye_optical_frame"
DETECTION_TYPES = {role.name: role.type_name for role in (DETECTIONS_2D, DETECTIONS_3D)}
STORE = get_typestore(Stores.ROS2_JAZZY)
for type_name in DETECTION_TYPES.values():
    STORE.register(get_types_from_msg(message_definition(type_name).text, type_name))
VIEW = pose((-3.0, 0.0, 1.0), (0.0, 0.0, 1.0))


def decoders(type_name):
    text = message_definition(type_name).text
    yield mcap_ros2.decoder.DecoderFactory().decoder_for("cdr", Schema(id=1, name=type_name, encoding="ros2msg", data=text.encode()))
    yield lambda data: STORE.deserialize_cdr(data, type_name)
    yield lambda data: deserialize_message(data, message_class(type_name))


@pytest.fixture(scope="module")
def told() -> FrameAnnotations:
    crates = [crate(2, (0.0, 0.5, 0.0), (0.5, 0.6, 1.5), 0.3, label=4), crate(117, (1.5, -0.4, 0.0), (1.0, 1.2, 1.0))]
    return annotated(crates, VIEW, CameraConfig(width=160, height=120), masks=True).annotations


@pytest.mark.parametrize("name", DETECTION_TYPES)
def test_what_the_recorder_derives_is_what_the_renderer_publishes(told, name):
    type_name = DETECTION_TYPES[name]
    derived = encode_detections(type_name, read_annotations(bytes(serialize_message(String(data=annotations_to_json(told))))), FRAME)
    live = bytes(serialize_message(ANNOTATION_MESSAGES[ROLES[name]](told, FRAME)))
    assert derived == bytes(STORE.serialize_cdr(STORE.deserialize_cdr(live, type_name), type_name))  # gaps between fields are zero


def test_decoders_read_the_visible_boxes(told):
    data = encode_detections(DETECTION_TYPES["detections_2d"], told, FRAME)
    for decode in decoders(DETECTION_TYPES["detections_2d"]):
        message = decode(data)
        assert (message.header.frame_id, message.header.stamp.sec, message.header.stamp.nanosec) == (FRAME, 0, VIEW.stamp_ns)
        for found, item in zip(message.detections, told.objects, strict=True):
            assert found.header.frame_id == FRAME and found.id == str(item.id)
            (result,) = found.results
            assert (NYU40[int(result.hypothesis.class_id)].name, result.hypothesis.score) == (item.label_name, 1.0)
            own, bounds = item.visible_box, found.bbox
            assert (bounds.center.position.x - bounds.size_x / 2, bounds.center.position.y - bounds.size_y / 2) == (own.x, own.y)
            assert (bounds.size_x, bounds.size_y, bounds.center.theta) == (own.width, own.height, 0.0)
            position, q = result.pose.pose.position, result.pose.pose.orientation
            assert ((position.x, position.y, position.z), (q.x, q.y, q.z, q.w)) == (item.camera_box.center_m, item.camera_box.orientation)
            assert not np.any(result.pose.covariance)


def test_decoders_read_the_oriented_boxes(told):
    data = encode_detections(DETECTION_TYPES["detections_3d"], told, FRAME)
    turn = rotation_from_quaternion(VIEW.orientation)
    for decode in decoders(DETECTION_TYPES["detections_3d"]):
        for found, item in zip(decode(data).detections, told.objects, strict=True):
            size, position = found.bbox.size, found.bbox.center.position
            assert found.id == str(item.id) and (size.x, size.y, size.z) == item.world_box.size_m
            np.testing.assert_allclose(turn @ (position.x, position.y, position.z) + VIEW.position_m, item.world_box.center_m, atol=2e-6)


def test_a_frame_without_objects_has_empty_detections(told):
    bare = FrameAnnotations(stamp_ns=5, scene="s", width=4, height=3, objects=(), relations=())
    for type_name in DETECTION_TYPES.values():
        for decode in decoders(type_name):
            assert list(decode(encode_detections(type_name, bare, FRAME)).detections) == []


def test_the_json_has_a_stamp_that_recorders_read(told):
    assert stamp_ns(STRING, bytes(serialize_message(String(data=annotations_to_json(told))))) == VIEW.stamp_ns


def test_topics_of_annotations_and_detections_belong_together():
    made = derived_streams(TOPIC)
    assert parse(TOPIC, STRING).role is ANNOTATIONS and {s.frame_id("robot1/") for s in made} == {"robot1/eye_optical_frame"}
    assert {s.topic: s.role.type_name for s in made} == {f"/synth/eye/{name}": type_name for name, type_name in DETECTION_TYPES.items()}
    assert all(source_topic(stream.topic) == TOPIC for stream in made)
    assert source_topic(TOPIC) == "" and parse(TOPIC, "sensor_msgs/msg/Image") is None


@pytest.mark.parametrize("change", [{"schema": "other"}, {"objects": [{"id": 0}]}, {"width": -1}, {"color": 1}])
def test_what_is_no_annotations_is_refused_in_one_line(told, change):
    text = json.dumps(json.loads(annotations_to_json(told)) | change)
    with pytest.raises(AnnotationsReadError, match=r"^annotations cannot be read .*annotations\."):
        read_annotations(bytes(serialize_message(String(data=text))))


def test_bytes_that_are_no_message_are_refused():
    with pytest.raises(AnnotationsReadError):
        read_annotations(b"\x00\x01\x00\x00" + b"\xff" * 9)
