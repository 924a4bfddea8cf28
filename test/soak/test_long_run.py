"""A long run: nothing lost, and memory, files and threads of every node stay as they are; slow, run by ``make soak``."""

import json
import os
import time
from pathlib import Path

import pytest
from scene_synth_ros_suite import Peer, dds_context, node_pids
from std_msgs.msg import String
from test_faults_soak import Run

from scene_synth_ros.bags.bag_inspect import inspect_bag
from scene_synth_ros.suite.qos import latched_qos

pytestmark = pytest.mark.soak

FRAMES = int(os.environ.get("SOAK_FRAMES", "2000"))
WIDTH, HEIGHT = (int(value) for value in os.environ.get("SOAK_SIZE", "640x480").split("x"))
FRAMES_PER_ROOM, WARM = 50, 200
GROWTH = 0.01
NODES = ("grammar_node", "renderer_node", "recorder_node")


def vitals(pid: int) -> tuple[int, int, int]:
    """Return resident bytes that are the process's own, open files, threads."""
    pages = (Path("/proc") / str(pid) / "statm").read_text().split()
    threads = next(line for line in (Path("/proc") / str(pid) / "status").read_text().splitlines() if line.startswith("Threads"))
    own = (int(pages[1]) - int(pages[2])) * os.sysconf("SC_PAGE_SIZE")
    return own, len(list((Path("/proc") / str(pid) / "fd").iterdir())), int(threads.split()[1])


def test_a_long_run_loses_nothing_and_grows_nowhere(tmp_path: Path) -> None:
    """The run begins again in the middle, so that each room is seen twice: rooms differ in size by more than memory may grow."""
    overrides = [f"renderer_node.camera.width:={WIDTH}", f"renderer_node.camera.height:={HEIGHT}"]
    words = [word for override in overrides for word in ("-p", override)]
    rooms = FRAMES // FRAMES_PER_ROOM // 2
    suite = Run(tmp_path / "bag", "--rooms", rooms, "--frames", FRAMES_PER_ROOM, *words)
    frames = [0]

    def hear(message: String) -> None:
        status = json.loads(message.data)
        if status["role"] == "recorder":
            frames[0] = max(frames[0], status["counts"].get("/synth/camera/pose", 0))

    samples: dict[str, list[tuple[int, tuple[int, int, int]]]] = {node: [] for node in NODES}
    began, again = time.monotonic(), False
    with dds_context(int(suite.env["ROS_DOMAIN_ID"])) as context:
        peer = Peer(context)
        peer.node.create_subscription(String, "status", hear, latched_qos(100))
        while suite.process.poll() is None:
            peer.spin_for(0.5)
            if not again and frames[0] > (rooms - 1) * FRAMES_PER_ROOM:
                again, _ = peer.trigger("grammar_node/reset")
            for node, pid in node_pids(suite.marker).items():
                try:
                    samples[node].append((frames[0], vitals(pid)))
                except OSError:
                    continue
    code, output = suite.finish()
    assert code == 0, output
    report = inspect_bag(tmp_path / "bag")
    assert not report.faults, report.faults
    assert {topic.count for topic in report.topics if "/camera/" in topic.name} == {FRAMES}
    print(f"{FRAMES} frames of 5 layers at {WIDTH}x{HEIGHT} in {time.monotonic() - began:.0f} s, {report.size / 1e9:.2f} GB")
    grown = []
    for node in NODES:
        at_room: dict[int, list[tuple[int, int, int]]] = {}
        for frame, values in samples[node]:
            at_room.setdefault(frame // FRAMES_PER_ROOM, []).append(values)
        pairs = [(at_room[room], at_room[room + rooms]) for room in range(WARM // FRAMES_PER_ROOM, rooms - 1)]
        before, growth = (
            median(median(v[0] for v in first) for first, _ in pairs),
            median(median(v[0] for v in second) - median(v[0] for v in first) for first, second in pairs),
        )
        files, threads = (median(median(v[i] for v in b) - median(v[i] for v in a) for a, b in pairs) for i in (1, 2))
        print(f"{node}: {before / 1e6:.0f} MB, grows by {growth / before:+.2%}; files {files:+g}, threads {threads:+g}")
        if growth >= GROWTH * before or files > 0 or threads > 0:
            grown.append(node)
    assert not grown, f"{', '.join(grown)} grew; see the figures above"


def median(values: object) -> float:
    ordered = sorted(values)
    return float(ordered[len(ordered) // 2])
