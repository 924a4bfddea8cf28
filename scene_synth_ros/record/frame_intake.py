"""Gives every message that arrives its time, and lets frames out when they are complete."""

from array import array
from bisect import bisect_left
from collections import deque
from collections.abc import Callable, Collection, Mapping

from scene_synth_ros.bags.bag_writer import MAX_TIME_NS
from scene_synth_ros.messages.stamps import NANOSECONDS, AnnouncedRoom, announced_room, stamp_ns
from scene_synth_ros.messages.streams import SCENE, has_own_stamps, parse
from scene_synth_ros.record.frame_sorter import FrameSorter, OrderedMessage
from scene_synth_ros.record.frame_topics import CLOCK_TOPIC
from scene_synth_ros.record.senders import Origin

ROOMS_KEPT, ASKED_KEPT = 17, 200


class SeenFrames:
    """Remembers topics and stamps of the rooms that may still be done again, packed because a long room has many: 12 bytes a stamp."""

    def __init__(self) -> None:
        self._bits: dict[str, int] = {}
        self._stamps, self._topics = array("q"), array("I")  # ascending, and which of the sets of topics each has
        self._sets: dict[int, int] = {}
        self._masks: list[int] = []
        self._starts: deque[int] = deque(maxlen=ROOMS_KEPT)
        self.repeats = 0

    def __len__(self) -> int:
        return len(self._stamps)

    def is_new(self, topic: str, stamp_ns: int) -> bool:
        """Return whether a message of this topic and stamp comes for the first time, and remember it."""
        bit = self._bits.setdefault(topic, 1 << len(self._bits))
        place, mask = self._find(stamp_ns)
        if mask & bit:
            self.repeats += 1
            return False
        number = self._sets.setdefault(mask | bit, len(self._masks))
        if number == len(self._masks):
            self._masks.append(mask | bit)
        if mask:
            self._topics[place] = number
        else:
            self._stamps.insert(place, stamp_ns)
            self._topics.insert(place, number)
        return True

    def has(self, topic: str, stamp_ns: int) -> bool:
        """Return whether a message of this topic and stamp has come."""
        return bool(self._find(stamp_ns)[1] & self._bits.get(topic, 0))

    def begin_room(self, start_ns: int) -> None:
        """Forget what is older than the last rooms."""
        self._starts.append(start_ns)
        if len(self._starts) == ROOMS_KEPT:
            oldest = bisect_left(self._stamps, self._starts[0])
            del self._stamps[:oldest], self._topics[:oldest]

    def _find(self, stamp_ns: int) -> tuple[int, int]:
        """Return the place of a stamp and the topics that it has, as bits."""
        place = bisect_left(self._stamps, stamp_ns)
        known = place < len(self._stamps) and self._stamps[place] == stamp_ns
        return place, self._masks[self._topics[place]] if known else 0


TIME_TOPICS = frozenset({"/clock", "/tf"})
"""What moves time and the frames of a graph; the frame of a pose that was asked for has none of it."""

WALL_STAMPED = ("diagnostic_msgs/msg/DiagnosticArray", "rcl_interfaces/msg/Log")
"""Types whose header holds wall time; in a bag of simulated time they are logged at the time of the frame before them."""

MAX_STRAY_NS = 60 * NANOSECONDS
"""Messages of others whose stamp is further from the newest frame are of another clock and are logged as those above."""


