"""Faults injected into real processes over DDS; slow, run by ``make soak``.  Moments are drawn from a fixed seed; figures are printed."""

import json
import os
import random
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, ParameterType
from rcl_interfaces.srv import DescribeParameters, ListParameters, SetParametersAtomically
from rclpy.parameter import Parameter
from sample_scene import sample_scene
from scene_synth_ros_suite import Child, Peer, environment, node_pids, node_process, record_command, stop, wait_until
from std_msgs.msg import String
from wall_clock import WallClock

from scene_description import scene_to_json
from scene_synth_ros.bags.bag_inspect import inspect_bag
from scene_synth_ros.bags.bag_repair import repair_bag
from scene_synth_ros.suite.qos import latched_qos

pytestmark = pytest.mark.soak

KILLS = int(os.environ.get("SOAK_KILLS", "20"))
STREAM = "/synth/camera/depth/image_raw"


class Run:
    """A recorded run of many small frames in processes of its own."""

    def __init__(self, bag: Path, *words: object, surroundings: Mapping[str, str] | None = None) -> None:
        self.bag = bag
        self.env = environment() | dict(surroundings or {})
        self.marker = self.env["SCENE_SYNTH_TEST"] = f"{os.getpid()}-{bag}"
        self.process = Child(record_command(bag, *words), env=self.env, start_new_session=True)

    def pid(self, node: str) -> int:
        return node_pids(self.marker)[node]

    def size(self) -> int:
        return sum(path.stat().st_size for path in self.bag.glob("*.mcap*"))

    def wait_for_frames(self, size: int = 100_000) -> None:
        wait_until(lambda: self.size() > size or self.process.poll() is not None, 180, f"{size} bytes in the bag", self.process)

    def finish(self, timeout_s: float = 600.0) -> tuple[int, str]:
        output, errors = self.process.communicate(timeout=timeout_s)
        assert "Traceback" not in errors + output
        return self.process.returncode, output + errors

    def wait_for_growth(self, what: str) -> float:
        """Wait until more is in the bag, or the run has ended; return how long that took (s)."""
        before, began = self.size(), time.monotonic()
        wait_until(lambda: self.size() > before or self.process.poll() is not None, 180, what, self.process)
        return time.monotonic() - began


@contextmanager
def run(bag: Path, *words: object, surroundings: Mapping[str, str] | None = None) -> Iterator[Run]:
    started = Run(bag, *words, surroundings=surroundings)
    try:
        yield started
    finally:
        stop(started.process)


def test_renderers_killed_at_random_moments_lose_and_repeat_no_frame(tmp_path: Path) -> None:
    draw, rooms, frames = random.Random(1), 3 * KILLS, 50
    times = []
    with run(tmp_path / "bag", "--rooms", rooms, "--frames", frames, "--respawn", KILLS + 1) as suite:
        suite.wait_for_frames()
        kills = 0
        while kills < KILLS and suite.process.poll() is None:
            time.sleep(draw.uniform(0.0, 3.0))
            try:
                os.kill(suite.pid("renderer_node"), signal.SIGKILL)
            except (KeyError, ProcessLookupError):
                continue
            kills += 1
            times.append(suite.wait_for_growth("frames after a kill"))
        code, output = suite.finish(1800.0)
    assert code == 0, output
    assert kills == KILLS, f"the run was too short: it ended after {kills} kills"
    report = inspect_bag(tmp_path / "bag")
    assert not report.faults, report.faults
    counts = {topic.count for topic in report.topics if "/camera/" in topic.name}
    assert counts == {rooms * frames}
    print(f"renderer killed {kills} times: {rooms * frames} frames, each once; frames again after {spread(times)}")


@pytest.mark.parametrize("node", ["recorder_node", "grammar_node"])
def test_other_nodes_killed_at_random_moments_leave_a_bag_that_can_be_read(tmp_path: Path, node: str) -> None:
    draw, whole, repaired, times = random.Random(2), 0, 0, []
    for number in range(KILLS):
        bag = tmp_path / f"bag{number}"
        with run(bag, "--rooms", 50, "--frames", 40) as suite:
            suite.wait_for_frames()
            time.sleep(draw.uniform(0.0, 2.0))
            began = time.monotonic()
            os.kill(suite.pid(node), signal.SIGKILL)
            code, output = suite.finish(60)
            times.append(time.monotonic() - began)
        assert code == 1 and f"{node} was ended by SIGKILL" in output
        assert not node_pids(suite.marker)
        if node == "recorder_node":
            report = repair_bag(bag, tmp_path / f"new{number}")
            faults = inspect_bag(report.bag).faults
            assert all("frames of its camera are missing" in fault for fault in faults), faults
            repaired += 1
        else:
            assert not inspect_bag(bag).faults
            whole += 1
    print(f"{node} killed {KILLS} times: {whole} bags whole, {repaired} repaired; the run ended with one line after {spread(times)}")


def spread(times: list[float]) -> str:
    """Return median and largest of some times (s)."""
    return f"{sorted(times)[len(times) // 2]:.1f} s (median), {max(times):.1f} s (longest)"


