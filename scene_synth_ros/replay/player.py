"""Plays a bag: hands out its messages when their time has come.  No ROS; the caller publishes."""

import threading
import time
from collections import deque
from collections.abc import Callable, Collection, Iterator

from scene_synth_ros.bags.bag_reader import BagMessage, BagReader
from scene_synth_ros.messages.stamps import NANOSECONDS


class Timeline:
    """Log time as it passes, at a rate that may change, with pauses; drift-free because all is counted from one anchor.

    ``rate``: log time per clock time, > 0.
    """

    def __init__(self, rate: float, *, paused: bool = False) -> None:
        self._rate = rate
        self._paused = paused
        self._anchor_log_ns = 0
        self._anchor_clock_ns: int | None = None

    @property
    def paused(self) -> bool:
        """Whether log time stands still."""
        return self._paused

    @property
    def has_begun(self) -> bool:
        """Whether log time has ever passed, or stood still in a pause after that."""
        return self._anchor_clock_ns is not None

    def stand(self, log_ns: int) -> None:
        """Let log time stand at ``log_ns`` until it begins."""
        self._anchor_log_ns, self._anchor_clock_ns = log_ns, None

    def begin(self, log_ns: int, clock_ns: int) -> None:
        """Let log time be ``log_ns`` at ``clock_ns``."""
        self._anchor_log_ns, self._anchor_clock_ns = log_ns, clock_ns

    def position_ns(self, clock_ns: int) -> int:
        """Return the log time at ``clock_ns``."""
        if self._paused or self._anchor_clock_ns is None:
            return self._anchor_log_ns
        return self._anchor_log_ns + round((clock_ns - self._anchor_clock_ns) * self._rate)

    def due_ns(self, log_ns: int) -> int | None:
        """Return the clock time of ``log_ns``; None while paused, and before time has begun."""
        if self._paused or self._anchor_clock_ns is None:
            return None
        return self._anchor_clock_ns + round((log_ns - self._anchor_log_ns) / self._rate)

    def set_rate(self, rate: float, clock_ns: int) -> None:
        """Go on at another rate from where log time is."""
        self._go_on(clock_ns)
        self._rate = rate

    def pause(self, clock_ns: int) -> None:
        """Stop log time; once paused, harmless."""
        self._go_on(clock_ns)
        self._paused = True

    def resume(self, clock_ns: int) -> None:
        """Let log time go on; while it runs, harmless."""
        self._go_on(clock_ns)
        self._paused = False

    def _go_on(self, clock_ns: int) -> None:
        """Count from here on, if time has begun."""
        if self.has_begun:
            self.begin(self.position_ns(clock_ns), clock_ns)


MAX_LATCHED = 1000
HELD_UP_NS = NANOSECONDS
"""A message that is published for longer than this was held up by its subscribers."""


