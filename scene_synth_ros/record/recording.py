"""One life of the recorder: from messages that arrive to bags."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from concurrent.futures import Future
from pathlib import Path

from rclpy.qos import QoSProfile

from scene_description.annotations import FrameAnnotations
from scene_synth_ros.bags.bag_writer import BagWriteError, BagWriter
from scene_synth_ros.messages.detections import encode_detections
from scene_synth_ros.messages.label_info import TimedLabels, encode_label_info
from scene_synth_ros.messages.message_definitions import message_definition
from scene_synth_ros.messages.poses import StampedTransform, TimedPose, encode_tf_message
from scene_synth_ros.messages.streams import TF_TYPE, derived_streams, laser_frame
from scene_synth_ros.record.bag_output import BagNumbers, BagOutput, Entry, RecordingOptions, is_latched
from scene_synth_ros.record.bag_thread import BagThread
from scene_synth_ros.record.camera_transforms import CameraTransforms
from scene_synth_ros.record.frame_intake import FrameIntake
from scene_synth_ros.record.frame_sorter import OrderedMessage
from scene_synth_ros.record.senders import Origin
from scene_synth_ros.record.topic_counts import TopicCounts
from scene_synth_ros.suite.qos import latched_qos, stream_qos

MAX_EARLY = 1000
"""How many messages without stamps wait for the first frame."""
JOBS_WAITING, JOB_SIZE = 16, 16
"""How many jobs may wait for the disk, of how many messages each; more keep whoever brings them waiting."""
TRANSFORM_TOPICS = (("/tf", stream_qos(100)), ("/tf_static", latched_qos()))


class Recording:
    """One life of the recorder: bags, one after the other, and the thread that writes them; ``close`` ends both.

    Threads: the thread of the node's executor calls every method; what waits for its frame (:class:`FrameIntake`) belongs to it.  The
    thread that writes owns the bags (:class:`BagOutput`) and gets everything through the queue of :class:`BagThread`; ``add`` waits while
    that is full.  Both count in ``taken`` and ``written``, which have a lock; ``warn`` is called from both, ``tell_fault`` from the second.

    Transforms are derived from the camera poses and written to ``/tf`` and ``/tf_static`` whether or not anybody publishes them; so is the
    LabelInfo beside labels, and the detections beside annotations.

    Args:
        make_writer: opens the bag of a folder.
        options: splitting, image compression, snapshots.
        warn: called with one line for messages that cannot be kept.
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
        self._frame_prefix = options.frame_prefix if options else ""
        self._transforms = CameraTransforms(self._frame_prefix)
        self._last_ns = -1
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
        """Close the bag after everything received so far; the future is what became of it, in words, or a BagWriteError."""
        self._enqueue(self.intake.flush())
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
        self._last_ns = -1

    def expect(self, topics: Collection[str], alike: Mapping[str, str]) -> None:
        """Say which topics make a frame complete, and which of them stand for each other; frames leave as soon as all are there."""
        self._enqueue(self.intake.expect(topics, alike))

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

    def add_pose(self, pose: TimedPose, camera: str) -> None:
        """Derive the transforms of a camera from its pose: world -> link at every stamp, link -> optical frame once."""
        transforms = self._transforms.of_pose(pose, camera)
        if transforms.static is not None:
            self._add_transform_topics()
            self._enqueue(self.intake.add_stamped("/tf_static", pose.stamp_ns, transforms.static))
        self._enqueue(self.intake.add_stamped("/tf", pose.stamp_ns, transforms.moving))

    def add_laser_pose(self, pose: TimedPose) -> None:
        """Derive the transform world -> scanner from its pose."""
        self._add_transform_topics()
        transform = StampedTransform(pose.stamp_ns, pose.world, laser_frame(self._frame_prefix), pose.position_m, pose.quaternion)
        self._enqueue(self.intake.add_stamped("/tf", pose.stamp_ns, encode_tf_message([transform]), aside=True))

    def add_sent(self, stamp_ns: int, sent: Mapping[str, int]) -> None:
        """Take what the settings of a frame say was sent before it on topics with stamps of their own; the frame waits for that."""
        self.intake.wait_for(stamp_ns, sent)

    def reach(self, topic: str, data: bytes) -> None:
        """Say that a message of a topic with stamps of its own has been added, with what is derived of it."""
        if not self._closed:
            self._enqueue(self.intake.reach(topic, data))

    def _add_transform_topics(self) -> None:
        for name, qos in TRANSFORM_TOPICS:
            if name not in self._topics:
                self.add_topic(name, TF_TYPE, [qos])

    def add_labels(self, labels: TimedLabels, topic: str) -> None:
        """Derive the LabelInfo beside the labels of a topic."""
        for stream in derived_streams(topic):
            if stream.topic not in self._topics:
                self.add_topic(stream.topic, stream.role.type_name, [latched_qos()])
            data = encode_label_info(labels.stamp_ns, stream.frame_id(self._frame_prefix), labels.names)
            self._enqueue(self.intake.add_stamped(stream.topic, labels.stamp_ns, data))

    def add_annotations(self, annotations: FrameAnnotations, topic: str) -> None:
        """Derive the detections beside the annotations of a topic."""
        for stream in derived_streams(topic):
            if stream.topic not in self._topics:
                self.add_topic(stream.topic, stream.role.type_name, [stream_qos()])
            data = encode_detections(stream.role.type_name, annotations, stream.frame_id(self._frame_prefix))
            self._enqueue(self.intake.add_stamped(stream.topic, annotations.stamp_ns, data))

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
        self._enqueue(self.intake.flush_complete())
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
            room = first and any(topic.endswith("/scene") for topic in together)
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
            self._warn(f"no frame has come yet; of the messages without stamps only the newest {MAX_EARLY} are kept")
            self._early.pop(0)
        self._early.append((topic, data, time.time_ns()))
