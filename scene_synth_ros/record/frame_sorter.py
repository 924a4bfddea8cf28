"""Puts messages that arrive in any order into the order of their stamps, so that a run always writes the same bytes.

DDS keeps the order of one topic, not of several.  Messages of one stamp form a group, which leaves when everything expected of that
stamp is there and all earlier groups have left; within a group the topics have a fixed order.

The clock of the bag is the stamp of the last group that left.  Some topics only follow it, because nobody knows by whose clock they are
stamped, or because they come at a rate of their own: a group that has nothing else leaves with the next group that leads, in its order, but
never moves the clock beyond those.  A group may also wait until another topic has come up to a stamp (:meth:`FrameSorter.wait_for`).
"""

import math
from collections.abc import Collection, Iterator, Mapping
from types import MappingProxyType
from typing import NamedTuple

UNEXPECTED_FACTOR = 16
"""While nothing is expected, groups leave only when they are flushed; so many more of them may wait."""

LEADING = ("/clock", "/scene", "/scene/map", "/scene/markers", "/tf_static", "/tf")
"""Ends of topics that go before the others of the same stamp."""


def topic_rank(topic: str) -> tuple[int, str]:
    """Return what sorts topics into the order in which they leave at equal stamps: those that lead, then all others by name."""
    return next((rank for rank, end in enumerate(LEADING) if topic.endswith(end)), len(LEADING)), topic


class OrderedMessage(NamedTuple):
    """A message whose turn has come.

    ``log_ns`` never decreases from one to the next; it is ``stamp_ns`` except for messages that came late or have no stamp (None).
    """

    topic: str
    stamp_ns: int | None
    log_ns: int
    data: bytes


class _Group:
    """What has arrived of one stamp; ``leads`` unless all of it is of topics that follow.

    ``aside``: messages that follow whatever their topic does; ``awaited``: topic -> stamp (ns) up to which it must have come;
    ``needless``: topics that a group which is set aside leaves out, None of any other group.
    """

    __slots__ = ("aside", "awaited", "leads", "messages", "missing", "needless", "size")

    def __init__(self, missing: set[str] | None) -> None:
        self.messages: list[tuple[str, bytes]] = []
        self.aside: list[tuple[str, bytes]] = []
        self.awaited: dict[str, int] = {}
        self.missing = missing
        self.needless: frozenset[str] | None = None
        self.size = 0
        self.leads = False

    @property
    def complete(self) -> bool:
        """Whether everything that was expected is there, of a group that has a place in the order."""
        return self.whole and not self.awaited and self.needless is None

    @property
    def whole(self) -> bool:
        """Whether everything that was expected is there."""
        return self.missing is not None and not self.missing


