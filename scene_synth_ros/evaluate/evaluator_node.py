"""The node that judges an algorithm while it runs."""

import json
import shlex
from collections import Counter
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from rclpy.qos import QoSReliabilityPolicy
from std_msgs.msg import String
from std_srvs.srv import Trigger

from evaluation.evaluation_file import write_evaluation
from evaluation.summary import NYU40_NAMES, make_evaluation
from scene_description import SceneSynthError, error_line
from scene_description.yaml_text import flow_yaml
from scene_synth_ros.evaluate.errors import EvaluateError
from scene_synth_ros.evaluate.evaluator_config import LIVE_TYPES, EvaluatorConfig, check_tasks, estimate_names, truth_names
from scene_synth_ros.evaluate.live_scores import LiveScores
from scene_synth_ros.evaluate.live_truth import LiveTruth
from scene_synth_ros.evaluate.stamp_buffer import Gathered, MeasuringThread, StampBuffer
from scene_synth_ros.evaluate.topics import TypedTopic
from scene_synth_ros.messages.message_definitions import message_class
from scene_synth_ros.messages.stamps import stamp_ns
from scene_synth_ros.suite.diagnostics import OK, WARN, Diagnostics, Report
from scene_synth_ros.suite.heap import trim_heap
from scene_synth_ros.suite.parameters import Parameters, parameter_values
from scene_synth_ros.suite.process import run_node
from scene_synth_ros.suite.qos import PROFILES, latched_qos
from scene_synth_ros.suite.suite_node import SuiteNode

_SEED = 0
_END_S = 30.0
"""How long the end of a life waits for what is still to be measured."""


