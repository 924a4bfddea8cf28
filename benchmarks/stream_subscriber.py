"""The other process of the stream benchmark: subscribes as the recorder does, and prints as JSON when which image has arrived."""

from __future__ import annotations

import json
import sys
import time

import rclpy
from rclpy.node import Node
from sensor_msgs.msg import Image

from scene_synth_ros.messages.stamps import stamp_ns
from scene_synth_ros.record.topic_inputs import QUEUE_DEPTH
from scene_synth_ros.suite.qos import stream_qos

STREAMED = ("color", "depth", "normals", "semantic", "instance")
"""The layers that a renderer publishes by default."""


def main() -> None:
    """Listen until everything is there or nothing has come for five seconds; print [stamp, steady clock] of each image (ns)."""
    expected = int(sys.argv[1]) * len(STREAMED)
    arrivals: list[tuple[int | None, int]] = []
    last = time.monotonic() + 10.0

    def take(data: bytes) -> None:
        nonlocal last
        arrivals.append((stamp_ns("sensor_msgs/msg/Image", data), time.monotonic_ns()))
        last = time.monotonic()

    rclpy.init()
    node = Node("stream_subscriber", namespace="/bench")
    for layer in STREAMED:
        node.create_subscription(Image, f"camera/{layer}/image_raw", take, stream_qos(QUEUE_DEPTH), raw=True)
    while len(arrivals) < expected and time.monotonic() - last < 5.0:
        rclpy.spin_once(node, timeout_sec=0.2)
    print(json.dumps(arrivals))


if __name__ == "__main__":
    main()
