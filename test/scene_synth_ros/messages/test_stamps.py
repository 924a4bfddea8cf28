"""Stamps out of CDR bytes, against messages serialised by rosbags in both byte orders."""

import json

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore

from scene_synth_ros.messages.stamps import stamp_ns

STORE = get_typestore(Stores.ROS2_JAZZY)
T = STORE.types
STAMP = 1_234_567_890_123_456_789


def header(stamp=STAMP):
    sec, nanosec = divmod(stamp, 10**9)
    return T["std_msgs/msg/Header"](T["builtin_interfaces/msg/Time"](sec, nanosec), "camera_optical_frame")


def pose():
    return T["geometry_msgs/msg/Pose"](T["geometry_msgs/msg/Point"](1.0, 2.0, 3.0), T["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0))


def marker(stamp=STAMP):
    vector, color = T["geometry_msgs/msg/Vector3"](1.0, 1.0, 1.0), T["std_msgs/msg/ColorRGBA"](1.0, 0.0, 0.0, 1.0)
    time, duration = T["builtin_interfaces/msg/Time"](0, 0), T["builtin_interfaces/msg/Duration"](0, 0)
    texture = T["sensor_msgs/msg/CompressedImage"](header(5), "", np.empty(0, np.uint8))
    mesh = T["visualization_msgs/msg/MeshFile"]("", np.empty(0, np.uint8))
    return T["visualization_msgs/msg/Marker"](
        header(stamp), "ns", 1, 1, 0, pose(), vector, color, duration, False, [], [], "", texture, [], "", "", mesh, False
    ), time


MESSAGES = {
    "sensor_msgs/msg/Image": lambda: T["sensor_msgs/msg/Image"](header(), 1, 2, "mono8", 0, 2, np.array([1, 2], np.uint8)),
    "geometry_msgs/msg/PoseStamped": lambda: T["geometry_msgs/msg/PoseStamped"](header(), pose()),
    "rosgraph_msgs/msg/Clock": lambda: T["rosgraph_msgs/msg/Clock"](header().stamp),
    "visualization_msgs/msg/MarkerArray": lambda: T["visualization_msgs/msg/MarkerArray"]([marker()[0], marker(7)[0]]),
    "tf2_msgs/msg/TFMessage": lambda: T["tf2_msgs/msg/TFMessage"](
        [
            T["geometry_msgs/msg/TransformStamped"](
                header(), "child", T["geometry_msgs/msg/Transform"](T["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0), pose().orientation)
            )
        ]
    ),
}


@pytest.mark.parametrize("little_endian", [True, False])
@pytest.mark.parametrize("type_name", MESSAGES)
def test_stamp_of_serialised_messages(type_name, little_endian):
    data = STORE.serialize_cdr(MESSAGES[type_name](), type_name, little_endian=little_endian)
    assert stamp_ns(type_name, data) == STAMP
    assert stamp_ns(type_name, memoryview(data)) == STAMP


@pytest.mark.parametrize("little_endian", [True, False])
@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (json.dumps({"stamp_ns": STAMP, "scene": {"stamp_ns": 3}}), STAMP),
        (json.dumps({"schema": "x", "stamp": {"sec": 12, "nanosec": 34}}), 12_000_000_034),
        (json.dumps({"stamp": {"sec": 12, "nanosec": 10**9}}), None),
        (json.dumps({"stamp": {"sec": 1.5, "nanosec": 0}}), None),
        (json.dumps({"stamp_ns": True}), None),
        (json.dumps([STAMP]), None),
        ("no json", None),
        ("", None),
        ("[" * 100_000, None),
    ],
)
def test_stamp_in_json(text, expected, little_endian):
    data = STORE.serialize_cdr(T["std_msgs/msg/String"](text), "std_msgs/msg/String", little_endian=little_endian)
    assert stamp_ns("std_msgs/msg/String", data) == expected


def test_seconds_before_1970_are_negative():
    data = STORE.serialize_cdr(T["rosgraph_msgs/msg/Clock"](header(-1_500_000_000).stamp), "rosgraph_msgs/msg/Clock")
    assert stamp_ns("rosgraph_msgs/msg/Clock", data) == -1_500_000_000


@pytest.mark.parametrize("type_name", [*MESSAGES, "std_msgs/msg/String"])
def test_cut_messages_and_other_encodings_have_none(type_name):
    cut = (b"", b"\x00\x01\x00\x00", b"\x00\x01\x00\x00\x01\x00\x00")
    parameter_list_cdr, no_cdr = b"\x00\x03\x00\x00" + bytes(64), b"\x01\x01\x00\x00" + bytes(64)
    for data in (*cut, parameter_list_cdr, no_cdr):
        assert stamp_ns(type_name, data) is None


def test_sequence_without_items_and_unknown_type_have_none():
    empty = STORE.serialize_cdr(T["tf2_msgs/msg/TFMessage"]([]), "tf2_msgs/msg/TFMessage")
    assert stamp_ns("tf2_msgs/msg/TFMessage", bytes(empty) + bytes(8)) is None
    assert stamp_ns("std_msgs/msg/Float64", b"\x00\x01\x00\x00" + bytes(8)) is None
