"""The replay node as a process over DDS."""

import hashlib
import os
import signal
import sys

import pytest
from bag_samples import START_NS, write_bag
from scene_synth_ros_suite import Child, claim_domain, without

LISTENER = """
import hashlib, sys, time
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSDurabilityPolicy, QoSProfile
from rclpy.node import Node
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import String
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage

wanted = int(sys.argv[1])
topics = {
    "/synth/scene": (String, True), "/synth/camera/semantic/labels": (String, True), "/tf_static": (TFMessage, True),
    "/synth/camera/color/image_raw": (Image, False), "/synth/camera/color/camera_info": (CameraInfo, False),
    "/synth/camera/depth/image_raw": (Image, False), "/synth/camera/depth/camera_info": (CameraInfo, False),
}
rclpy.init()
node = Node("listener")
executor = SingleThreadedExecutor()
executor.add_node(node)
received, subscriptions = [], []
for name, (kind, latched) in topics.items():
    qos = QoSProfile(depth=100, durability=QoSDurabilityPolicy.TRANSIENT_LOCAL if latched else QoSDurabilityPolicy.VOLATILE)
    listen = lambda data, name=name: received.append((name, hashlib.sha256(data + bytes(-len(data) % 4)).hexdigest()))
    subscriptions.append(node.create_subscription(kind, name, listen, qos, raw=True))
resume = node.create_client(Trigger, "/replay_node/resume")
end = time.monotonic() + 30
while not (resume.service_is_ready() and all(s.get_publisher_count() for s in subscriptions)) and time.monotonic() < end:
    executor.spin_once(timeout_sec=0.05)
resume.call_async(Trigger.Request())
while len(received) < wanted and time.monotonic() < end:
    executor.spin_once(timeout_sec=0.1)
for name, digest in received:
    print(name, digest)
"""

CLIENT = """
import sys, time
import rclpy
from rcl_interfaces.srv import SetParameters
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_srvs.srv import Trigger

rclpy.init()
node = Node("client")

def call(kind, name, request):
    client = node.create_client(kind, name)
    if not client.wait_for_service(10):
        sys.exit(f"no service {name}")
    future = client.call_async(request)
    rclpy.spin_until_future_complete(node, future, timeout_sec=10)
    return future.result()

for service in ("pause", "resume"):
    answer = call(Trigger, f"/replay_node/{service}", Trigger.Request())
    print(answer.success, answer.message.split(" at ")[0])
changes = [("rate", 3.0), ("loop", False), ("rate", -1.0), ("bag", "other")]
request = SetParameters.Request(parameters=[Parameter(name, value=value).to_parameter_msg() for name, value in changes])
for result in call(SetParameters, "/replay_node/set_parameters", request).results:
    print(result.successful, result.reason)
"""


@pytest.fixture(scope="module")
def environment():
    return {**os.environ, "ROS_DOMAIN_ID": str(claim_domain())}


def start(environment, *words):
    return Child([sys.executable, *words], env=environment)


def replay(environment, bag, *settings):
    words = [word for setting in (f"bag:={bag}", *settings) for word in ("-p", setting)]
    return start(environment, "-m", "scene_synth_ros.replay.replay_node", "--ros-args", *words)


def finish(process, timeout=180):
    try:
        output, errors = process.communicate(timeout=timeout)
    finally:
        process.kill()
    assert "Traceback" not in errors
    return process.returncode, output, errors


def digest(data):
    """Hash a message with the padding to a multiple of four that RTPS adds on its way (DDS-RTPS 2.5, section 10.2.1.2)."""
    return hashlib.sha256(data + bytes(-len(data) % 4)).hexdigest()


def test_a_subscriber_receives_every_byte(tmp_path, environment):
    written = write_bag(tmp_path / "bag", frames=10, size=200)
    sent = [(topic, digest(data)) for topic, _, data in written]
    listener = start(environment, "-c", LISTENER, str(len(sent)))
    player = replay(environment, tmp_path / "bag", "rate:=4.0", "wait_for_subscribers_s:=10.0", "start_paused:=true")
    _, output, _ = finish(listener)
    code, _, errors = finish(player)
    received = [tuple(line.split()) for line in output.split("\n") if line]
    for topic in {topic for topic, _ in sent}:
        assert [digest for name, digest in received if name == topic] == [digest for name, digest in sent if name == topic]
    assert code == 0
    assert "WARN" not in errors and f"replayed {len(sent)} messages" in errors


