"""Which random numbers a frame's noise is made of: the index that the renderer is given."""

from __future__ import annotations

from scene_description import CameraPose, SceneDescription

OFF_PATH = 2**62
"""Frames beyond the camera path (on demand, driven by hand) are numbered from here on by their stamps."""


def path_indices(scene: SceneDescription) -> dict[int, int]:
    """Return stamp (ns) -> position in the camera path."""
    return {pose.stamp_ns: index for index, pose in enumerate(scene.camera_path)}


def frame_index(scene: SceneDescription, pose: CameraPose) -> int:
    """Return the index of a frame: its position in the camera path if it is one of its poses, else a number made of its stamp."""
    index = path_indices(scene).get(pose.stamp_ns)
    if index is not None and scene.camera_path[index] == pose:
        return index
    return OFF_PATH + pose.stamp_ns
