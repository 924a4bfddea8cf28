"""A bag of the sample room, seen from a base that turns as it goes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from sample_scene import sample_scene

from grammar.camera.motion_plan import poses_of
from grammar.synthesize import FloorMap
from scene_description import SceneDescription
from scene_description.motion import Drive, Motion
from scene_synth_ros.cli.parameters.run_parameters import RunWords, run_parameters
from scene_synth_ros.offline.offline_bag import OfflineBag
from scene_synth_ros.offline.settings import read_settings

FRAMES = 8


def moving_scene() -> SceneDescription:
    """The sample room, seen from a base that turns as it goes; frames at 7 Hz."""
    scene = sample_scene()
    times = (np.arange(40) - 2.0) * 0.05
    drive = Drive(start_m=(1.0, 1.0), distances_m=tuple((0.2 * times).tolist()), headings_rad=tuple((0.5 * np.sin(times)).tolist()))
    motion = Motion(kind="base", spacing_s=0.05, drive=drive, camera_m=(0.05, 0.0, 0.9))
    stamps = [10**9 + round(k * 1e9 / 7.0) for k in range(FRAMES)]
    return replace(scene, camera_path=poses_of(motion, stamps), motion=motion)


def write_bag(folder: Path, *words: str) -> Path:
    settings = read_settings(run_parameters(RunWords(record=Path("bag"), overrides=tuple(f"renderer_node.{word}" for word in words))))
    with OfflineBag(folder, settings, lambda scene: FloorMap(np.zeros((4, 4), np.int8), 0.05, (0.0, 0.0))) as bag:
        bag.add_room(moving_scene())
    return folder


def stamp_of(message) -> int:
    return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