class FrameSorter:
    """Holds messages until their group is complete, within bounds; no clocks, no threads.

    Args:
        expected: topics that every stamp must have to be complete; None lets groups leave only when they are flushed or too much waits.
        max_stamps: how many stamps may wait for what is expected; without an expectation, ``UNEXPECTED_FACTOR`` times as many.  Those that
            have only patient topics do not count.
        max_bytes: how many bytes may wait, all stamps together.

    Attributes:
        late: messages that came after their stamp had left; they leave at once.
        forced: groups that left incomplete because too much was waiting.
        waiting_bytes: size of what is waiting.
    """

    def __init__(self, expected: Collection[str] | None, *, max_stamps: int = 64, max_bytes: int = 256 * 2**20) -> None:
        self._expected = None if expected is None else frozenset(expected)
        self._alike: Mapping[str, str] = {}
        self._followers: set[str] = set()
        self._patient: set[str] = set()
        self._max_stamps, self._max_bytes = max_stamps, max_bytes
        self._groups: dict[int, _Group] = {}
        self._awaiting: set[int] = set()  # stamps of those that await a topic
        self._reached: dict[str, int] = {}
        self._released_ns: int | None = None
        self.late = 0
        self.forced = 0
        self.waiting_bytes = 0

    @property
    def waiting_stamps(self) -> int:
        """How many stamps are waiting."""
        return len(self._groups)

    @property
    def clock_ns(self) -> int:
        """Time of the bag: the stamp of the last group that has left, 0 before the first."""
        return self._released_ns or 0

    @property
    def first_ns(self) -> float:
        """Earliest stamp that is waiting; infinite if there is none."""
        return min(self._groups, default=math.inf)

    def configure(self, expected: Collection[str] | None, alike: Mapping[str, str] = MappingProxyType({})) -> list[OrderedMessage]:
        """Change the expectation for stamps yet to come; return what may leave now, in order.

        What waits goes on waiting for what is still expected of it; where nothing was expected before, or is from now on, all of it leaves.

        ``alike``: topic -> the topic that stands for it; of those with the same one, a stamp needs one only.
        """
        released = self.flush() if self._expected is None or expected is None or alike != self._alike else []
        self._alike = dict(alike)
        self._expected = None if expected is None else frozenset(map(self._stand_in, expected))
        for group in self._groups.values():
            group.missing = None if group.missing is None else group.missing & (self._expected or frozenset())
        return released + list(self._release_complete())

    def add(self, topic: str, stamp_ns: int | None, data: bytes, *, aside: bool = False) -> list[OrderedMessage]:
        """Take a message; return what may leave now, in order.  A message without a stamp leaves at once.

        ``aside``: it only follows, whatever its topic does otherwise, and is not what a group misses.
        """
        if stamp_ns is None:
            return [OrderedMessage(topic, None, self.clock_ns, data)]
        if self._released_ns is not None and stamp_ns <= self._released_ns:
            self.late += 1
            return [OrderedMessage(topic, stamp_ns, self._released_ns, data)]
        group = self._group(stamp_ns)
        (group.aside if aside else group.messages).append((topic, data))
        group.leads = group.leads or not (aside or topic in self._followers or group.needless is not None)
        group.size += len(data)
        self.waiting_bytes += len(data)
        if group.missing is not None and not aside:
            group.missing.discard(self._stand_in(topic))
        released = list(self._release_complete()) if group.whole else []
        most = self._max_stamps * (UNEXPECTED_FACTOR if self._expected is None else 1)
        counts = aside or topic not in self._patient  # else no stamp counts that did not before
        while (counts and len(self._groups) > most and self._counted() > most) or self.waiting_bytes > self._max_bytes:
            self.forced += 1
            released += self._release_one()
            released += self._release_complete()
        return released

    def set_aside(self, stamp_ns: int, needless: Collection[str]) -> list[OrderedMessage]:
        """Let what has a stamp, and has not left, leave by itself when it is whole, at the time of the bag; return it if it is.

        ``needless``: topics that it may lack, and leaves out.
        """
        if self._released_ns is not None and stamp_ns <= self._released_ns:
            return []
        group = self._group(stamp_ns)
        group.needless, group.leads = frozenset(needless), False
        group.missing = None if group.missing is None else group.missing - group.needless
        return list(self._release_complete())

    def wait_for(self, stamp_ns: int, topic: str, up_to_ns: int) -> None:
        """Let what has a stamp, and has not left, wait until :meth:`reach` says that a topic has come up to another stamp."""
        if (self._released_ns is None or stamp_ns > self._released_ns) and self._reached.get(topic, -1) < up_to_ns:
            self._group(stamp_ns).awaited[topic] = up_to_ns
            self._awaiting.add(stamp_ns)

    def reach(self, topic: str, stamp_ns: int) -> list[OrderedMessage]:
        """Take that a topic has come up to a stamp; return what may leave now, in order."""
        self._reached[topic] = max(stamp_ns, self._reached.get(topic, -1))
        arrived = [stamp for stamp in self._awaiting if self._groups[stamp].awaited.get(topic, math.inf) <= stamp_ns]
        for stamp in arrived:
            awaited = self._groups[stamp].awaited
            del awaited[topic]
            if not awaited:
                self._awaiting.remove(stamp)
        return list(self._release_complete()) if arrived else []

    @property
    def held(self) -> str:
        """For which message the first waiting stamp waits that lacks nothing else; empty if there is none."""
        first = min((stamp for stamp, group in self._groups.items() if group.awaited and not group.missing), default=None)
        return "" if first is None else f"{first} {self._groups[first].awaited}"

    def follow(self, topic: str, follows: bool, *, patient: bool = False) -> None:
        """Say whether a topic only follows the clock, also of what waits; at first no topic does.

        ``patient``: it is stamped by the frames' clock, and many of its stamps may come between two frames.
        """
        (self._followers.add if follows else self._followers.discard)(topic)
        (self._patient.add if follows and patient else self._patient.discard)(topic)
        for group in self._groups.values():
            self._judge(group)

    def take_back(self, topic: str) -> list[tuple[int, bytes]]:
        """Return what waits of a topic, as stamps (ns) and messages, and hold it no more."""
        return [message for stamp in sorted(self._groups) for message in self._take_out(stamp, {topic})]

    def finish(self) -> list[OrderedMessage]:
        """Return, when nothing more will come, the complete groups that wait, what is before them, and what only follows.

        Of groups that miss something, what is expected of every group is left out.  Behind the last frame, what is of patient topics moves
        the clock.
        """
        if self._expected is None:
            return self.flush()
        for stamp in [stamp for stamp, group in self._groups.items() if group.missing]:
            self._take_out(stamp, self._expected)
        last = max((stamp for stamp, group in self._groups.items() if not group.missing), default=-1)
        released = self.flush(last)
        for stamp in sorted(stamp for stamp, group in self._groups.items() if self._is_patient(group)):
            released += self._release(stamp) if stamp > self.clock_ns else []
        return released + self.flush_following()

    def _take_out(self, stamp_ns: int, topics: Collection[str]) -> list[tuple[int, bytes]]:
        """Return what waits of some topics with a stamp, as stamps (ns) and messages, and hold it no more."""
        group = self._groups[stamp_ns]
        taken = [(stamp_ns, data) for topic, data in group.messages if {topic, self._stand_in(topic)} & set(topics)]
        group.messages = [message for message in group.messages if not {message[0], self._stand_in(message[0])} & set(topics)]
        size = sum(len(data) for _, data in [*group.messages, *group.aside])
        self.waiting_bytes -= group.size - size
        group.size = size
        self._judge(group)
        if not group.messages and not group.aside:
            self._pop(stamp_ns)
        return taken

    def _judge(self, group: _Group) -> None:
        """Say anew whether a group leads."""
        group.leads = group.needless is None and any(topic not in self._followers for topic, _ in group.messages)

    def restart_clock(self) -> None:
        """Forget the time of the bag: the next group that leaves is not late, whatever its stamp."""
        self._released_ns = None

    def flush(self, up_to_ns: int | None = None) -> list[OrderedMessage]:
        """Return everything that waits with a stamp of at most ``up_to_ns`` (None: everything), complete or not, in order."""
        end_ns = self._last_leading() if up_to_ns is None else up_to_ns
        released = [message for stamp in self._waiting_up_to(end_ns) for message in self._release(stamp)]
        if up_to_ns is None:
            released += [message for stamp in sorted(self._groups) for message in self._release_following(stamp)]
        return released + list(self._release_complete())

    def flush_following(self) -> list[OrderedMessage]:
        """Return what waits in groups that only follow and are no part of a frame, at the time of the bag."""
        frame = self._expected or frozenset()
        following = [
            stamp
            for stamp, group in sorted(self._groups.items())
            if not group.leads and not any(self._stand_in(topic) in frame for topic, _ in group.messages)
        ]
        return [message for stamp in following for message in self._release_following(stamp)]

    def missing(self) -> dict[int, frozenset[str]]:
        """Return, for every waiting stamp, the topics that it still waits for."""
        return {stamp: frozenset(self._groups[stamp].missing or ()) for stamp in sorted(self._groups)}

    def _group(self, stamp_ns: int) -> _Group:
        if stamp_ns not in self._groups:
            self._groups[stamp_ns] = _Group(None if self._expected is None else set(self._expected))
        return self._groups[stamp_ns]

    def _stand_in(self, topic: str) -> str:
        return self._alike.get(topic, topic)

    def _release_complete(self) -> Iterator[OrderedMessage]:
        while True:
            for stamp in sorted(stamp for stamp, group in self._groups.items() if group.needless is not None and not group.missing):
                yield from self._release_following(stamp)
            first = min((stamp for stamp, group in self._groups.items() if group.leads or group.complete), default=None)
            if first is None or not self._groups[first].complete:
                return
            for stamp in self._waiting_up_to(first):
                yield from self._release(stamp)

    def _waiting_up_to(self, end_ns: float) -> list[int]:
        """Return the stamps up to ``end_ns`` that wait and have a place in the order."""
        return sorted(stamp for stamp, group in self._groups.items() if stamp <= end_ns and group.needless is None)

    def _counted(self) -> int:
        """Return how many stamps wait that have more than what is patient."""
        return sum(not self._is_patient(group) for group in self._groups.values())

    def _is_patient(self, group: _Group) -> bool:
        """Return whether a group has messages, and all are of patient topics."""
        return bool(group.messages) and all(topic in self._patient for topic, _ in group.messages)

    def _last_leading(self) -> float:
        """Return the last waiting stamp up to which the clock may go; infinitely early if there is none."""
        return max((stamp for stamp, group in self._groups.items() if group.leads or group.complete), default=-math.inf)

    def _release_one(self) -> list[OrderedMessage]:
        """Let one group out because too much waits: first those that would move the clock but must not, then the earliest."""
        last = self._last_leading()
        beyond = min((stamp for stamp, group in self._groups.items() if stamp > last or group.needless is not None), default=None)
        return self._release(min(self._groups)) if beyond is None else self._release_following(beyond)

    def _release_following(self, stamp_ns: int) -> list[OrderedMessage]:
        """Let out a group at the time of the bag, as if it had no stamp."""
        group = self._pop(stamp_ns)
        ordered = sorted([*group.messages, *group.aside], key=lambda message: topic_rank(message[0]))
        return [OrderedMessage(topic, None, self.clock_ns, data) for topic, data in ordered if topic not in (group.needless or ())]

    def _release(self, stamp_ns: int) -> list[OrderedMessage]:
        group = self._pop(stamp_ns)
        self._released_ns = stamp_ns
        ordered = sorted([*group.messages, *group.aside], key=lambda message: topic_rank(message[0]))
        return [OrderedMessage(topic, stamp_ns, stamp_ns, data) for topic, data in ordered]

    def _pop(self, stamp_ns: int) -> _Group:
        group = self._groups.pop(stamp_ns)
        self._awaiting.discard(stamp_ns)
        self.waiting_bytes -= group.size
        return group
