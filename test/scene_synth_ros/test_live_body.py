"""A body recorded from live nodes: nothing lost, and the same messages as a bag that is written without them."""

from pathlib import Path

from rclpy.serialization import deserialize_message
from scene_synth_ros_suite import SMALL, run_suite

from grammar.synthesize import SceneSynthesizer
from scene_synth_ros.bags.bag_inspect import inspect_bag
from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.cli.parameters.run_parameters import RunWords, run_parameters
from scene_synth_ros.messages.canonical_cdr import canonical_cdr
from scene_synth_ros.messages.message_definitions import message_class
from scene_synth_ros.offline.offline_bag import OfflineBag
from scene_synth_ros.offline.rules import sample_room
from scene_synth_ros.offline.settings import read_settings

OVERRIDES = (
    *SMALL, "grammar_node.motion.kind:=base", "grammar_node.motion.rest_s:=0.1", "renderer_node.body.enabled:=true",
    "renderer_node.imu.enabled:=true", "renderer_node.imu.rate_hz:=400.0", "renderer_node.wheels.enabled:=true",
    "renderer_node.lidar.enabled:=true", "renderer_node.lidar.columns:=200", "renderer_node.lidar.rate_hz:=20.0",
    *(f"renderer_node.streams.{layer}:=false" for layer in ("color", "normals", "semantic", "instance")),
)  # fmt: skip


def said(bag: Path) -> dict[str, list[tuple[int, bytes]]]:
    """Topic -> log time and content of each message; the description has no stamp, and is logged as it comes."""
    found: dict[str, list[tuple[int, bytes]]] = {}
    with BagReader(bag) as reader:
        for message in reader.messages(file_order=True):
            if message.topic != "/diagnostics":
                plain = message.type_name.startswith(("tf2_msgs", "vision_msgs"))
                content = message.data if plain else canonical_cdr(deserialize_message(message.data, message_class(message.type_name)))
                stamp = 0 if message.topic.endswith("robot_description") else message.log_ns
                found.setdefault(message.topic, []).append((stamp, bytes(content)))
    return found


def test_a_live_body_is_recorded_whole_and_the_same_is_written_offline(tmp_path: Path) -> None:
    words = [word for override in OVERRIDES for word in ("-p", override)]
    process = run_suite(tmp_path / "live", "--rooms", 1, "--frames", 4, "--seed", 6, *words)
    assert process.returncode == 0, process.stderr + process.stdout
    assert inspect_bag(tmp_path / "live").faults == ()
    run = RunWords(record=tmp_path / "live", rooms=1, frames=4, seed=6, overrides=OVERRIDES)
    settings, rules = read_settings(run_parameters(run)), SceneSynthesizer.from_config()
    with OfflineBag(tmp_path / "offline", settings, rules.floor_map) as offline:
        offline.add_room(sample_room(rules, settings, 0))
    live, made = said(tmp_path / "live"), said(tmp_path / "offline")
    assert live.keys() == made.keys()
    for topic, messages in made.items():
        assert live[topic] == messages, topic
    assert len(live["/synth/imu/data"]) == 121
    assert len(live["/synth/lidar/points"]) == len(live["/synth/lidar/points_ideal"]) == 6
