"""Frames of the sample room whose body has an inertial measurement unit."""

from types import SimpleNamespace

from sample_scene import sample_scene

from renderer.body.config import ImuConfig
from scene_description import to_mapping
from scene_description.poses import world_from_optical

CONFIG = ImuConfig(enabled=True, mount_m=(0.1, 0.0, -0.05), mount_rotation_rad=(0.3, 0.1, -2.0), clock_offset_s=0.002)
SCENE = sample_scene()


def frame_of(number: int, config: ImuConfig = CONFIG) -> SimpleNamespace:
    """Return frame ``number`` of the sample room, as converters ask for it, with the settings of a device."""
    pose = SCENE.camera_path[number]
    matrix = world_from_optical(pose.position_m, pose.orientation)
    return SimpleNamespace(settings={"imu": to_mapping(config)}, scene=SCENE, has_scene=True, stamp_ns=pose.stamp_ns, matrix=matrix)
