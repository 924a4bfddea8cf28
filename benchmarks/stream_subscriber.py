"""The other process of the stream benchmark: subscribes as the recorder does, counts the images that arrive and prints the number."""

from __future__ import annotations

import sys
import time

import rclpy
from rclpy.node import Node
from sensor_msgs.msg import Image

from scene_synth_ros.qos import stream_qos
from scene_synth_ros.recorder_node import QUEUE_DEPTH

STREAMED = ("color", "depth", "normals", "semantic", "instance")
"""The layers that a renderer publishes by default."""


def main() -> None:
    """Count until everything is there or nothing has come for five seconds."""
    expected = int(sys.argv[1]) * len(STREAMED)
    received, last = 0, time.monotonic() + 10.0

    def count(_: bytes) -> None:
        nonlocal received, last
        received += 1
        last = time.monotonic()

    rclpy.init()
    node = Node("stream_subscriber", namespace="/bench")
    for layer in STREAMED:
        node.create_subscription(Image, f"camera/{layer}/image_raw", count, stream_qos(QUEUE_DEPTH), raw=True)
    while received < expected and time.monotonic() - last < 5.0:
        rclpy.spin_once(node, timeout_sec=0.2)
    print(received)


if __name__ == "__main__":
    main()
