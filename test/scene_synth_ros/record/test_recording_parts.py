"""The parts of the recorder that need no node: splitting, snapshots, repeats."""

import json
import random
import tracemalloc
from pathlib import Path

import pytest
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped
from rclpy.qos import QoSDurabilityPolicy, QoSProfile
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Header, String

from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.bags.bag_writer import BagWriter
from scene_synth_ros.record.frame_intake import SeenFrames
from scene_synth_ros.record.recorder_config import SplitPolicy
from scene_synth_ros.record.recording import Recording
from scene_synth_ros.record.senders import Origin
from scene_synth_ros.record.snapshot_ring import KeptMessage, SnapshotRing


def add_pose(recording: Recording, topic: str, stamp: int) -> None:
    recording.add(topic, bytes(serialize_message(PoseStamped(header=Header(stamp=Time(sec=0, nanosec=stamp))))))


def test_a_file_ends_by_size_duration_or_rooms_and_never_before_its_first_frame() -> None:
    assert not SplitPolicy(size_mb=1.0).is_due(10**9, None, 5, 0, True)
    assert SplitPolicy(size_mb=1.0).is_due(10**6, 0, 5, 0, False) and not SplitPolicy(size_mb=1.0).is_due(10**6 - 1, 0, 5, 0, False)
    assert SplitPolicy(duration_s=2.0).is_due(0, 10**9, 3 * 10**9, 0, False)
    assert not SplitPolicy(duration_s=2.0).is_due(0, 10**9, 3 * 10**9 - 1, 0, False)
    assert SplitPolicy(rooms=2).is_due(0, 0, 5, 2, True)
    assert not SplitPolicy(rooms=2).is_due(0, 0, 5, 2, False) and not SplitPolicy(rooms=2).is_due(0, 0, 5, 1, True)
    assert not SplitPolicy().is_due(10**12, 0, 10**18, 10**6, True)


def test_a_snapshot_has_the_last_seconds_and_the_latched_state_before() -> None:
    ring = SnapshotRing(2.0, 10**6)
    ring.latched = {"/scene"}
    ring.add(KeptMessage("/scene", 0, b"old"))
    ring.add(KeptMessage("/scene", 1, b"room"))
    for second in range(6):
        ring.add(KeptMessage("/image", second * 10**9, b"x" * 10))
    content = list(ring.content())
    assert content[0] == KeptMessage("/scene", 3 * 10**9, b"room")
    assert [message.log_ns for message in content[1:]] == [3 * 10**9, 4 * 10**9, 5 * 10**9]


