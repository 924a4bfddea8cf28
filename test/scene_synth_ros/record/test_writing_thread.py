"""The thread that writes outlives every exception: the fault is told, what waits is resolved, nothing hangs."""

import json
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PointStamped
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message
from sensor_msgs.msg import Image
from std_msgs.msg import Header, String

from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.bags.bag_writer import BagWriteError, BagWriter
from scene_synth_ros.messages.image_codec import ImageCompression
from scene_synth_ros.record.bag_output import RecordingOptions
from scene_synth_ros.record.recording import Recording

POINT, TEXT, IMAGE = "geometry_msgs/msg/PointStamped", "std_msgs/msg/String", "sensor_msgs/msg/Image"
DEADLINE_S = 20.0


def point(seconds: int) -> bytes:
    return bytes(serialize_message(PointStamped(header=Header(stamp=Time(sec=seconds)))))


def text(stamp_ns: int) -> bytes:
    return bytes(serialize_message(String(data=json.dumps({"stamp_ns": stamp_ns}))))


def in_time(work: Callable[[], object]) -> object:
    """Do something that might hang in a thread of its own; return what it returned or raised."""
    outcome: list[object] = []

    def run() -> None:
        try:
            outcome.append(work())
        except Exception as error:
            outcome.append(error)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    thread.join(DEADLINE_S)
    assert not thread.is_alive(), f"it hangs for {DEADLINE_S} s"
    return outcome[0]


def test_a_negative_stamp_before_the_first_frame_is_refused_and_the_rest_is_written(tmp_path: Path) -> None:
    told: list[str] = []
    recording = Recording(BagWriter, warn=told.append)
    recording.add_topic("/odd", POINT, [QoSProfile(depth=10)])
    recording.add_topic("/a", POINT, [QoSProfile(depth=10)])
    recording.begin(tmp_path / "bag")
    recording.add("/odd", point(-5))
    for second in range(18):
        recording.add("/a", point(second))
    in_time(recording.flush)
    in_time(recording.close)
    assert (recording.intake.refused, recording.fault) == (1, "")
    assert told == ["/odd: a message was refused: expected a stamp from 0 to 9223372036 s, got -5.000000000 s"]
    assert recording.taken.total() == 19, "a refused message is done with"
    with BagReader(tmp_path / "bag") as reader:
        assert [(message.topic, message.log_ns) for message in reader.messages()] == [("/a", second * 10**9) for second in range(18)]


@pytest.mark.parametrize("stamp_ns", [-1, -(2**63) + 1, 2**63 - 1])
def test_stamps_that_no_bag_can_hold_are_refused_where_they_come_in(tmp_path: Path, stamp_ns: int) -> None:
    recording = Recording(BagWriter)
    recording.add_topic("/a", TEXT, [QoSProfile(depth=10)])
    recording.begin(tmp_path / "bag")
    assert recording.add("/a", text(stamp_ns)) is False
    assert recording.add("/a", text(2**63 - 2)) is True
    in_time(recording.close)
    assert (recording.intake.refused, recording.written.copy(), recording.fault) == (1, {"/a": 1}, "")


class Faulty:
    """A bag writer one of whose calls raises what nobody foresaw, once."""

    def __init__(self, folder: Path, call: str, after: int = 0) -> None:
        self._writer, self._call, self._left = BagWriter(folder), call, after

    def __getattr__(self, name: str) -> Any:
        found = getattr(self._writer, name)
        if name != self._call:
            return found

        def call(*values: Any, **options: Any) -> Any:
            self._left -= 1
            if self._left < 0:
                raise ZeroDivisionError(f"{name} of a faulty writer")
            return found(*values, **options)

        return call


