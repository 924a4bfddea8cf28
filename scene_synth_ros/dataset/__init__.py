"""Frames of bags, shards and datasets as numpy arrays, in any order; no ROS is needed.

>>> from scene_synth_ros.dataset import open_dataset
>>> data = open_dataset("rooms", layers=("color", "depth", "semantic"))  # doctest: +SKIP
>>> data[17]["color"].shape, data[17].pose.position_m  # doctest: +SKIP
"""

from scene_synth_ros.dataset.camera import Camera, Pose
from scene_synth_ros.dataset.dataset import Dataset, open_dataset, without_damaged
from scene_synth_ros.dataset.errors import DatasetError
from scene_synth_ros.dataset.frame import Frame
from scene_synth_ros.dataset.rooms import RoomInfo

__all__ = ["Camera", "Dataset", "DatasetError", "Frame", "Pose", "RoomInfo", "open_dataset", "without_damaged"]
