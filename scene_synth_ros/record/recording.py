"""One life of the recorder: from messages that arrive to bags."""

import time
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from concurrent.futures import Future
from pathlib import Path

from rclpy.qos import QoSProfile

from scene_synth_ros.bags.bag_writer import BagWriteError, BagWriter
from scene_synth_ros.bags.run_info import JPEG_QUALITY, PARAMETERS_NAME, RECORD_NAME, NodeValues, parameters_file, run_record
from scene_synth_ros.messages.message_definitions import message_definition
from scene_synth_ros.messages.stamps import frame_place
from scene_synth_ros.messages.streams import LASER, POSE, SCENE, SETTINGS, Stream, parse
from scene_synth_ros.record.bag_output import BagNumbers, BagOutput, Entry, RecordingOptions, TopicCounts, is_latched
from scene_synth_ros.record.bag_thread import BagThread
from scene_synth_ros.record.derived_messages import NOT_DERIVED, DerivedMessage, Deriver
from scene_synth_ros.record.frame_intake import TIME_TOPICS, FrameIntake
from scene_synth_ros.record.frame_sorter import OrderedMessage
from scene_synth_ros.record.frame_topics import CLOCK_TOPIC
from scene_synth_ros.record.recorder_config import RecorderConfig, read_pairs
from scene_synth_ros.record.senders import Origin
from scene_synth_ros.suite.parameters import Groups

MAX_EARLY = 1000
"""How many messages without stamps wait for the first frame."""
JOBS_WAITING, JOB_SIZE = 16, 16
"""How many jobs may wait for the disk, of how many messages each; more keep whoever brings them waiting."""