@pytest.mark.parametrize(
    ("call", "after"), [("write", 0), ("write", 5), ("split", 0), ("set_record", 0), ("set_attachment", 0), ("add_topic", 1)]
)
def test_any_exception_of_the_writer_is_told_and_nothing_hangs(tmp_path: Path, call: str, after: int) -> None:
    told: list[Exception] = []

    def tell(error: Exception) -> str:
        told.append(error)
        return f"told: {error}"

    recording = Recording(lambda folder: Faulty(folder, call, after), tell_fault=tell, jobs_waiting=1)
    recording.add_topic("/a", POINT, [QoSProfile(depth=10)])
    recording.begin(tmp_path / "bag").result(DEADLINE_S)

    def record() -> None:
        recording.add_topic("/b", POINT, [QoSProfile(depth=10)])
        recording.describe_run("run", {"seed": "1"}, "parameters.yaml", b"{}")
        for second in range(10):
            recording.add("/a", point(second))
            if second == 5:
                recording.split()
        recording.flush()
        for second in range(10, 60):
            recording.add("/a", point(second))
        recording.flush()

    assert in_time(record) is None
    assert recording.fault == f"the recording ends: told: {call} of a faulty writer"
    assert len(told) == 1 and isinstance(told[0], ZeroDivisionError)
    assert recording.waiting_messages == 0
    assert recording.taken["/a"] == 60, "what comes after the fault is taken and dropped, or whoever publishes would wait"
    with pytest.raises(BagWriteError, match="faulty writer"):
        recording.end().result(DEADLINE_S)
    with pytest.raises(BagWriteError, match="faulty writer"):
        recording.begin(tmp_path / "next").result(DEADLINE_S)
    told = in_time(recording.close)
    assert isinstance(told, BagWriteError) and "faulty writer" in str(told)
    with BagReader(tmp_path / "bag") as reader:
        assert reader.summary.finished, "what was written before the fault is a whole bag"


def test_an_exception_while_the_bag_is_closed_is_told(tmp_path: Path) -> None:
    recording = Recording(lambda folder: Faulty(folder, "close"))
    recording.add_topic("/a", POINT, [QoSProfile(depth=10)])
    recording.begin(tmp_path / "bag").result(DEADLINE_S)
    recording.add("/a", point(1))
    told = in_time(recording.close)
    assert isinstance(told, BagWriteError) and "close of a faulty writer" in str(told)


def test_any_exception_while_a_bag_is_begun_is_told(tmp_path: Path) -> None:
    def make(folder: Path) -> BagWriter:
        raise ZeroDivisionError(f"no {folder.name}")

    recording = Recording(make)
    with pytest.raises(BagWriteError, match=r"the recording ends: ZeroDivisionError\('no bag'\)"):
        recording.begin(tmp_path / "bag").result(DEADLINE_S)
    assert recording.fault and not recording.writing
    assert isinstance(in_time(recording.close), BagWriteError)


def test_any_exception_of_the_codec_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def compress(*_: object) -> bytes:
        raise IndexError("a codec's own mistake")

    monkeypatch.setattr("scene_synth_ros.record.bag_output.compress", compress)
    recording = Recording(BagWriter, RecordingOptions(compression=ImageCompression(color="png")))
    topic = "/synth/camera/color/image_raw"
    recording.add_topic(topic, IMAGE, [QoSProfile(depth=10)])
    recording.begin(tmp_path / "bag").result(DEADLINE_S)
    for second in range(3):
        recording.add(topic, bytes(serialize_message(Image(header=Header(stamp=Time(sec=second))))))
    in_time(recording.flush)
    assert recording.fault.startswith("the recording ends: IndexError") and "a codec's own mistake" in recording.fault
    assert recording.taken[topic] == 3
    assert isinstance(in_time(recording.close), BagWriteError)


def test_what_comes_after_the_end_is_left_out(tmp_path: Path) -> None:
    recording = Recording(BagWriter)
    recording.add_topic("/a", POINT, [QoSProfile(depth=10)])
    recording.begin(tmp_path / "bag").result(DEADLINE_S)
    recording.close()
    recording.close()
    assert recording.add("/a", point(1)) is False
    in_time(recording.flush)
    with pytest.raises(BagWriteError, match="the recording has ended"):
        recording.end().result(DEADLINE_S)
