"""The TFMessage encoder against two independent decoders."""

import mcap_ros2.decoder
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.records import Schema
from rosbags.typesys import Stores, get_typestore

from scene_synth_ros.messages.message_definitions import message_definition
from scene_synth_ros.messages.poses import StampedTransform, encode_tf_message
from scene_synth_ros.messages.streams import TF_TYPE

STORE = get_typestore(Stores.ROS2_JAZZY)
SCHEMA = Schema(id=1, name=TF_TYPE, encoding="ros2msg", data=message_definition(TF_TYPE).text.encode())
DECODE = mcap_ros2.decoder.DecoderFactory().decoder_for("cdr", SCHEMA)

names = st.text(st.characters(blacklist_characters="\0", blacklist_categories=("Cs",)), max_size=12)
numbers = st.floats(-1e6, 1e6)
transforms = st.builds(
    StampedTransform,
    st.integers(0, 2**31 * 10**9 - 1),
    names,
    names,
    st.tuples(numbers, numbers, numbers),
    st.tuples(numbers, numbers, numbers, numbers),
)


def fields(item):
    transform = item.transform
    return StampedTransform(
        item.header.stamp.sec * 10**9 + item.header.stamp.nanosec,
        item.header.frame_id,
        item.child_frame_id,
        (transform.translation.x, transform.translation.y, transform.translation.z),
        (transform.rotation.x, transform.rotation.y, transform.rotation.z, transform.rotation.w),
    )


@settings(max_examples=60, deadline=None)
@given(st.lists(transforms, max_size=4))
def test_two_decoders_return_what_was_encoded(items):
    data = encode_tf_message(items)
    assert [fields(item) for item in DECODE(data).transforms] == items
    message = STORE.deserialize_cdr(data, TF_TYPE)
    assert [fields(item) for item in message.transforms] == items
    assert bytes(STORE.serialize_cdr(message, TF_TYPE)) == data


def test_rclpy_encodes_the_same_transform():
    from geometry_msgs.msg import TransformStamped
    from rclpy.serialization import serialize_message

    item = StampedTransform(5_000_000_007, "map", "camera_link", (1.0, -2.0, 0.5), (0.0, 0.0, float(np.sqrt(0.5)), float(np.sqrt(0.5))))
    message = TransformStamped(child_frame_id=item.child)
    message.header.frame_id, message.header.stamp.sec, message.header.stamp.nanosec = item.parent, 5, 7
    message.transform.translation.x, message.transform.translation.y, message.transform.translation.z = item.position_m
    message.transform.rotation.z, message.transform.rotation.w = item.quaternion[2:]
    message.transform.rotation.x = message.transform.rotation.y = 0.0
    decoded = STORE.deserialize_cdr(serialize_message(message), "geometry_msgs/msg/TransformStamped")
    assert fields(decoded) == item
    assert fields(STORE.deserialize_cdr(encode_tf_message([item]), TF_TYPE).transforms[0]) == item


def test_stamp_out_of_range_is_refused():
    with pytest.raises(ValueError, match="map -> a: expected a stamp of 32-bit seconds, got 2147483648 s"):
        encode_tf_message([StampedTransform(2**31 * 10**9, "map", "a", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))])
