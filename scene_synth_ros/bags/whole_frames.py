"""Leaves out frames of which something is missing, so that what is saved of a cut or damaged bag has whole frames only.

The messages of a camera at one log time form a frame.  What it consists of is learned from all of them: the streams and labels that nearly
every one has.  Cameras whose log times are not their stamps, as those of other recorders, teach nothing and keep all.
"""

from array import array
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

import numpy as np

from renderer import LAYERS
from scene_synth_ros.bags.bag_metadata import TopicInfo
from scene_synth_ros.bags.bag_reader import BagMessage
from scene_synth_ros.messages.stamps import NANOSECONDS, stamp_ns
from scene_synth_ros.messages.streams import (
    CLOUD_TYPE,
    COMPRESSED_TYPE,
    IMAGE_FORMS,
    IMAGE_TYPE,
    INFO_TYPE,
    LABELS,
    POSE_TYPE,
    derived_streams,
    find_streams,
    parse,
)

FRAME_TYPES = (IMAGE_TYPE, COMPRESSED_TYPE, INFO_TYPE, CLOUD_TYPE, POSE_TYPE)
_IMAGE_TYPES = FRAME_TYPES[:3]


def cameras(topics: Mapping[str, str]) -> dict[str, list[str]]:
    """Return camera -> topics whose stamps must agree; cameras without an image are left out."""
    found: dict[str, list[str]] = {}
    for topic, type_name in topics.items():
        if type_name in _IMAGE_TYPES:
            stream = parse(topic, type_name)
            found.setdefault(stream.base if stream is not None else topic.rsplit("/", 2)[0], []).append(topic)
    for topic, type_name in topics.items():
        stream = parse(topic, type_name)
        if stream is not None and stream.role.of == "camera" and stream.base in found:
            found[stream.base].append(topic)
    return found


def label_topics(topics: Mapping[str, str]) -> list[str]:
    """Return the topics that tell what the ids in the images of these topics mean."""
    labelled = {name for name, row in LAYERS.items() if row.labels is not None}
    return [stream.beside(LABELS).topic for stream in find_streams(topics, *IMAGE_FORMS).values() if stream.layer in labelled]


_USUAL = 0.75
"""Share of a camera's other frames that must have a stream so that a frame without lacks it."""
_MAX_NS = 2**63
MAX_HELD = 512 * 2**20
"""Bytes of a group that may wait for its end; a larger one is no frame and passes."""


class WholeFrames:
    """Lets messages through but those of frames of which something is missing.

    All messages are noted first; then they go through again, file by file.

    Args:
        topics: of the bag; a frame that is alone must have all streams of its cameras, and the labels of their ids, that are among them.

    Attributes:
        cut: what was left out, lines for people.
    """

    def __init__(self, topics: Iterable[TopicInfo]) -> None:
        types = {topic.name: topic.type_name for topic in topics}
        self._cameras = cameras(types)
        self._camera_of = {topic: camera for camera, streams in self._cameras.items() for topic in streams}
        labels = label_topics(types)
        self._labels = frozenset([*labels, *(stream.topic for topic in labels for stream in derived_streams(topic))]) & types.keys()
        self._bases = {topic: stream.base for topic, kind in types.items() if (stream := parse(topic, kind)) is not None}
        self._noted: dict[str, array[int]] = {topic: array("q") for topic in (*self._camera_of, *self._labels)}
        self._late = set[str]()
        self._torn: dict[str, set[int]] = {}
        self._other_groups: set[frozenset[str]] = set()
        self.cut: list[str] = []

    def note(self, messages: Iterable[BagMessage]) -> None:
        """Note the times of messages; cameras whose messages are not logged at their stamps, as others record them, keep all."""
        for message in messages:
            noted = self._noted.get(message.topic)
            if noted is not None and message.log_ns < _MAX_NS:
                noted.append(message.log_ns)
                if message.topic in self._camera_of and stamp_ns(message.type_name, message.data) not in (None, message.log_ns):
                    self._late.add(self._camera_of[message.topic])

    def judge(self) -> None:
        """Find the frames of which something is missing, now that all messages are noted."""
        for camera, streams in self._cameras.items():
            labels = [topic for topic in self._labels if self._bases.get(topic) == camera]
            times = [np.unique(np.frombuffer(self._noted[topic], np.int64)) for topic in (*streams, *labels)]
            frames = np.unique(np.concatenate(times[: len(streams)]))
            usual = [own for own in times if len(frames) == 1 or len(own) > _USUAL * (len(frames) - 1)]
            lacking = frames[np.sum([np.isin(frames, own) for own in usual], axis=0) < len(usual)] if usual else frames[:0]
            self._torn[camera] = set() if camera in self._late else set(lacking.tolist())

    def of_file(self, messages: Iterable[BagMessage], is_cut: Callable[[], bool]) -> Iterator[BagMessage]:
        """Yield the messages of a file without frames of which something is missing.

        Of one within the file what is not of its camera stays; one at the end goes with everything of its time, and so does what comes
        before a frame if the file was cut there.  ``is_cut`` is asked at the end, whether more had been in the file.
        """
        held: list[BagMessage] = []
        group_ns, size = -1, 0
        for message in messages:
            if message.log_ns != group_ns:
                yield from self._whole(held)
                held, group_ns, size = [], message.log_ns, 0
            held.append(message)
            size += len(message.data)
            if size > MAX_HELD:
                yield from held
                held = []
        names = frozenset(message.topic for message in held)
        if self._torn_cameras(group_ns) or (held and is_cut() and self._is_beginning(names)):
            self._tell(group_ns, held)
        else:
            yield from self._whole(held)

    def _torn_cameras(self, time_ns: int) -> set[str]:
        return {camera for camera, torn in self._torn.items() if time_ns in torn}

    def _whole(self, held: Sequence[BagMessage]) -> Iterator[BagMessage]:
        """Yield the messages of one time that are of no frame of which something is missing."""
        torn = self._torn_cameras(held[0].log_ns) if held else set[str]()
        left_out = [message for message in held if self._bases.get(message.topic) in torn or self._camera_of.get(message.topic) in torn]
        if left_out:
            self._tell(left_out[0].log_ns, left_out)
        names = frozenset(message.topic for message in held)
        if not names & self._camera_of.keys():
            self._other_groups.add(names)
        yield from (message for message in held if not any(message is other for other in left_out))

    def _tell(self, time_ns: int, left_out: Sequence[BagMessage]) -> None:
        seconds = f"{time_ns // NANOSECONDS}.{time_ns % NANOSECONDS:09d}"
        names = ", ".join(sorted({message.topic for message in left_out}))
        self.cut.append(f"the frame at {seconds} s, of which only {len(left_out)} messages are left: {names}")

    def _is_beginning(self, names: frozenset[str]) -> bool:
        """Return whether what is at the end of a cut file may be the beginning of a frame whose streams were cut off."""
        frames = any(map(len, (self._noted[topic] for topic in self._camera_of)))
        begun = names & self._labels if frames else self._camera_of.keys()
        return not names & self._camera_of.keys() and bool(begun) and names not in self._other_groups
