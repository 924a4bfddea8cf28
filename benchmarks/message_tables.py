"""Speed tables of messages: streams and bags of 640x480 frames, and the start of the suite to its first image."""

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median

import numpy as np
import rclpy
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message
from sample_scene import sample_scene
from sensor_msgs.msg import Image
from std_msgs.msg import String

from benchmarks.generate_runs import write_bare
from benchmarks.renderer_tables import VIEW, furnished_room
from benchmarks.table import Row, at_least, at_most
from renderer import LAYERS, CameraConfig, RenderConfig, Renderer
from renderer.film.frame import Frame
from scene_description import CameraPose
from scene_synth_ros.bags.bag_inspect import inspect_bag
from scene_synth_ros.bags.bag_reader import BagMessage
from scene_synth_ros.bags.bag_writer import BagWriter
from scene_synth_ros.messages.conversions import image_to_msg, layer_encoding
from scene_synth_ros.messages.frame_messages import StreamConfig
from scene_synth_ros.messages.stamps import stamp_ns
from scene_synth_ros.record.recording import Recording
from scene_synth_ros.record.topic_inputs import QUEUE_DEPTH
from scene_synth_ros.render.streams import StreamPublishers
from scene_synth_ros.suite.process import init_ros
from scene_synth_ros.suite.qos import latched_qos, stream_qos
from scene_synth_ros.suite.status import NodeStatus, status_from_json, status_to_json

STREAMED = ("color", "depth", "normals", "semantic", "instance")
"""The layers that a renderer publishes by default."""
FRAMES, RECORDED_FRAMES = 300, 150
RATE_HZ, PERIOD_NS = 30.0, 33_333_333
SAMPLES = 4
FRAMES_AHEAD = 8
"""As a renderer's default: so many frames may wait for the recorder."""
DISCOVERY_S = 1.0
"""A publisher may know a subscriber before the subscriber knows it; what it sends then is not waited for."""


def measure_stream() -> list[Row]:
    """Publish to a subscriber, then to a recorder, each in another process; return what it cost, how long it took and what was lost."""
    os.environ["ROS_DOMAIN_ID"] = str(1 + os.getpid() % 100)
    surroundings = dict(os.environ)
    init_ros([])
    node = Node("stream_bench", namespace="/bench")
    streams = StreamPublishers(node, StreamConfig(color_companions=False, lazy=False), CameraConfig())
    streams.messages.begin_room(sample_scene())
    frame = make_frame()
    recorded = _recorded(node, streams, frame)  # before any frame is latched that the recorder would wait to see whole
    rows = [*_subscribed(node, streams, frame, surroundings), *recorded]
    node.destroy_node()
    rclpy.shutdown()
    return rows


def make_frame() -> Frame:
    """Return a frame of the furnished room with the noise that colour of few samples has."""
    config = RenderConfig(samples_per_pixel=SAMPLES, auto_exposure=False)
    with Renderer(furnished_room(), CameraConfig(), config, scene_key=1) as renderer:
        return renderer.render(VIEW, 0, STREAMED)


def _subscribed(node: Node, streams: StreamPublishers, frame: Frame, surroundings: dict[str, str]) -> list[Row]:
    """Publish to an ordinary subscriber, which knows nothing of the transport that the nodes choose."""
    command = [sys.executable, "-c", f"from benchmarks.message_tables import listen; listen({FRAMES})"]
    subscriber = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=surroundings)
    while not all(node.count_subscribers(f"/bench/camera/{layer}/image_raw") for layer in STREAMED):
        time.sleep(0.05)
    time.sleep(DISCOVERY_S)
    sent_ns, spent_s = _publish(streams, frame, FRAMES)
    output, _ = subscriber.communicate(timeout=60)
    arrivals = json.loads(output)
    complete_ns: dict[int, int] = {}
    for stamp, at_ns in arrivals:
        complete_ns[stamp] = max(at_ns, complete_ns.get(stamp, 0))
    late_ms = np.array([(complete_ns[stamp] - at_ns) / 1e6 for stamp, at_ns in sent_ns.items() if stamp in complete_ns])
    return [
        at_most("convert and publish 5 layers, 640x480, processor time a frame", 1000.0 * spent_s / FRAMES, "ms", 15.0),
        at_most(f"images lost of {FRAMES * len(STREAMED)} at 30 Hz to another process", FRAMES * len(STREAMED) - len(arrivals), "", 0.0),
        Row("last ray to the last of 5 callbacks, median", float(np.median(late_ms)), "ms"),
        Row("  99 of 100 frames within", float(np.percentile(late_ms, 99)), "ms"),
    ]


