"""The node that publishes a bag again."""

from __future__ import annotations

import difflib
import math
import sys
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from rclpy.duration import Duration
from rclpy.exceptions import InvalidTopicNameException
from rclpy.node import Node
from rclpy.publisher import Publisher
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from scene_description import SceneSynthError
from scene_description.strict import Limits
from scene_synth_ros.bags.bag_metadata import TopicInfo
from scene_synth_ros.bags.bag_reader import BagMessage, BagReader, BagReadError
from scene_synth_ros.messages.conversions import clock_to_msg
from scene_synth_ros.messages.message_definitions import MessageDefinitionError, message_class, message_definition
from scene_synth_ros.messages.stamps import NANOSECONDS
from scene_synth_ros.replay.player import Player
from scene_synth_ros.replay.replay_qos import replay_qos
from scene_synth_ros.suite.parameters import ParameterError, Parameters
from scene_synth_ros.suite.process import end_process, run_node
from scene_synth_ros.suite.suite_node import STEADY

CLOCK_TOPIC = "/clock"
ACK_TIMEOUT_S = 5.0
SETTLE_S = 0.2
"""A publisher counts a subscriber before that one has matched it in turn; what is published in between would be lost to it."""

_POLL_S = 0.02
_BAG_FIXED = "a bag is opened once"
_START_FIXED = "it is used at the start only"


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplayConfig:
    """Settings of the replay node."""

    bag: Annotated[str, Limits(max_length=4096, description="Folder of the bag, or its .mcap file", fixed=_BAG_FIXED)] = ""
    rate: Annotated[float, Limits(ge=0.001, le=1000.0, description="Speed, 2 is twice as fast as recorded")] = 1.0
    loop: Annotated[bool, Limits(description="Begin again at the end")] = False
    start_offset_s: Annotated[float, Limits(ge=0.0, le=1e9, unit="s", description="Skip the beginning", fixed=_START_FIXED)] = 0.0
    topics: Annotated[
        tuple[str, ...], Limits(max_length=1000, description="Publish only these topics; empty: all", fixed="publishers are made once")
    ] = ()
    clock_hz: Annotated[
        float,
        Limits(
            ge=0.0,
            le=1000.0,
            unit="Hz",
            description="Publish /clock at this rate by the wall clock, instead of what was recorded; 0: as recorded",
            fixed=_START_FIXED,
        ),
    ] = 0.0
    start_paused: Annotated[bool, Limits(description="Wait for the service ~/resume before the first message", fixed=_START_FIXED)] = False
    wait_for_subscribers_s: Annotated[
        float,
        Limits(ge=0.0, le=3600.0, unit="s", description="Wait at most this long until every topic has a subscriber", fixed=_START_FIXED),
    ] = 0.5