class EvaluatorNode(SuiteNode):
    """Pairs truth and estimates at equal stamps and measures them.

    Threads: callbacks run in the thread of the executor and do no more than gather messages by stamps; what is gathered is measured in the
    thread of :class:`MeasuringThread`, made in ``open`` and ended in ``close``.

    Subscribes: the truth's topics of the parameter ``tasks``, the topics of estimates, each as soon as it has a publisher, and ``scene``,
    which says what room a frame shows; what tells the truth's camera, classes and run (:class:`LiveTruth`).
    Publishes: ``evaluation`` (std_msgs/String, JSON, latched, once a second while frames come): frames and running scores by task, and what
    was dropped and why; ``/diagnostics``: the same numbers.
    Services (std_srvs/Trigger): ``~/write`` writes the results so far to the file of the parameter ``out``, as the end of the node does.
    Parameters: the fields of :class:`EvaluatorConfig`.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("evaluator_node", **options)
        self._settings = Parameters(self, {"": EvaluatorConfig}, check=lambda values: check_tasks(values[""]))
        self._closed = True
        self.arrivals = 0
        """How many messages have come."""
        self.begin(self._settings[""].autostart)

    def open(self) -> None:
        """Make subscriptions, publishers and the thread that measures."""
        config: EvaluatorConfig = self._settings[""]
        truth = truth_names(config, self.resolve_topic_name)
        self._estimate_names = estimate_names(config, self.resolve_topic_name)
        names = {*(topic.name for topic in truth.values()), *self._estimate_names.values()}
        self._buffer = StampBuffer[bytes](names, config.window)
        self._scores = LiveScores(config.tasks, truth, config.kept)
        self._truth = LiveTruth(self, truth, self.resolve_topic_name(config.camera))
        self._subscribed: set[str] = set()
        self._dropped, self._told = Counter[str](), ""
        self._running = self._scores.scores()
        with ExitStack() as undo:
            self._measuring = MeasuringThread[Gathered[bytes]](self._scores.measure, self._tell_fault, config.queue)
            undo.callback(self._measuring.close, 1.0)
            self._publisher = self.create_publisher(String, "evaluation", latched_qos())
            self._diagnostics = Diagnostics(self, self._report)
            self.create_subscription(String, "scene", self._on_scene, latched_qos(10), raw=True)
            self.create_service(Trigger, "~/write", self._on_write)
            for topic in truth.values():
                self._subscribe(topic)
            self._look()
            self.create_timer(0.2, self._look)
            self.create_timer(0.5, self._truth.step)
            self.create_timer(1.0, self._publish)
            self.create_timer(1.0, trim_heap)
            undo.pop_all()
        self._closed = False

    def close(self) -> None:
        """Measure what has come, write the results and end the thread; harmless when repeated."""
        if self._closed:
            return
        self._closed = True
        for gathered in self._buffer.finish():
            self._offer(gathered)
        if not self._measuring.close(_END_S):
            self.get_logger().error(f"{self._measuring.waiting} frames are left out: they were not measured within {_END_S:g} s")
        try:
            self.get_logger().info(self._write())
        except (SceneSynthError, OSError) as error:
            self.get_logger().error(error_line(error))
            self.exit_code = 1

    def _look(self) -> None:
        """Subscribe to estimates that have a publisher now, whose type says how they are read."""
        types = dict(self.get_topic_names_and_types())
        for task, name in self._estimate_names.items():
            kind = next(iter(types.get(name, ())), "") if self.count_publishers(name) else ""
            topic = TypedTopic(name, kind)
            if kind and kind not in LIVE_TYPES[task]:
                self.refuse(f"{name}: expected {' or '.join(LIVE_TYPES[task])} as estimates of {task}, got {kind}; publish that type")
            elif kind:
                self._scores.add_estimates(task, topic)
                try:
                    self._subscribe(topic)
                except EvaluateError as error:
                    self.refuse(str(error))

    def _subscribe(self, topic: TypedTopic) -> None:
        """Subscribe once, with a reliability that every publisher of now offers.

        Raises:
            EvaluateError: the package of the message's type is not installed.
        """
        if topic.name in self._subscribed:
            return
        try:
            message_type = message_class(topic.type_name)
        except (ImportError, AttributeError):
            package = topic.type_name.partition("/")[0]
            raise EvaluateError(f"{topic.name}: expected {topic.type_name}, got no package {package}; install it, or judge a bag") from None
        self._subscribed.add(topic.name)
        offered = self.get_publishers_info_by_topic(topic.name)
        unsure = any(info.qos_profile.reliability == QoSReliabilityPolicy.BEST_EFFORT for info in offered)
        qos = PROFILES["sensor_data" if unsure else "reliable"]
        self.create_subscription(message_type, topic.name, partial(self._on_message, topic), qos, raw=True)

    def _on_message(self, topic: TypedTopic, data: bytes) -> None:
        if not self.active:
            return
        self.arrivals += 1
        stamp = stamp_ns(topic.type_name, data)
        if stamp is None:
            self._dropped["unstamped"] += 1
            return
        gathered = self._buffer.add(topic.name, stamp, data)
        if gathered is not None:
            self._offer(gathered)

    def _offer(self, gathered: Gathered[bytes]) -> None:
        if not self._measuring.offer(gathered):
            self._dropped["too_fast"] += 1
            self.warn(
                f"measuring has fallen behind: {self._dropped['too_fast']} frames were dropped; judge fewer tasks, or a slower stream"
            )

    def _on_scene(self, data: bytes) -> None:
        self._scores.add_room(data, self.get_clock().now().nanoseconds)

    def _on_write(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        try:
            response.message, response.success = self._write(), True
        except (SceneSynthError, OSError) as error:
            response.message = error_line(error)
        return response

    def _write(self) -> str:
        """Write the results; return what was done, in words."""
        config: EvaluatorConfig = self._settings[""]
        frames = self._scores.frames()
        for line in self._scores.notes():
            self.get_logger().warning(line)
        if not config.out or not frames:
            return (
                "nothing was measured; no results are written" if config.out else f"{len(frames)} results; out is empty, no file is written"
            )
        foreign = sum(counts["foreign"] for counts in self._scores.counts().values())
        evaluation = make_evaluation(
            frames,
            title=config.title,
            algorithm=config.algorithm or ", ".join(sorted(set(self._estimate_names.values()))),
            created_with=self._command(config),
            seed=_SEED,
            missing={name.replace("_", " "): count for name, count in (self._drops() | {"foreign": foreign}).items() if count},
            class_names=self._truth.class_names or NYU40_NAMES,
        )
        write_evaluation(Path(config.out), replace(evaluation, truth=self._truth.record()))
        return f"{config.out}: {len(frames)} results"

    def _command(self, config: EvaluatorConfig) -> str:
        """Return the command that judges the same while the same is published: the parameters that are not at their defaults."""
        default = parameter_values({"": EvaluatorConfig()})
        given = {name: value for name, value in parameter_values({"": config}).items() if value != default[name]}
        words = [word for name, value in given.items() for word in ("-p", f"{name}:={flow_yaml(value)}")]
        namespace = ["-r", f"__ns:={self.get_namespace()}"] if self.get_namespace() != "/" else []
        ros_arguments = ["--ros-args"] if words or namespace else []
        return shlex.join(["ros2", "run", "scene_synth_ros", "evaluator_node", *ros_arguments, *namespace, *words])

    def _drops(self) -> dict[str, int]:
        """Return why messages or frames were left out -> how many."""
        return {name: self._dropped[name] + self._buffer.counts[name] for name in ("late", "repeated", "unstamped", "too_fast")}

    def _publish(self) -> None:
        """Publish the running scores, if there is anything new."""
        if not self.active:
            return
        counts, room = self._scores.counts(), self._scores.room()
        self._running = self._scores.scores()
        tasks = {task: {**counts[task], "metrics": self._running[task]} for task in counts}
        told = {"room": {"index": room.index, "room_type": room.room_type, "seed": room.seed}, "tasks": tasks, "dropped": self._drops()}
        text = json.dumps(told)
        if text != self._told:
            self._told = text
            self._publisher.publish(String(data=text))

    def _report(self) -> Report:
        counts, drops = self._scores.counts(), self._drops()
        values: dict[str, object] = {f"dropped_{name}": count for name, count in drops.items()}
        values |= {"waiting_stamps": self._buffer.waiting, "waiting_frames": self._measuring.waiting}
        for task, found in counts.items():
            values |= {f"{task}.{name}": count for name, count in found.items()}
            values |= {f"{task}.{name}": "" if value is None else f"{value:.6g}" for name, value in self._running[task].items()}
        notes = self._scores.notes()
        warning = self.last_warning(10.0) or (notes[-1] if notes else "")
        return (WARN, warning, values) if warning else (OK, "judging", values)

    def _tell_fault(self, error: Exception) -> str:
        return self.faults.tell(error, f"{self.get_name()} measured a frame")


def main(args: list[str] | None = None) -> None:
    """Run the evaluator node."""
    run_node(EvaluatorNode, args)


if __name__ == "__main__":
    main()