def listen(frames: int) -> None:
    """Subscribe as the recorder does, until everything is there or nothing has come for five seconds.

    Prints [stamp, steady clock] of each image (ns) as JSON.
    """
    expected = frames * len(STREAMED)
    arrivals: list[tuple[int | None, int]] = []
    last = time.monotonic() + 10.0

    def take(data: bytes) -> None:
        nonlocal last
        arrivals.append((stamp_ns("sensor_msgs/msg/Image", data), time.monotonic_ns()))
        last = time.monotonic()

    rclpy.init()
    node = Node("stream_subscriber", namespace="/bench")
    for layer in STREAMED:
        node.create_subscription(Image, f"camera/{layer}/image_raw", take, stream_qos(QUEUE_DEPTH), raw=True)
    while len(arrivals) < expected and time.monotonic() - last < 5.0:
        rclpy.spin_once(node, timeout_sec=0.2)
    print(json.dumps(arrivals))


def _recorded(node: Node, streams: StreamPublishers, frame: Frame) -> list[Row]:
    """Publish to the recorder, which like a renderer's is never more than some frames behind."""
    with tempfile.TemporaryDirectory() as folder:
        bag = Path(folder) / "bag"
        command = [sys.executable, "-m", "scene_synth_ros.record.recorder_node", "--ros-args", "-r", "__ns:=/bench", "-p", f"bag:={bag}"]
        recorder = subprocess.Popen([*command, "--log-level", "warn"])
        link = _RecorderLink(node, streams)
        link.connect()
        before_s = _processor_seconds(recorder.pid)
        _publish(streams, frame, RECORDED_FRAMES, link.wait_for)
        link.wait_for(RECORDED_FRAMES + FRAMES_AHEAD)
        spent_s = _processor_seconds(recorder.pid) - before_s
        recorder.send_signal(signal.SIGINT)
        recorder.wait(60)
        counts = {topic.name: topic.count for topic in inspect_bag(bag).topics}
    recorded = min(counts[f"/bench/camera/{layer}/image_raw"] for layer in STREAMED)
    return [
        Row("recorder, zstd, 5 layers at 30 Hz, processor time a frame", 1000.0 * spent_s / RECORDED_FRAMES, "ms"),
        at_least(f"frames in the bag of {RECORDED_FRAMES}", recorded, "", RECORDED_FRAMES),
    ]


class _RecorderLink:
    """Says what was published, as a renderer does, and hears what the recorder has taken."""

    def __init__(self, node: Node, streams: StreamPublishers) -> None:
        self._node, self._streams = node, streams
        self._recorders: list[NodeStatus] = []
        self._status = node.create_publisher(String, "status", latched_qos(10))
        node.create_subscription(String, "status", self._hear, latched_qos(100))

    def connect(self) -> None:
        """Wait until every topic is connected, seen from both sides."""
        counts, start = dict(self._streams.counts), self._streams.start
        state = NodeStatus(node="/bench/stream_bench", role="renderer", state="ready", counts=counts, start=start)
        self._status.publish(String(data=status_to_json(state)))
        self._spin_while(lambda: not (self._recorders and self._streams.reach(self._recorders, start)))

    def _hear(self, message: String) -> None:
        status = status_from_json(message.data)
        if status.role == "recorder":
            self._recorders = [status]

    def wait_for(self, index: int) -> None:
        """Wait until the frame of this index may be published because so few wait before it, a minute at most."""
        self._spin_while(lambda: self._taken() <= index - FRAMES_AHEAD - 1)

    def _taken(self) -> int:
        counts = self._recorders[0].counts
        return min(counts.get(f"/bench/camera/{layer}/image_raw", 0) for layer in STREAMED)

    def _spin_while(self, condition: Callable[[], bool]) -> None:
        deadline = time.monotonic() + 60.0
        while condition():
            if time.monotonic() > deadline:
                raise TimeoutError("the recorder has not moved for a minute")
            rclpy.spin_once(self._node, timeout_sec=0.1)


def _publish(
    streams: StreamPublishers, frame: Frame, count: int, wait_for: Callable[[int], None] = lambda _: None
) -> tuple[dict[int, int], float]:
    """Publish so many frames at the rate; return when each was begun (steady clock, ns) by stamp, and the processor time (s) of all."""
    sent_ns, spent_s = {}, 0.0
    began, first_ns = time.perf_counter(), time.monotonic_ns()
    for index in range(count):
        wait_for(index)
        time.sleep(max(0.0, began + index / RATE_HZ - time.perf_counter()))
        pose = CameraPose(stamp_ns=first_ns + index * PERIOD_NS, position_m=(0.0, 0.0, 1.0), orientation=(0.0, 0.0, 0.0, 1.0))
        before, sent_ns[pose.stamp_ns] = time.process_time(), time.monotonic_ns()
        streams.publish(frame, pose, json.dumps({"stamp_ns": pose.stamp_ns}))
        spent_s += time.process_time() - before
    return sent_ns, spent_s


