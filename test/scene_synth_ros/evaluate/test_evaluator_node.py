"""The evaluator node as a process of its own, over DDS: what it says of known estimates, what it drops, what it writes."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

import numpy as np
from room_bag import room_scene
from scene_synth_ros_suite import Peer, node_process
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import String

from evaluation.evaluation_file import TruthRecord, read_evaluation
from renderer import CameraConfig
from scene_description import scene_to_json
from scene_description.labels import semantic_labels
from scene_synth_ros.messages.conversions import camera_info_to_msg, image_to_msg, labels_to_msg
from scene_synth_ros.suite.qos import latched_qos, stream_qos
from scene_synth_ros.suite.status import NodeStatus, status_to_json

FRAMES = 3


def known(out: Path) -> bool:
    truth = read_evaluation(out).truth
    return truth is not None and None not in (truth.seed, truth.image_width, truth.label_standard)


def test_it_judges_what_two_other_nodes_publish(tmp_path: Path) -> None:
    out = tmp_path / "evaluation.json"
    settings = {"tasks": "['depth','normals']", "estimates": "['depth:=/my/depth','normals:=/my/normals']", "window": 2, "out": out}
    with node_process("evaluator_node", settings) as context:
        peer = Peer(context)
        topics = {
            "depth": "camera/depth/image_raw",
            "normals": "camera/normals/image_raw",
            "my depth": "/my/depth",
            "my normals": "/my/normals",
        }
        send = {name: peer.node.create_publisher(Image, topic, stream_qos()) for name, topic in topics.items()}
        heard: list[dict] = []
        peer.node.create_subscription(String, "evaluation", lambda message: heard.append(json.loads(message.data)), latched_qos())
        scene = room_scene(0, FRAMES)
        peer.node.create_publisher(String, "scene", latched_qos()).publish(String(data=scene_to_json(scene)))
        for name, value in {"seed": 5, "scene.room_type": "bedroom,office", "grammar_file": "/home/me/mine.yaml"}.items():
            peer.node.declare_parameter(name, value)
        grammar = NodeStatus(node=f"{peer.node.get_namespace()}/test_peer", role="grammar", state="ready")
        peer.node.create_publisher(String, "status", latched_qos(100)).publish(String(data=status_to_json(grammar)))
        labels = labels_to_msg(semantic_labels(), scene.camera_path[0].stamp_ns)
        peer.node.create_publisher(String, "camera/semantic/labels", latched_qos()).publish(labels)
        infos = peer.node.create_publisher(CameraInfo, "camera/depth/camera_info", stream_qos())
        peer.spin_until(lambda: all(publisher.get_subscription_count() for publisher in send.values()), 120, "the evaluator")
        depth = np.linspace(1.0, 4.0, 24 * 32, dtype=np.float32).reshape(24, 32)
        normals = np.zeros((24, 32, 3), np.float32)
        normals[..., 2] = -1.0
        for number, pose in enumerate(scene.camera_path):
            stamp = pose.stamp_ns
            infos.publish(camera_info_to_msg(CameraConfig(width=32, height=24), stamp, "eye"))
            send["my depth"].publish(image_to_msg(depth * np.float32(1.25), "32FC1", stamp, "eye"))
            send["depth"].publish(image_to_msg(depth, "32FC1", stamp, "eye"))
            send["normals"].publish(image_to_msg(normals, "32FC3", stamp, "eye"))
            send["my normals"].publish(image_to_msg(normals, "32FC3", stamp, "world" if number == 1 else "eye"))
        again = scene.camera_path[0].stamp_ns
        send["my depth"].publish(image_to_msg(depth, "32FC1", again, "eye"))
        peer.spin_until(lambda: heard and heard[-1]["tasks"]["depth"]["measured"] == FRAMES, 120, "the scores")
        peer.spin_until(lambda: peer.values.get("dropped_repeated") == "1", 120, "the repeated message")
        peer.spin_until(lambda: heard[-1]["room"]["room_type"] == scene.category, 120, "the room")
        told = heard[-1]["tasks"]
        assert abs(told["depth"]["metrics"]["abs_rel"] - 0.25) < 1e-7
        assert (told["normals"]["measured"], told["normals"]["missing"], told["normals"]["metrics"]["mean"]) == (FRAMES - 1, 1, 0.0)
        peer.spin_until(lambda: peer.trigger("evaluator_node/write")[0] and known(out), 120, "the parameters of the grammar node")
        done, said = peer.trigger("evaluator_node/write")
        assert done and said == f"{out}: {2 * FRAMES} results"
        refused = "expected normals in frame 'eye' as the truth is, got 'world'"
        peer.spin_until(lambda: any(refused in line for line in peer.warnings), 60, "the next diagnostics")
    found = read_evaluation(out)
    info = camera_info_to_msg(CameraConfig(width=32, height=24), 0, "eye")
    assert found.truth == TruthRecord(
        image_width=32, image_height=24, camera_model=info.distortion_model, distortion=tuple(info.d), label_standard="nyu40",
        intrinsics=tuple(round(info.k[place], 2) for place in (0, 4, 2, 5)), seed=5, grammar="mine.yaml", room_types="bedroom,office",
    )  # fmt: skip
    assert shlex.split(found.created_with) == [
        *("ros2 run scene_synth_ros evaluator_node --ros-args -r __ns:=/synth -p".split()),
        "tasks:=[depth, normals]",
        *("-p", "estimates:=['depth:=/my/depth', 'normals:=/my/normals']", "-p", "window:=2", "-p", f"out:={out}"),
    ]
    (key,) = {(row.key.room_type, row.key.room) for row in found.frames}
    assert key == (scene.category, scene.index)
    assert found.missing["frames without an estimate"] == 1 and found.missing["repeated"] == 1
