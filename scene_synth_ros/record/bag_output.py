"""What is written: bags one after the other, their files, and snapshots beside them."""

import threading
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from rclpy.qos import QoSDurabilityPolicy, QoSProfile

from scene_synth_ros.bags.bag_writer import BagWriteError, BagWriter
from scene_synth_ros.messages.image_codec import ImageCompression, compress, compressed_topic, image_form
from scene_synth_ros.messages.image_reader import CodecError
from scene_synth_ros.messages.stamps import NANOSECONDS
from scene_synth_ros.messages.streams import COMPRESSED_TYPE
from scene_synth_ros.record.recorder_config import SplitPolicy
from scene_synth_ros.record.snapshot_ring import KeptMessage, SnapshotRing


class TopicCounts:
    """A counter of messages by topic.

    Threads: any thread may call anything; the lock guards the counter.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._counts: Counter[str] = Counter()

    def add(self, topic: str) -> None:
        """Count one message."""
        with self._lock:
            self._counts[topic] += 1

    def __getitem__(self, topic: str) -> int:
        with self._lock:
            return self._counts[topic]

    def total(self) -> int:
        """Return how many messages all topics have."""
        with self._lock:
            return self._counts.total()

    def copy(self) -> dict[str, int]:
        """Return topic -> messages as it is now."""
        with self._lock:
            return dict(self._counts)


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingOptions:
    """How bags are written beyond what their writer decides.

    ``incidental`` topics are recorded without having been asked for: a bag that has nothing else holds nothing.
    """

    split: SplitPolicy = field(default_factory=SplitPolicy)
    compression: ImageCompression = field(default_factory=ImageCompression)
    snapshot_s: float = 0.0
    snapshot_bytes: int = 2**28
    incidental: frozenset[str] = frozenset()
    frame_prefix: str = ""


@dataclass(slots=True)
class BagNumbers:
    """How many names of bags and snapshots were used up; it outlives a recording, so that the next one chooses other names."""

    bags: int = 0
    snapshots: int = 0


class Entry(NamedTuple):
    """A message with its place in the bag: ``first`` of a frame, of one that begins a ``room``; topics that come ``together`` with it."""

    topic: str
    data: bytes
    log_ns: int
    first: bool = False
    room: bool = False
    together: frozenset[str] = frozenset()


class _Topic(NamedTuple):
    """A topic and how its messages are kept: ``png``, ``jpeg`` or ``none``."""

    type_name: str
    offered: list[QoSProfile]
    form: str


def is_latched(offered: list[QoSProfile]) -> bool:
    """Return whether all publishers of a topic offer their last messages to late subscribers."""
    return bool(offered) and all(qos.durability == QoSDurabilityPolicy.TRANSIENT_LOCAL for qos in offered)


class BagOutput:
    """Which bag is open: its name, when it is split, in which form images are kept, and the last seconds for a snapshot.

    Threads: the thread that writes calls every method, so nothing here needs a lock; ``writing`` may be read by any thread.

    Attributes:
        writing: whether a bag is open.
        discarded: whether the last bag was removed because it held nothing.
    """

    def __init__(
        self,
        make_writer: Callable[[Path], BagWriter],
        options: RecordingOptions,
        numbers: BagNumbers,
        written: TopicCounts,
        warn: Callable[[str], None],
    ) -> None:
        self._make_writer, self._options, self._numbers, self._written, self._warn = make_writer, options, numbers, written, warn
        self.writing = self.discarded = False
        self._writer: BagWriter | None = None
        self._topics: dict[str, _Topic] = {}
        self._records: dict[str, dict[str, str]] = {}
        self._attachments: dict[str, bytes] = {}
        self._ring = SnapshotRing(options.snapshot_s, options.snapshot_bytes)
        self._file_start_ns: int | None = None
        self._file_rooms = 0
        self._split_asked = False

    def add_topic(self, topic: str, type_name: str, offered: list[QoSProfile]) -> None:
        """Open a channel in the bag at work and in all to come."""
        self._topics[topic] = _Topic(type_name, offered, image_form(topic, type_name, self._options.compression))
        if is_latched(offered):
            self._ring.latched = {*self._ring.latched, topic}
        if self._writer is not None:
            self._add_channel(self._writer, topic)

    def begin(self, base: Path) -> str:
        """Open the next bag, ``base``, then ``base_2`` and so on without names that are taken; return its folder.

        Raises:
            BagWriteError: one is open already, or it cannot be begun.
        """
        if self._writer is not None:
            raise BagWriteError("a bag is open already")
        numbers = self._numbers
        while (folder := base.with_name(f"{base.name}_{numbers.bags + 1}") if numbers.bags else base).exists() and numbers.bags:
            numbers.bags += 1
        writer = self._make_writer(folder)
        numbers.bags += 1
        self._prepare(writer)
        self._writer, self.writing = writer, True
        self._file_start_ns, self._file_rooms = None, 0
        return str(folder)

    def end(self) -> str:
        """Close the bag; return what it holds, in words.

        Raises:
            BagWriteError: it could not be completed.
        """
        writer, self._writer, self.writing = self._writer, None, False
        if writer is None:
            return "no bag was open"
        writer.close()
        return f"{writer.directory}: {sum(writer.counts.values())} messages"

    def finish(self) -> None:
        """Close the bag, as everything ends; one that holds nothing is removed.

        Raises:
            BagWriteError: it could not be completed.
        """
        if self._writer is None or any(count for topic, count in self._writer.counts.items() if topic not in self._options.incidental):
            self.end()
            return
        writer, self._writer, self.writing = self._writer, None, False
        writer.discard()
        self.discarded = True

    def split(self) -> None:
        """Go on in a new file with the next frame."""
        self._split_asked = True

    def describe_run(self, name: str, record: dict[str, str], attachment: str, data: bytes) -> None:
        """Keep a metadata record and an attachment with the bag at work and all to come."""
        self._records[name], self._attachments[attachment] = record, data
        if self._writer is not None:
            self._writer.set_record(name, record)
            self._writer.set_attachment(attachment, data)

    def write(self, entry: Entry) -> None:
        """Write a message into the open bag and keep it for snapshots."""
        self._ring.add(KeptMessage(entry.topic, entry.log_ns, entry.data))
        if self._writer is None:
            return
        try:
            topic, data = self._kept_form(entry.topic, entry.data)
        except CodecError as error:
            self._warn(str(error))
            return
        if entry.first:
            self._split_if_due(self._writer, entry)
        self._writer.write(topic, data, entry.log_ns, entry.log_ns)
        self._written.add(topic)

    def snapshot(self, base: Path) -> str:
        """Write the last seconds into a bag of their own, ``base_0`` and so on without names that are taken; return what it holds.

        Raises:
            BagWriteError: nothing is kept, or it cannot be written.
        """
        messages = list(self._ring.content())
        if not messages:
            raise BagWriteError("no snapshot: nothing is kept yet" if self._options.snapshot_s else "no snapshot: snapshot_s is 0")
        while (folder := base.with_name(f"{base.name}_{self._numbers.snapshots}")).exists():
            self._numbers.snapshots += 1
        with self._make_writer(folder) as writer:
            self._numbers.snapshots += 1
            self._prepare(writer)
            for kept in messages:
                try:
                    topic, data = self._kept_form(kept.topic, kept.data)
                except CodecError as error:
                    self._warn(str(error))
                    continue
                writer.write(topic, data, kept.log_ns, kept.log_ns)
        seconds = (messages[-1].log_ns - messages[0].log_ns) / NANOSECONDS
        return f"{folder}: {len(messages)} messages, {seconds:.3f} s"

    def _prepare(self, writer: BagWriter) -> None:
        """Tell a new bag what is known: topics, records, attachments."""
        try:
            for topic in self._topics:
                self._add_channel(writer, topic)
            for name, record in self._records.items():
                writer.set_record(name, record)
            for name, data in self._attachments.items():
                writer.set_attachment(name, data)
        except BaseException:
            writer.close()
            raise

    def _add_channel(self, writer: BagWriter, topic: str) -> None:
        known = self._topics[topic]
        if known.form == "none":
            writer.add_topic(topic, known.type_name, known.offered)
        else:
            writer.add_topic(compressed_topic(topic), COMPRESSED_TYPE, known.offered)

    def _kept_form(self, topic: str, data: bytes) -> tuple[str, bytes]:
        form = self._topics[topic].form
        if form == "none":
            return topic, data
        return compressed_topic(topic), compress(data, topic, form, self._options.compression.jpeg_quality)

    def _split_if_due(self, writer: BagWriter, entry: Entry) -> None:
        due = self._options.split.is_due(writer.file_size, self._file_start_ns, entry.log_ns, self._file_rooms, entry.room)
        if (due or self._split_asked) and self._file_start_ns is not None:
            self._split_asked = False
            self._file_start_ns, self._file_rooms = None, 0
            writer.split(entry.log_ns, entry.together)
        if self._file_start_ns is None:
            self._file_start_ns = entry.log_ns
        self._file_rooms += entry.room
