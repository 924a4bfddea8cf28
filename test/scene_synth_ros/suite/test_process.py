"""How node processes end."""

import signal
import subprocess
import sys
from pathlib import Path

import pytest
from scene_synth_ros_suite import Child, Peer, dds_context, environment, stop
from std_msgs.msg import String

from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.suite.qos import stream_qos

TOPIC, COUNT = "/synth/burst", 80


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_recorder_that_lags_behind_takes_what_was_sent_before_the_signal(tmp_path: Path, number: signal.Signals) -> None:
    env = environment()
    words = ["-m", "scene_synth_ros.record.recorder_node", "--ros-args", "-r", "__ns:=/synth", "-p", f"bag:={tmp_path / 'bag'}"]
    recorder = Child([sys.executable, *words], env=env)
    try:
        with dds_context(int(env["ROS_DOMAIN_ID"])) as context:
            peer = Peer(context)
            publisher = peer.node.create_publisher(String, TOPIC, stream_qos(COUNT))
            peer.spin_until(lambda: publisher.get_subscription_count() == 1, 30, "the recorder's subscription")
            for _ in range(25):  # the recorder matches in its turn meanwhile, on a busy machine too
                publisher.publish(String(data="before"))
                peer.spin_for(0.1)
            recorder.send_signal(signal.SIGSTOP)
            for index in range(COUNT):
                publisher.publish(String(data=f"{index} " + 1000 * "x"))
            recorder.send_signal(number)
            recorder.send_signal(signal.SIGCONT)
            _, errors = recorder.communicate(timeout=20)
            assert recorder.returncode == 0 and "Traceback" not in errors, errors
    finally:
        stop(recorder)
    with BagReader(tmp_path / "bag") as reader:
        assert sum(b"before" not in message.data for message in reader.messages([TOPIC])) == COUNT


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (None, "--params-file node.yaml: expected a parameter file, got none; check the path"),
        ("a: [1", "Couldn't parse params file: '--params-file node.yaml'"),
    ],
)
def test_a_parameter_file_that_cannot_be_read_ends_a_node_with_one_line(tmp_path: Path, text: str | None, line: str) -> None:
    if text is not None:
        (tmp_path / "node.yaml").write_text(text)
    words = ["-m", "scene_synth_ros.render.renderer_node", "--ros-args", "--params-file", "node.yaml"]
    process = subprocess.run(
        [sys.executable, *words], cwd=tmp_path, env=environment(), capture_output=True, text=True, timeout=60, check=False
    )
    assert process.returncode == 2
    assert line in process.stderr.splitlines()[-1] and ".c:" not in process.stderr.splitlines()[-1]


FAULTY = """
import sys
from rclpy.node import Node
from scene_synth_ros.suite.process import run_node

class Faulty(Node):
    exit_code = None

    def __init__(self):
        super().__init__("faulty")
        self.create_timer(0.01, self.work)
        self.mistake("make")

    def work(self):
        self.exit_code = 0
        self.mistake("work")

    def close(self):
        self.mistake("close")

    def mistake(self, when):
        if sys.argv[1] == when:
            raise ValueError(f"mistake in {when}")

run_node(Faulty, [])
"""


@pytest.mark.parametrize("when", ["make", "work", "close"])
def test_a_fault_of_the_program_ends_a_process_with_a_status_of_its_own(when: str) -> None:
    process = subprocess.run(
        [sys.executable, "-c", FAULTY, when], env=environment(), capture_output=True, text=True, timeout=60, check=False
    )
    assert process.returncode == 70
    assert process.stderr.count("Traceback") == 1 and f"ValueError: mistake in {when}; please report it" in process.stderr
