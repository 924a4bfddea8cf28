"""Bags: the recorder's writing beside the bare ``mcap`` writer with the same messages."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median

from mcap.writer import CompressionType, Writer
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message

from benchmarks.stream_bench import make_frame
from benchmarks.table import Row, at_least
from renderer import LAYERS
from scene_synth_ros.bags.bag_writer import DEFAULT_CHUNK_SIZE, BagWriter
from scene_synth_ros.messages.conversions import image_to_msg, layer_encoding
from scene_synth_ros.messages.message_definitions import message_definition
from scene_synth_ros.record.recording import Recording

FRAMES, ROUNDS = 40, 5
TYPE = "sensor_msgs/msg/Image"
Frames = list[tuple[int, dict[str, bytes]]]
"""Stamp (ns) -> topic -> serialised message."""


def measure() -> list[Row]:
    """Write frames of five layers both ways, in turns; medians of rounds are taken."""
    frame = make_frame()
    stamps = [1 + index * 33_333_333 for index in range(FRAMES)]
    frames: Frames = [
        (
            stamp,
            {
                f"/{name}": bytes(serialize_message(image_to_msg(image, layer_encoding(LAYERS[name]), stamp, "eye")))
                for name, image in items
            },
        )
        for stamp in stamps
        for items in [frame.layers.items()]
    ]
    size_mb = sum(map(len, frames[0][1].values())) / 1e6
    ours, bare = [], []
    for _ in range(ROUNDS):
        ours.append(_timed(_record, frames))
        bare.append(_timed(_write_bare, frames))
    return [
        Row(f"recorder, 5 layers ({size_mb:.1f} MB a frame), zstd, synced", FRAMES / median(seconds for seconds, _ in ours), "frames/s"),
        Row("  processor time of a frame", 1000.0 * median(spent for _, spent in ours) / FRAMES, "ms"),
        Row("bare mcap writer, the same messages, zstd", FRAMES / median(seconds for seconds, _ in bare), "frames/s"),
        Row("  processor time of a frame", 1000.0 * median(spent for _, spent in bare) / FRAMES, "ms"),
        at_least("recorder over bare mcap writer", median(b / a for (a, _), (b, _) in zip(ours, bare, strict=True)), "", 0.8),
    ]


def _timed(write: Callable[[Path, Frames], None], frames: Frames) -> tuple[float, float]:
    """Return elapsed and processor seconds until everything is on disk."""
    with tempfile.TemporaryDirectory() as folder:
        cpu, began = time.process_time(), time.perf_counter()
        write(Path(folder) / "bag", frames)
        return time.perf_counter() - began, time.process_time() - cpu


def _record(path: Path, frames: Frames) -> None:
    """Do what the recorder does with messages that arrive: sort, sum up, compress, index, sync every chunk."""
    recording = Recording(BagWriter)
    for topic in frames[0][1]:
        recording.add_topic(topic, TYPE, [QoSProfile(depth=10)])
    recording.expect(frames[0][1], {})
    recording.begin(path)
    for _, messages in frames:
        for topic, data in messages.items():
            recording.add(topic, data)
    recording.close()


def _write_bare(path: Path, frames: Frames) -> None:
    """Write with the library's own writer, in chunks of the same size; sync once, at the end."""
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=DEFAULT_CHUNK_SIZE, compression=CompressionType.ZSTD)
        writer.start("ros2", "bench")
        schema = writer.register_schema(TYPE, "ros2msg", message_definition(TYPE).text.encode())
        channels = {topic: writer.register_channel(topic, "cdr", schema) for topic in frames[0][1]}
        for stamp, messages in frames:
            for topic, data in messages.items():
                writer.add_message(channels[topic], stamp, data, stamp)
        writer.finish()
        file.flush()
        os.fsync(file.fileno())
