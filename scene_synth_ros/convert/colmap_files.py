"""COLMAP's binary model: cameras, images and points (https://colmap.github.io/format.html).

Little-endian; pixel coordinates have the upper left corner of the image at (0, 0), so the centre of the first pixel at (0.5, 0.5).
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from scene_description import CameraPose
from scene_description.poses import quaternion_from_rotation
from scene_synth_ros.convert.lens import HALF_PIXEL, Lens
from scene_synth_ros.convert.poses import camera_from_world
from scene_synth_ros.convert.sparse_points import SparsePoints

_COUNT = struct.Struct("<Q")
_CAMERA = struct.Struct("<iiQQ")
_IMAGE = struct.Struct("<i7di")
_POINT = struct.Struct("<Q3d3BdQ")
_PIXEL = np.dtype([("xy", "<f8", 2), ("point", "<i8")])
_TRACK = np.dtype([("image", "<i4"), ("pixel", "<i4")])


class Model(NamedTuple):
    """A camera model of COLMAP: its number and, of our coefficients, which stand for its own and in which order."""

    number: int
    name: str
    coefficients: tuple[int, ...]


_PINHOLE = Model(1, "PINHOLE", ())
_OPENCV = Model(4, "OPENCV", (0, 1, 2, 3))
_FISHEYE = Model(5, "OPENCV_FISHEYE", (0, 1, 2, 3))
_FULL = Model(6, "FULL_OPENCV", (0, 1, 2, 3, 4, 5, 6, 7))


class ColmapImage(NamedTuple):
    """An image: its name, the number of its camera, its pose."""

    name: str
    camera: int
    pose: CameraPose


def model_of(lens: Lens) -> Model | None:
    """Return the model that carries a lens, the simplest of several; None where there is none."""
    if lens.model == "brown_conrady":
        return _FULL if lens.coefficients[4] else _OPENCV
    return {"pinhole": _PINHOLE, "rational": _FULL, "kannala_brandt": _FISHEYE}.get(lens.model)


def cameras_bin(lenses: Sequence[tuple[Model, Lens]]) -> bytes:
    """Return ``cameras.bin``; cameras are numbered from 1."""
    parts = [_COUNT.pack(len(lenses))]
    for number, (model, lens) in enumerate(lenses, 1):
        told = (*lens.coefficients, *(0.0,) * 8)
        numbers = [lens.fx, lens.fy, lens.cx + HALF_PIXEL, lens.cy + HALF_PIXEL, *(told[place] for place in model.coefficients)]
        parts.append(_CAMERA.pack(number, model.number, lens.width, lens.height) + struct.pack(f"<{len(numbers)}d", *numbers))
    return b"".join(parts)


def images_bin(images: Sequence[ColmapImage], points: SparsePoints) -> bytes:
    """Return ``images.bin``; images are numbered from 1, points too, and image i sees ``points.seen[i]``."""
    parts = [_COUNT.pack(len(images))]
    for number, (image, seen) in enumerate(zip(images, points.seen, strict=True), 1):
        matrix = camera_from_world(image.pose)
        x, y, z, w = quaternion_from_rotation(matrix[:3, :3])
        rows = np.zeros(len(seen.points), _PIXEL)
        rows["xy"], rows["point"] = seen.pixels + HALF_PIXEL, seen.points + 1
        parts += [_IMAGE.pack(number, w, x, y, z, *matrix[:3, 3], image.camera), image.name.encode(), b"\0"]
        parts += [_COUNT.pack(len(rows)), rows.tobytes()]
    return b"".join(parts)


def points_bin(points: SparsePoints) -> bytes:
    """Return ``points3D.bin``; the error of every point is 0."""
    owner = np.concatenate([seen.points for seen in points.seen] or [np.zeros(0, np.int64)])
    tracks = np.zeros(len(owner), _TRACK)
    tracks["image"] = np.repeat(np.arange(1, len(points.seen) + 1), [len(seen.points) for seen in points.seen])
    tracks["pixel"] = np.concatenate([np.arange(len(seen.points)) for seen in points.seen] or [np.zeros(0, np.int64)])
    order = np.argsort(owner, kind="stable")
    ends = np.searchsorted(owner[order], np.arange(len(points.points_m) + 1))
    tracks = tracks[order]
    parts = [_COUNT.pack(len(points.points_m))]
    for number, (point, color) in enumerate(zip(points.points_m.tolist(), points.colors.tolist(), strict=True)):
        track = tracks[ends[number] : ends[number + 1]]
        parts += [_POINT.pack(number + 1, *point, *color, 0.0, len(track)), track.tobytes()]
    return b"".join(parts)