class ReplayNode(Node):  # type: ignore[misc]
    """Publishes the messages of a bag again, byte for byte, with the QoS they were recorded with, in the rhythm of their log times.

    Publications: the topics of the bag, or those of the parameter ``topics``.  A topic whose message type is not installed, or is installed
    with another definition, is left out with a warning.  Latched topics from before ``start_offset_s`` are published first.

    Services (std_srvs/Trigger): ``~/pause``, ``~/resume``, ``~/step`` (while paused: the messages of the next log time, that is one frame).
    Subscriptions: ``~/seek`` (std_msgs/Float64): go on at so many seconds from the beginning of the bag.

    Parameters: those of :class:`ReplayConfig`; ``rate`` and ``loop`` may change while it runs.

    An unfinished or damaged bag is played as far as it can be read, with a warning.  The process ends with code 0 when the bag has ended
    and reliable subscribers have acknowledged, or five seconds after; with 1 and one line on stderr if there is nothing to play.

    Raises:
        BagReadError: the bag cannot be read or holds nothing that can be published.
        ParameterError: a parameter does not fit, by itself or for this bag.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("replay_node", automatically_declare_parameters_from_overrides=True, **options)
        self.exit_code: int | None = None
        self._settings = Parameters(self, {"": ReplayConfig}, self._on_change)
        config: ReplayConfig = self._settings[""]
        if not config.bag:
            raise ParameterError("replay_node: parameter bag: expected the folder of a bag, got ''; set -p bag:=FOLDER")
        self._reader = BagReader(config.bag)
        topics = self._choose_topics(config)
        self._replayed: dict[str, Publisher] = {}
        for topic in topics:
            self._add_publisher(topic)
        if not self._replayed:
            raise BagReadError(f"{config.bag}: no topic can be published here")
        self._player = Player(
            self._reader,
            self._publish,
            topics=self._replayed.keys(),
            start_offset_ns=round(config.start_offset_s * NANOSECONDS),
            rate=config.rate,
            loop=config.loop,
            paused=config.start_paused,
        )
        self.create_service(Trigger, "~/pause", self._pause)
        self.create_service(Trigger, "~/resume", self._resume)
        self.create_service(Trigger, "~/step", self._step)
        self.create_subscription(Float64, "~/seek", self._seek, 10)
        if config.clock_hz:
            self._clock = self.create_publisher(Clock, CLOCK_TOPIC, 10)
            self.create_timer(1.0 / config.clock_hz, self._publish_clock, clock=STEADY)
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._run, name="replay", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop playing and close the bag."""
        self._stopped.set()
        self._player.stop()
        self._thread.join(timeout=0.5)
        if not self._thread.is_alive():
            self._reader.close()

    def _choose_topics(self, config: ReplayConfig) -> list[TopicInfo]:
        summary = self._reader.summary
        if summary.start_ns is None or summary.end_ns is None:
            raise BagReadError(f"{config.bag}: the bag holds no messages" + (f"; {summary.faults[0]}" if summary.faults else ""))
        duration_s = (summary.end_ns - summary.start_ns) / NANOSECONDS
        if config.start_offset_s > duration_s:
            got = f"expected at most the bag's {duration_s} s, got {config.start_offset_s}"
            raise ParameterError(f"replay_node: parameter start_offset_s: {got}")
        known = {topic.name: topic for topic in summary.topics}
        for name in config.topics:
            if name not in known:
                close = difflib.get_close_matches(name, known, n=1)
                hint = f"did you mean '{close[0]}'?" if close else f"it has {', '.join(sorted(known))}"
                raise ParameterError(f"replay_node: parameter topics: '{name}' is not in the bag; {hint}")
        if summary.faults:
            more = f" (and {len(summary.faults) - 1} more, see scene_synth inspect)" if len(summary.faults) > 1 else ""
            self.get_logger().warning(f"the bag is damaged, it is played as far as it can be read: {summary.faults[0]}{more}")
        chosen = [topic for topic in summary.topics if not config.topics or topic.name in config.topics]
        return [topic for topic in chosen if not (config.clock_hz and topic.name == CLOCK_TOPIC)]

    def _add_publisher(self, topic: TopicInfo) -> None:
        try:
            message_type = import_type(topic)
            self._replayed[topic.name] = self.create_publisher(message_type, topic.name, replay_qos(topic.qos))
        except (UnplayableError, InvalidTopicNameException) as error:
            self.get_logger().warning(f"topic {topic.name[:200]} is left out: {' '.join(str(error).split())}")

    def _publish(self, message: BagMessage) -> None:
        self._replayed[message.topic].publish(message.data)

    def _run(self) -> None:
        try:
            self._wait_for_subscribers(self._settings[""].wait_for_subscribers_s)
            config: ReplayConfig = self._settings[""]
            self.get_logger().info(f"replaying {config.bag}: {len(self._replayed)} topics at rate {config.rate:g}")
            self._player.run()
            if not self._stopped.is_set():
                self._wait_for_acknowledgements()
                self.get_logger().info(f"replayed {self._player.published} messages")
                self.exit_code = 0
        except Exception as error:  # whatever ends this thread must end the process
            if not self._stopped.is_set():
                self.get_logger().fatal(f"replay failed: {' '.join(str(error).split())}")
                self.exit_code = 1

    def _wait_for_subscribers(self, timeout_s: float) -> None:
        end_s = time.monotonic() + timeout_s
        while time.monotonic() < end_s and not all(publisher.get_subscription_count() for publisher in self._replayed.values()):
            if self._stopped.wait(_POLL_S):
                return
        if timeout_s > 0.0:
            self._stopped.wait(SETTLE_S)

    def _wait_for_acknowledgements(self) -> None:
        waiting = list(self._replayed.values())
        end_s = time.monotonic() + ACK_TIMEOUT_S
        while waiting and time.monotonic() < end_s and not self._stopped.is_set():
            waiting = [publisher for publisher in waiting if not publisher.wait_for_all_acked(Duration(seconds=_POLL_S))]
        if waiting and not self._stopped.is_set():
            self.get_logger().warning(f"subscribers of {len(waiting)} topics have not acknowledged everything in {ACK_TIMEOUT_S:g} s")

    def _on_change(self, _prefixes: set[str]) -> None:
        config: ReplayConfig = self._settings[""]
        self._player.set_rate(config.rate)
        self._player.set_loop(config.loop)

    def _pause(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._player.pause()
        response.success, response.message = True, f"paused at {self._player.position_s():.3f} s"
        return response

    def _resume(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success, response.message = True, f"going on at {self._player.position_s():.3f} s"
        self._player.resume()
        return response

    def _step(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success = self._player.paused
        if response.success:
            self._player.step()
        response.message = f"one step from {self._player.position_s():.3f} s" if response.success else "it plays; pause it first"
        return response

    def _seek(self, message: Float64) -> None:
        if math.isfinite(message.data):
            self.get_logger().info(f"going on at {self._player.seek(message.data):.3f} s")
        else:
            self.get_logger().warning(f"~/seek: expected seconds, got {message.data}")

    def _publish_clock(self) -> None:
        self._clock.publish(clock_to_msg(self._player.log_time_ns()))


class UnplayableError(SceneSynthError):
    """A topic that cannot be published here; one line."""


def import_type(topic: TopicInfo) -> Any:
    """Return the message class of a recorded topic.

    Raises:
        UnplayableError: the class is not installed or not the one that was recorded, or the messages are not CDR.
    """
    if topic.serialization_format != "cdr":
        raise UnplayableError(f"expected messages in cdr, got {topic.serialization_format[:40]!r}")
    try:
        definition = message_definition(topic.type_name)
    except MessageDefinitionError as error:
        raise UnplayableError(str(error)) from None
    if topic.type_hash and definition.type_hash and topic.type_hash != definition.type_hash:
        raise UnplayableError(f"type {topic.type_name} was recorded with another definition than the installed one")
    try:
        return message_class(topic.type_name)
    except (ImportError, AttributeError):
        debian_name = f"ros-jazzy-{topic.type_name.partition('/')[0].replace('_', '-')}"
        raise UnplayableError(f"type {topic.type_name} is not installed; install the package {debian_name}") from None


def main(args: Sequence[str] | None = None) -> None:
    """Run the node as a process; see :class:`ReplayNode`."""

    def make() -> ReplayNode:
        try:
            return ReplayNode()
        except BagReadError as error:
            sys.stderr.write(f"{error}\n")
            end_process(1)
            raise

    run_node(make, None if args is None else list(args))


if __name__ == "__main__":
    main()
