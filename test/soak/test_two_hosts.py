"""Nodes on two hosts: network namespaces joined by a cable that is cut and healed; slow, run by ``make soak``, needs root."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from scene_synth_ros_suite import Child, environment, wait_until

from scene_synth_ros.bags.bag_inspect import inspect_bag
from scene_synth_ros.cli.processes.supervisor import NODES
from scene_synth_ros.verify.bag_verify import verify_bag

ROOMS, FRAMES = 4, 60
CUT_S = 10.0
HOSTS = {"synth_a": "10.77.0.1/24", "synth_b": "10.77.0.2/24"}
SMALL = {"camera.width": 96, "camera.height": 72, "render.samples_per_pixel": 1, "render.auto_exposure": False}

pytestmark = [pytest.mark.soak, pytest.mark.skipif(os.geteuid() != 0, reason="network namespaces need root")]


def ip(*words: str) -> None:
    subprocess.run(["ip", *words], check=True, capture_output=True)


@pytest.fixture
def cable() -> Iterator[Callable[[str], None]]:
    """Two hosts with a cable; what is yielded sets its link ``up`` or ``down``."""
    for host in HOSTS:
        with suppress(subprocess.CalledProcessError):
            ip("netns", "delete", host)
    try:
        for host in HOSTS:
            ip("netns", "add", host)
        ends = [f"{host}_eth" for host in HOSTS]
        ip("link", "add", ends[0], "type", "veth", "peer", "name", ends[1])
    except (OSError, subprocess.CalledProcessError) as error:
        pytest.skip(f"network namespaces cannot be made here: {error}")
    for (host, address), end in zip(HOSTS.items(), ends, strict=True):
        ip("link", "set", end, "netns", host)
        ip("-n", host, "addr", "add", address, "dev", end)
        for device in ("lo", end):
            ip("-n", host, "link", "set", device, "up")
        ip("-n", host, "route", "add", "224.0.0.0/4", "dev", end)
    yield lambda state: ip("-n", "synth_a", "link", "set", "synth_a_eth", state)
    for host in HOSTS:
        ip("netns", "delete", host)


class Hosts:
    """Node processes on the two hosts."""

    def __init__(self) -> None:
        self._env = environment()
        self.nodes: dict[str, Child] = {}

    def start(self, host: str, node: str, settings: dict[str, object]) -> None:
        words = ["ip", "netns", "exec", host, sys.executable, "-m", NODES[node].module, "--ros-args", "-r", "__ns:=/synth"]
        words += [word for key, value in settings.items() for word in ("-p", f"{key}:={str(value).lower()}")]
        self.nodes[node] = Child(words, env=self._env)

    def run(self, bag: Path) -> None:
        peers = {"expected_recorders": 1, "exit_when_done": True}
        self.start("synth_b", "recorder_node", {"bag": bag, "exit_when_done": True})
        self.start("synth_a", "renderer_node", {**SMALL, **peers})
        run = {"rooms": ROOMS, "frames_per_room": FRAMES, "seed": 3, "scene.room_type": "bathroom", "expected_renderers": 1}
        self.start("synth_a", "grammar_node", {**run, **peers})

    def wait(self, timeout_s: float) -> tuple[dict[str, int], str]:
        """Return exit codes and all that was said."""
        deadline = time.monotonic() + timeout_s
        said = ""
        for name, process in self.nodes.items():
            output, errors = process.communicate(timeout=max(1.0, deadline - time.monotonic()))
            said += f"--- {name}\n{output}{errors}"
        return {name: process.returncode for name, process in self.nodes.items()}, said

    def stop(self) -> None:
        for process in self.nodes.values():
            if process.poll() is None:
                process.send_signal(signal.SIGKILL)
            process.communicate()


@pytest.fixture
def hosts() -> Iterator[Hosts]:
    started = Hosts()
    yield started
    started.stop()


def bag_size(bag: Path) -> int:
    return sum(path.stat().st_size for path in bag.glob("*.mcap*"))


def assert_whole(bag: Path, codes: dict[str, int], said: str) -> None:
    assert set(codes.values()) == {0} and "Traceback" not in said, said
    report = inspect_bag(bag)
    assert not report.faults, report.faults
    assert {topic.count for topic in report.topics if topic.name.endswith("/image_raw")} == {ROOMS * FRAMES}
    assert verify_bag(bag).good


def test_a_run_over_two_hosts_is_whole(cable: Callable[[str], None], hosts: Hosts, tmp_path: Path) -> None:
    hosts.run(tmp_path / "bag")
    assert_whole(tmp_path / "bag", *hosts.wait(400.0))


@pytest.mark.parametrize("moment", range(3))
def test_a_cable_that_is_cut_and_healed_costs_no_frame(cable: Callable[[str], None], hosts: Hosts, tmp_path: Path, moment: int) -> None:
    bag = tmp_path / "bag"
    hosts.run(bag)
    wait_until(lambda: bag_size(bag) > 300_000 * (1 + 3 * moment), 200, "frames in the bag")
    cable("down")
    time.sleep(CUT_S)
    before, began = bag_size(bag), time.monotonic()
    cable("up")
    wait_until(lambda: bag_size(bag) > before, 120, "frames after the cut")
    recovered_s = time.monotonic() - began
    assert_whole(bag, *hosts.wait(400.0))
    print(f"cable cut for {CUT_S:g} s: nothing lost, frames again after {recovered_s:.1f} s")