class Recording:
    """The order of messages: what each waits for, what is derived of it, which begin a frame or a room.  One life of the recorder.

    Threads: the thread of the node's executor calls every method; what waits for its frame (:class:`FrameIntake`) belongs to it.  The
    thread that writes owns the bags (:class:`BagOutput`) and gets everything through the queue of :class:`BagThread`; ``add`` waits while
    that is full.  Both count in ``taken`` and ``written``, which have a lock; ``warn`` is called from both, ``tell_fault`` from the second.

    Args:
        tell_fault: called with a fault of the program that has ended the writing; returns it in one line.
        numbers: of bags and snapshots, where an earlier recording has made some.
        jobs_waiting: how many times ``JOB_SIZE`` messages may wait for the disk.

    Attributes:
        taken: messages received and done with, by topic: written, or left out on purpose.
        written: messages in bags, by topic.
        intake: what waits for its frame; its counts are for people.
    """

    def __init__(
        self,
        make_writer: Callable[[Path], BagWriter],
        options: RecordingOptions | None = None,
        warn: Callable[[str], None] = lambda _: None,
        tell_fault: Callable[[Exception], str] = repr,
        numbers: BagNumbers | None = None,
        jobs_waiting: int = JOBS_WAITING,
    ) -> None:
        self.taken, self.written = TopicCounts(), TopicCounts()
        self._warn = warn
        self._output = BagOutput(make_writer, options or RecordingOptions(), numbers or BagNumbers(), self.written, warn)
        self._thread = BagThread(tell_fault, jobs_waiting)
        self._closed = False
        self.intake = FrameIntake(warn)
        self._topics: set[str] = set()
        self._early: list[tuple[str, bytes, int]] = []
        self._early_full = False
        self._deriver = Deriver(options.frame_prefix if options else "")
        self._last_ns = -1
        self._suite_is_present = False
        self._brought = 0

    @property
    def fault(self) -> str:
        """Why writing has ended early, one line; empty while all is well."""
        return self._thread.fault

    @property
    def writing(self) -> bool:
        """Whether a bag is open."""
        return self._output.writing

    @property
    def discarded(self) -> bool:
        """Whether the last bag was removed at the end, because it held nothing."""
        return self._output.discarded

    @property
    def waiting_messages(self) -> int:
        """Messages that wait for the disk."""
        return self._brought - self.taken.total()

    def begin(self, base: Path) -> Future[str]:
        """Open the next bag, ``base``, then ``base_2`` and so on, after everything received so far; the future is its folder.

        Its exception is a BagWriteError: one is open already, or it cannot be begun.
        """
        return self._thread.ask(self._output.begin, base)

    def end(self) -> Future[str]:
        """Close the bag after every whole frame received so far; the future is what became of it, in words, or a BagWriteError.

        A frame of which only a part has come goes into the next bag.
        """
        self._enqueue(self.intake.flush_unexpected())
        return self._thread.ask(self._output.end)

    def split(self) -> None:
        """Go on in a new file with the next frame."""
        self._enqueue(self.intake.flush_unexpected())
        self._thread.do(self._output.split)

    def snapshot(self, base: Path) -> Future[str]:
        """Write the last seconds into a bag of their own, ``base_<n>``; the future is what it holds, in words, or a BagWriteError."""
        self._enqueue(self.intake.flush_unexpected())
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
        self._topics.add(topic)
        self.intake.add_topic(topic, type_name, is_latched(offered), origin)
        self._thread.do(self._output.add_topic, topic, type_name, offered)

    def set_origin(self, topic: str, origin: Origin) -> None:
        """Say whose messages a topic has, now that more is known of it."""
        self._enqueue(self.intake.set_origin(topic, origin))

    def begin_suite(self) -> None:
        """Let time begin anew with the suite's first frame, whatever has been recorded before that."""
        self.intake.begin_suite()
        self._last_ns, self._suite_is_present = -1, True

    def expect(self, topics: Collection[str], alike: Mapping[str, str]) -> None:
        """Say which topics make a frame complete, and which of them stand for each other; frames leave as soon as all are there.

        Of a body's frames no transforms are derived: they are of the body's own messages.
        """
        of_body = {"/tf"} if self._deriver.has_body else set()
        self._enqueue(self.intake.expect(set(topics) - of_body, alike))

    def add(self, topic: str, data: bytes) -> bool:
        """Take a message as it arrives; return False if it is left out: recorded before, refused, or too late."""
        if self._closed:
            return False
        released = self.intake.add(topic, data)
        if released is None:
            self._brought += 1
            self.taken.add(topic)
            return False
        self._enqueue(released)
        return True

    def taker(self, topic: str, type_name: str, namespace: str) -> Callable[[bytes], None]:
        """Return what takes a message of a topic that was added, with what is derived of it while it is the suite's."""
        derive = self._deriver.of_topic(topic, type_name, namespace)
        stream = parse(topic, type_name)
        own_stamps = topic == CLOCK_TOPIC or (stream is not None and stream.has_own_stamps)
        is_settings = stream is not None and stream.role is SETTINGS

        def take(data: bytes) -> None:
            if is_settings and (place := frame_place(data)) is not None:
                if place.asked:
                    self._enqueue(self.intake.set_aside(topic, place.stamp_ns))
                else:  # the frame waits for what was sent before it
                    sent = {name if name.startswith("/") else namespace + name: stamp for name, stamp in place.sent_ns.items()}
                    self.intake.wait_for(place.stamp_ns, sent)
            if self.add(topic, data) and derive is not None and self._is_the_suites(topic, stream):
                try:
                    for message in derive(data):
                        self._add_derived(message)
                except tuple(NOT_DERIVED) as error:
                    self._warn(f"{topic}: {error}; it has no {NOT_DERIVED[type(error)]}")
            if own_stamps and not self._closed:
                self._enqueue(self.intake.reach(topic, data))

        return take

    def _is_the_suites(self, topic: str, stream: Stream | None) -> bool:
        """Return whether a topic is of this suite's cameras; where no suite is heard, as with a replay, poses beside images are."""
        if not self.intake.is_own(topic):
            return False
        if self._suite_is_present or stream is None or stream.role is not POSE or stream.camera == LASER:
            return True
        return any(known.base == stream.base and known.layer for name in self._topics if (known := parse(name)) is not None)

    def _add_derived(self, message: DerivedMessage) -> None:
        if message.topic in TIME_TOPICS and message.stamp_ns <= self._last_ns:
            return  # of a pose that came too late to move anything
        for topic in message.opens:
            if topic.name not in self._topics:
                self.add_topic(topic.name, topic.type_name, [topic.qos])
        self._enqueue(self.intake.add_stamped(message.topic, message.stamp_ns, message.data, aside=message.aside))

    def flush(self, room: int | None = None) -> None:
        """Hand everything that waits, or what waits of a room and of those before it, to the writer and wait until it is written."""
        self._enqueue(self.intake.flush(room))
        self._thread.wait()

    def close(self) -> None:
        """Write the complete frames that wait, close the bag and end the thread; harmless when repeated.  A bag that holds nothing goes.

        A frame of which only a part has come, as at an interruption, is left out.  Messages without stamps are logged at the time of the
        first frame; where none has come, by the wall clock when they arrived.

        Raises:
            BagWriteError: something was not written; the text is ``fault``.
        """
        if self._closed:
            return
        self._closed = True
        self._enqueue(self.intake.finish())
        self._hand_over([Entry(topic, data, arrival_ns) for topic, data, arrival_ns in self._early])  # nothing had a stamp
        self._thread.do(self._finish)
        self._thread.close()
        if self.fault:
            raise BagWriteError(self.fault)

    def _enqueue(self, messages: Iterable[OrderedMessage]) -> None:
        """Say of messages in order which begin a frame or a room, and hand them over."""
        batch = list(messages)
        frames: dict[int, set[str]] = {}
        for message in batch:
            frames.setdefault(message.log_ns, set()).add(message.topic)
        entries: list[Entry] = []
        for message in batch:
            if message.stamp_ns is None and self._last_ns < 0:
                self._hold_early(message.topic, message.data)
                continue
            first = message.stamp_ns is not None and message.log_ns > self._last_ns
            together = frozenset(frames[message.log_ns]) if first else frozenset()
            room = first and any((stream := parse(topic)) is not None and stream.role is SCENE for topic in together)
            self._last_ns = max(self._last_ns, message.log_ns)
            entries += [Entry(topic, data, message.log_ns) for topic, data, _ in self._early]
            self._early = []
            entries.append(Entry(message.topic, message.data, message.log_ns, first, room, together))
        self._hand_over(entries)

    def _hand_over(self, entries: Sequence[Entry]) -> None:
        self._brought += len(entries)
        for start in range(0, len(entries), JOB_SIZE):
            self._thread.do(self._write, entries[start : start + JOB_SIZE])

    def _write(self, entries: Sequence[Entry]) -> None:
        """Write messages, unless writing has ended; in the thread that writes."""
        left = iter(entries)
        try:
            for entry in left:
                self.taken.add(entry.topic)
                if not self.fault:
                    self._output.write(entry)
        finally:
            for entry in left:  # dropped because of a fault, and done with
                self.taken.add(entry.topic)

    def _finish(self) -> None:
        """Close the bag; in the thread that writes.  After a fault, what there is stays."""
        (self._output.end if self.fault else self._output.finish)()

    def _hold_early(self, topic: str, data: bytes) -> None:
        """Keep a message that has no stamp until there is a first frame whose time it can have."""
        if len(self._early) == MAX_EARLY:
            if not self._early_full:
                self._warn(f"no frame has come yet; of the messages without stamps only the newest {MAX_EARLY} are kept")
            self._early_full = True
            self._early.pop(0)
        self._early.append((topic, data, time.time_ns()))