class Player:
    """Plays an open bag.

    Threading: ``run`` plays, and calls ``publish``, in the thread that calls it; every other method may be called in any thread.  One
    condition guards timeline, seek, steps and the stop flag; whatever changes them wakes the thread that plays.

    Messages are paced by their log times.  Those that come late (a slow machine, a high rate) are handed out at once, none is left out.
    Where ``publish`` itself holds one up for a second, log time has stood still: what follows is not hurried to make up for it.
    Latched topics have their state at the start handed out first.

    Args:
        start_offset_ns: skip this much log time at the beginning.
        rate: log time per real time, > 0.
        paused: wait for ``resume`` before the first message.
    """

    def __init__(
        self,
        reader: BagReader,
        publish: Callable[[BagMessage], None],
        *,
        topics: Collection[str],
        start_offset_ns: int = 0,
        rate: float = 1.0,
        loop: bool = False,
        paused: bool = False,
    ) -> None:
        self._reader = reader
        self._publish = publish
        self._topics = frozenset(topics)
        self._begin_ns = reader.summary.start_ns or 0
        self._start_ns = self._begin_ns + start_offset_ns
        self._timeline = Timeline(rate, paused=paused)
        self._timeline.stand(self._start_ns)
        self._loop = loop
        self._stopped = False
        self._seek_ns: int | None = None
        self._steps = 0
        self._change = threading.Condition()
        self.published = 0

    @property
    def paused(self) -> bool:
        """Whether playing is paused."""
        return self._timeline.paused

    @property
    def has_begun(self) -> bool:
        """Whether messages have begun to be handed out: from then on log time passes."""
        return self._timeline.has_begun

    def position_s(self) -> float:
        """Return the log time from the beginning of the bag, in seconds."""
        with self._change:
            return (self._timeline.position_ns(time.monotonic_ns()) - self._begin_ns) / NANOSECONDS

    def log_time_ns(self) -> int:
        """Return the log time that has been reached, within the bag."""
        end_ns = self._reader.summary.end_ns or self._begin_ns
        with self._change:
            return min(max(self._timeline.position_ns(time.monotonic_ns()), self._begin_ns), end_ns)

    def pause(self) -> None:
        """Stop handing out messages."""
        with self._change:
            self._timeline.pause(time.monotonic_ns())
            self._change.notify_all()

    def resume(self) -> None:
        """Go on where ``pause`` stopped."""
        with self._change:
            self._timeline.resume(time.monotonic_ns())
            self._change.notify_all()

    def step(self) -> None:
        """While paused, hand out the messages of the next log time."""
        with self._change:
            self._steps += 1
            self._change.notify_all()

    def seek(self, position_s: float) -> float:
        """Go on at a log time, in seconds from the beginning of the bag; return the position within the bag that was taken."""
        end_ns = self._reader.summary.end_ns or self._begin_ns
        with self._change:
            self._seek_ns = min(max(self._begin_ns + round(position_s * NANOSECONDS), self._begin_ns), end_ns)
            if self._timeline.has_begun:
                self._timeline.begin(self._seek_ns, time.monotonic_ns())
            else:
                self._timeline.stand(self._seek_ns)
            self._change.notify_all()
            return (self._seek_ns - self._begin_ns) / NANOSECONDS

    def set_rate(self, rate: float) -> None:
        """Change the rate, > 0, from now on."""
        with self._change:
            self._timeline.set_rate(rate, time.monotonic_ns())
            self._change.notify_all()

    def set_loop(self, loop: bool) -> None:
        """Decide whether the next end of the bag is followed by its beginning."""
        self._loop = loop

    def stop(self) -> None:
        """Make ``run`` return soon."""
        with self._change:
            self._stopped = True
            self._change.notify_all()

    def run(self) -> None:
        """Play until the end, or until ``stop`` is called; a paused player stays at the end."""
        start_ns = self._start_ns
        while not self._stopped:
            before = self.published
            self._play_from(start_ns)
            with self._change:
                while self._timeline.paused and self._seek_ns is None and not self._stopped and not self._loop:
                    self._steps = 0
                    self._change.wait()
                start_ns, sought, self._seek_ns = self._start_ns if self._seek_ns is None else self._seek_ns, self._seek_ns, None
            if sought is None and (not self._loop or self.published == before):
                return

    def _play_from(self, start_ns: int) -> None:
        """Hand out what is latched at a log time, then everything from there on, until the end or a seek."""
        for message in self._latched_state(start_ns):
            self._hand_out(message)
        with self._change:
            self._timeline.begin(start_ns, time.monotonic_ns())
        handed_ns: int | None = None
        for message in self._reader.messages(self._topics, start_ns):
            if message.log_ns != handed_ns and not self._wait_for(message.log_ns):
                return
            handed_ns = message.log_ns
            if self._stopped or self._seek_ns is not None:
                return
            self._hand_out(message)

    def _hand_out(self, message: BagMessage) -> None:
        began_ns = time.monotonic_ns()
        self._publish(message)
        self.published += 1
        now_ns = time.monotonic_ns()
        if now_ns - began_ns > HELD_UP_NS:
            with self._change:
                if self._seek_ns is None:
                    self._timeline.begin(max(message.log_ns, self._start_ns), now_ns)

    def _latched_state(self, start_ns: int) -> Iterator[BagMessage]:
        """Yield the messages of latched topics that a subscriber at a log time would still be given."""
        depths = {
            topic.name: min(max((qos.depth for qos in topic.qos), default=1) or 1, MAX_LATCHED)
            for topic in self._reader.summary.topics
            if topic.name in self._topics and topic.qos and all(qos.durability == "transient_local" for qos in topic.qos)
        }
        if start_ns <= self._begin_ns or not depths:
            return
        kept: dict[str, deque[BagMessage]] = {name: deque(maxlen=depth) for name, depth in depths.items()}
        for message in self._reader.messages(depths):
            if self._stopped or message.log_ns >= start_ns:
                break
            kept[message.topic].append(message)
        yield from sorted((message for queue in kept.values() for message in queue), key=lambda message: message.log_ns)

    def _wait_for(self, log_ns: int) -> bool:
        """Wait until ``log_ns`` is due or a step is asked for; return False if playing has been stopped or goes on elsewhere."""
        with self._change:
            while not self._stopped and self._seek_ns is None:
                due_ns = self._timeline.due_ns(log_ns)
                if due_ns is None:
                    if self._steps:
                        self._steps -= 1
                        self._timeline.begin(log_ns, time.monotonic_ns())
                        return True
                    self._change.wait()
                    continue
                self._steps = 0
                left_ns = due_ns - time.monotonic_ns()
                if left_ns <= 0:
                    return True
                self._change.wait(left_ns / NANOSECONDS)
        return False
