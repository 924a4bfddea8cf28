"""Takes messages as they arrive, orders them by stamp and writes them to bags in a thread of its own."""

from __future__ import annotations

import queue
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Collection, Iterable, Mapping
from concurrent.futures import Future
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from rclpy.qos import QoSDurabilityPolicy, QoSProfile

from scene_description.poses import LINK_FROM_OPTICAL, conjugate_quaternion, multiply_quaternions
from scene_synth_ros.bags.bag_writer import BagWriteError, BagWriter
from scene_synth_ros.messages.image_codec import COMPRESSED_TYPE, CodecError, ImageCompression, compress, compressed_topic, image_form
from scene_synth_ros.messages.message_definitions import message_definition
from scene_synth_ros.messages.stamps import NANOSECONDS, AnnouncedRoom, announced_room, stamp_ns
from scene_synth_ros.messages.timed_pose import TimedPose
from scene_synth_ros.messages.transforms_cdr import StampedTransform, encode_tf_message
from scene_synth_ros.record.frame_sorter import FrameSorter, OrderedMessage
from scene_synth_ros.record.seen_frames import ROOMS_KEPT, SeenFrames
from scene_synth_ros.record.snapshot_ring import KeptMessage, SnapshotRing
from scene_synth_ros.record.split_policy import SplitPolicy
from scene_synth_ros.suite.qos import latched_qos, stream_qos

TF_TYPE = "tf2_msgs/msg/TFMessage"
WALL_STAMPED = ("diagnostic_msgs/msg/DiagnosticArray", "rcl_interfaces/msg/Log")
"""Types whose header holds wall time; in a bag of simulated time they are logged at the time of the frame before them."""

MAX_EARLY = 1000
"""How many messages without stamps wait for the first frame."""
MAX_STRAY_NS = 60 * NANOSECONDS
"""Messages of others whose stamp is further from the newest frame are of another clock and are logged as those above."""


class _Job(NamedTuple):
    """A message for the thread that writes; ``room`` marks the first of a frame that begins a room, ``first`` the first of any frame."""

    topic: str
    data: bytes
    log_ns: int
    first: bool
    room: bool
    together: frozenset[str]


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingOptions:
    """How bags are written beyond what their writer decides."""

    split: SplitPolicy = field(default_factory=SplitPolicy)
    compression: ImageCompression = field(default_factory=ImageCompression)
    snapshot_s: float = 0.0
    snapshot_bytes: int = 2**28


