"""A slow walk through a sampled room as an algorithm sees it: path-traced pictures, cached ones, and what is true of their motion."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.references import References
from benchmarks.sampled_rooms import SLOW, SampledRoom, camera_of, preset_config, sample_room
from grammar.synthesize import SceneSynthesizer
from renderer import Renderer

ROOM_TYPES, SIZE = ("bedroom", "kitchen", "living_room"), (320, 240)
TRUTH = ("depth", "flow", "flow_backward", "occlusion", "occlusion_backward", "instance", "part", "material", "roughness", "metallic")
"""Layers that tell of the motion, and which pixels are matt."""


class Walk(NamedTuple):
    """Frames of one room.

    Attributes:
        room: with as many poses as there are frames.
        traced, cached: pictures, (h, w, 3) uint8 each, by the path tracer, denoised, and by the cache.
        truth: layers of ``TRUTH``.
    """

    room: SampledRoom
    traced: list[NDArray[np.uint8]]
    cached: list[NDArray[np.uint8]]
    truth: list[dict[str, NDArray[Any]]]


def walks(types: tuple[str, ...], frames: int, preset: str, references: References) -> Iterator[Walk]:
    """Yield a walk of so many frames, 15 a second at 0.5 m/s, through the first room of each type."""
    synthesizer = SceneSynthesizer.from_config()
    for room_type in types:
        room = sample_room(synthesizer, room_type, 0, SLOW)
        room = room._replace(path=room.path[:frames])
        cached, truth = [], []
        with Renderer(room.flat, camera_of(SIZE), preset_config(preset), room.key) as renderer:
            for index, pose in enumerate(room.path):
                frame = renderer.render(pose, index, ("color", *TRUTH), exposure=room.exposure, path=room.path)
                cached.append(np.array(frame.layers["color"]))
                truth.append({name: np.array(frame.layers[name]) for name in TRUTH})
        yield Walk(room, [references.view(room, index, SIZE).color for index in range(len(room.path))], cached, truth)