def _processor_seconds(pid: int) -> float:
    """Return the processor time that a process has used so far."""
    fields = (Path("/proc") / str(pid) / "stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


BAG_FRAMES, ROUNDS = 40, 5
TYPE = "sensor_msgs/msg/Image"


def measure_bag() -> list[Row]:
    """Write frames of five layers both ways, in turns; medians of rounds are taken."""
    frame = make_frame()
    messages = [
        BagMessage(
            f"/{name}", TYPE, stamp, stamp, bytes(serialize_message(image_to_msg(image, layer_encoding(LAYERS[name]), stamp, "eye")))
        )
        for stamp in range(1, BAG_FRAMES * PERIOD_NS, PERIOD_NS)
        for name, image in frame.layers.items()
    ]
    size_mb = sum(len(message.data) for message in messages) / BAG_FRAMES / 1e6
    ours, bare = [], []
    for _ in range(ROUNDS):
        ours.append(_timed(_record, messages))
        bare.append(_timed(write_bare, messages))
    return [
        Row(
            f"recorder, 5 layers ({size_mb:.1f} MB a frame), zstd, synced", BAG_FRAMES / median(seconds for seconds, _ in ours), "frames/s"
        ),
        Row("  processor time of a frame", 1000.0 * median(spent for _, spent in ours) / BAG_FRAMES, "ms"),
        Row("bare mcap writer, the same messages, zstd", BAG_FRAMES / median(seconds for seconds, _ in bare), "frames/s"),
        Row("  processor time of a frame", 1000.0 * median(spent for _, spent in bare) / BAG_FRAMES, "ms"),
        at_least("recorder over bare mcap writer", median(b / a for (a, _), (b, _) in zip(ours, bare, strict=True)), "", 0.8),
    ]


def _timed(write: Callable[[Path, list[BagMessage]], None], messages: list[BagMessage]) -> tuple[float, float]:
    """Return elapsed and processor seconds until everything is on disk."""
    with tempfile.TemporaryDirectory() as folder:
        cpu, began = time.process_time(), time.perf_counter()
        write(Path(folder) / "bag", messages)
        return time.perf_counter() - began, time.process_time() - cpu


def _record(path: Path, messages: list[BagMessage]) -> None:
    """Do what the recorder does with messages that arrive: sort, sum up, compress, index, sync every chunk."""
    recording, topics = Recording(BagWriter), {message.topic for message in messages}
    for topic in topics:
        recording.add_topic(topic, TYPE, [QoSProfile(depth=10)])
    recording.expect(topics, {})
    recording.begin(path)
    for message in messages:
        recording.add(message.topic, message.data)
    recording.close()


TIMEOUT_S = 120.0


def measure_start() -> list[Row]:
    """Run the suite with an empty cache of kernels and twice with that of this folder, and return how long each took to its first image."""
    os.environ["ROS_DOMAIN_ID"] = str(1 + (os.getpid() + 50) % 100)
    with tempfile.TemporaryDirectory() as empty:
        cold = _seconds_to_first_image({"NUMBA_CACHE_DIR": empty})
    _seconds_to_first_image({})
    warm = _seconds_to_first_image({})
    return [
        at_most("first 640x480 image after run, warm kernel cache", warm, "s", 10.0),
        at_most("later with no kernel compiled", cold - warm, "s", 30.0),
    ]


def _seconds_to_first_image(surroundings: dict[str, str]) -> float:
    images: list[Image] = []
    rclpy.init()
    node = Node("start_bench", namespace="/synth")
    node.create_subscription(Image, "camera/color/image_raw", images.append, stream_qos())
    began = time.perf_counter()
    words = [sys.executable, "-m", "scene_synth_ros", "run", "--frames", "100", "--log-level", "warn"]
    process = subprocess.Popen(words, env=os.environ | surroundings)
    try:
        while not images and time.perf_counter() - began < TIMEOUT_S:
            rclpy.spin_once(node, timeout_sec=0.1)
        return time.perf_counter() - began
    finally:
        process.terminate()
        process.wait()
        node.destroy_node()
        rclpy.shutdown()
