"""Leaves out the frame in which a cut file ends, so that what is saved of it has whole frames only.

Messages of equal log time, one after the other, form a group.  What a frame consists of is learned from the groups before: the topics that
every group with an image had.  Bags whose log times differ within a frame, as those of other recorders, teach nothing and keep all.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from scene_synth_ros.bags.bag_metadata import TopicInfo
from scene_synth_ros.bags.bag_reader import BagMessage
from scene_synth_ros.bags.camera_streams import cameras, label_topics
from scene_synth_ros.messages.stamps import NANOSECONDS
from scene_synth_ros.messages.streams import derived_streams

MAX_HELD = 512 * 2**20
"""Bytes of a group that may wait for its end; a larger one is no frame and passes."""


class WholeFrames:
    """Lets messages through, file by file and group by group.

    Args:
        topics: of the bag; the first frame must have all streams of its cameras, and the labels of their ids, that are among them.

    Attributes:
        cut: what was left out, lines for people.
    """

    def __init__(self, topics: Iterable[TopicInfo]) -> None:
        types = {topic.name: topic.type_name for topic in topics}
        self._streams = frozenset(name for streams in cameras(types).values() for name in streams)
        labels = label_topics(types)
        derived = [stream.topic for topic in labels for stream in derived_streams(topic)]
        self._of_frame = self._streams | (frozenset([*labels, *derived]) & types.keys())
        self._frames, self._first = 0, frozenset[str]()
        self._other_groups: set[frozenset[str]] = set()
        self.cut: list[str] = []

    def of_file(self, messages: Iterable[BagMessage], is_cut: Callable[[], bool]) -> Iterator[BagMessage]:
        """Yield the messages of a file, without the group at its end if the file was cut within that.

        Args:
            messages: as they stand in the file.
            is_cut: asked at the end, whether more had been in the file.
        """
        held: list[BagMessage] = []
        names: set[str] = set()
        group_ns, size = -1, 0
        for message in messages:
            if message.log_ns != group_ns:
                yield from held
                self._learn(frozenset(names))
                held, names, group_ns, size = [], set(), message.log_ns, 0
            held.append(message)
            names.add(message.topic)
            size += len(message.data)
            if size > MAX_HELD:
                yield from held
                held = []
        if held and is_cut() and self._is_torn(frozenset(names)):
            seconds = f"{group_ns // NANOSECONDS}.{group_ns % NANOSECONDS:09d}"
            self.cut.append(f"the frame at {seconds} s, of which only {len(held)} messages are left: {', '.join(sorted(names))}")
            return
        yield from held
        self._learn(frozenset(names))

    def _learn(self, names: frozenset[str]) -> None:
        """Take a whole group: of the first frame the streams only, as it may have what comes once a room or a run."""
        if not names & self._streams:
            self._other_groups.add(names)
            return
        self._frames += 1
        if self._frames == 2:
            self._of_frame = self._first & names
        elif self._frames > 2:
            self._of_frame &= names
        else:
            self._first, self._of_frame = names, names & self._streams

    def _is_torn(self, names: frozenset[str]) -> bool:
        if names & self._streams:
            return not self._of_frame <= names
        begun = names & self._of_frame if self._frames else self._streams  # what comes before the first frame is part of it
        return bool(begun) and names not in self._other_groups
