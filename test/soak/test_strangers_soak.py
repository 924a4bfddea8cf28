"""Several suites on one graph with strangers; slow, run by ``make soak``.  The seed is drawn from the clock and printed."""

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

ROOMS = int(os.environ.get("SOAK_ROOMS", "60"))
TOPICS = {
    "/other/camera/color/image_raw": "sensor_msgs/Image",
    "/other/camera/color/camera_info": "sensor_msgs/CameraInfo",
    "/other/camera/pose": "geometry_msgs/PoseStamped",
    "/synth/robot/pose": "geometry_msgs/PoseStamped",
    "/robot1/robot/pose": "geometry_msgs/PoseStamped",
    "/synth/robot/labels": "std_msgs/String",
    "/clock": "rosgraph_msgs/Clock",
}
STAMPS = (-5, 2**31 - 1, "wall", *range(30))


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
        stack.enter_context(stranger(env, TOPICS, STAMPS, seed=seed))
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
