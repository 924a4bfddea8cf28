"""Accidents at random moments, and strangers on the same graph; slow, run by ``make soak``.  Seeds are drawn from the clock and printed."""

import os
import random
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from hashlib import sha256
from pathlib import Path

import pytest
from scene_synth_ros_suite import SMALL, Child, announced_often, command, environment, node_pids, record_command, stop, wait_until

from scene_synth_ros.bags.bag_inspect import inspect_bag
from scene_synth_ros.bags.bag_reader import BagReader, BagReadError
from scene_synth_ros.bags.bag_repair import repair_bag

pytestmark = pytest.mark.soak

ENDS = int(os.environ.get("SOAK_ENDS", "200"))
ROOMS = int(os.environ.get("SOAK_ROOMS", "60"))
END_S = 20.0
NODES = ("recorder_node", "renderer_node", "grammar_node")
SIGNALS = (signal.SIGTERM, signal.SIGINT, signal.SIGKILL)


def partial_frames(bag: Path) -> int:
    """Return how many log times have some topics of the camera, and not all of them."""
    topics: dict[int, set[str]] = {}
    with BagReader(bag) as reader:
        for message in reader.messages():
            if message.topic.startswith("/synth/camera/"):
                topics.setdefault(message.log_ns, set()).add(message.topic)
    whole = set().union(*topics.values())
    return sum(of_frame != whole for of_frame in topics.values())