class Recording:
    """Bags that are being recorded, one after the other; ``add`` never waits for the disk longer than its queue is full.

    Transforms are derived from the camera poses and written to ``/tf`` and ``/tf_static`` whether or not anybody publishes them.

    Args:
        make_writer: opens the bag of a folder.
        options: splitting, image compression, snapshots.
        complain: called with one line for messages that cannot be kept; from the thread that writes.
        queue_size: messages that may wait for the disk.

    Attributes:
        taken: messages received and done with, by topic, written or left out on purpose.
        written: messages in bags, by topic.
        fault: why writing has ended early; empty while all is well.
    """

    def __init__(
        self,
        make_writer: Callable[[Path], BagWriter],
        options: RecordingOptions | None = None,
        complain: Callable[[str], None] = lambda _: None,
        queue_size: int = 256,
    ) -> None:
        self._make_writer, self._options, self._complain = make_writer, options or RecordingOptions(), complain
        self._writer: BagWriter | None = None
        self._types: dict[str, tuple[str, list[QoSProfile], bool]] = {}
        self._forms: dict[str, str] = {}
        self._expected: set[str] = set()
        self._alike: Mapping[str, str] = {}
        self._sorter = FrameSorter(None)
        self._seen = SeenFrames()
        self._rooms: deque[AnnouncedRoom] = deque(maxlen=ROOMS_KEPT)
        self._newest_ns: int | None = None
        self._begun: set[str] = set()
        self._whole_from_ns = 0
        self._early: list[tuple[str, bytes, int]] = []
        self._cameras: dict[str, str] = {}
        self._ring = SnapshotRing(self._options.snapshot_s, self._options.snapshot_bytes)
        self._last_ns = -1
        self._file_start_ns: int | None = None
        self._file_rooms = 0
        self._split_asked = False
        self._records: dict[str, dict[str, str]] = {}
        self._attachments: dict[str, bytes] = {}
        self._jobs: queue.Queue[_Job | Callable[[], None] | None] = queue.Queue(queue_size)
        self.taken: Counter[str] = Counter()
        self.written: Counter[str] = Counter()
        self.fault = ""
        self._thread = threading.Thread(target=self._write_all, name="bag", daemon=True)
        self._thread.start()

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
        return self._writer is not None

    def begin(self, folder: Path) -> None:
        """Open a bag; what was received before goes to the one before.

        Raises:
            BagWriteError: it cannot be begun.
        """
        writer = self._open(folder)

        def take() -> None:
            self._file_start_ns, self._file_rooms = None, 0
            self._writer = writer
            for topic in list(self._types):  # those that have come since
                self._add_channel(writer, topic)

        self._jobs.put(take)

    def end(self) -> Future[str]:
        """Close the bag after everything received so far; the future is what became of it, in words, or a BagWriteError."""
        self._enqueue(self._sorter.flush())
        return self._control(self._close_bag)

    def split(self) -> None:
        """Go on in a new file with the next frame."""
        self._release_unexpected()
        self._control(self._ask_for_split)

    def snapshot(self, folder: Path) -> Future[str]:
        """Write the last seconds into a bag of their own; the future is what it holds, in words, or a BagWriteError."""
        self._release_unexpected()
        return self._control(lambda: self._write_snapshot(folder))

    def describe_run(self, name: str, record: dict[str, str], attachment: str, data: bytes) -> None:
        """Keep a metadata record and an attachment with the bag at work and all to come."""

        def take() -> None:
            self._records[name], self._attachments[attachment] = record, data
            if self._writer is not None:
                self._writer.set_record(name, record)
                self._writer.set_attachment(attachment, data)

        self._jobs.put(take)

    def add_topic(self, topic: str, type_name: str, offered: list[QoSProfile], *, foreign: bool = False) -> None:
        """Open a channel for a topic; ``foreign`` topics may have stamps of another clock.

        Raises:
            MessageDefinitionError: the type is not installed.
            BagWriteError: the bag is closed.
        """
        message_definition(type_name)
        self._types[topic] = (type_name, offered, foreign)
        self._forms[topic] = image_form(topic, type_name, self._options.compression)
        if offered and all(qos.durability == QoSDurabilityPolicy.TRANSIENT_LOCAL for qos in offered):
            self._ring.latched = {*self._ring.latched, topic}
        if self._writer is not None:
            self._add_channel(self._writer, topic)

    def expect(self, topics: Collection[str], alike: Mapping[str, str]) -> None:
        """Say which topics make a frame complete, and which of them stand for each other; frames leave as soon as all are there."""
        if set(topics) != self._expected or alike != self._alike:
            self._expected, self._alike = set(topics), alike
            self._enqueue(self._sorter.configure(self._expected or None, alike))

    def add(self, topic: str, data: bytes) -> bool:
        """Take a message as it arrives; return False if it is one that was recorded before.

        It is padded to whole words, as DDS does on the way between processes, so that bags do not depend on where a publisher runs.
        """
        type_name, _, foreign = self._types[topic]
        stamp = None if type_name in WALL_STAMPED else stamp_ns(type_name, data)
        if topic in self._expected and stamp is not None:
            if not self._seen.is_new(topic, stamp):
                self.taken[topic] += 1
                return False
            self._newest_ns = stamp
            if topic not in self._begun and topic not in self._ring.latched:
                self._begun.add(topic)
                self._whole_from_ns = max(self._whole_from_ns, stamp)
        elif foreign and stamp is not None and (self._newest_ns is None or abs(stamp - self._newest_ns) > MAX_STRAY_NS):
            stamp = None
        elif stamp is not None and topic in self._ring.latched and not foreign:
            if not self._seen.is_new(topic, stamp):  # latched messages come again when a connection does
                self.taken[topic] += 1
                return False
            if topic.endswith("/scene"):
                self._seen.begin_room(stamp)
                self._rooms.append(announced_room(data))
        self._enqueue(self._sorter.add(topic, stamp, data + bytes(-len(data) % 4)))
        if self._sorter.first_ns < self._whole_from_ns:  # latched parts of frames from before the recorder was connected
            self._enqueue(self._sorter.flush(self._whole_from_ns - 1))
        return True

    def add_pose(self, topic: str, pose: TimedPose, camera: str) -> None:
        """Derive the transforms of a camera from its pose: world -> link at every stamp, link -> optical frame once."""
        link = f"{camera}_link"
        if camera not in self._cameras:
            self._cameras[camera] = link
            for name, qos in (("/tf", stream_qos(100)), ("/tf_static", latched_qos())):
                if name not in self._types:
                    self.add_topic(name, TF_TYPE, [qos])
            static = [
                StampedTransform(pose.stamp_ns, known_link, f"{known}_optical_frame", (0.0, 0.0, 0.0), LINK_FROM_OPTICAL)
                for known, known_link in sorted(self._cameras.items())
            ]
            self._enqueue(self._sorter.add("/tf_static", pose.stamp_ns, encode_tf_message(static)))
        rotation = multiply_quaternions(pose.quaternion, conjugate_quaternion(LINK_FROM_OPTICAL))
        transform = StampedTransform(pose.stamp_ns, pose.world, link, pose.position_m, rotation)
        self._enqueue(self._sorter.add("/tf", pose.stamp_ns, encode_tf_message([transform])))

    def flush(self, room: int | None = None) -> None:
        """Hand everything that waits, or what waits of a room and of those before it, to the writer and wait until it is written.

        Frames of later rooms, of which some messages may still be on their way, are left to be completed; if the room's scene description
        was not recorded, nothing tells them apart and all leave.
        """
        rooms = () if room is None else reversed(self._rooms)
        end_ns = next((max(known.stamps_ns, default=-1) for known in rooms if known.index == room), None)
        self._enqueue(self._sorter.flush(end_ns))
        if not self.fault:
            self._jobs.join()

    @property
    def waiting_bytes(self) -> int:
        """Bytes that wait for their frame to be complete."""
        return self._sorter.waiting_bytes

    @property
    def waiting_messages(self) -> int:
        """Messages that wait for the disk."""
        return self._jobs.qsize()

    def close(self) -> None:
        """Write the complete frames that wait and close the bag; a frame of which only a part has come, as at an interruption, is left out.

        Messages without stamps are logged at the time of the first frame; where none has come, by the wall clock when they arrived.

        Raises:
            BagWriteError: the bag could not be completed.
        """
        if self._expected:
            complete = [stamp for stamp, missing in self._sorter.missing().items() if not missing]
            self._enqueue(self._sorter.flush(max(complete, default=-1)))
        else:
            self._enqueue(self._sorter.flush())
        for topic, data, arrival_ns in self._early:  # nothing had a stamp
            self._jobs.put(_Job(topic, data, arrival_ns, False, False, frozenset()))
        self._jobs.put(None)
        self._thread.join()
        if self._writer is not None:
            self._writer.close()

    def _open(self, folder: Path) -> BagWriter:
        writer = self._make_writer(folder)
        for topic in self._types:
            self._add_channel(writer, topic)
        for name, record in self._records.items():
            writer.set_record(name, record)
        for name, data in self._attachments.items():
            writer.set_attachment(name, data)
        return writer

    def _add_channel(self, writer: BagWriter, topic: str) -> None:
        type_name, offered, _ = self._types[topic]
        if self._forms[topic] == "none":
            writer.add_topic(topic, type_name, offered)
        else:
            writer.add_topic(compressed_topic(topic), COMPRESSED_TYPE, offered)

    def _release_unexpected(self) -> None:
        """Let out what waits if there are no frames for which it could wait."""
        if not self._expected:
            self._enqueue(self._sorter.flush())

    def _ask_for_split(self) -> str:
        self._split_asked = True
        return ""

    def _control(self, work: Callable[[], str]) -> Future[str]:
        future: Future[str] = Future()

        def run() -> None:
            try:
                future.set_result(work())
            except BagWriteError as error:
                future.set_exception(error)

        self._jobs.put(run)
        return future

    def _enqueue(self, messages: Iterable[OrderedMessage]) -> None:
        batch = list(messages)
        frames: dict[int, set[str]] = {}
        for message in batch:
            frames.setdefault(message.log_ns, set()).add(message.topic)
        for message in batch:
            if message.stamp_ns is None and message.log_ns == 0:
                self._hold_early(message.topic, message.data)
                continue
            first = message.stamp_ns is not None and message.log_ns > self._last_ns
            together = frozenset(frames[message.log_ns]) if first else frozenset()
            room = first and any(topic.endswith("/scene") for topic in together)
            self._last_ns = max(self._last_ns, message.log_ns)
            for topic, data, _ in self._early:
                self._jobs.put(_Job(topic, data, message.log_ns, False, False, frozenset()))
            self._early = []
            self._jobs.put(_Job(message.topic, message.data, message.log_ns, first, room, together))

    def _hold_early(self, topic: str, data: bytes) -> None:
        """Keep a message that has no stamp until there is a first frame whose time it can have."""
        if len(self._early) == MAX_EARLY:
            self._complain(f"no frame has come yet; of the messages without stamps only the newest {MAX_EARLY} are kept")
            self._early.pop(0)
        self._early.append((topic, data, time.time_ns()))

    def _write_all(self) -> None:
        while (job := self._jobs.get()) is not None:
            try:
                if isinstance(job, _Job):
                    self._take(job)
                else:
                    job()
            except BagWriteError as error:
                self.fault = self.fault or str(error)
            finally:
                self._jobs.task_done()
        self._jobs.task_done()

    def _take(self, job: _Job) -> None:
        self.taken[job.topic] += 1
        try:
            topic, data = self._kept_form(job.topic, job.data)
        except CodecError as error:
            self._complain(str(error))
            return
        self._ring.add(KeptMessage(job.topic, job.log_ns, job.data))
        if self._writer is None or self.fault:
            return
        if job.first:
            self._split_if_due(self._writer, job)
        self._writer.write(topic, data, job.log_ns, job.log_ns)
        self.written[topic] += 1

    def _kept_form(self, topic: str, data: bytes) -> tuple[str, bytes]:
        form = self._forms[topic]
        if form == "none":
            return topic, data
        return compressed_topic(topic), compress(data, topic, form, self._options.compression.jpeg_quality)

    def _split_if_due(self, writer: BagWriter, job: _Job) -> None:
        due = self._options.split.is_due(writer.file_size, self._file_start_ns, job.log_ns, self._file_rooms, job.room)
        if (due or self._split_asked) and self._file_start_ns is not None:
            self._split_asked = False
            self._file_start_ns, self._file_rooms = None, 0
            writer.split(job.log_ns, job.together)
        if self._file_start_ns is None:
            self._file_start_ns = job.log_ns
        self._file_rooms += job.room

    def _close_bag(self) -> str:
        writer, self._writer = self._writer, None
        if writer is None:
            return "no bag was open"
        writer.close()
        return f"{writer.directory}: {sum(writer.counts.values())} messages"

    def _write_snapshot(self, folder: Path) -> str:
        messages = list(self._ring.content())
        if not messages:
            raise BagWriteError("no snapshot: nothing is kept yet" if self._options.snapshot_s else "no snapshot: snapshot_s is 0")
        with self._open(folder) as writer:
            for kept in messages:
                topic, data = self._kept_form(kept.topic, kept.data)
                writer.write(topic, data, kept.log_ns, kept.log_ns)
        seconds = (messages[-1].log_ns - messages[0].log_ns) / NANOSECONDS
        return f"{folder}: {len(messages)} messages, {seconds:.3f} s"
