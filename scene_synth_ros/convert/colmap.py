"""COLMAP: a folder a room with ``images`` and ``sparse/0``, the model that a reconstruction without errors would have.

Poses and intrinsics are the true ones, points come from depth (:mod:`scene_synth_ros.convert.sparse_points`).  All cameras of a room
share its model.  Metres, z up, the frame of the map.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from scene_synth_ros.convert.colmap_files import ColmapImage, Model, cameras_bin, images_bin, model_of, points_bin
from scene_synth_ros.convert.image_files import write_picture
from scene_synth_ros.convert.lens import Lens, lens_of, refuse_lens
from scene_synth_ros.convert.poses import camera_pose
from scene_synth_ros.convert.shutter import refuse_rolling_shutter
from scene_synth_ros.convert.sparse_points import Cells, Glimpse, SparsePoints, cells_of, glimpse
from scene_synth_ros.convert.writer import Sequence, Source, Writer
from scene_synth_ros.dataset import Frame


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
        """Take the folder and the source."""
        self._out, self._source = out, source
        self._rooms: dict[str, _Room] = {}

    def begin_sequence(self, sequence: Sequence) -> _View:
        """Make the folders of a room and of a camera in it.

        Raises:
            ConvertError: COLMAP has no model of the lens, or the shutter rolls.
        """
        refuse_rolling_shutter(self._source.frame(sequence, 0), sequence.camera, "colmap")
        lens = lens_of(self._source.camera(sequence))
        model = model_of(lens)
        if model is None:
            raise refuse_lens(lens, sequence.camera, "colmap", "with a field of view below 180 degrees", "choose --to nerfstudio")
        room = self._rooms.setdefault(sequence.folder, _Room(self._out / sequence.folder))
        room.cameras.append((model, lens))
        folder = sequence.name.removeprefix(sequence.folder).lstrip("_") if sequence.cameras > 1 else ""
        (room.path / "images" / folder).mkdir(parents=True)
        return _View(room, sequence, lens, cells_of(lens), len(room.cameras), folder)

    def encode(self, frame: Frame, number: int, state: _View) -> tuple[ColmapImage, Glimpse]:
        """Write the picture; return the image, and what it adds to the points."""
        pose, roles = camera_pose(frame), self._source.roles
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

    def finish(self) -> tuple[str, ...]:
        """Return no notes."""
        return ()
