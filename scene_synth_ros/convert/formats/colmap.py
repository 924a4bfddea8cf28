"""COLMAP: a folder a room with ``images`` and ``sparse/0``, the model that a reconstruction without errors would have.

Poses and intrinsics are the true ones, points come from depth (:mod:`scene_synth_ros.convert.sparse_points`).  All cameras of a room
share its model.  Metres, z up, the frame of the map.  The model is COLMAP's binary one (https://colmap.github.io/format.html):
little-endian; pixel coordinates have the upper left corner of the image at (0, 0), so the centre of the first pixel at (0.5, 0.5).
"""

import struct
from collections.abc import Sequence as Items
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scene_description import CameraPose
from scene_description.poses import quaternion_from_rotation
from scene_synth_ros.convert.camera import HALF_PIXEL, Lens, camera_from_world, camera_pose, lens_of, refuse_lens, refuse_rolling_shutter
from scene_synth_ros.convert.files import write_picture
from scene_synth_ros.convert.sparse_points import Cells, Glimpse, SparsePoints, cells_of, glimpse
from scene_synth_ros.convert.writer import Sequence, Source, Writer
from scene_synth_ros.dataset import Frame

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


@dataclass(slots=True)
class _Room:
    """The model of a room in the making."""

    path: Path
    cameras: list[tuple[Model, Lens]] = field(default_factory=list)
    images: list[ColmapImage] = field(default_factory=list)
    points: SparsePoints = field(default_factory=SparsePoints)


class _View(NamedTuple):
    """A camera of a room; ``folder``: of its images, below ``images``, by the camera's name; empty where there is one camera."""

    room: _Room
    sequence: Sequence
    lens: Lens
    cells: Cells
    number: int
    folder: str


class FormatWriter(Writer):
    """Writes COLMAP models."""

    def begin(self, out: Path, source: Source) -> None:
        """Begin with no room."""
        super().begin(out, source)
        self._rooms: dict[str, _Room] = {}

    def begin_sequence(self, sequence: Sequence) -> _View:
        """Make the folders of a room and of a camera in it.

        Raises:
            ConvertError: COLMAP has no model of the lens, or the shutter rolls.
        """
        refuse_rolling_shutter(self.source.frame(sequence, 0), sequence.camera, self.name)
        lens = lens_of(self.source.camera(sequence))
        model = model_of(lens)
        if model is None:
            raise refuse_lens(lens, sequence.camera, self.name, "with a field of view below 180 degrees", "choose --to nerfstudio")
        room = self._rooms.setdefault(sequence.folder, _Room(self.out / sequence.folder))
        room.cameras.append((model, lens))
        folder = sequence.name.removeprefix(sequence.folder).lstrip("_") if sequence.cameras > 1 else ""
        (room.path / "images" / folder).mkdir(parents=True)
        return _View(room, sequence, lens, cells_of(lens), len(room.cameras), folder)

    def encode(self, frame: Frame, number: int, state: _View) -> tuple[ColmapImage, Glimpse]:
        """Write the picture; return the image, and what it adds to the points."""
        pose, roles = camera_pose(frame), self.source.roles
        name = write_picture(frame, roles["picture"], state.room.path / "images" / state.folder / f"{number:06d}")
        seen = glimpse(state.lens, state.cells, pose, frame[roles["depth"]], frame[roles["picture"]])
        return ColmapImage(f"{state.folder}/{name}".lstrip("/"), state.number, pose), seen

    def take(self, item: tuple[ColmapImage, Glimpse], state: _View) -> None:
        """Add image and points to the room."""
        state.room.images.append(item[0])
        state.room.points.add(item[1])

    def end_sequence(self, state: _View) -> None:
        """Write the model after the last camera of the room."""
        if state.sequence.place < state.sequence.cameras - 1:
            return
        room = self._rooms.pop(state.sequence.folder)
        model = room.path / "sparse" / "0"
        model.mkdir(parents=True)
        (model / "cameras.bin").write_bytes(cameras_bin(room.cameras))
        (model / "images.bin").write_bytes(images_bin(room.images, room.points))
        (model / "points3D.bin").write_bytes(points_bin(room.points))


def model_of(lens: Lens) -> Model | None:
    """Return the model that carries a lens, the simplest of several; None where there is none."""
    if lens.model == "brown_conrady":
        return _FULL if lens.coefficients[4] else _OPENCV
    return {"pinhole": _PINHOLE, "rational": _FULL, "kannala_brandt": _FISHEYE}.get(lens.model)


def cameras_bin(lenses: Items[tuple[Model, Lens]]) -> bytes:
    """Return ``cameras.bin``; cameras are numbered from 1."""
    parts = [_COUNT.pack(len(lenses))]
    for number, (model, lens) in enumerate(lenses, 1):
        told = (*lens.coefficients, *(0.0,) * 8)
        numbers = [lens.fx, lens.fy, lens.cx + HALF_PIXEL, lens.cy + HALF_PIXEL, *(told[place] for place in model.coefficients)]
        parts.append(_CAMERA.pack(number, model.number, lens.width, lens.height) + struct.pack(f"<{len(numbers)}d", *numbers))
    return b"".join(parts)


def images_bin(images: Items[ColmapImage], points: SparsePoints) -> bytes:
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