@pytest.mark.parametrize("node", ["grammar_node", "renderer_node", "recorder_node"])
def test_a_node_that_is_stopped_for_five_seconds_goes_on(tmp_path: Path, node: str) -> None:
    with run(tmp_path / "bag", "--rooms", 3, "--frames", 40) as suite:
        suite.wait_for_frames()
        pid = suite.pid(node)
        os.kill(pid, signal.SIGSTOP)
        time.sleep(5.0)
        os.kill(pid, signal.SIGCONT)
        recovered = suite.wait_for_growth("frames after the stop")
        code, output = suite.finish()
    assert code == 0, output
    report = inspect_bag(tmp_path / "bag")
    assert not report.faults and next(topic.count for topic in report.topics if topic.name == STREAM) == 120
    print(f"{node} stopped for 5 s: nothing lost, frames again after {recovered:.1f} s")


def test_a_wall_clock_that_jumps_costs_no_frame(tmp_path: Path) -> None:
    clock, draw, rooms, frames, times = WallClock(tmp_path), random.Random(4), 60, 50, []
    with run(tmp_path / "bag", "--rooms", rooms, "--frames", frames, surroundings=clock.environment) as suite:
        suite.wait_for_frames()
        for jump_s in (-3600, 3600, -1, 86400, -86400, 10):
            time.sleep(draw.uniform(0.0, 2.0))
            assert suite.process.poll() is None, "the run is meant to outlast the jumps"
            clock.shift(jump_s)
            times.append(suite.wait_for_growth("frames after the jump"))
        code, output = suite.finish()
    assert code == 0, output
    report = inspect_bag(tmp_path / "bag")
    assert not report.faults, report.faults
    assert {topic.count for topic in report.topics if "/camera/" in topic.name} == {rooms * frames}
    print(f"wall clock set {len(times)} times by up to a day: nothing lost, frames again after {spread(times)}")


@pytest.mark.skipif(os.geteuid() != 0, reason="mounting a small disk needs root")
def test_a_disk_that_fills_up_ends_the_run_with_a_whole_bag(tmp_path: Path) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=24m", "tmpfs", str(disk)], capture_output=True, text=True, check=False)
    if mount.returncode:
        pytest.skip(f"a small disk cannot be mounted here: {mount.stderr.strip()}")
    try:
        with run(disk / "bag", "--rooms", 50, "--frames", 40) as suite:
            code, output = suite.finish()
        assert code == 1 and "the bag is whole with" in output and "No space left on device" in output, output
        report = inspect_bag(disk / "bag")
        assert all("frames of its camera are missing" in fault for fault in report.faults), report.faults
        print(f"disk of 24 MB full: {report.size / 1e6:.1f} MB of whole bag, {sum(topic.count for topic in report.topics)} messages")
    finally:
        subprocess.run(["umount", str(disk)], check=True)


DEAF = """
import rclpy
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import Image
import time
rclpy.init()
node = Node("deaf")
kept = [node.create_subscription(Image, f"/synth/camera/{layer}/image_raw", print, QoSProfile(depth=5)) for layer in ("color", "depth")]
while True:
    time.sleep(1)
"""


def test_a_subscriber_that_never_reads_costs_the_run_nothing(tmp_path: Path) -> None:
    suite = Run(tmp_path / "bag", "--rooms", 3, "--frames", 40)
    deaf = subprocess.Popen([sys.executable, "-c", DEAF], env=suite.env)
    try:
        code, output = suite.finish()
        assert code == 0, output
        assert deaf.poll() is None
        assert not inspect_bag(tmp_path / "bag").faults
    finally:
        deaf.kill()
        deaf.wait()
        stop(suite.process)


def test_a_thousand_malformed_scenes_are_refused(tmp_path: Path) -> None:
    draw, good = random.Random(3), scene_to_json(sample_scene())
    count = int(os.environ.get("SOAK_SCENES", "1000"))
    with node_process("renderer_node", {"camera.width": 32, "camera.height": 24, "render.samples_per_pixel": 1}) as context:
        peer = Peer(context)
        done: list[int] = []
        peer.node.create_subscription(String, "status", lambda m: done.append(json.loads(m.data)["done_scene"]), latched_qos(100))
        scenes = peer.node.create_publisher(String, "scene", latched_qos())
        scenes.publish(String(data=good))
        peer.spin_until(lambda: sample_scene().index in done, 180, "the first good scene")
        for _ in range(count):
            scenes.publish(String(data=damaged(good, draw)))
            peer.spin_for(0.01)
        done.clear()
        scenes.publish(String(data=good))
        peer.spin_until(lambda: sample_scene().index in done, 180, "a good scene after the bad ones")
    print(f"{count} malformed scenes: the renderer survived")


