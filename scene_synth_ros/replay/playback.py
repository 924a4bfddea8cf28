"""Plays a bag once from its beginning to its end: waits for subscribers, plays, waits until they have everything."""

import threading
import time
from collections.abc import Callable, Collection, Mapping
from concurrent.futures import Future, wait
from typing import Protocol

from rclpy.duration import Duration
from rclpy.publisher import Publisher
from rclpy.qos import QoSHistoryPolicy, QoSProfile, QoSReliabilityPolicy

from scene_synth_ros.bags.bag_reader import BagMessage, BagReader
from scene_synth_ros.messages.stamps import NANOSECONDS
from scene_synth_ros.replay.player import Player
from scene_synth_ros.replay.replay_config import ReplayConfig
from scene_synth_ros.suite.daemon_job import start_daemon_job
from scene_synth_ros.suite.rclpy_internals import Logger

KEPT_OF_ALL = 1000
PATIENCE_S = 10.0
"""How long a subscriber that acknowledges nothing may hold up the others."""

_POLL_S = 0.02


class AcknowledgedPublisher(Protocol):
    """What is asked of a publisher, that of rclpy."""

    qos_profile: QoSProfile

    def wait_for_all_acked(self, timeout: Duration) -> bool:
        """Wait; return whether all reliable subscribers have acknowledged everything.  Best-effort subscribers do not count."""


class Acknowledgements:
    """Counts what the subscribers of each topic have not been asked for yet, and waits for them when the history is full.

    Subscribers that acknowledge nothing for :data:`PATIENCE_S` are told of once and not waited for until they have caught up.

    Threading: one thread calls every method; ``stopped`` may be set in any.

    Args:
        stopped: ends every wait.
    """

    def __init__(
        self,
        publishers: Mapping[str, AcknowledgedPublisher],
        stopped: threading.Event,
        warn: Callable[[str], None],
        patience_s: float = PATIENCE_S,
    ) -> None:
        self._publishers, self._stopped, self._warn, self._patience_s = publishers, stopped, warn, patience_s
        self._room = {topic: _history(publisher.qos_profile) for topic, publisher in publishers.items()}
        self._since = dict.fromkeys(publishers, 0)
        self._silent: set[str] = set()

    def make_room(self, topic: str) -> None:
        """Wait until the next message of a topic overwrites nothing that somebody still needs, and count it."""
        room = self._room[topic]
        if room and self._since[topic] >= room and not self._stopped.is_set():
            patience_s = 0.0 if topic in self._silent else self._patience_s
            if self._acknowledged([topic], patience_s):
                self._silent.discard(topic)
                self._since[topic] = 0
            elif topic not in self._silent and not self._stopped.is_set():
                self._silent.add(topic)
                self._warn(
                    f"a subscriber of {topic} has acknowledged nothing for {patience_s:g} s; it is not waited for and loses messages"
                )
        self._since[topic] += 1

    def finish(self) -> None:
        """Wait until everything that was published is acknowledged."""
        topics = [topic for topic, room in self._room.items() if room and topic not in self._silent]
        if not self._acknowledged(topics, self._patience_s) and not self._stopped.is_set():
            self._warn(f"subscribers have not acknowledged everything in {self._patience_s:g} s")

    def _acknowledged(self, topics: Collection[str], seconds: float) -> bool:
        """Wait for so long; return whether the subscribers of these topics have everything."""
        end_s = time.monotonic() + seconds
        while True:
            poll = Duration(seconds=min(_POLL_S, max(0.0, end_s - time.monotonic())))
            topics = [topic for topic in topics if not self._publishers[topic].wait_for_all_acked(poll)]
            if not topics or time.monotonic() >= end_s or self._stopped.is_set():
                return not topics


def _history(qos: QoSProfile) -> int:
    """Return how many messages a publisher keeps for a subscriber that has not acknowledged them; 0 for one that nobody acknowledges.

    One that keeps all is held to :data:`KEPT_OF_ALL`: Fast DDS refuses messages when it keeps 5000.
    """
    if qos.reliability != QoSReliabilityPolicy.RELIABLE:
        return 0
    return max(1, qos.depth) if qos.history == QoSHistoryPolicy.KEEP_LAST else KEPT_OF_ALL


SETTLE_S = 0.2
"""A publisher counts a subscriber before that one has matched it in turn; what is published in between would be lost to it."""

_POLL_S = 0.02
_STOP_S = 0.5


class Playback:
    """The thread that plays, its publishers, and the word to stop.

    The publishers assert their liveliness before they play, which makes Fast DDS send a heartbeat: a reader of Cyclone DDS counts what is
    sent to it from the first heartbeat on, and would lose the first message of every topic.

    Threading: :meth:`_run` is the playing thread, which alone publishes.  The executor's thread starts and stops it, and steers ``player``,
    which guards itself; besides that they share only the event of :meth:`stop` and the thread's future.

    Attributes:
        player: decides which message is due.
        ended: future of the thread; it has the exception if one ended it.
    """

    def __init__(self, reader: BagReader, publishers: Mapping[str, Publisher], config: Callable[[], ReplayConfig], logger: Logger) -> None:
        self._publishers, self._config, self._logger = publishers, config, logger
        start = config()
        self.player = Player(
            reader,
            self._publish,
            topics=publishers.keys(),
            start_offset_ns=round(start.start_offset_s * NANOSECONDS),
            rate=start.rate,
            loop=start.loop,
            paused=start.start_paused,
        )
        self._stopped = threading.Event()
        self._acknowledgements = Acknowledgements(publishers, self._stopped, logger.warning)
        self.ended: Future[None] = start_daemon_job("replay", self._run)

    def stop(self) -> bool:
        """Stop playing; return whether the thread has ended, which it has half a second to do."""
        self._stopped.set()
        self.player.stop()
        return not wait([self.ended], _STOP_S).not_done

    def _run(self) -> None:
        self._wait_for_subscribers(self._config().wait_for_subscribers_s)
        config = self._config()
        self._logger.info(f"replaying {config.bag}: {len(self._publishers)} topics at rate {config.rate:g}")
        self.player.run()
        if not self._stopped.is_set():
            self._acknowledgements.finish()
            self._logger.info(f"replayed {self.player.published} messages")

    def _publish(self, message: BagMessage) -> None:
        self._acknowledgements.make_room(message.topic)
        if not self._stopped.is_set():
            self._publishers[message.topic].publish(message.data)

    def _wait_for_subscribers(self, timeout_s: float) -> None:
        end_s = time.monotonic() + timeout_s
        while time.monotonic() < end_s and not all(publisher.get_subscription_count() for publisher in self._publishers.values()):
            if self._stopped.wait(_POLL_S):
                return
        if timeout_s > 0.0:
            self._stopped.wait(SETTLE_S)
        for publisher in self._publishers.values():
            publisher.assert_liveliness()
        if timeout_s > 0.0:
            self._stopped.wait(SETTLE_S)
