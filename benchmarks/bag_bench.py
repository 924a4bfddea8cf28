"""Bags: the recorder's writing against the disk's own speed, with the images of a real frame."""

from __future__ import annotations

import os
import tempfile
import time
from pathlib import Path

from rclpy.serialization import serialize_message

from benchmarks.stream_bench import make_frame
from benchmarks.table import Row
from scene_synth_ros.bag_writer import BagWriter
from scene_synth_ros.conversions import image_to_msg
from scene_synth_ros.frame_messages import STREAMS

FRAMES = 40


def measure() -> list[Row]:
    """Write frames of five layers, compressed and synced, and the same bytes to a plain file."""
    frame = make_frame()
    messages = {
        name: bytes(serialize_message(image_to_msg(image, STREAMS[name].encoding, 1, "eye"))) for name, image in frame.layers.items()
    }
    size_mb = sum(map(len, messages.values())) / 1e6
    with tempfile.TemporaryDirectory() as folder:
        cpu, began = time.process_time(), time.perf_counter()
        with BagWriter(Path(folder) / "bag") as writer:
            for name in messages:
                writer.add_topic(f"/{name}", "sensor_msgs/msg/Image")
            for index in range(FRAMES):
                for name, data in messages.items():
                    writer.write(f"/{name}", data, index + 1, index + 1)
        bag_seconds, bag_cpu = time.perf_counter() - began, time.process_time() - cpu
        began = time.perf_counter()
        with open(Path(folder) / "plain", "wb", buffering=0) as plain:
            for _ in range(FRAMES):
                for data in messages.values():
                    plain.write(data)
                os.fsync(plain.fileno())
        plain_seconds = time.perf_counter() - began
    return [
        Row(f"bag of 5 layers ({size_mb:.1f} MB a frame), zstd", FRAMES / bag_seconds, "frames/s"),
        Row("processor time of writing a frame", 1000.0 * bag_cpu / FRAMES, "ms"),
        Row("the same bytes to a plain file", FRAMES / plain_seconds, "frames/s"),
        Row("share of the plain file's speed", plain_seconds / bag_seconds, ""),
    ]