def test_whoever_is_ended_whenever_the_run_ends_with_its_name_and_a_whole_bag(tmp_path: Path) -> None:
    seed = time.time_ns()
    print(f"seed {seed}")
    draw, times, tally = random.Random(seed), [], Counter[str]()
    for number in range(ENDS):
        folder, bag, temporary = tmp_path / str(number), tmp_path / str(number) / "bag", tmp_path / str(number) / "tmp"
        temporary.mkdir(parents=True)
        env = environment() | {"TMPDIR": str(temporary), "SCENE_SYNTH_TEST": f"{os.getpid()}-{folder}"}
        who, how = draw.choice((*NODES, "run")), draw.choice(SIGNALS)
        words = ["--rooms", 200, "--frames", 40, "-p", "grammar_node.scene.room_type:=hallway"]
        process = Child(record_command(bag, *words), env=env, start_new_session=True)
        try:
            wait_until(lambda marker=env["SCENE_SYNTH_TEST"]: len(node_pids(marker)) >= 3, 30, "the nodes", process)
            time.sleep(draw.uniform(0.0, 12.0))
            os.kill(process.pid if who == "run" else node_pids(env["SCENE_SYNTH_TEST"])[who], how)
            began = time.monotonic()
            output = "".join(process.communicate(timeout=END_S))
            wait_until(lambda marker=env["SCENE_SYNTH_TEST"]: not node_pids(marker), END_S, "the nodes to end")
            times.append(time.monotonic() - began)
        finally:
            stop(process)
        what = f"{number}: {who} {how.name}\n{output}"
        killed = who == "run" and how == signal.SIGKILL
        assert process.returncode == (-how if killed else 130 if who == "run" else 1), what
        assert "Traceback" not in output, what
        assert who == "run" or [f"run: {who} was ended by {how.name}" in line for line in output.splitlines()].count(True) == 1, what
        assert killed or not list(temporary.iterdir()), what
        tally["no bag" if not bag.exists() else check_frames(bag, what)] += 1
    middle = sorted(times)[len(times) // 2]
    print(f"{ENDS} ends: {dict(tally)}; all processes gone after {middle:.1f} s (median), {max(times):.1f} s (longest)")


def check_frames(bag: Path, what: str) -> str:
    """Check that a bag, if need be repaired, has whole frames only; return in which state it was."""
    if not list(bag.glob("*.active")):
        assert partial_frames(bag) == 0, what
        return "whole"
    try:
        report = repair_bag(bag, bag.with_name("repaired"))
    except BagReadError:
        return "nothing to repair"
    assert partial_frames(report.bag) == 0, what
    return "repaired"


STRANGERS = """
import random, sys, time
import rclpy
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped
from rclpy.node import Node
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Header, String
rclpy.init()
node, draw = Node("stranger", namespace="/other"), random.Random(int(sys.argv[1]))
kinds = {"/other/camera/color/image_raw": Image, "/other/camera/color/camera_info": CameraInfo, "/other/camera/pose": PoseStamped}
kinds |= {"/synth/robot/pose": PoseStamped, "/synth/robot/labels": String, "/robot1/robot/pose": PoseStamped, "/clock": Clock}
publishers = {name: node.create_publisher(kind, name, 10) for name, kind in kinds.items()}
print("here", flush=True)
while rclpy.ok():
    for name, publisher in publishers.items():
        now = time.time_ns()
        stamp = draw.choice([Time(sec=-5), Time(sec=2**31 - 1), Time(sec=now // 10**9, nanosec=now % 10**9), Time(sec=draw.randrange(30))])
        if name == "/clock":
            publisher.publish(Clock(clock=stamp))
        elif name.endswith("labels"):
            publisher.publish(String(data="{no labels}"))
        else:
            publisher.publish(kinds[name](header=Header(stamp=stamp, frame_id=draw.choice(["", "map", "odom"]))))
    time.sleep(0.01)
"""


@contextmanager
def strangers(env: dict[str, str], seed: int) -> Iterator[None]:
    process = subprocess.Popen([sys.executable, "-c", STRANGERS, str(seed)], env=announced_often(env), stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None and process.stdout.readline() == "here\n"
        yield
    finally:
        process.terminate()
        process.communicate()


def camera(bag: Path, namespace: str) -> dict[str, list[tuple[int, str]]]:
    """Return topic below the camera -> log times and digests of what follows the header, which has the namespace in it."""
    found: dict[str, list[tuple[int, str]]] = {}
    with BagReader(bag) as reader:
        for message in reader.messages(file_order=True):
            if message.topic.startswith(f"{namespace}/camera/") and message.topic.endswith("image_raw"):
                entry = (message.log_ns, sha256(message.data[-1000:]).hexdigest())
                found.setdefault(message.topic.removeprefix(namespace), []).append(entry)
    return found


def test_three_suites_and_strangers_leave_bags_as_a_suite_alone_makes_them(tmp_path: Path) -> None:
    seed = time.time_ns() % 2**31
    print(f"seed {seed}")
    words = ["--rooms", ROOMS, "--frames", 30, "--seed", seed, "-p", "recorder_node.extra_topics:=['/other/*']"]
    alone = Child(record_command(tmp_path / "alone", *words), env=environment())
    with ExitStack() as stack:
        stack.callback(stop, alone)
        assert alone.wait(3600) == 0, alone.said()
    env, began = environment(), time.monotonic()
    with ExitStack() as stack:
        stack.enter_context(strangers(env, seed))
        small = [word for override in SMALL for word in ("-p", override)]
        live = Child(command("run", "--params", "live", "--namespace", "/robot2", *small), env=env)
        stack.callback(stop, live)
        runs = {name: Child(record_command(tmp_path / name, *words, "--namespace", f"/{name}"), env=env) for name in ("synth", "robot1")}
        for process in runs.values():
            stack.callback(stop, process)
        for name, process in runs.items():
            status = process.wait(3600)
            said = "".join(process.said())
            assert status == 0, (name, said)
            assert "all" in said and "rooms are done" in said and "lost" not in said and "Traceback" not in said, (name, said)
        assert live.poll() is None, live.said()
    expected = camera(tmp_path / "alone", "/synth")
    for name in runs:
        assert camera(tmp_path / name, f"/{name}") == expected
        report = inspect_bag(tmp_path / name)
        assert (report.faults, report.lacking) == ((), ())
        counts = {topic.name: topic.count for topic in report.topics}
        assert counts["/tf"] == ROOMS * 30 and counts["/tf_static"] == 1, "only the suite's camera moves frames"
    print(f"three suites with strangers: two bags of {ROOMS * 30} frames like that of a suite alone, in {time.monotonic() - began:.0f} s")