class FrameIntake:
    """What waits for its frame; every method that may let messages out returns them in order.

    Threads: the thread of the node's executor only.

    Attributes:
        refused: messages with a stamp that no bag can hold, left out.
    """

    def __init__(self, warn: Callable[[str], None]) -> None:
        self._warn = warn
        self._types: dict[str, str] = {}
        self._origins: dict[str, Origin] = {}
        self._latched: set[str] = set()
        self._expected: set[str] = set()
        self._alike: Mapping[str, str] = {}
        self._sorter = FrameSorter(None)
        self._seen = SeenFrames()
        self._rooms: deque[AnnouncedRoom] = deque(maxlen=ROOMS_KEPT)
        self._newest_ns: int | None = None
        self._begun: dict[str, int] = {}
        self._whole_from_ns = 0
        self._asked: deque[int] = deque(maxlen=ASKED_KEPT)
        self._told: set[str] = set()
        self.refused = 0

    @property
    def repeats(self) -> int:
        """Messages of frames that came before, left out."""
        return self._seen.repeats

    @property
    def late(self) -> int:
        """Messages that came after their frame had left."""
        return self._sorter.late

    @property
    def waiting_bytes(self) -> int:
        """Bytes that wait for their frame to be complete."""
        return self._sorter.waiting_bytes

    @property
    def held(self) -> str:
        """For which message of another topic the first complete frame waits, empty if there is none."""
        return self._sorter.held

    def add_topic(self, topic: str, type_name: str, latched: bool, origin: Origin) -> None:
        """Get to know a topic."""
        self._types[topic], self._origins[topic] = type_name, origin
        self._place(topic)
        if latched:
            self._latched.add(topic)

    def set_origin(self, topic: str, origin: Origin) -> list[OrderedMessage]:
        """Say whose messages a topic has, now that more is known of it."""
        released: list[OrderedMessage] = []
        before = self._origins[topic]
        if origin is not before:
            self._origins[topic] = origin
            self._place(topic)
            for stamp, data in self._sorter.take_back(topic) if origin is Origin.OTHERS else ():
                released += self._sorter.add(topic, self._stamp_of_others(stamp), data)
            if topic in self._expected and Origin.OTHERS in (before, origin):
                released += self._sorter.configure(self._awaited() or None, self._alike)
        return released

    def set_aside(self, topic: str, stamp: int) -> list[OrderedMessage]:
        """Take that the frame of a stamp was asked for, as its settings on a topic say: it has no part in the order of time."""
        if not self.is_own(topic) or self._seen.has(topic, stamp):
            return []
        self._asked.append(stamp)
        self._begun = {known: begin_ns for known, begin_ns in self._begun.items() if begin_ns != stamp}
        return self._sorter.set_aside(stamp, TIME_TOPICS)

    def is_own(self, topic: str) -> bool:
        """Return whether the messages of a topic are known to be the suite's."""
        return self._origins[topic] is Origin.SUITE

    def begin_suite(self) -> None:
        """Let time begin anew with the suite's first frame, whatever has left before that."""
        self._sorter.restart_clock()
        self._newest_ns = None

    def expect(self, topics: Collection[str], alike: Mapping[str, str]) -> list[OrderedMessage]:
        """Say which topics make a frame complete, and which of them stand for each other."""
        if set(topics) == self._expected and alike == self._alike:
            return []
        self._expected, self._alike = set(topics), alike
        released = self._sorter.configure(self._awaited() or None, alike)
        for topic in self._types:
            self._place(topic)
        return released

    def wait_for(self, stamp: int, sent: Mapping[str, int]) -> None:
        """Let the frame of a stamp wait for what was sent before it on recorded topics: topic -> stamp of the last message."""
        for topic, last_ns in sent.items():
            if self._origins.get(topic) is Origin.SUITE:
                self._sorter.wait_for(stamp, topic, last_ns)

    def add(self, topic: str, data: bytes) -> list[OrderedMessage] | None:
        """Take a message; None if it is left out: it came before, or no bag can hold its stamp.

        It is padded to whole words, as DDS does on the way between processes, so that bags do not depend on where a publisher runs.
        """
        type_name, origin = self._types[topic], self._origins[topic]
        stamp = None if type_name in WALL_STAMPED else stamp_ns(type_name, data)
        if stamp is not None and not 0 <= stamp < MAX_TIME_NS:
            self._refuse(topic, stamp)
            return None
        own = origin is Origin.SUITE and self._comes_between(topic)
        if stamp is not None and origin is Origin.OTHERS:
            stamp = self._stamp_of_others(stamp)
        elif stamp is not None and (own or topic in self._expected or topic in self._latched):
            if not self._seen.is_new(topic, stamp):  # a frame is done again, or a connection is made again to what is latched
                return None
            self._note(topic, stamp, data)
        return self.add_stamped(topic, stamp, data + bytes(-len(data) % 4))

    def reach(self, topic: str, data: bytes) -> list[OrderedMessage]:
        """Take that a message of a topic with stamps of its own has come, and what is derived of it."""
        stamp = stamp_ns(self._types[topic], data)
        return [] if stamp is None else self._sorter.reach(topic, stamp)

    def add_stamped(self, topic: str, stamp: int | None, data: bytes, *, aside: bool = False) -> list[OrderedMessage]:
        """Take a message whose stamp (ns) is known; one ``aside`` belongs to no frame, though its topic may."""
        released = self._sorter.add(topic, stamp, data, aside=aside)
        before_ns, self._whole_from_ns = self._whole_from_ns, max(self._begun.values(), default=0)
        if self._whole_from_ns == before_ns and (stamp is None or stamp >= before_ns):
            return released
        # Latched parts of frames from before the recorder was connected; renderers that share rooms do not come to them in order.
        if self._sorter.first_ns < self._whole_from_ns and not self._rooms_are_shared:
            released += self._sorter.flush(self._whole_from_ns - 1)
        return released

    def flush(self, room: int | None = None) -> list[OrderedMessage]:
        """Let out everything, or what waits of a room and of those before it.

        Frames of later rooms, of which some messages may still be on their way, are left to be completed; if the room's scene description
        was not recorded, nothing tells them apart and all leave.
        """
        rooms = () if room is None else reversed(self._rooms)
        end_ns = next((max(known.stamps_ns, default=-1) for known in rooms if known.index == room), None)
        return self._sorter.flush(end_ns)

    def flush_unexpected(self) -> list[OrderedMessage]:
        """Let out what only follows frames, or everything if no frames are expected; a frame goes on waiting for all of it."""
        return self._sorter.flush_following() if self._expected else self._sorter.flush()

    def finish(self) -> list[OrderedMessage]:
        """Let out, when nothing more will come, whole frames and what is of none."""
        return self._sorter.finish()

    def _note(self, topic: str, stamp: int, data: bytes) -> None:
        """Take the time of a frame from a message that is certainly the suite's, and a room from its description."""
        if topic not in self._expected:
            stream = parse(topic, self._types[topic])
            if stream is not None and stream.role is SCENE:
                self._seen.begin_room(stamp)
                self._rooms.append(announced_room(data))
        elif self._origins[topic] is Origin.SUITE and stamp not in self._asked:
            self._newest_ns = stamp
            if topic not in self._latched:
                self._begun.setdefault(topic, stamp)

    @property
    def _rooms_are_shared(self) -> bool:
        return any(topic != stand_in for topic, stand_in in self._alike.items())

    def _awaited(self) -> set[str]:
        """Return the topics that frames wait for: not those where others publish, whose messages cannot be told from the frames'."""
        return {topic for topic in self._expected if self._origins.get(topic) is not Origin.OTHERS}

    def _place(self, topic: str) -> None:
        """Tell the sorter of a topic's place."""
        own = self._origins[topic] is Origin.SUITE
        self._sorter.follow(topic, self._follows(topic), patient=own and self._comes_between(topic))

    def _follows(self, topic: str) -> bool:
        """Return whether messages of a topic only follow frames: those of others, and those between frames, where there are any."""
        return self._origins[topic] is not Origin.SUITE or (bool(self._expected) and self._comes_between(topic))

    def _comes_between(self, topic: str) -> bool:
        """Return whether messages of a topic of the suite come between frames: at a rate of their own, as ticks of a clock may."""
        return has_own_stamps(topic) or (topic == CLOCK_TOPIC and topic not in self._expected)

    def _stamp_of_others(self, stamp: int) -> int | None:
        """Return the stamp of a message of others if it can be of the frames' clock; None is logged at the time of the bag."""
        near = self._newest_ns is not None and abs(stamp - self._newest_ns) <= MAX_STRAY_NS
        return stamp if near else None

    def _refuse(self, topic: str, stamp: int) -> None:
        self.refused += 1
        if topic not in self._told:
            self._told.add(topic)
            limit_s = MAX_TIME_NS // NANOSECONDS
            self._warn(f"{topic}: a message was refused: expected a stamp from 0 to {limit_s} s, got {stamp / NANOSECONDS:.9f} s")
