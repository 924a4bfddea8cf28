"""Bags of estimates with known faults, for the tests of what judges them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from rclpy.serialization import serialize_message
from room_bag import RoomBag

from scene_synth_ros.bags.bag_writer import BagWriter
from scene_synth_ros.evaluate.task_streams import TASK_STREAMS
from scene_synth_ros.messages.conversions import ENCODING_CHANNELS, image_to_msg

Images = dict[str, np.ndarray]
Frames = dict[int, Images]
"""Stamp -> task -> estimate."""


def noisy_frames(bag: RoomBag, seed: int = 1) -> Frames:
    """Return estimates of depth, normals and classes of a tolerable algorithm: seeded errors of a few per cent."""
    rng = np.random.default_rng(seed)
    return {stamp: _noisy(images, rng) for stamp, images in sorted(bag.images.items())}


def _noisy(truth: Mapping[str, np.ndarray], rng: np.random.Generator) -> Images:
    depth = truth["depth"] * rng.normal(1.0, 0.02, truth["depth"].shape)
    normals = truth["normals"] + rng.normal(0.0, 0.05, truth["normals"].shape)
    semantic = np.where(rng.random(truth["semantic"].shape) < 0.05, 1, truth["semantic"])
    return {"depth": depth.astype(np.float32), "normals": normals.astype(np.float32), "semantic": semantic.astype(np.uint16)}


def write_estimates(folder: Path, frames: Frames, frame_id: str = "eye") -> Path:
    """Write estimates on the default topics."""
    with BagWriter(folder) as writer:
        for stamp, images in frames.items():
            for task, pixels in images.items():
                stream = TASK_STREAMS[task]
                message = image_to_msg(
                    np.ascontiguousarray(pixels, ENCODING_CHANNELS[stream.encoding][0]), stream.encoding, stamp, frame_id
                )
                writer.add_topic(stream.estimate, stream.types[0])
                writer.write(stream.estimate, bytes(serialize_message(message)), stamp, stamp)
    return folder


def _each(task: str, change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Frames], Frames]:
    return lambda frames: {stamp: {**images, task: change(images[task])} for stamp, images in frames.items()}


def _swapped(frames: Frames) -> Frames:
    stamps = list(frames)
    return dict(zip(stamps, [frames[stamp] for i in range(0, len(stamps), 2) for stamp in reversed(stamps[i : i + 2])], strict=True))


def _delayed(frames: Frames) -> Frames:
    stamps = list(frames)
    return dict(zip(stamps[1:], [frames[stamp] for stamp in stamps[:-1]], strict=True))


def _half_and_back(pixels: np.ndarray) -> np.ndarray:
    return pixels[::2, ::2].repeat(2, axis=0).repeat(2, axis=1)


def _with_holes(pixels: np.ndarray) -> np.ndarray:
    return np.where(np.random.default_rng(5).random(pixels.shape) < 0.3, np.nan, pixels)


def _exchanged(pixels: np.ndarray) -> np.ndarray:
    return np.where(pixels == 5, 7, np.where(pixels == 7, 5, pixels))


REGRESSIONS: dict[str, Callable[[Frames], Frames]] = {
    "depth is 5 % too far": _each("depth", lambda pixels: pixels * 1.05),
    "stamps of neighbours are swapped": _swapped,
    "each estimate has the stamp of the next frame": _delayed,
    "depth has half the resolution": _each("depth", lambda pixels: pixels[::2, ::2]),
    "depth is made at half the resolution and scaled up": _each("depth", _half_and_back),
    "a third of the depth is missing": _each("depth", _with_holes),
    "normals are in another frame's axes": _each("normals", lambda pixels: pixels[..., [2, 0, 1]]),
    "a class is dropped": _each("semantic", lambda pixels: np.where(pixels == 5, 0, pixels)),
    "two classes are exchanged": _each("semantic", _exchanged),
    "every third frame has no estimate": lambda frames: {stamp: frames[stamp] for i, stamp in enumerate(frames) if i % 3},
}
"""What went wrong -> what becomes of the estimates."""


def summary_values(evaluation: Any, task: str, by: str = "all") -> dict[Any, dict[str, float | None]]:
    """Return key -> metric -> value of one way of an evaluation's summary."""
    rows = [row for row in evaluation.summary if row.task == task and row.by == by]
    return {row.key: {name: found.value for name, found in row.metrics.items()} for row in rows}
