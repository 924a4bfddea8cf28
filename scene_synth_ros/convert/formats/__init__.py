"""The table of formats: what each is, which layers it needs, and the module of its writer, which is loaded only when it is asked for."""

import importlib
from typing import NamedTuple

from scene_synth_ros.convert.writer import Role, Writer

COLOR = ("color", "color_sensed", "color_noisy")
DEPTH = ("depth", "depth_sensed")
_PICTURE, _DEPTH = Role("picture", COLOR), Role("depth", DEPTH)
_FIRST_DEPTH = Role("depth", DEPTH, required=False, first_only=True)
_INSTANCE = Role("instance", ("instance",))


class Format(NamedTuple):
    """A format.

    Attributes:
        summary: for people.
        module: below ``scene_synth_ros.convert.formats``.
        roles: the layers that it has a place for.
        any_layer: whether it carries other layers too, those that ``--layers`` names.
        unasked: whether it takes them all where ``--layers`` names none.
        writer: class in the module.
    """

    summary: str
    module: str
    roles: tuple[Role, ...]
    any_layer: bool = False
    unasked: bool = True
    writer: str = "FormatWriter"


FORMATS: dict[str, Format] = {
    "coco": Format(
        "COCO: instances with masks, panoptic segments", "coco", (_PICTURE, _INSTANCE, Role("semantic", ("semantic",), required=False))
    ),
    "bop": Format("BOP: poses, masks and models of objects", "bop", (_PICTURE, _DEPTH, _INSTANCE)),
    "tum": Format("TUM RGB-D: pictures, depth and trajectory for SLAM", "tum", (_PICTURE, _DEPTH)),
    "euroc": Format("EuRoC (ASL): grey pictures and poses of one or more cameras", "euroc", (_PICTURE,)),
    "kitti": Format("KITTI odometry: grey pictures and poses of a camera or a rectified pair", "kitti", (_PICTURE,)),
    "vslam-lab": Format(
        "VSLAM-LAB: pictures of one or more cameras, depth of the first, inertial readings", "vslam_lab", (_PICTURE, _FIRST_DEPTH)
    ),
    "nerfstudio": Format(
        "nerfstudio: transforms.json with pictures and depth", "nerfstudio", (_PICTURE, Role("depth", DEPTH, required=False))
    ),
    "colmap": Format("COLMAP: a sparse model with exact poses, points from depth", "colmap", (_PICTURE, _DEPTH)),
    "webdataset": Format("WebDataset: tar files with everything of a frame, for training", "webdataset", (), any_layer=True),
    "lerobot": Format(
        "LeRobot v3.0: camera paths as episodes, images in Parquet",
        "lerobot",
        (_PICTURE, Role("depth", DEPTH, required=False)),
        any_layer=True,
        unasked=False,
    ),
    "hdf5": Format("HDF5: one file, an array for each layer of a room", "hdf5", (), any_layer=True),
    "frames": Format("plain folders: PNG, NPZ and JSON", "frames", (), any_layer=True),
    "frames_exr": Format("plain folders: PNG, OpenEXR and JSON", "frames", (), any_layer=True, writer="ExrFormatWriter"),
}
"""Name, as of ``--to`` -> format."""


def writer_of(name: str) -> Writer:
    """Return a new writer of a format.

    Raises:
        ConvertError: a library that it needs is not installed.
    """
    form = FORMATS[name]
    writer: Writer = getattr(importlib.import_module(f"scene_synth_ros.convert.formats.{form.module}"), form.writer)(name)
    return writer