def recording_options(values: Groups) -> RecordingOptions:
    """Return how bags are written beyond what their writer decides."""
    config: RecorderConfig = values[""]
    return RecordingOptions(
        split=values["split"],
        compression=values["images"],
        snapshot_s=config.snapshot_s,
        snapshot_bytes=round(config.snapshot_mb * 1e6),
        incidental=frozenset() if config.topics or config.extra_topics else frozenset({"/diagnostics"}),
        frame_prefix=config.frame_prefix,
    )


def make_writer(values: Groups, folder: Path) -> BagWriter:
    """Open a bag.

    Raises:
        ParameterError: a note of ``custom_data`` is not KEY=VALUE.
        BagWriteError: the bag cannot be begun.
    """
    config: RecorderConfig = values[""]
    return BagWriter(
        folder,
        metadata_version=config.metadata_version,
        compression=config.compression,
        compression_level=config.compression_level,
        chunk_size=config.chunk_size,
        custom_data=read_pairs(config.custom_data),
    )


def describe_run(recording: Recording, values: Groups, nodes: NodeValues, *, machine: bool = True) -> None:
    """Keep with the bags of a recording what made them: versions, seed, the parameters of all nodes; the ``machine``, too, if asked."""
    record = run_record(nodes, machine=machine) | {JPEG_QUALITY: str(values["images"].jpeg_quality)}
    recording.describe_run(RECORD_NAME, record, PARAMETERS_NAME, parameters_file(nodes))
