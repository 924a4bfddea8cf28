"""nerfstudio: a folder a room and camera with ``transforms.json``, pictures, depth in millimetres, and points to start from.

Data conventions: https://docs.nerf.studio/quickstart/data_conventions.html.  ``transform_matrix`` takes points of OpenGL's camera (x right,
y up, z backward) to the map (metres, z up); the centre of the first pixel is at (0.5, 0.5).
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from scene_synth_ros.convert.camera import HALF_PIXEL, Lens, camera_pose, lens_of, refuse_lens, refuse_rolling_shutter, world_from_opengl
from scene_synth_ros.convert.files import ply_points, write_depth, write_json, write_picture, write_png
from scene_synth_ros.convert.sparse_points import Cells, Glimpse, SparsePoints, cells_of, glimpse
from scene_synth_ros.convert.writer import Sequence, Writer
from scene_synth_ros.dataset import Frame

STEPS_A_METRE = 1000.0
_POINTS = "sparse_pc.ply"
_MASK = "mask.png"
"""White where the lens sees something; written where that is not everywhere."""
_COEFFICIENTS = {
    "pinhole": ("OPENCV", ()),
    "brown_conrady": ("OPENCV", ("k1", "k2", "p1", "p2", "k3")),
    "kannala_brandt": ("OPENCV_FISHEYE", ("k1", "k2", "k3", "k4")),
    "equirectangular": ("EQUIRECTANGULAR", ()),
}
"""Lens -> camera_model, and the names of its coefficients in the order of CameraInfo's D."""


@dataclass(slots=True)
class _Folder:
    """A sequence in the making; ``cells``: None where there is no depth, or no axis to measure it along."""

    path: Path
    camera: dict[str, Any]
    lens: Lens
    cells: Cells | None
    is_masked: bool
    frames: list[dict[str, Any]] = field(default_factory=list)
    points: SparsePoints = field(default_factory=SparsePoints)


class _Item(NamedTuple):
    """A frame: its row, what it adds to the points, and how many pixels are too far away."""

    row: dict[str, Any]
    seen: Glimpse | None
    beyond: int


class FormatWriter(Writer):
    """Writes folders for nerfstudio."""

    steps_a_metre = STEPS_A_METRE

    def begin_sequence(self, sequence: Sequence) -> _Folder:
        """Make the folders of a sequence.

        Raises:
            ConvertError: nerfstudio has no model of the lens, or the shutter rolls.
        """
        refuse_rolling_shutter(self.source.frame(sequence, 0), sequence.camera, self.name)
        lens = lens_of(self.source.camera(sequence))
        if lens.model not in _COEFFICIENTS:
            raise refuse_lens(lens, sequence.camera, self.name, "of plumb_bob, equidistant or equirectangular", "choose --to colmap")
        path = self.out / sequence.name
        (path / "images").mkdir(parents=True)
        has_depth = "depth" in self.source.roles
        if has_depth:
            (path / "depth").mkdir()
        seen = lens.sees()
        if not seen.all():
            write_png(path / _MASK, seen.astype(np.uint8) * np.uint8(255))
        return _Folder(path, camera_entries(lens), lens, cells_of(lens) if has_depth else None, not seen.all())

    def encode(self, frame: Frame, number: int, state: _Folder) -> _Item:
        """Write picture and depth; return the frame's row."""
        pose, roles = camera_pose(frame), self.source.roles
        picture = write_picture(frame, roles["picture"], state.path / "images" / f"frame_{number:05d}")
        row: dict[str, Any] = {"file_path": f"images/{picture}", "transform_matrix": world_from_opengl(pose).tolist()}
        if state.is_masked:
            row["mask_path"] = _MASK
        if state.cells is None:
            return _Item(row, None, 0)
        depth_m = frame[roles["depth"]]
        name = f"depth/frame_{number:05d}.png"
        beyond = write_depth(state.path / name, depth_m, STEPS_A_METRE)
        seen = glimpse(state.lens, state.cells, pose, depth_m, frame[roles["picture"]])
        return _Item(row | {"depth_file_path": name}, seen, beyond)

    def take(self, item: _Item, state: _Folder) -> None:
        """Keep the row, and the points."""
        state.frames.append(item.row)
        self.beyond += item.beyond
        if item.seen is not None:
            state.points.add(item.seen)

    def end_sequence(self, state: _Folder) -> None:
        """Write points and ``transforms.json``."""
        meta = dict(state.camera)
        if state.cells is not None:
            (state.path / _POINTS).write_bytes(ply_points(state.points.points_m, state.points.colors))
            meta["ply_file_path"] = _POINTS
        write_json(state.path / "transforms.json", meta | {"frames": state.frames})


def camera_entries(lens: Lens) -> dict[str, Any]:
    """Return what ``transforms.json`` says of a lens.

    A panorama spans pi over ``fl_x`` = half its width and over ``fl_y`` = its height, as nerfstudio's rays do.
    """
    name, keys = _COEFFICIENTS[lens.model]
    fx, fy = (0.5 * lens.width, float(lens.height)) if lens.model == "equirectangular" else (lens.fx, lens.fy)
    entries = {"camera_model": name, "w": lens.width, "h": lens.height, "fl_x": fx, "fl_y": fy}
    entries |= {"cx": lens.cx + HALF_PIXEL, "cy": lens.cy + HALF_PIXEL}
    return entries | dict(zip(keys, lens.coefficients, strict=True))
