"""Lives of a recorder node, from configure to cleanup: each ends before the next begins, and leaves nothing behind."""

import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest
import rclpy
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped
from rcl_interfaces.msg import ParameterValue
from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.parameter import Parameter
from scene_synth_ros_suite import claim_domain, dds_context, wait_until
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, Imu
from std_msgs.msg import Header, String

from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.bags.bag_writer import BagWriter
from scene_synth_ros.record.recorder_node import RecorderNode
from scene_synth_ros.suite.faults import FAULT_STATUS
from scene_synth_ros.suite.qos import BURST_DEPTH, PROFILES, latched_qos, stream_qos
from scene_synth_ros.suite.status import NodeStatus, status_from_json, status_to_json

SUCCESS, FAILURE = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE


@pytest.fixture
def node(tmp_path: Path) -> Iterator[RecorderNode]:
    with dds_context(claim_domain()) as context:
        words = ["--ros-args", "-r", "__ns:=/synth", "-p", f"bag:={tmp_path / 'bag'}", "-p", "autostart:=false"]
        made = RecorderNode(context=context, cli_args=words, use_global_arguments=False)
        yield made
        made.close()


def writing_threads() -> list[str]:
    return [thread.name for thread in threading.enumerate() if thread.name.startswith(("bag", "manifest", "sync"))]


def test_each_life_ends_before_the_next_begins(node: RecorderNode, tmp_path: Path) -> None:
    assert node.trigger_configure() == node.trigger_activate() == SUCCESS
    assert "bag_0" in writing_threads()
    assert node.trigger_deactivate() == node.trigger_cleanup() == SUCCESS
    assert writing_threads() == []
    assert node.trigger_configure() == SUCCESS
    assert node.trigger_activate() == SUCCESS
    assert node.trigger_deactivate() == node.trigger_activate() == SUCCESS
    assert node.trigger_deactivate() == node.trigger_cleanup() == SUCCESS
    assert writing_threads() == []
    for name in ("bag", "bag_2", "bag_3"):
        assert sorted(path.name for path in (tmp_path / name).iterdir()) == [f"{name}_0.mcap", "metadata.yaml"]


