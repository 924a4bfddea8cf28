"""Several suites on one graph with strangers; slow, run by ``make soak``.  The seed is drawn from the clock and printed.

``SOAK_STRANGER_ROOMS`` says how many rooms are recorded: 60 take ten minutes on two idle processors.
"""

import os
import time
from contextlib import ExitStack
from hashlib import sha256
from pathlib import Path

import pytest
from scene_synth_ros_suite import SMALL, Child, command, environment, record_command, stop
from strangers import stranger

from scene_synth_ros.bags.bag_inspect import inspect_bag
from scene_synth_ros.bags.bag_reader import BagReader

pytestmark = pytest.mark.soak

ROOMS, FRAMES = int(os.environ.get("SOAK_STRANGER_ROOMS", "60")), 30
FIRST, SECOND, LIVE = "synth", "zebra", "third"
"""Namespaces of the suites; the first two record."""
TOPICS = {
    "/strange/camera/color/image_raw": "sensor_msgs/Image",
    "/strange/camera/color/camera_info": "sensor_msgs/CameraInfo",
    "/strange/camera/pose": "geometry_msgs/PoseStamped",
    **{
        f"/{namespace}/{topic}": kind
        for namespace in (FIRST, SECOND)
        for topic, kind in {
            "robot/pose": "geometry_msgs/PoseStamped",
            "robot/color/image_raw": "sensor_msgs/Image",
            "robot/labels": "std_msgs/String",
            "status": "std_msgs/String",
        }.items()
    },
    "/clock": "rosgraph_msgs/Clock",
}
STAMPS = (-5, 2**31 - 1, "wall", *range(30))


def contents(bag: Path) -> dict[str, list[tuple[int, str]]]:
    """Return topic -> log times and digests of its messages; without those of strangers."""
    found: dict[str, list[tuple[int, str]]] = {}
    with BagReader(bag) as reader:
        for message in reader.messages(file_order=True):
            if message.topic not in TOPICS and message.topic != "/diagnostics":
                found.setdefault(message.topic, []).append((message.log_ns, sha256(message.data).hexdigest()))
    return found


def test_three_suites_and_strangers_leave_bags_as_a_suite_alone_makes_them(tmp_path: Path) -> None:
    seed = time.time_ns() % 2**31
    print(f"seed {seed}")
    words = ["--rooms", ROOMS, "--frames", FRAMES, "--seed", seed, "-p", "recorder_node.extra_topics:=['/strange/*']"]
    for name in (FIRST, SECOND):
        alone = Child(record_command(tmp_path / f"{name}_alone", *words, "--namespace", f"/{name}"), env=environment())
        with ExitStack() as stack:
            stack.callback(stop, alone)
            assert alone.wait(3600) == 0, alone.said()
    env, began = environment(), time.monotonic()
    with ExitStack() as stack:
        stack.enter_context(stranger(env, TOPICS, STAMPS, period_s=0.02, seed=seed))
        small = [word for override in SMALL for word in ("-p", override)]
        live = Child(command("run", "--params", "live", "--namespace", f"/{LIVE}", *small), env=env)
        stack.callback(stop, live)
        runs = {name: Child(record_command(tmp_path / name, *words, "--namespace", f"/{name}"), env=env) for name in (FIRST, SECOND)}
        for process in runs.values():
            stack.callback(stop, process)
        for name, process in runs.items():
            status = process.wait(3600)
            said = "".join(process.said())
            assert status == 0, (name, said)
            assert "all" in said and "rooms are done" in said and "lost" not in said and "Traceback" not in said, (name, said)
        assert live.poll() is None, live.said()
    for name in runs:
        expected, whole = contents(tmp_path / f"{name}_alone"), inspect_bag(tmp_path / f"{name}_alone")
        assert len(expected["/tf"]) == ROOMS * FRAMES and len(expected["/tf_static"]) == 1
        found, report = contents(tmp_path / name), inspect_bag(tmp_path / name)
        assert found.keys() == expected.keys()
        differing = {topic: (len(found[topic]), len(expected[topic])) for topic in expected if found[topic] != expected[topic]}
        assert not differing
        assert (report.faults, report.lacking, report.end_ns) == ((), (), whole.end_ns)
        strange = sum(topic.count for topic in report.topics if topic.name in TOPICS)
        print(f"/{name}: {ROOMS * FRAMES} frames like those of a suite alone, and {strange} messages of strangers")
    print(f"three suites with strangers: {time.monotonic() - began:.0f} s")
