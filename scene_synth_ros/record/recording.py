"""Takes messages as they arrive, orders them by stamp and hands them to the thread that writes."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Collection, Iterable, Mapping
from concurrent.futures import Future
from pathlib import Path

from rclpy.qos import QoSProfile

from scene_synth_ros.bags.bag_writer import MAX_TIME_NS, BagWriteError, BagWriter
from scene_synth_ros.messages.message_definitions import TF_MESSAGE, message_definition
from scene_synth_ros.messages.stamps import NANOSECONDS, AnnouncedRoom, announced_room, stamp_ns
from scene_synth_ros.messages.timed_pose import TimedPose
from scene_synth_ros.record.bag_output import BagNumbers, BagOutput, Entry, RecordingOptions, is_latched
from scene_synth_ros.record.bag_thread import BagThread
from scene_synth_ros.record.camera_transforms import CameraTransforms
from scene_synth_ros.record.frame_sorter import FrameSorter, OrderedMessage
from scene_synth_ros.record.seen_frames import ROOMS_KEPT, SeenFrames
from scene_synth_ros.record.senders import Origin
from scene_synth_ros.record.topic_counts import TopicCounts
from scene_synth_ros.suite.qos import latched_qos, stream_qos

WALL_STAMPED = ("diagnostic_msgs/msg/DiagnosticArray", "rcl_interfaces/msg/Log")
"""Types whose header holds wall time; in a bag of simulated time they are logged at the time of the frame before them."""

MAX_EARLY = 1000
"""How many messages without stamps wait for the first frame."""
MAX_STRAY_NS = 60 * NANOSECONDS
"""Messages of others whose stamp is further from the newest frame are of another clock and are logged as those above."""


class Recording:
    """One life of the recorder: bags, one after the other, and the thread that writes them; ``close`` ends both.

    Transforms are derived from the camera poses and written to ``/tf`` and ``/tf_static`` whether or not anybody publishes them.

    Threads: the thread of the node's executor calls every method; what is kept and ordered here belongs to it.  The thread that writes
    owns the bags (:class:`BagOutput`) and gets everything through the queue of :class:`BagThread`; ``add`` waits while that is full.  Both
    count in ``taken`` and ``written``, which have a lock; ``warn`` and ``log_fault`` are called from both.

    Args:
        make_writer: opens the bag of a folder.
        options: splitting, image compression, snapshots.
        warn: called with one line for messages that cannot be kept.
        log_fault: called with the traceback of a fault of the program that has ended the writing.
        numbers: of bags and snapshots, where an earlier recording has made some.
        queue_size: messages that may wait for the disk.

    Attributes:
        taken: messages received and done with, by topic: written, or left out on purpose.
        written: messages in bags, by topic.
        refused: messages with a stamp that no bag can hold, left out.
    """

    def __init__(
        self,
        make_writer: Callable[[Path], BagWriter],
        options: RecordingOptions | None = None,
        warn: Callable[[str], None] = lambda _: None,
        log_fault: Callable[[str], None] = lambda _: None,
        numbers: BagNumbers | None = None,
        queue_size: int = 256,
    ) -> None:
        self.taken, self.written, self.refused = TopicCounts(), TopicCounts(), 0
        self._warn = warn
        self._output = BagOutput(make_writer, options or RecordingOptions(), numbers or BagNumbers(), self.written, warn)
        self._thread = BagThread(log_fault, queue_size)
        self._closed = False
        self._types: dict[str, str] = {}
        self._origins: dict[str, Origin] = {}
        self._latched: set[str] = set()
        self._expected: set[str] = set()
        self._alike: Mapping[str, str] = {}
        self._sorter = FrameSorter(None)
        self._seen = SeenFrames()
        self._rooms: deque[AnnouncedRoom] = deque(maxlen=ROOMS_KEPT)
        self._newest_ns: int | None = None
        self._begun: set[str] = set()
        self._whole_from_ns = 0
        self._early: list[tuple[str, bytes, int]] = []
        self._transforms = CameraTransforms()
        self._last_ns = -1

    @property
    def fault(self) -> str:
        """Why writing has ended early, one line; empty while all is well."""
        return self._thread.fault

    @property
    def repeats(self) -> int:
        """Messages of frames that were recorded already, left out."""
        return self._seen.repeats

    @property
    def late(self) -> int:
        """Messages that came after their frame had been written, logged later than their stamp."""
        return self._sorter.late

    @property
    def writing(self) -> bool:
        """Whether a bag is open."""
        return self._output.writing

    @property
    def waiting_bytes(self) -> int:
        """Bytes that wait for their frame to be complete."""
        return self._sorter.waiting_bytes

    @property
    def waiting_messages(self) -> int:
        """Messages that wait for the disk."""
        return self._thread.waiting

    def begin(self, base: Path) -> Future[str]:
        """Open the next bag, ``base``, then ``base_2`` and so on, after everything received so far; the future is its folder.

        Its exception is a BagWriteError: one is open already, or it cannot be begun.
        """
        return self._thread.ask(self._output.begin, base)

    def end(self) -> Future[str]:
        """Close the bag after everything received so far; the future is what became of it, in words, or a BagWriteError."""
        self._enqueue(self._sorter.flush())
        return self._thread.ask(self._output.end)

    def split(self) -> None:
        """Go on in a new file with the next frame."""
        self._release_unexpected()
        self._thread.do(self._output.split)

    def snapshot(self, base: Path) -> Future[str]:
        """Write the last seconds into a bag of their own, ``base_<n>``; the future is what it holds, in words, or a BagWriteError."""
        self._release_unexpected()
        return self._thread.ask(self._output.snapshot, base)

    def describe_run(self, name: str, record: dict[str, str], attachment: str, data: bytes) -> None:
        """Keep a metadata record and an attachment with the bag at work and all to come."""
        self._thread.do(self._output.describe_run, name, record, attachment, data)

    def add_topic(self, topic: str, type_name: str, offered: list[QoSProfile], origin: Origin = Origin.SUITE) -> None:
        """Open a channel for a topic; the messages of ``origin`` others may have stamps of another clock.

        Raises:
            MessageDefinitionError: the type is not installed.
        """
        message_definition(type_name)
        self._types[topic], self._origins[topic] = type_name, origin
        self._sorter.follow(topic, origin is not Origin.SUITE)
        if is_latched(offered):
            self._latched.add(topic)
        self._thread.do(self._output.add_topic, topic, type_name, offered)

    def set_origin(self, topic: str, origin: Origin) -> None:
        """Say whose messages a topic has, now that more is known of it."""
        if origin is self._origins[topic]:
            return
        self._origins[topic] = origin
        self._sorter.follow(topic, origin is not Origin.SUITE)
        if origin is Origin.OTHERS:
            for stamp, data in self._sorter.take_back(topic):
                self._enqueue(self._sorter.add(topic, self._stamp_of_others(stamp), data))

    def begin_suite(self) -> None:
        """Let time begin anew with the suite's first frame, whatever has been recorded before that."""
        self._sorter.restart_clock()
        self._newest_ns, self._last_ns = None, -1

    def expect(self, topics: Collection[str], alike: Mapping[str, str]) -> None:
        """Say which topics make a frame complete, and which of them stand for each other; frames leave as soon as all are there."""
        if set(topics) != self._expected or alike != self._alike:
            self._expected, self._alike = set(topics), alike
            self._enqueue(self._sorter.configure(self._expected or None, alike))

    def add(self, topic: str, data: bytes) -> bool:
        """Take a message as it arrives; return False if it is left out: recorded before, refused, or too late.

        It is padded to whole words, as DDS does on the way between processes, so that bags do not depend on where a publisher runs.
        """
        if self._closed:
            return False
        type_name, origin = self._types[topic], self._origins[topic]
        stamp = None if type_name in WALL_STAMPED else stamp_ns(type_name, data)
        if stamp is not None and not 0 <= stamp < MAX_TIME_NS:
            self._refuse(topic, stamp)
            return False
        if stamp is not None and origin is Origin.OTHERS:
            stamp = self._stamp_of_others(stamp)
        elif stamp is not None and (topic in self._expected or topic in self._latched):
            if not self._is_new(topic, stamp):  # a frame is done again, or a connection is made again to what is latched
                return False
            if topic in self._expected:
                self._note_frame(topic, stamp, origin)
            elif topic.endswith("/scene"):
                self._seen.begin_room(stamp)
                self._rooms.append(announced_room(data))
        self._enqueue(self._sorter.add(topic, stamp, data + bytes(-len(data) % 4)))
        if self._sorter.first_ns < self._whole_from_ns:  # latched parts of frames from before the recorder was connected
            self._enqueue(self._sorter.flush(self._whole_from_ns - 1))
        return True

    def add_pose(self, pose: TimedPose, camera: str) -> None:
        """Derive the transforms of a camera from its pose: world -> link at every stamp, link -> optical frame once."""
        transforms = self._transforms.of_pose(pose, camera)
        if transforms.static is not None:
            for name, qos in (("/tf", stream_qos(100)), ("/tf_static", latched_qos())):
                if name not in self._types:
                    self.add_topic(name, TF_MESSAGE, [qos])
            self._enqueue(self._sorter.add("/tf_static", pose.stamp_ns, transforms.static))
        self._enqueue(self._sorter.add("/tf", pose.stamp_ns, transforms.moving))

    def flush(self, room: int | None = None) -> None:
        """Hand everything that waits, or what waits of a room and of those before it, to the writer and wait until it is written.

        Frames of later rooms, of which some messages may still be on their way, are left to be completed; if the room's scene description
        was not recorded, nothing tells them apart and all leave.
        """
        rooms = () if room is None else reversed(self._rooms)
        end_ns = next((max(known.stamps_ns, default=-1) for known in rooms if known.index == room), None)
        self._enqueue(self._sorter.flush(end_ns))
        self._thread.wait()

    def close(self) -> None:
        """Write the complete frames that wait, close the bag and end the thread; harmless when repeated.

        A frame of which only a part has come, as at an interruption, is left out.  Messages without stamps are logged at the time of the
        first frame; where none has come, by the wall clock when they arrived.

        Raises:
            BagWriteError: something was not written; the text is ``fault``.
        """
        if self._closed:
            return
        self._closed = True
        if self._expected:
            complete = [stamp for stamp, missing in self._sorter.missing().items() if not missing]
            self._enqueue(self._sorter.flush(max(complete, default=-1)))
        else:
            self._enqueue(self._sorter.flush())
        for topic, data, arrival_ns in self._early:  # nothing had a stamp
            self._hand_over(Entry(topic, data, arrival_ns))
        self._thread.do(self._output.end)
        self._thread.close()
        if self.fault:
            raise BagWriteError(self.fault)

    def _stamp_of_others(self, stamp: int) -> int | None:
        """Return the stamp of a message of others if it can be of the frames' clock; None is logged at the time of the bag."""
        near = self._newest_ns is not None and abs(stamp - self._newest_ns) <= MAX_STRAY_NS
        return stamp if near else None

    def _note_frame(self, topic: str, stamp: int, origin: Origin) -> None:
        """Take the time of a frame from a message that is certainly the suite's."""
        if origin is not Origin.SUITE:
            return
        self._newest_ns = stamp
        if topic not in self._begun and topic not in self._latched:
            self._begun.add(topic)
            self._whole_from_ns = max(self._whole_from_ns, stamp)

    def _is_new(self, topic: str, stamp: int) -> bool:
        """Return whether a message comes for the first time; one that does not is done with."""
        new = self._seen.is_new(topic, stamp)
        if not new:
            self.taken.add(topic)
        return new

    def _refuse(self, topic: str, stamp: int) -> None:
        self.refused += 1
        self.taken.add(topic)
        limit_s = MAX_TIME_NS // NANOSECONDS
        self._warn(f"{topic}: a message was refused: expected a stamp from 0 to {limit_s} s, got {stamp / NANOSECONDS:.9f} s")

    def _release_unexpected(self) -> None:
        """Let out what waits if there are no frames for which it could wait."""
        if not self._expected:
            self._enqueue(self._sorter.flush())

    def _enqueue(self, messages: Iterable[OrderedMessage]) -> None:
        batch = list(messages)
        frames: dict[int, set[str]] = {}
        for message in batch:
            frames.setdefault(message.log_ns, set()).add(message.topic)
        for message in batch:
            if message.stamp_ns is None and self._last_ns < 0:
                self._hold_early(message.topic, message.data)
                continue
            first = message.stamp_ns is not None and message.log_ns > self._last_ns
            together = frozenset(frames[message.log_ns]) if first else frozenset()
            room = first and any(topic.endswith("/scene") for topic in together)
            self._last_ns = max(self._last_ns, message.log_ns)
            for topic, data, _ in self._early:
                self._hand_over(Entry(topic, data, message.log_ns))
            self._early = []
            self._hand_over(Entry(message.topic, message.data, message.log_ns, first, room, together))

    def _hand_over(self, entry: Entry) -> None:
        self._thread.do(self._write, entry)

    def _write(self, entry: Entry) -> None:
        """Write a message, unless writing has ended; in the thread that writes."""
        self.taken.add(entry.topic)
        if not self.fault:
            self._output.write(entry)

    def _hold_early(self, topic: str, data: bytes) -> None:
        """Keep a message that has no stamp until there is a first frame whose time it can have."""
        if len(self._early) == MAX_EARLY:
            self._warn(f"no frame has come yet; of the messages without stamps only the newest {MAX_EARLY} are kept")
            self._early.pop(0)
        self._early.append((topic, data, time.time_ns()))
