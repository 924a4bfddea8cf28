"""The node that publishes a bag again."""

import math
import sys
from collections.abc import Sequence
from typing import Any

from rclpy.exceptions import InvalidTopicNameException
from rclpy.node import Node
from rclpy.publisher import Publisher
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Float64

from scene_description import SceneSynthError, error_line
from scene_synth_ros.bags.bag_metadata import TopicInfo
from scene_synth_ros.bags.bag_reader import BagReader, BagReadError
from scene_synth_ros.messages.conversions import clock_to_msg
from scene_synth_ros.replay.playable_topics import CLOCK_TOPIC, UnplayableError, chosen_topics, import_type, replay_qos
from scene_synth_ros.replay.playback import Playback
from scene_synth_ros.replay.replay_config import ReplayConfig
from scene_synth_ros.suite.parameters import ParameterError, Parameters
from scene_synth_ros.suite.process import end_process, run_node
from scene_synth_ros.suite.suite_node import REFUSALS, STEADY, serve_trigger


class ReplayNode(Node):  # type: ignore[misc]
    """Publishes the messages of a bag again, byte for byte, with the QoS they were recorded with, in the rhythm of their log times.

    Threading: callbacks run in the executor's thread; :class:`Playback` owns the thread that publishes.  ``_look_at_end`` notices its end.

    Publications: the topics of the bag, or those of the parameter ``topics``.  A topic whose message type is not installed, or is installed
    with another definition, is left out with a warning.  Latched topics from before ``start_offset_s`` are published first.

    Reliable subscribers lose nothing between the two processes: before a message would overwrite one in the publisher's history that they
    have not acknowledged, the replay waits, for ten seconds at most.

    Services (std_srvs/Trigger): ``~/pause``, ``~/resume``, ``~/step`` (while paused: the messages of the next log time, that is one frame).
    Subscriptions: ``~/seek`` (std_msgs/Float64): go on at so many seconds from the beginning of the bag.

    Parameters: those of :class:`ReplayConfig`; ``rate`` and ``loop`` may change while it runs.

    An unfinished or damaged bag is played as far as it can be read, with a warning.  The process ends with code 0 when the bag has ended
    and reliable subscribers have acknowledged, or ten seconds after; with 1 and one line on stderr if there is nothing to play.

    Raises:
        BagReadError: the bag cannot be read or holds nothing that can be published.
        ParameterError: a parameter does not fit, by itself or for this bag.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("replay_node", **options)
        self.exit_code: int | None = None
        self._settings = Parameters(self, {"": ReplayConfig}, self._on_change)
        config: ReplayConfig = self._settings[""]
        if not config.bag:
            raise ParameterError("replay_node: parameter bag: expected the folder of a bag, got ''; set -p bag:=FOLDER")
        self._reader = BagReader(config.bag)
        topics = chosen_topics(self._reader.summary, config)
        self._warn_of_damage()
        publishers = {topic.name: publisher for topic in topics if (publisher := self._make_publisher(topic)) is not None}
        if not publishers:
            raise BagReadError(f"{config.bag}: no topic can be published here")
        self._playback = Playback(self._reader, publishers, lambda: self._settings[""], self.get_logger())
        self._player = self._playback.player
        for name, work in {"pause": self._pause, "resume": self._resume, "step": self._step}.items():
            serve_trigger(self, name, work)
        self.create_subscription(Float64, "~/seek", self._seek, 10)
        if config.clock_hz:
            self._clock_publisher = self.create_publisher(Clock, CLOCK_TOPIC, 10)
            self.create_timer(1.0 / config.clock_hz, self._publish_clock, clock=STEADY)
        self.create_timer(0.05, self._look_at_end, clock=STEADY)

    def close(self) -> None:
        """Stop playing and close the bag."""
        if self._playback.stop():
            self._reader.close()

    def _warn_of_damage(self) -> None:
        faults = self._reader.summary.faults
        if faults:
            more = f" (and {len(faults) - 1} more, see scene_synth inspect)" if len(faults) > 1 else ""
            self.get_logger().warning(f"the bag is damaged, it is played as far as it can be read: {faults[0]}{more}")

    def _make_publisher(self, topic: TopicInfo) -> Publisher | None:
        try:
            return self.create_publisher(import_type(topic), topic.name, replay_qos(topic.qos))
        except (UnplayableError, InvalidTopicNameException) as error:
            self.get_logger().warning(f"topic {topic.name[:200]} is left out: {' '.join(str(error).split())}")
            return None

    def _look_at_end(self) -> None:
        """End the process when playing has ended; a fault of the program goes on to whoever spins the node, and is told there."""
        if not self._playback.ended.done():
            return
        error = self._playback.ended.exception()
        if error is None:
            self.exit_code = 0
        elif isinstance(error, REFUSALS):
            self.get_logger().fatal(f"replay failed: {error_line(error)}")
            self.exit_code = 1
        else:
            raise error

    def _on_change(self, _prefixes: set[str]) -> None:
        config: ReplayConfig = self._settings[""]
        self._player.set_rate(config.rate)
        self._player.set_loop(config.loop)

    def _pause(self) -> str:
        self._player.pause()
        return f"paused at {self._player.position_s():.3f} s"

    def _resume(self) -> str:
        going_on = f"going on at {self._player.position_s():.3f} s"
        self._player.resume()
        return going_on

    def _step(self) -> str:
        if not self._player.paused:
            raise SceneSynthError("it plays; pause it first")
        self._player.step()
        return f"one step from {self._player.position_s():.3f} s"

    def _seek(self, message: Float64) -> None:
        if math.isfinite(message.data):
            self.get_logger().info(f"going on at {self._player.seek(message.data):.3f} s")
        else:
            self.get_logger().warning(f"~/seek: expected seconds, got {message.data}")

    def _publish_clock(self) -> None:
        """Publish the log time that is reached, once it has begun to pass."""
        if not self._player.has_begun:
            return
        self._clock_publisher.publish(clock_to_msg(self._player.log_time_ns()))


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
