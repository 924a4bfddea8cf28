"""What the thread that writes keeps to itself: bags are opened one at a time, snapshots never meet."""

import threading
from collections.abc import Iterator
from concurrent.futures import TimeoutError
from pathlib import Path

import pytest
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PointStamped
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message
from sensor_msgs.msg import Image
from std_msgs.msg import Header, String

from scene_synth_ros.bags.bag_writer import BagWriteError, BagWriter
from scene_synth_ros.messages.image_codec import ImageCompression
from scene_synth_ros.messages.streams import IMAGE_TYPE
from scene_synth_ros.record import bag_output
from scene_synth_ros.record.bag_output import RecordingOptions
from scene_synth_ros.record.recording import MAX_EARLY, Recording

POINT = "geometry_msgs/msg/PointStamped"
COLOR = "/synth/camera/color/image_raw"
DEADLINE_S = 20.0


def point(seconds: int) -> bytes:
    return bytes(serialize_message(PointStamped(header=Header(stamp=Time(sec=seconds)))))


class SlowDisk:
    """Opens bags that take messages only once they are let go."""

    def __init__(self) -> None:
        self.free = threading.Event()
        self.reached = threading.Event()

    def make(self, folder: Path) -> BagWriter:
        disk = self

        class Slow(BagWriter):
            def add_topic(self, *values: object, **named: object) -> None:
                disk.reached.set()
                assert disk.free.wait(DEADLINE_S)
                super().add_topic(*values, **named)

        return Slow(folder)


@pytest.fixture
def disk() -> Iterator[SlowDisk]:
    slow = SlowDisk()
    yield slow
    slow.free.set()


def test_two_starts_in_a_row_open_one_bag(tmp_path: Path) -> None:
    recording = Recording(BagWriter)
    first, second = recording.begin(tmp_path / "bag"), recording.begin(tmp_path / "bag")
    assert first.result(DEADLINE_S) == str(tmp_path / "bag")
    with pytest.raises(BagWriteError, match="a bag is open already"):
        second.result(DEADLINE_S)
    assert not recording.fault, "the asker hears of it; the recording goes on"
    assert recording.end().result(DEADLINE_S) == f"{tmp_path}/bag: 0 messages"
    recording.close()
    assert [path.name for path in tmp_path.iterdir()] == ["bag"]
    assert sorted(path.name for path in (tmp_path / "bag").iterdir()) == ["bag_0.mcap", "metadata.yaml"]


@pytest.mark.parametrize(
    ("topic", "others", "left"), [("/diagnostics", [], []), ("/diagnostics", ["mine"], ["bag"]), ("/a", [], ["bag"]), (None, [], [])]
)
def test_a_bag_that_holds_nothing_at_the_end_is_removed_and_nothing_else(
    tmp_path: Path, topic: str | None, others: list[str], left: list[str]
) -> None:
    (tmp_path / "before").mkdir()
    recording = Recording(BagWriter, RecordingOptions(incidental=frozenset({"/diagnostics"})))
    for name in ("/diagnostics", "/a"):
        recording.add_topic(name, "std_msgs/msg/String", [QoSProfile(depth=10)])
    recording.begin(tmp_path / "new" / "bag").result(DEADLINE_S)
    for name in others:
        (tmp_path / "new" / "bag" / name).touch()
    if topic is not None:
        recording.add(topic, bytes(serialize_message(String(data="what has no stamp"))))
    recording.close()
    assert recording.discarded == (topic != "/a") and not recording.writing
    assert [path.name for path in (tmp_path / "new").iterdir()] == left
    assert [path.name for path in tmp_path.glob("new/bag/*") if path.suffix not in (".mcap", ".yaml")] == others
    assert (tmp_path / "before").is_dir()


def test_that_messages_before_the_first_frame_are_too_many_is_said_once(tmp_path: Path) -> None:
    told: list[str] = []
    recording = Recording(BagWriter, warn=told.append)
    recording.add_topic("/a", "std_msgs/msg/String", [QoSProfile(depth=10)])
    recording.begin(tmp_path / "bag").result(DEADLINE_S)
    for number in range(MAX_EARLY + 5):
        recording.add("/a", bytes(serialize_message(String(data=str(number)))))
    recording.close()
    assert len(told) == 1 and recording.written["/a"] == MAX_EARLY


