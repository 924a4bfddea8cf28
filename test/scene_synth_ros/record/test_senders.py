"""Whose messages a topic has, and that only those of the suite move the clock of a bag."""

import json
from pathlib import Path

import pytest
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PointStamped, PoseStamped
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message
from std_msgs.msg import Header, String

from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.bags.bag_writer import BagWriter
from scene_synth_ros.record.frame_intake import MAX_STRAY_NS, FrameIntake
from scene_synth_ros.record.recording import Recording
from scene_synth_ros.record.senders import PATIENCE, SPEAKERS_PATIENCE, Origin, Senders
from scene_synth_ros.suite.connections import Endpoint
from scene_synth_ros.suite.qos import latched_qos
from scene_synth_ros.suite.status import NodeStatus

POINT = "geometry_msgs/msg/PointStamped"
FRAME = ("/synth/camera/color", "/synth/camera/depth")
STRANGER = "/synth/stranger"
INFO = "/synth/camera/color/camera_info"
WALL_S = 1_790_000_000


def status(node: str, role: str) -> NodeStatus:
    return NodeStatus(node=node, role=role, state="ready")


class Graph:
    """Who publishes what, as discovery says it."""

    def __init__(self) -> None:
        self.nodes = {
            "/clock": ["/synth/renderer_node"],
            "/synth/status": ["/synth/grammar_node", "/synth/renderer_node"],
            "/synth/camera/color": ["/synth/renderer_node"],
            "/synth/stranger": ["/synth/robot"],
            "/other/point": ["/robot"],
        }

    def publishers_of(self, topic: str) -> list[Endpoint]:
        return [Endpoint(node, f"gid of {node}") for node in self.nodes.get(topic, [])]


@pytest.fixture
def graph() -> Graph:
    return Graph()


@pytest.fixture
def senders(graph: Graph) -> Senders:
    made = Senders(graph.publishers_of, "/synth/")
    for node, role in (("/synth/grammar_node", "grammar"), ("/synth/renderer_node", "renderer")):
        assert made.take_status(status(node, role)) and not made.take_status(status(node, role))
    return made


def test_a_topic_is_the_suites_if_only_nodes_of_the_suite_publish_it(senders: Senders) -> None:
    assert senders.judge("/synth/camera/color") is Origin.SUITE
    assert senders.judge("/clock") is Origin.SUITE
    assert senders.judge("/other/point") is Origin.OTHERS


def test_a_stranger_inside_the_namespace_is_found_out(senders: Senders) -> None:
    assert [senders.judge(STRANGER) for _ in range(PATIENCE)] == [Origin.UNKNOWN] * PATIENCE
    assert senders.judge(STRANGER) is Origin.OTHERS


def test_a_stranger_beside_the_suite_makes_a_topic_foreign(senders: Senders, graph: Graph) -> None:
    graph.nodes["/synth/camera/color"].append("/synth/robot")
    assert senders.judge("/synth/camera/color") is Origin.UNKNOWN
    for _ in range(PATIENCE):
        origin = senders.judge("/synth/camera/color")
    assert origin is Origin.OTHERS
    graph.nodes["/synth/camera/color"].remove("/synth/robot")
    assert senders.judge("/synth/camera/color") is Origin.SUITE
    graph.nodes["/synth/camera/color"].clear()
    assert senders.judge("/synth/camera/color") is Origin.SUITE, "as before, while nobody publishes it"


def test_a_stranger_that_speaks_on_status_too_is_one_in_the_end(senders: Senders, graph: Graph) -> None:
    graph.nodes["/synth/status"].append("/synth/robot")
    assert [senders.judge(STRANGER) for _ in range(SPEAKERS_PATIENCE + 1)][-2:] == [Origin.UNKNOWN, Origin.OTHERS]


