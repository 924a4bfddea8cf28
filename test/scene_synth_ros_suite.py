"""Helpers of the tests that run real node processes over DDS."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

SMALL = ["renderer_node.camera.width:=96", "renderer_node.camera.height:=72", "renderer_node.render.samples_per_pixel:=1"]
"""Overrides that make frames cheap."""


def environment() -> dict[str, str]:
    """Return the environment of one test run, with a DDS domain of its own."""
    return {**os.environ, "ROS_DOMAIN_ID": str(random.SystemRandom().randint(1, 100)), "PYTHONPATH": str(Path(__file__).parents[2])}


def command(*words: object) -> list[str]:
    """Return a ``scene_synth`` command line."""
    return [sys.executable, "-m", "scene_synth_ros", *map(str, words)]


def run_suite(bag: Path, *words: object, env: dict[str, str] | None = None, timeout_s: float = 120.0) -> subprocess.CompletedProcess[str]:
    """Record a bag with small frames and wait for the end."""
    overrides = [word for override in SMALL for word in ("-p", override)]
    return subprocess.run(
        command("run", "--record", bag, *overrides, *words),
        env=env or environment(),
        capture_output=True,
        text=True,
        timeout=timeout_s,
        check=False,
    )


def wait_until(condition: Callable[[], object], timeout_s: float, what: str) -> None:
    """Wait until a condition holds.

    Raises:
        TimeoutError: it does not in time.
    """
    deadline = time.monotonic() + timeout_s
    while not condition():
        if time.monotonic() > deadline:
            raise TimeoutError(f"waited {timeout_s} s for {what}")
        time.sleep(0.05)


def node_pids(marker: str) -> dict[str, int]:
    """Return node name -> process id of the running nodes whose command line or environment holds ``marker``."""
    found = {}
    for process in Path("/proc").glob("[0-9]*"):
        try:
            words = (process / "cmdline").read_bytes().decode().split("\0")
            surroundings = (process / "environ").read_bytes().decode(errors="replace")
        except OSError:
            continue
        name = next((word.removeprefix("scene_synth_ros.") for word in words if word.startswith("scene_synth_ros.")), "")
        if name and marker in surroundings:
            found[name] = int(process.name)
    return found


def stop(process: subprocess.Popen[str]) -> None:
    """End a process that a test has started, whatever has become of the test."""
    if process.poll() is None:
        process.send_signal(signal.SIGTERM)
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()
    process.communicate()