def test_a_snapshot_is_bounded_by_memory() -> None:
    ring = SnapshotRing(100.0, 50)
    for second in range(20):
        ring.add(KeptMessage("/image", second * 10**9, b"x" * 10))
        assert ring.size <= 50
    assert [message.log_ns // 10**9 for message in ring.content()] == [15, 16, 17, 18, 19]
    ring.add(KeptMessage("/image", 10**11, b"x" * 51))
    assert ring.size == 0 and not list(ring.content())


def test_memory_for_a_snapshot_is_freed_by_whole_frames() -> None:
    ring = SnapshotRing(100.0, 50)
    ring.latched = {"/labels"}
    for second in range(4):
        for topic in ("/depth", "/image", "/labels"):
            ring.add(KeptMessage(topic, second * 10**9, b"x" * 10))
    assert [message.log_ns // 10**9 for message in ring.content()] == [3, 3, 3, 3]
    assert [message.topic for message in ring.content()] == ["/labels", "/depth", "/image", "/labels"]
    for topic in ("/depth", "/image", "/labels", "/pose"):  # of a frame that is too large, nothing is kept, what comes last neither
        ring.add(KeptMessage(topic, 10**10, b"x" * 20))
    assert not list(ring.content()) and ring.size == 0
    ring.add(KeptMessage("/depth", 11 * 10**9, b"x"))
    assert [message.topic for message in ring.content()] == ["/labels", "/depth"]
    ring.add(KeptMessage("/image", 12 * 10**9, b"x" * 51))
    ring.add(KeptMessage("/image", 0, b"time begins anew"))
    assert [message.data for message in ring.content()][1:] == [b"time begins anew"]


def test_repeats_are_told_from_firsts_and_old_rooms_are_forgotten() -> None:
    seen = SeenFrames()
    for room in range(40):
        seen.begin_room(room * 100)
        for frame in range(5):
            for topic in ("/a", "/b"):
                assert seen.is_new(topic, room * 100 + frame)
    assert not seen.is_new("/b", 3904) and seen.is_new("/c", 3904)
    assert seen.repeats == 1
    assert len(seen) <= 18 * 5
    assert seen.is_new("/a", 3902 - 1_000_000) and not seen.is_new("/a", 3902), "stamps need not come in order"
    assert seen.has("/c", 3904) and not seen.has("/c", 3903) and not seen.has("/d", 3904)


def test_a_long_room_is_remembered_in_a_few_bytes_a_stamp() -> None:
    seen, topics = SeenFrames(), [f"/topic_{number}" for number in range(30)]
    tracemalloc.start()
    try:
        for tick in range(20_000):  # 100 s of an IMU
            for topic in topics[: 30 if tick % 13 == 0 else 3]:
                assert seen.is_new(topic, 10**12 + tick * 5_000_000)
        held, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert len(seen) == 20_000 and held < 16 * 20_000, "12 bytes a stamp, and what arrays keep in reserve"


def test_a_finished_room_leaves_and_the_next_one_is_left_to_be_completed(tmp_path: Path) -> None:
    recording = Recording(BagWriter)
    latched = QoSProfile(depth=10, durability=QoSDurabilityPolicy.TRANSIENT_LOCAL)
    recording.add_topic("/synth/scene", "std_msgs/msg/String", [latched])
    for topic in ("/a", "/b"):
        recording.add_topic(topic, "geometry_msgs/msg/PoseStamped", [QoSProfile(depth=10)])
    recording.expect({"/a", "/b"}, {})
    recording.begin(tmp_path / "bag")

    def scene(index: int, *stamps: int) -> None:
        text = json.dumps({"index": index, "camera_path": [{"stamp_ns": stamp} for stamp in stamps]})
        recording.add("/synth/scene", bytes(serialize_message(String(data=text))))

    scene(0, 100, 200)
    scene(1, 300, 400)
    for topic, stamp in (("/a", 100), ("/b", 100), ("/a", 200), ("/a", 300)):  # half of 200 is lost, half of 300 is on its way
        add_pose(recording, topic, stamp)
    recording.flush(0)
    assert recording.written.copy() == {"/synth/scene": 1, "/a": 2, "/b": 1}
    add_pose(recording, "/b", 300)
    add_pose(recording, "/a", 400)
    recording.flush(1)
    assert recording.written.copy() == {"/synth/scene": 2, "/a": 4, "/b": 2}
    add_pose(recording, "/b", 400)
    add_pose(recording, "/a", 500)
    recording.flush(7)  # of which nothing is known
    assert recording.intake.late == 1
    recording.close()
    with BagReader(tmp_path / "bag") as reader:
        order = [(message.topic, message.log_ns) for message in reader.messages(file_order=True)]
    rooms = [[("/synth/scene", 100), ("/a", 100), ("/b", 100), ("/a", 200)], [("/synth/scene", 300), ("/a", 300), ("/b", 300), ("/a", 400)]]
    assert order == [*rooms[0], *rooms[1], ("/b", 400), ("/a", 500)]


def test_frames_of_which_only_latched_parts_can_come_hold_nothing_up(tmp_path: Path) -> None:
    recording = Recording(BagWriter)
    latched = QoSProfile(depth=10, durability=QoSDurabilityPolicy.TRANSIENT_LOCAL)
    recording.add_topic("/settings", "std_msgs/msg/String", [latched])
    for topic in ("/pose", "/late"):
        recording.add_topic(topic, "geometry_msgs/msg/PoseStamped", [QoSProfile(depth=10)])
    recording.expect({"/settings", "/pose", "/late"}, {})
    recording.begin(tmp_path / "bag")

    def settings(stamp: int) -> None:
        recording.add("/settings", bytes(serialize_message(String(data=json.dumps({"stamp_ns": stamp})))))

    for stamp in (1, 2, 3):
        settings(stamp)
    for stamp in (4, 5):  # /late is connected from stamp 5 on
        add_pose(recording, "/pose", stamp)
        settings(stamp)
    assert recording.intake.waiting_bytes
    add_pose(recording, "/late", 5)
    assert not recording.intake.waiting_bytes
    settings(2)
    assert not recording.intake.waiting_bytes
    recording.close()
    assert recording.written.copy() == {"/settings": 5, "/pose": 2, "/late": 1}


@pytest.mark.parametrize("seed", range(5))
def test_a_bag_ends_with_a_whole_frame_wherever_it_is_stopped_or_split(tmp_path: Path, seed: int) -> None:
    draw, topics, frames = random.Random(seed), ("/a", "/b", "/c"), 40
    recording = Recording(BagWriter)
    for topic in topics:
        recording.add_topic(topic, "geometry_msgs/msg/PoseStamped", [QoSProfile(depth=10)])
    recording.expect(topics, {})
    recording.begin(tmp_path / "bag")
    left = {topic: list(range(1, frames + 1)) for topic in topics}
    expected = set(range(1, frames + 1))
    while any(left.values()):
        topic = draw.choice([topic for topic, stamps in left.items() if stamps])  # each topic comes in its order, none waits for another
        add_pose(recording, topic, left[topic].pop(0))
        wish = draw.random()
        if wish < 0.1:
            recording.end()
            recording.begin(tmp_path / "bag")
        elif wish < 0.2:
            recording.split()
        elif wish > 0.99:
            break
    expected = set(range(1, min(frames - len(stamps) for stamps in left.values()) + 1))
    recording.close()
    found: list[int] = []
    for file in sorted(tmp_path.glob("*/*.mcap")):
        of_stamp: dict[int, set[str]] = {}
        with BagReader(file) as reader:
            for message in reader.messages():
                of_stamp.setdefault(message.log_ns, set()).add(message.topic)
        assert all(there == set(topics) for there in of_stamp.values()), file
        found += of_stamp
    assert sorted(found) == sorted(expected), "every whole frame is in one file"


def test_at_the_end_partial_frames_are_left_out_wherever_they_are(tmp_path: Path) -> None:
    recording = Recording(BagWriter)
    for topic in ("/a", "/b", "/other"):
        recording.add_topic(topic, "geometry_msgs/msg/PoseStamped", [QoSProfile(depth=10)])
    recording.set_origin("/other", Origin.OTHERS)
    recording.expect({"/a", "/b"}, {})
    recording.begin(tmp_path / "bag")
    for topic, stamp in (("/a", 1), ("/b", 1), ("/a", 2), ("/a", 3), ("/b", 3), ("/a", 4), ("/other", 4)):
        add_pose(recording, topic, stamp)
    recording.close()
    assert recording.written.copy() == {"/a": 2, "/b": 2, "/other": 1}


def test_what_was_asked_for_moves_no_time_in_a_bag(tmp_path: Path) -> None:
    recording, pose, settings = Recording(BagWriter), "/synth/camera/pose", "/synth/renderer_node/settings"
    types = {"/clock": "rosgraph_msgs/msg/Clock", pose: "geometry_msgs/msg/PoseStamped", settings: "std_msgs/msg/String"}
    for topic, kind in types.items():
        recording.add_topic(topic, kind, [QoSProfile(depth=10)])
    takers = {topic: recording.taker(topic, kind, "/synth/") for topic, kind in types.items()}
    recording.begin_suite()
    recording.expect({*types, "/tf"}, {})
    recording.begin(tmp_path / "bag")

    def frame(stamp: int, *, asked: bool = False) -> None:
        takers[pose](bytes(serialize_message(PoseStamped(header=Header(stamp=Time(sec=stamp))))))
        if not asked:
            takers["/clock"](bytes(serialize_message(Clock(clock=Time(sec=stamp)))))
        told = {"stamp_ns": stamp * 10**9} | ({"asked": True} if asked else {})
        takers[settings](bytes(serialize_message(String(data=json.dumps(told)))))

    for stamp, asked in ((77, True), (1, False), (5, True), (2, False), (78, True), (3, False), (2, True)):
        frame(stamp, asked=asked)
    recording.close()
    with BagReader(tmp_path / "bag") as reader:
        logged = {topic: [message.log_ns // 10**9 for message in reader.messages([topic], file_order=True)] for topic in (*types, "/tf")}
    assert logged["/clock"] == logged["/tf"] == [1, 2, 3]
    assert logged[pose] == logged[settings] == [1, 1, 1, 2, 2, 3]