def test_a_renderer_whose_status_is_still_on_its_way_is_waited_for(senders: Senders, graph: Graph) -> None:
    graph.nodes["/synth/status"].append("/synth/renderer_node_2")
    graph.nodes["/synth/second/color"] = ["/synth/renderer_node_2"]
    assert {senders.judge("/synth/second/color") for _ in range(5 * PATIENCE)} == {Origin.UNKNOWN}
    senders.take_status(status("/synth/renderer_node_2", "renderer"))
    assert senders.judge("/synth/second/color") is Origin.SUITE


def test_a_renderer_that_is_no_part_of_the_run_changes_nothing_beside_one_that_is(graph: Graph) -> None:
    known: set[str] = set()
    senders = Senders(graph.publishers_of, "/synth/", known)
    graph.nodes["/synth/camera/color"] = ["/synth/renderer_node", "/synth/renderer_node", "/synth/forgotten"]
    graph.nodes["/synth/status"].append("/synth/forgotten")
    graph.nodes["/synth/forgotten/settings"] = ["/synth/forgotten"]
    senders.take_status(status("/synth/grammar_node", "grammar"))
    assert senders.judge("/synth/camera/color") is Origin.UNKNOWN
    known |= {"/synth/renderer_node", "/synth/forgotten"}
    senders.take_status(status("/synth/renderer_node", "renderer"))
    assert senders.judge("/synth/camera/color") is Origin.SUITE, "a namesake of a stranger, too"
    assert [senders.judge("/synth/forgotten/settings") for _ in range(PATIENCE + 1)][-1] is Origin.OTHERS


def test_without_a_suite_what_is_in_the_namespace_is_taken_for_it(graph: Graph) -> None:
    senders = Senders(graph.publishers_of, "/synth/")
    senders.take_status(status("/synth/recorder_node", "recorder"))
    assert not senders.suite_is_present
    assert [senders.judge(topic) for topic in ("/clock", STRANGER, "/other/point")] == [Origin.SUITE, Origin.SUITE, Origin.OTHERS]


def test_where_a_suite_is_awaited_nothing_is_known_to_be_its_own_until_it_is_heard(graph: Graph) -> None:
    senders = Senders(graph.publishers_of, "/synth/", awaits_suite=True)
    senders.take_status(status("/synth/recorder_node", "recorder"))
    own, others = ("/clock", STRANGER, "/synth/camera/color"), "/other/point"
    assert {senders.judge(topic) for _ in range(5 * PATIENCE) for topic in own} == {Origin.UNKNOWN}
    assert senders.judge(others) is Origin.OTHERS
    senders.take_status(status("/synth/grammar_node", "grammar"))
    senders.take_status(status("/synth/renderer_node", "renderer"))
    assert [senders.judge(topic) for topic in own] == [Origin.SUITE, Origin.UNKNOWN, Origin.SUITE]


def point(seconds: float) -> bytes:
    stamp = Time(sec=int(seconds), nanosec=round(seconds % 1 * 1e9))
    return bytes(serialize_message(PointStamped(header=Header(stamp=stamp))))


def recording_of_frames(folder: Path, origin: Origin) -> Recording:
    recording = Recording(BagWriter)
    for topic in FRAME:
        recording.add_topic(topic, POINT, [QoSProfile(depth=10)])
    recording.add_topic(STRANGER, POINT, [QoSProfile(depth=10)], origin)
    recording.expect(FRAME, {})
    recording.begin(folder)
    return recording


