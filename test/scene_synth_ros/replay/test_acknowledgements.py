"""Back-pressure of a replay: who is waited for, and for how long."""

import threading
import time

from rclpy.duration import Duration
from rclpy.qos import QoSHistoryPolicy, QoSProfile, QoSReliabilityPolicy

from scene_synth_ros.replay.playback import KEPT_OF_ALL, Acknowledgements


class Publisher:
    """Counts how often it is asked; its subscribers acknowledge after so many questions."""

    def __init__(self, qos: QoSProfile, after: float = 0) -> None:
        self.qos_profile, self.after, self.asked = qos, after, 0

    def wait_for_all_acked(self, timeout: Duration) -> bool:
        self.asked += 1
        time.sleep(timeout.nanoseconds / 1e9 if self.asked <= self.after else 0.0)
        return self.asked > self.after


def acknowledgements(**publishers: Publisher) -> tuple[Acknowledgements, list[str], threading.Event]:
    warnings: list[str] = []
    stopped = threading.Event()
    return Acknowledgements(publishers, stopped, warnings.append, patience_s=0.2), warnings, stopped


def test_a_history_is_filled_before_anybody_is_waited_for() -> None:
    publisher = Publisher(QoSProfile(depth=3), after=2)
    waiting, warnings, _ = acknowledgements(a=publisher)
    for _ in range(3):
        waiting.make_room("a")
    assert publisher.asked == 0
    waiting.make_room("a")
    assert publisher.asked == 3, "asked until they had acknowledged"
    for _ in range(2):
        waiting.make_room("a")
    assert publisher.asked == 3
    waiting.make_room("a")
    assert publisher.asked == 4 and not warnings


def test_best_effort_subscribers_slow_nothing_down() -> None:
    publisher = Publisher(QoSProfile(depth=1, reliability=QoSReliabilityPolicy.BEST_EFFORT), after=1e9)
    waiting, warnings, _ = acknowledgements(a=publisher)
    for _ in range(100):
        waiting.make_room("a")
    waiting.finish()
    assert publisher.asked == 0 and not warnings


def test_one_that_keeps_all_is_held_too() -> None:
    publisher = Publisher(QoSProfile(depth=1, history=QoSHistoryPolicy.KEEP_ALL))
    waiting, _, _ = acknowledgements(a=publisher)
    for _ in range(KEPT_OF_ALL):
        waiting.make_room("a")
    assert publisher.asked == 0
    waiting.make_room("a")
    assert publisher.asked == 1


def test_a_dead_subscriber_is_told_of_once_and_then_left_behind_until_it_has_caught_up() -> None:
    publisher = Publisher(QoSProfile(depth=2), after=1e9)
    waiting, warnings, _ = acknowledgements(a=publisher)
    began = time.monotonic()
    for _ in range(50):
        waiting.make_room("a")
    assert 0.2 <= time.monotonic() - began < 5.0, "not 0.2 s for every message"
    assert warnings == ["a subscriber of a has acknowledged nothing for 0.2 s; it is not waited for and loses messages"]
    waiting.finish()
    assert len(warnings) == 1
    publisher.after = publisher.asked
    waiting.make_room("a")
    publisher.after = 1e9
    waiting.make_room("a")
    began = time.monotonic()
    waiting.make_room("a")
    assert time.monotonic() - began >= 0.2, "it is waited for again"


def test_a_stop_ends_the_wait() -> None:
    publisher = Publisher(QoSProfile(depth=1), after=1e9)
    waiting, warnings, stopped = acknowledgements(a=publisher)
    waiting.make_room("a")
    stopped.set()
    waiting.make_room("a")
    assert publisher.asked == 0
    waiting.finish()
    assert publisher.asked == 1 and not warnings, "asked once, not for as long as there is patience"