def test_a_configuration_that_fails_leaves_no_thread(node: RecorderNode, monkeypatch: pytest.MonkeyPatch) -> None:
    def create_publisher(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(node, "create_publisher", create_publisher)
    assert node.trigger_configure() == FAILURE
    assert writing_threads() == []
    monkeypatch.undo()
    assert node.trigger_configure() == SUCCESS


class Peer:
    """Publishes poses of a camera to a node and spins that."""

    def __init__(self, node: RecorderNode) -> None:
        self._node, self.executor = node, SingleThreadedExecutor(context=node.context)
        self.executor.add_node(node)
        self.other = rclpy.create_node("peer", namespace="/synth", context=node.context)
        self.poses = self.other.create_publisher(PoseStamped, "camera/pose", stream_qos())
        self.spin_until(self.poses.get_subscription_count, "the recorder")

    def spin_until(self, condition: Callable[[], object], what: str) -> None:
        def met() -> object:
            self.executor.spin_once(timeout_sec=0.05)
            return condition()

        wait_until(met, 20, what)


@pytest.fixture
def peer(node: RecorderNode) -> Iterator[Peer]:
    assert node.trigger_configure() == node.trigger_activate() == SUCCESS
    made = Peer(node)
    yield made
    made.executor.shutdown()
    made.other.destroy_node()


def test_a_pose_that_cannot_be_read_ends_nothing(node: RecorderNode, peer: Peer) -> None:
    info = peer.other.create_publisher(CameraInfo, "camera/color/camera_info", stream_qos())
    peer.spin_until(info.get_subscription_count, "the recorder")
    peer.poses.publish(b"\x00\x01\x00\x00" + b"\xff" * 9)
    peer.poses.publish(PoseStamped())
    peer.spin_until(lambda: node.arrivals == 2, "both poses")
    assert node.trigger_deactivate() == SUCCESS
    assert "/synth/camera/pose: a pose cannot be read" in node.last_warning()


def test_messages_of_a_topic_that_wait_are_taken_together_in_their_order(node: RecorderNode, peer: Peer, tmp_path: Path) -> None:
    device = peer.other.create_publisher(Imu, "imu/data", stream_qos(BURST_DEPTH))
    peer.spin_until(device.get_subscription_count, "the recorder")
    for number in range(60):
        device.publish(Imu(header=Header(stamp=Time(nanosec=number * 5_000_000))))
    assert device.wait_for_all_acked(Duration(seconds=10))
    turns = 0
    while node.arrivals < 60 and turns < 30:  # of which timers take some
        peer.executor.spin_once(timeout_sec=0.05)
        turns += 1
    assert node.arrivals == 60
    assert node.trigger_deactivate() == SUCCESS
    with BagReader(tmp_path / "bag") as reader:
        assert [message.log_ns for message in reader.messages() if message.topic == "/synth/imu/data"] == [5_000_000 * n for n in range(60)]


def test_a_publisher_that_the_subscription_cannot_hear_is_told(node: RecorderNode, peer: Peer, capfd: pytest.CaptureFixture[str]) -> None:
    unreliable = peer.other.create_publisher(PoseStamped, "camera/pose", PROFILES["sensor_data"])
    told: list[str] = []

    def is_told() -> bool:
        told.append(capfd.readouterr().err)
        return "offering incompatible QoS" in "".join(told)

    peer.spin_until(is_told, "a line on the publisher")
    assert unreliable.get_subscription_count() == 0


def test_the_compressed_form_of_an_image_is_left_to_viewers_where_the_image_is_recorded(node: RecorderNode, peer: Peer) -> None:
    names = ("camera/color/image_raw", "camera/depth/image_raw", "other/image_raw")
    raw = [peer.other.create_publisher(Image, name, stream_qos()) for name in names[:2]]
    compressed = [
        peer.other.create_publisher(CompressedImage, f"{name}/{transport}", stream_qos())
        for name, transport in zip(names, ("compressed", "compressedDepth", "compressed"), strict=True)
    ]
    peer.spin_until(lambda: all(publisher.get_subscription_count() for publisher in [*raw, compressed[2]]), "the recorder")
    node._look()
    assert [publisher.get_subscription_count() for publisher in compressed] == [0, 0, 1], "only where there is no raw image"


def test_a_fault_of_the_program_while_writing_ends_the_node_with_what_was_written(
    node: RecorderNode, peer: Peer, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def write(*_: object) -> None:
        raise ZeroDivisionError("nobody foresaw this")

    peer.poses.publish(PoseStamped())
    peer.spin_until(lambda: node.arrivals == 1, "a pose")
    node._recording.flush()
    monkeypatch.setattr(BagWriter, "write", write)
    peer.poses.publish(PoseStamped(header=Header(stamp=Time(sec=1))))
    peer.spin_until(lambda: node.arrivals == 2, "another pose")
    node._recording.flush()
    peer.spin_until(lambda: node.exit_code is not None, "the end")
    assert node.exit_code == FAULT_STATUS and node._state == "failed" and node.faults.count == 1
    assert node._reason.startswith("the recording ends: fault of the program") and "ZeroDivisionError: nobody foresaw this" in node._reason
    assert writing_threads() == []
    with BagReader(tmp_path / "bag") as reader:
        assert reader.summary.finished and "/synth/camera/pose" in {message.topic for message in reader.messages()}


def test_a_recorder_of_thousands_of_topics_is_understood(node: RecorderNode, peer: Peer) -> None:
    heard: list[str] = []
    peer.other.create_subscription(String, "status", lambda message: heard.append(message.data), latched_qos(100))
    peer.executor.add_node(peer.other)
    cameras = {f"/synth/camera_{number}/{name}" for number in range(40) for name in ("pose", *(f"layer_{n}/image_raw" for n in range(25)))}
    renderer = NodeStatus(node="/synth/renderer_node", role="renderer", state="starting", counts=dict.fromkeys(sorted(cameras), 0))
    node._on_status(status_from_json(status_to_json(renderer)))
    node._inputs.known |= dict.fromkeys((f"/robots/{number}/joint_states_of_this_robot" for number in range(5000)), 0)
    node._inputs.known |= dict.fromkeys(cameras, 0)
    node._inputs.known["/synth/camera_3/pose"] = -1
    peer.spin_until(lambda: heard and len(status_from_json(heard[-1]).counts) == len(cameras), "a status with the topics of the cameras")
    assert status_from_json(heard[-1]).counts["/synth/camera_3/pose"] == -1


def test_nodes_without_a_name_or_that_answer_oddly_only_lack_their_parameters(
    node: RecorderNode, peer: Peer, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[str] = []
    monkeypatch.setattr(node, "warn", told.append)
    answers = [GetParameters.Response(values=[ParameterValue(type=200)] * 2), GetParameters.Response()]

    def names(_: object, response: ListParameters.Response) -> ListParameters.Response:
        response.result.names = ["seed", "rooms"]
        return response

    for name in ("short", "odd"):
        peer.other.create_service(ListParameters, f"{name}/list_parameters", names)
        peer.other.create_service(GetParameters, f"{name}/get_parameters", lambda *_: answers.pop())
    peer.executor.add_node(peer.other)
    for name in ("no name", "/synth/" + "n" * 290, "/synth/short", "/synth/odd"):
        node._on_status(NodeStatus(node=name, role="grammar", state="ready"))
    peer.spin_until(lambda: len(told) == 4, "what becomes of the last")
    assert all("are left out" in line for line in told) and not answers
    assert node._collector.values == {} and node.faults.count == 0


def test_the_end_of_a_run_of_others_in_the_namespace_ends_no_recording(node: RecorderNode, peer: Peer) -> None:
    node.token, others = "own", NodeStatus(node="/synth/grammar_node", role="grammar", state="finished", run="others", token="others")
    node.set_parameters([Parameter("exit_when_done", value=True)])
    node._on_status(others)
    node._tick()
    assert node.exit_code is None and node._rooms.run == ""
    node._on_status(replace(others, run="own", token="own"))
    node._tick()
    assert node.exit_code == 0