def log_times(folder: Path, topic: str) -> list[int]:
    with BagReader(folder) as reader:
        return [message.log_ns // 10**9 for message in reader.messages([topic], file_order=True)]


@pytest.mark.parametrize("origin", [Origin.UNKNOWN, Origin.OTHERS])
def test_wall_time_from_inside_the_namespace_drags_no_frame_along(tmp_path: Path, origin: Origin) -> None:
    recording = recording_of_frames(tmp_path / "bag", origin)
    for second in range(10):
        for number in range(40):
            recording.add(STRANGER, point(WALL_S + second + number / 40))
        for topic in FRAME:
            recording.add(topic, point(second))
    assert recording.intake.late == 0
    recording.set_origin(STRANGER, Origin.OTHERS)
    recording.close()
    for topic in FRAME:
        assert log_times(tmp_path / "bag", topic) == list(range(10))
    strange = log_times(tmp_path / "bag", STRANGER)
    assert len(strange) == 400 and max(strange) <= 9, "all are kept, at the time of the frames"


def test_wall_time_on_a_topic_of_the_frames_drags_no_frame_along(tmp_path: Path) -> None:
    recording = recording_of_frames(tmp_path / "bag", Origin.OTHERS)
    recording.add(FRAME[0], point(0))
    recording.add(FRAME[1], point(0))
    recording.set_origin(FRAME[0], Origin.OTHERS)
    for second in range(1, 10):
        for number in range(10):
            recording.add(FRAME[0], point(WALL_S + second + number / 10))
        for topic in FRAME:
            recording.add(topic, point(second))
    recording.close()
    assert log_times(tmp_path / "bag", FRAME[1]) == list(range(10))
    assert recording.intake.late == 0


def test_no_frame_waits_for_a_topic_on_which_others_publish_the_same_stamps() -> None:
    intake = FrameIntake(lambda text: None)
    for topic in FRAME:
        intake.add_topic(topic, POINT, False, Origin.SUITE)
    intake.expect(FRAME, {})
    intake.set_origin(FRAME[0], Origin.UNKNOWN)
    for number in range(200):  # more than may wait, so that those of the first frames are gone when these come
        intake.add(FRAME[0], point(number / 10))
    for number in range(3):
        for topic in FRAME:
            intake.add(topic, point(number / 10))
    released = [message for message in intake.set_origin(FRAME[0], Origin.OTHERS) if message.topic == FRAME[1]]
    assert [message.log_ns for message in released] == [0, 10**8, 2 * 10**8]
    assert [message.log_ns for message in intake.add(FRAME[1], point(0.3)) or () if message.topic == FRAME[1]] == [3 * 10**8]


def test_near_stamps_of_others_keep_their_place_and_hold_no_frame_up(tmp_path: Path) -> None:
    recording = recording_of_frames(tmp_path / "bag", Origin.OTHERS)
    for second in range(10):
        for topic in FRAME:
            recording.add(topic, point(second))
        recording.add(STRANGER, point(second + 0.5))
        assert recording.intake.waiting_bytes < 2 * len(point(0)), "no frame waits for what others do not say"
    for number in range(200):
        recording.add(STRANGER, point(9.5 + number / 10))
    recording.add(FRAME[0], point(10))
    recording.add(FRAME[1], point(10))
    recording.close()
    assert log_times(tmp_path / "bag", FRAME[0]) == list(range(11)), "a sender cannot lead the clock, however near"
    with BagReader(tmp_path / "bag") as reader:
        stamps = [message.log_ns / 1e9 for message in reader.messages([STRANGER], file_order=True)]
    assert stamps[:9] == [second + 0.5 for second in range(9)]
    assert MAX_STRAY_NS > 30 * 10**9


def test_a_suite_that_begins_after_others_has_its_own_time(tmp_path: Path) -> None:
    recording = Recording(BagWriter)
    recording.add_topic(STRANGER, POINT, [QoSProfile(depth=10)])
    recording.add_topic("/synth/scene", "std_msgs/msg/String", [latched_qos()])
    recording.begin(tmp_path / "bag")
    for number in range(2000):
        recording.add(STRANGER, point(WALL_S + number))
    scene = {"index": 0, "camera_path": [{"stamp_ns": second * 10**9} for second in range(3)]}
    recording.add("/synth/scene", bytes(serialize_message(String(data=json.dumps(scene)))))
    recording.begin_suite()
    recording.set_origin(STRANGER, Origin.OTHERS)
    for topic in FRAME:
        recording.add_topic(topic, POINT, [QoSProfile(depth=10)])
    recording.expect(FRAME, {})
    for second in range(3):
        for topic in FRAME:
            recording.add(topic, point(second))
    recording.close()
    assert log_times(tmp_path / "bag", FRAME[0]) == [0, 1, 2]
    assert log_times(tmp_path / "bag", STRANGER)[-1] == 0


def test_a_pose_of_others_is_no_camera(tmp_path: Path) -> None:
    recording = Recording(BagWriter)
    pose, labels, latched = "geometry_msgs/msg/PoseStamped", "std_msgs/msg/String", latched_qos()
    recording.begin(tmp_path / "bag")
    takers = {}
    for topic, kind, origin in (
        ("/other/pose", pose, Origin.OTHERS),
        ("/synth/robot/pose", pose, Origin.UNKNOWN),
        ("/synth/camera/pose", pose, Origin.SUITE),
        ("/other/map/labels", labels, Origin.OTHERS),
    ):
        recording.add_topic(topic, kind, [latched], origin)
        takers[topic] = recording.taker(topic, kind, "/synth/")
    recording.begin_suite()
    for second in (1, 2):
        for topic in ("/other/pose", "/synth/robot/pose"):
            takers[topic](bytes(serialize_message(PoseStamped(header=Header(stamp=Time(sec=WALL_S + second))))))
        takers["/synth/camera/pose"](bytes(serialize_message(PoseStamped(header=Header(frame_id="map", stamp=Time(sec=second))))))
        takers["/other/map/labels"](bytes(serialize_message(String(data=json.dumps({"stamp_ns": second, "labels": []})))))
    recording.close()
    assert {name: count for name, count in recording.written.copy().items() if name not in takers} == {"/tf": 2, "/tf_static": 1}
    with BagReader(tmp_path / "bag") as reader:
        assert reader.summary.end_ns == 2 * 10**9


def test_a_camera_of_others_that_is_there_before_an_awaited_suite_drags_no_frame_along(tmp_path: Path) -> None:
    recording = Recording(BagWriter)
    pose = "geometry_msgs/msg/PoseStamped"
    for topic, kind in (("/synth/robot/pose", pose), ("/synth/robot/color/camera_info", "sensor_msgs/msg/CameraInfo")):
        recording.add_topic(topic, kind, [QoSProfile(depth=10)], Origin.UNKNOWN)
    recording.begin(tmp_path / "bag")
    take = recording.taker("/synth/robot/pose", pose, "/synth/")
    for number in range(2000):
        take(bytes(serialize_message(PoseStamped(header=Header(stamp=Time(sec=WALL_S + number))))))
    recording.begin_suite()
    for topic in FRAME:
        recording.add_topic(topic, POINT, [QoSProfile(depth=10)])
    recording.expect(FRAME, {})
    for second in range(3):
        for topic in FRAME:
            recording.add(topic, point(second))
    recording.close()
    assert "/tf" not in recording.written.copy() and "/tf_static" not in recording.written.copy()
    with BagReader(tmp_path / "bag") as reader:
        assert reader.summary.end_ns == 2 * 10**9
    assert log_times(tmp_path / "bag", FRAME[0]) == [0, 1, 2]


def test_without_a_suite_a_pose_in_the_namespace_is_a_cameras_beside_its_images(tmp_path: Path) -> None:
    recording = Recording(BagWriter)
    recording.begin(tmp_path / "bag")
    pose = "geometry_msgs/msg/PoseStamped"
    for topic, kind in (("/synth/robot/pose", pose), ("/synth/camera/pose", pose), (INFO, "sensor_msgs/msg/CameraInfo")):
        recording.add_topic(topic, kind, [QoSProfile(depth=10)])
        if kind == pose:
            recording.taker(topic, kind, "/synth/")(bytes(serialize_message(PoseStamped(header=Header(stamp=Time(sec=1))))))
    recording.taker("/synth/camera/pose", pose, "/synth/")(bytes(serialize_message(PoseStamped(header=Header(stamp=Time(sec=2))))))
    recording.close()
    assert recording.written.copy() == {"/synth/robot/pose": 1, "/synth/camera/pose": 2, "/tf": 1, "/tf_static": 1}