def test_a_bag_of_what_was_asked_for_stays_whatever_it_is(tmp_path: Path) -> None:
    recording = Recording(BagWriter)
    recording.add_topic("/diagnostics", "std_msgs/msg/String", [QoSProfile(depth=10)])
    recording.begin(tmp_path / "bag").result(DEADLINE_S)
    recording.add("/diagnostics", bytes(serialize_message(String(data="on purpose"))))
    recording.close()
    assert not recording.discarded and (tmp_path / "bag" / "metadata.yaml").exists()


def test_topics_may_come_while_a_snapshot_is_begun(tmp_path: Path, disk: SlowDisk) -> None:
    recording = Recording(disk.make, RecordingOptions(snapshot_s=100.0))
    for topic in ("/a", "/b"):
        recording.add_topic(topic, POINT, [QoSProfile(depth=10)])
    recording.add("/a", point(1))
    taken = recording.snapshot(tmp_path / "snapshot")
    assert disk.reached.wait(DEADLINE_S), "the snapshot is going through the topics"
    recording.add_topic("/c", POINT, [QoSProfile(depth=10)])
    disk.free.set()
    assert taken.result(DEADLINE_S) == f"{tmp_path}/snapshot_0: 1 messages, 0.000 s"
    recording.close()


def test_a_snapshot_that_is_late_does_not_stand_in_the_way_of_the_next(tmp_path: Path, disk: SlowDisk) -> None:
    recording = Recording(disk.make, RecordingOptions(snapshot_s=100.0))
    recording.add_topic("/a", POINT, [QoSProfile(depth=10)])
    with pytest.raises(BagWriteError, match="nothing is kept yet"):
        recording.snapshot(tmp_path / "snapshot").result(DEADLINE_S)
    recording.add("/a", point(1))
    late = recording.snapshot(tmp_path / "snapshot")
    with pytest.raises(TimeoutError):
        late.result(0.1)
    following = recording.snapshot(tmp_path / "snapshot")
    disk.free.set()
    assert late.result(DEADLINE_S).startswith(f"{tmp_path}/snapshot_0: ")
    assert following.result(DEADLINE_S).startswith(f"{tmp_path}/snapshot_1: ")
    recording.close()


def test_both_threads_count_what_is_taken_and_none_is_forgotten(tmp_path: Path) -> None:
    recording = Recording(BagWriter)
    recording.add_topic("/a", POINT, [QoSProfile(depth=10)])
    recording.expect({"/a"}, {})
    recording.begin(tmp_path / "bag")
    for second in range(3000):
        recording.add("/a", point(second))
        recording.add("/a", point(second))
        recording.written.copy()
    recording.close()
    assert recording.taken["/a"] == 6000
    assert recording.written.copy() == {"/a": 3000}


def test_names_that_are_taken_are_passed_over(tmp_path: Path) -> None:
    for name in ("snapshot_0", "snapshot_2", "bag_2"):
        (tmp_path / name).mkdir()
    recording = Recording(BagWriter, RecordingOptions(snapshot_s=100.0))
    recording.add_topic("/a", POINT, [QoSProfile(depth=10)])
    recording.add("/a", point(1))
    for number in (1, 3):
        assert recording.snapshot(tmp_path / "snapshot").result(DEADLINE_S).startswith(f"{tmp_path}/snapshot_{number}: ")
    for name in ("bag", "bag_3"):
        assert recording.begin(tmp_path / "bag").result(DEADLINE_S) == str(tmp_path / name)
        recording.end().result(DEADLINE_S)
    recording.close()
    assert not list((tmp_path / "bag_2").iterdir())


def test_an_image_is_compressed_where_a_bag_is_open_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    compressed: list[str] = []
    monkeypatch.setattr(bag_output, "compress", lambda data, topic, *_: compressed.append(topic) or data)
    recording = Recording(BagWriter, RecordingOptions(compression=ImageCompression(color="png"), snapshot_s=1.0))
    recording.add_topic(COLOR, IMAGE_TYPE, [QoSProfile(depth=10)])
    for second in (1, 2):
        recording.add(COLOR, bytes(serialize_message(Image(header=Header(stamp=Time(sec=second))))))
        recording.flush()
        assert len(compressed) == second - 1
        recording.begin(tmp_path / "bag").result(DEADLINE_S) if second == 1 else recording.close()