def damaged(text: str, draw: random.Random) -> str:
    """Return a scene's JSON with one thing wrong: cut, characters exchanged, a value of another kind or size."""
    kind = draw.randrange(4)
    if kind == 0:
        return text[: draw.randrange(len(text))]
    if kind == 1:
        characters = list(text)
        for _ in range(draw.randrange(1, 20)):
            characters[draw.randrange(len(characters))] = chr(draw.randrange(32, 1000))
        return "".join(characters)
    document = json.loads(text)
    places: list[tuple[object, object]] = []

    def collect(value: object) -> None:
        items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
        for key, item in items:
            places.append((value, key))
            collect(item)

    collect(document)
    holder, key = draw.choice(places)
    values = (None, -1, 1e308, "x" * 5000, [], {}, True, [[]] * 300, 2**70, "../../etc/passwd", float("1e999"))
    holder[key] = draw.choice(values)
    return json.dumps(document)


OWN_OF_ROS = ("use_sim_time", "start_type_description_service")
ANY_VALUE = st.one_of(
    st.integers(-(2**63), 2**63 - 1),
    st.floats(allow_nan=True, allow_infinity=True),
    st.booleans(),
    st.text(max_size=50),
    st.lists(st.integers(-(2**31), 2**31), max_size=5),
    st.lists(st.text(max_size=9), min_size=1, max_size=5),
)


def fitting_value(descriptor: ParameterDescriptor) -> st.SearchStrategy[object]:
    """Return values of the parameter's type and range, and now and then something else."""
    whole = descriptor.integer_range[0] if descriptor.integer_range else IntegerRange(from_value=-100, to_value=100)
    real = descriptor.floating_point_range[0] if descriptor.floating_point_range else FloatingPointRange(from_value=-1e3, to_value=1e3)
    integers = st.integers(whole.from_value, min(whole.to_value, whole.from_value + 5000))
    floats = st.floats(real.from_value, real.to_value)
    words = re.findall(r"[a-z_0-9]+", descriptor.additional_constraints)
    texts = st.sampled_from(words) if words else st.text(max_size=9)
    kinds = {
        ParameterType.PARAMETER_BOOL: st.booleans(),
        ParameterType.PARAMETER_INTEGER: integers,
        ParameterType.PARAMETER_DOUBLE: floats,
        ParameterType.PARAMETER_STRING: texts,
        ParameterType.PARAMETER_DOUBLE_ARRAY: st.lists(floats, min_size=1, max_size=8),
        ParameterType.PARAMETER_STRING_ARRAY: st.lists(texts, min_size=1, max_size=4),
    }
    fitting = kinds.get(descriptor.type, ANY_VALUE)
    return st.integers(0, 9).flatmap(lambda pick: fitting if pick else ANY_VALUE)


@pytest.mark.parametrize("node", ["grammar_node", "renderer_node", "recorder_node"])
def test_fuzzed_parameters_are_taken_or_refused_and_harm_nobody(tmp_path: Path, node: str) -> None:
    start = {
        "grammar_node": {"lock_step": True, "expected_renderers": 1},
        "renderer_node": {"camera.width": 32, "camera.height": 24},
        "recorder_node": {"bag": str(tmp_path / "bag")},
    }
    examples = int(os.environ.get("SOAK_PARAMETERS", "1000")) // 3
    with node_process(node, start[node]) as context:
        peer = Peer(context)

        def ask(kind: type, name: str, request: object) -> object:
            client = clients.setdefault(name, peer.node.create_client(kind, f"{node}/{name}"))
            peer.spin_until(client.service_is_ready, 60, name)
            future = client.call_async(request)
            peer.spin_until(future.done, 60, f"the answer of {name}")
            return future.result()

        clients: dict[str, object] = {}
        names = sorted(ask(ListParameters, "list_parameters", ListParameters.Request()).result.names)
        described = ask(DescribeParameters, "describe_parameters", DescribeParameters.Request(names=names)).descriptors
        live = [item for item in described if "fixed at start" not in item.additional_constraints and item.name not in OWN_OF_ROS]
        choices = st.one_of([st.tuples(st.just(item.name), fitting_value(item)) for item in live if not item.name.startswith("qos_")])
        tally = {True: 0, False: 0}

        @settings(max_examples=examples, deadline=None, suppress_health_check=list(HealthCheck), database=None)
        @given(st.lists(choices, min_size=1, max_size=4, unique_by=lambda pair: pair[0]))
        def fuzz(chosen: list[tuple[str, object]]) -> None:
            parameters = []
            for name, value in chosen:
                try:
                    parameters.append(Parameter(name, value=value).to_parameter_msg())
                except (TypeError, ValueError, AssertionError, OverflowError, UnicodeError):
                    return
            answer = ask(SetParametersAtomically, "set_parameters_atomically", SetParametersAtomically.Request(parameters=parameters))
            tally[answer.result.successful] += 1
            assert answer.result.successful or answer.result.reason

        fuzz()
        assert tally[True] > examples // 10, "the sets are meant to be taken often"
        ask(DescribeParameters, "describe_parameters", DescribeParameters.Request(names=names))
    print(f"{node}: {sum(tally.values())} parameter sets, {tally[True]} taken, {tally[False]} refused with a reason")
