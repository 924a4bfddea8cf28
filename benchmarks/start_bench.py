"""Start: from the command ``run`` to the first colour image in another process, kernels cached or not."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time

import rclpy
from rclpy.node import Node
from sensor_msgs.msg import Image

from benchmarks.table import Row, at_most
from scene_synth_ros.suite.qos import stream_qos

TIMEOUT_S = 120.0


def measure() -> list[Row]:
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
