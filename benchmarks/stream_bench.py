"""Messages: processor time of converting and publishing five layers, and whether 300 frames at 30 Hz reach another process."""

from __future__ import annotations

import os
import subprocess
import sys
import time

import numpy as np
import rclpy
from rclpy.node import Node

from benchmarks.stream_subscriber import STREAMED
from benchmarks.table import Row, at_most
from renderer.config import CameraConfig
from renderer.frame import LAYERS, Frame
from scene_description import CameraPose
from scene_description.labels import instance_palette, label_palette
from scene_synth_ros.conversions import semantic_labels
from scene_synth_ros.frame_messages import Palettes, StreamConfig
from scene_synth_ros.streams import StreamPublishers
from scene_synth_ros.supervisor import node_environment

FRAMES = 300
RATE_HZ = 30.0
DISCOVERY_S = 1.0
"""A publisher may know a subscriber before the subscriber knows it; what it sends then is not waited for."""


def measure() -> list[Row]:
    """Publish to a subscriber in another process and return what it cost and what was lost."""
    os.environ.update(node_environment(os.environ), ROS_DOMAIN_ID=str(1 + os.getpid() % 100))
    rclpy.init()
    node = Node("stream_bench", namespace="/bench")
    streams = StreamPublishers(node, StreamConfig(color_companions=False, lazy=False), CameraConfig())
    streams.messages.begin_palettes(Palettes(label_palette(), instance_palette(256)), {"semantic": semantic_labels(), "instance": {}})
    frame = make_frame()
    subscriber = subprocess.Popen([sys.executable, "-m", "benchmarks.stream_subscriber", str(FRAMES)], stdout=subprocess.PIPE, text=True)
    while any(streams.subscribers(layer) == 0 for layer in streams.messages.layers):
        time.sleep(0.05)
    time.sleep(DISCOVERY_S)
    began, spent = time.perf_counter(), 0.0
    for index in range(FRAMES):
        time.sleep(max(0.0, began + index / RATE_HZ - time.perf_counter()))
        before = time.process_time()
        pose = CameraPose(stamp_ns=1 + index * 33_333_333, position_m=(0.0, 0.0, 1.0), orientation=(0.0, 0.0, 0.0, 1.0))
        streams.publish(frame, pose, "{}")
        spent += time.process_time() - before
    output, _ = subscriber.communicate(timeout=60)
    received = int(output.strip())
    node.destroy_node()
    rclpy.shutdown()
    return [
        at_most("convert and publish 5 layers, 640x480, processor time a frame", 1000.0 * spent / FRAMES, "ms", 15.0),
        at_most(f"images lost of {FRAMES * len(STREAMED)} at 30 Hz to another process", FRAMES * len(STREAMED) - received, "", 0.0),
    ]


def make_frame() -> Frame:
    """Return a frame whose layers hold noise, which does not compress."""
    rng = np.random.default_rng(0)
    camera = CameraConfig()
    layers = {}
    for name in STREAMED:
        layer = LAYERS[name]
        shape = (camera.height, camera.width, layer.channels) if layer.channels else (camera.height, camera.width)
        layers[name] = (rng.random(shape) * 100).astype(layer.dtype)
    return Frame(layers, None)
