"""Schemas and type hashes against the installed files and against rosbags' own type system."""

import re
import sys
from pathlib import Path

import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from scene_synth_ros.messages.message_definitions import MessageDefinitionError, message_definition
from scene_synth_ros.messages.streams import DETECTIONS_2D_TYPE, DETECTIONS_3D_TYPE, LABEL_INFO_TYPE, TF_TYPE

STORE = get_typestore(Stores.ROS2_JAZZY)
TYPES = [
    "diagnostic_msgs/msg/DiagnosticArray",
    "geometry_msgs/msg/PoseStamped",
    "nav_msgs/msg/OccupancyGrid",
    "rosgraph_msgs/msg/Clock",
    "sensor_msgs/msg/CameraInfo",
    "sensor_msgs/msg/Image",
    "std_msgs/msg/String",
    "tf2_msgs/msg/TFMessage",
    "visualization_msgs/msg/MarkerArray",
]


def share(name: str) -> str:
    package, _, type_name = name.split("/")
    return Path(sys.prefix, "share", package, "msg", f"{type_name}.msg").read_text()


def test_text_is_the_files_with_delimiters():
    line = "=" * 80
    expected = (
        share("sensor_msgs/msg/Image")
        + f"\n{line}\nMSG: std_msgs/Header\n"
        + share("std_msgs/msg/Header")
        + f"\n{line}\nMSG: builtin_interfaces/Time\n"
        + share("builtin_interfaces/msg/Time")
    )
    assert message_definition("sensor_msgs/msg/Image").text == expected


def test_dependencies_come_once_depth_first_by_name():
    names = re.findall(r"^MSG: (.*)$", message_definition("nav_msgs/msg/OccupancyGrid").text, re.MULTILINE)
    assert names == [
        "nav_msgs/MapMetaData",
        "builtin_interfaces/Time",
        "geometry_msgs/Pose",
        "geometry_msgs/Point",
        "geometry_msgs/Quaternion",
        "std_msgs/Header",
    ]


@pytest.mark.parametrize("type_name", TYPES)
def test_hash_and_fields_agree_with_rosbags(type_name):
    definition = message_definition(type_name)
    assert definition.type_hash == STORE.hash_rihs01(type_name)
    first, *rest = definition.text.split("\n" + "=" * 80 + "\nMSG: ")
    texts = {type_name: first, **dict(part.split("\n", 1) for part in rest)}
    for name, text in texts.items():
        full = name if "/msg/" in name else name.replace("/", "/msg/")
        assert get_types_from_msg(text, full)[full] == STORE.fielddefs[full]


@pytest.mark.parametrize("name", ["Image", "../etc/passwd", "sensor_msgs/msg/../Image", "", "a/b/c/d", "sensor_msgs/srv/Image"])
def test_malformed_name_is_one_line(name):
    with pytest.raises(MessageDefinitionError) as error:
        message_definition(name)
    assert str(error.value) == f"message type '{name}': expected 'package/msg/Type', got '{name}'"


def test_unknown_type_is_named(monkeypatch, tmp_path):
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    folder = tmp_path / "share" / "odd_msgs" / "msg"
    folder.mkdir(parents=True)
    (folder / "Outer.msg").write_text("lost_msgs/Inner[<=3] inner\nstring<=5 name\nint8 A=1\n")
    with pytest.raises(MessageDefinitionError) as error:
        message_definition("odd_msgs/msg/Outer")
    text = str(error.value)
    assert "'lost_msgs/Inner' (needed by 'odd_msgs/msg/Outer')" in text and "install the package lost_msgs" in text and "\n" not in text


@pytest.mark.parametrize("name", [TF_TYPE, LABEL_INFO_TYPE, DETECTIONS_2D_TYPE, DETECTIONS_3D_TYPE])
def test_what_is_always_written_has_the_same_definition_where_its_package_is_not_installed(name, monkeypatch, tmp_path):
    for package in ("geometry_msgs", "std_msgs", "builtin_interfaces"):
        (tmp_path / "share" / package).parent.mkdir(exist_ok=True)
        (tmp_path / "share" / package).symlink_to(Path(sys.prefix, "share", package))
    installed = message_definition(name)
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    assert message_definition(name) == installed


def test_own_prefix_comes_before_the_interpreters(monkeypatch, tmp_path):
    monkeypatch.setenv("AMENT_PREFIX_PATH", f":{tmp_path}")
    folder = tmp_path / "share" / "tf2_msgs" / "msg"
    folder.mkdir(parents=True)
    (folder / "TFMessage.msg").write_bytes(b"# installed\r\ngeometry_msgs/TransformStamped[] transforms\r\n")
    (folder / "TFMessage.json").write_text('{"type_hashes": [{"type_name": "tf2_msgs/msg/TFMessage", "hash_string": "RIHS01_7"}]}')
    definition = message_definition("tf2_msgs/msg/TFMessage")
    assert definition.text.startswith("# installed\r\n") and definition.type_hash == "RIHS01_7"