def test_a_reliable_subscriber_receives_every_image_however_fast_they_are_played(tmp_path, environment):
    written = write_bag(tmp_path / "bag", frames=60, size=400)
    listener = start(environment, "-c", LISTENER, str(len(written)))
    player = replay(environment, tmp_path / "bag", "rate:=1000.0", "wait_for_subscribers_s:=10.0", "start_paused:=true")
    _, output, _ = finish(listener)
    code, _, errors = finish(player)
    received = {name: sum(line.startswith(f"{name} ") for line in output.split("\n")) for name in {topic for topic, _, _ in written}}
    assert received == {name: sum(topic == name for topic, _, _ in written) for name in received}
    assert code == 0 and "WARN" not in errors


def test_a_topic_whose_type_is_not_installed_is_left_out(tmp_path, environment):
    written = write_bag(tmp_path / "bag", frames=2)
    code, _, errors = finish(replay(environment | without("tf2_msgs", tmp_path), tmp_path / "bag", "rate:=20.0"))
    assert code == 0
    assert "topic /tf_static is left out: type tf2_msgs/msg/TFMessage is not installed; install the package ros-jazzy-tf2-msgs" in errors
    assert errors.count("WARN") == 1 and f"replayed {len(written) - 1} messages" in errors


def test_services_parameters_and_signals(tmp_path, environment):
    write_bag(tmp_path / "bag", frames=3)
    process = replay(environment, tmp_path / "bag", "loop:=true")
    code, output, errors = finish(start(environment, "-c", CLIENT))
    assert code == 0, errors
    assert output.split("\n")[:-1] == [
        "True paused",
        "True going on",
        "True ",
        "True ",
        "False Parameter rate out of range Min: 0.001, Max: 1000.0, value: -1.0",
        "False bag cannot change in a running node: a bag is opened once; restart it",
    ]
    process.send_signal(signal.SIGINT)
    assert finish(process)[0] in (0, 130)


@pytest.mark.parametrize(
    ("settings", "code", "line"),
    [
        ([], 1, "{bag}: not found; give the folder of a bag or an .mcap file"),
        (["bag:=''"], 2, "replay_node: parameter bag: expected the folder of a bag, got ''; set -p bag:=FOLDER"),
        (["bag:={whole}", "rate:=0.0"], 2, "replay_node: parameter rate: expected a number in [0.001, 1000.0], got 0.0"),
        (["bag:={whole}", "topics:=['/synth/scen']"], 2, "parameter topics: '/synth/scen' is not in the bag; did you mean '/synth/scene'?"),
        (["bag:={whole}", "start_offset_s:=5.0"], 2, "parameter start_offset_s: expected at most the bag's 0.1 s, got 5.0"),
        (["bag:={text}"], 1, "no MCAP file, its first bytes are not MCAP's"),
    ],
)
def test_what_cannot_be_played_is_one_line_on_stderr(tmp_path, environment, settings, code, line):
    write_bag(tmp_path / "whole", frames=2)
    (tmp_path / "text").write_text("no bag at all")
    names = {"whole": tmp_path / "whole", "text": tmp_path / "text", "bag": tmp_path / "nowhere"}
    returned, _, errors = finish(replay(environment, names["bag"], *(setting.format(**names) for setting in settings)))
    assert returned == code
    assert line.format(**names) in errors and errors.count("\n") == 1


def test_a_truncated_bag_is_played_as_far_as_it_goes(tmp_path, environment):
    write_bag(tmp_path / "bag", frames=30, chunk_size=5000)
    data = (tmp_path / "bag" / "bag_0.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(data[: len(data) * 2 // 3])
    code, _, errors = finish(replay(environment, tmp_path / "cut.mcap", "rate:=100.0", "wait_for_subscribers_s:=0.0"))
    assert code == 0
    assert errors.count("the bag is damaged, it is played as far as it can be read: cut.mcap: unfinished or truncated") == 1
    assert START_NS > 0 and "replayed " in errors
