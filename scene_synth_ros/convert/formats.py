"""The table of formats: what each is, which layers it needs, and the module of its writer, which is loaded only when it is asked for."""

from __future__ import annotations

import importlib
from typing import NamedTuple

from scene_synth_ros.convert.writer import Role, Writer

COLOR = ("color", "color_sensed", "color_noisy")
DEPTH = ("depth", "depth_sensed")
_PICTURE, _DEPTH = Role("picture", COLOR), Role("depth", DEPTH)
_INSTANCE = Role("instance", ("instance",))


class Format(NamedTuple):
    """A format.

    Attributes:
        summary: for people.
        module: below ``scene_synth_ros.convert``; has a class ``FormatWriter`` without arguments.
        roles: the layers that it has a place for.
        any_layer: whether it carries other layers too, those that ``--layers`` names.
    """

    summary: str
    module: str
    roles: tuple[Role, ...]
    any_layer: bool = False


FORMATS: dict[str, Format] = {
    "coco": Format(
        "COCO: instances with masks, panoptic segments", "coco", (_PICTURE, _INSTANCE, Role("semantic", ("semantic",), required=False))
    ),
    "bop": Format("BOP: poses, masks and models of objects", "bop", (_PICTURE, _DEPTH, _INSTANCE)),
    "tum": Format("TUM RGB-D: pictures, depth and trajectory for SLAM", "tum", (_PICTURE, _DEPTH)),
    "euroc": Format("EuRoC (ASL): grey pictures and poses of one or more cameras", "euroc", (_PICTURE,)),
    "nerfstudio": Format(
        "nerfstudio: transforms.json with pictures and depth", "nerfstudio", (_PICTURE, Role("depth", DEPTH, required=False))
    ),
    "colmap": Format("COLMAP: a sparse model with exact poses, points from depth", "colmap", (_PICTURE, _DEPTH)),
}
"""Name, as of ``--to`` -> format."""


def writer_of(name: str) -> Writer:
    """Return a new writer of a format.

    Raises:
        ConvertError: a library that it needs is not installed.
    """
    writer: Writer = importlib.import_module(f"scene_synth_ros.convert.{FORMATS[name].module}").FormatWriter()
    return writer
