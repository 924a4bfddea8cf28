"""Plays a bag once from its beginning to its end: waits for subscribers, plays, waits until they have everything."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Future, wait

from rclpy.impl.rcutils_logger import RcutilsLogger
from rclpy.publisher import Publisher

from scene_synth_ros.bags.bag_reader import BagMessage, BagReader
from scene_synth_ros.messages.stamps import NANOSECONDS
from scene_synth_ros.replay.acknowledgements import Acknowledgements
from scene_synth_ros.replay.player import Player
from scene_synth_ros.replay.replay_config import ReplayConfig
from scene_synth_ros.suite.daemon_job import start_daemon_job

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

    Args:
        reader: the bag.
        publishers: topic -> publisher.
        config: returns the present settings.
        logger: of the node.

    Attributes:
        player: decides which message is due.
        ended: future of the thread; it has the exception if one ended it.
    """

    def __init__(
        self, reader: BagReader, publishers: Mapping[str, Publisher], config: Callable[[], ReplayConfig], logger: RcutilsLogger
    ) -> None:
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
