"""Publishers of others, which stamp as they like."""

import json
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

from scene_synth_ros_suite import announced_often

_STRANGER = """
import json, random, sys, time
from importlib import import_module
import rclpy
from builtin_interfaces.msg import Time
from rclpy.node import Node
topics, stamps, period_s, seed = json.loads(sys.argv[1])
rclpy.init()
node, draw = Node("stranger", namespace="/synth"), random.Random(seed)
kinds = {name: getattr(import_module(f"{kind.split('/')[0]}.msg"), kind.split("/")[1]) for name, kind in topics.items()}
publishers = {name: node.create_publisher(kind, name, 100) for name, kind in kinds.items()}
print("here", flush=True)
while rclpy.ok():
    for name, publisher in publishers.items():
        seconds, now, message = draw.choice(stamps), time.time_ns(), kinds[name]()
        stamp = Time(sec=now // 10**9, nanosec=now % 10**9) if seconds == "wall" else Time(sec=seconds)
        if hasattr(message, "header"):
            message.header.stamp, message.header.frame_id = stamp, draw.choice(["", "map", "odom"])
        elif hasattr(message, "clock"):
            message.clock = stamp
        else:
            message.data = "{no labels}"
        publisher.publish(message)
    time.sleep(period_s)
"""


@contextmanager
def stranger(
    env: Mapping[str, str], topics: Mapping[str, str], stamps: Sequence[int | str], *, period_s: float = 0.01, seed: int = 0
) -> Iterator[None]:
    """Publish on topics as long as the block lasts.

    Args:
        env: of the process.
        topics: name -> type, as ``sensor_msgs/Image``.
        stamps: seconds, or ``wall``; each message has one of them by chance.
        period_s: between two messages of a topic.
        seed: of the choices.
    """
    words = json.dumps([dict(topics), list(stamps), period_s, seed])
    process = subprocess.Popen([sys.executable, "-c", _STRANGER, words], env=announced_often(env), stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None and process.stdout.readline() == "here\n"
        yield
    finally:
        process.terminate()
        process.communicate()
