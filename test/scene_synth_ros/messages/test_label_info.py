"""LabelInfo made of JSON labels, against rclpy's own serialisation and two independent decoders."""

import mcap_ros2.decoder
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.records import Schema
from rclpy.serialization import deserialize_message, serialize_message
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from sample_scene import sample_scene
from std_msgs.msg import String
from vision_msgs.msg import LabelInfo, VisionClass

from scene_description.labels import instance_labels, semantic_labels
from scene_synth_ros.messages.conversions import labels_to_msg
from scene_synth_ros.messages.label_info import (
    LabelReadError,
    encode_label_info,
    is_labels,
    label_info_to_msg,
    read_labels,
)
from scene_synth_ros.messages.message_definitions import message_definition
from scene_synth_ros.messages.streams import LABEL_INFO_TYPE as LABEL_INFO
from scene_synth_ros.messages.streams import STRING_TYPE as STRING
from scene_synth_ros.messages.streams import derived_streams
from scene_synth_ros.record.frame_topics import made_of

LABELS = "/synth/eye/instance/labels"
TEXT = message_definition(LABEL_INFO).text
STORE = get_typestore(Stores.ROS2_JAZZY)
STORE.register(get_types_from_msg(TEXT, LABEL_INFO))
DECODE = mcap_ros2.decoder.DecoderFactory().decoder_for("cdr", Schema(id=1, name=LABEL_INFO, encoding="ros2msg", data=TEXT.encode()))

texts = st.text(st.characters(blacklist_characters="\0", blacklist_categories=("Cs",)), max_size=9)
tables = st.dictionaries(st.integers(0, 65535), texts, max_size=5)


def without_memory_in_gaps(message: LabelInfo) -> bytes:
    """What rclpy serialises; it leaves in the gaps between fields what was in memory, here they are zero."""
    return bytes(STORE.serialize_cdr(STORE.deserialize_cdr(serialize_message(message), LABEL_INFO), LABEL_INFO))


@settings(max_examples=80, deadline=None)
@given(st.integers(0, 2**31 * 10**9 - 1), texts, tables)
def test_the_bytes_are_those_of_rclpy_and_two_decoders_return_what_was_encoded(stamp, frame, names):
    data = encode_label_info(stamp, frame, names)
    message = LabelInfo(class_map=[VisionClass(class_id=key, class_name=name) for key, name in names.items()])
    message.header.frame_id, message.header.stamp.sec, message.header.stamp.nanosec = frame, stamp // 10**9, stamp % 10**9
    assert data == without_memory_in_gaps(message)
    assert deserialize_message(data, LabelInfo) == message
    for decoded in (DECODE(data), STORE.deserialize_cdr(data, LABEL_INFO)):
        assert {item.class_id: item.class_name for item in decoded.class_map} == names
        assert (decoded.header.frame_id, decoded.header.stamp.sec, decoded.threshold) == (frame, stamp // 10**9, 0.0)


@pytest.mark.parametrize("table", [semantic_labels(), instance_labels(sample_scene())])
def test_what_the_recorder_derives_of_labels_is_what_the_renderer_publishes(table):
    labels = read_labels(bytes(serialize_message(labels_to_msg(table, 5 * 10**9 + 7))))
    assert labels.names == {key: value["name"] for key, value in table.items()}
    derived = encode_label_info(labels.stamp_ns, derived_streams(LABELS)[0].frame_id("robot1/"), labels.names)
    assert derived == without_memory_in_gaps(label_info_to_msg(table, 5 * 10**9 + 7, "robot1/eye_optical_frame"))


def test_topics_of_labels_and_label_info_belong_together():
    assert is_labels(LABELS, STRING) and [s.topic for s in derived_streams(LABELS)] == ["/synth/eye/instance/label_info"]
    assert made_of("/synth/eye/instance/label_info") == LABELS
    assert not is_labels(LABELS, "sensor_msgs/msg/Image") and not is_labels("/synth/eye/depth/labels", STRING)
    assert made_of("/detector/label_info") == made_of(LABELS) == ""


@pytest.mark.parametrize(
    "text",
    [
        "no json",
        "[1]",
        '{"labels": {"1": {"name": "bed"}}}',
        '{"stamp_ns": 5, "labels": {"bed": {"name": "bed"}}}',
        '{"stamp_ns": 5, "labels": {"1": "bed"}}',
        '{"stamp_ns": 5, "labels": {"1": {"name": 7}}}',
        '{"stamp_ns": 5, "labels": {"65536": {"name": "bed"}}}',
        '{"stamp_ns": 5, "labels": [1]}',
    ],
)
def test_what_is_no_labels_is_refused_in_one_line(text):
    with pytest.raises(LabelReadError, match=r"^labels cannot be read"):
        read_labels(bytes(serialize_message(String(data=text))))


def test_bytes_that_are_no_message_are_refused():
    with pytest.raises(LabelReadError):
        read_labels(b"\x00\x01\x00\x00" + b"\xff" * 9)
