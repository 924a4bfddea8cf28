"""BOP: images with the poses and masks of the objects in them, and the objects' models, for 6D pose estimation.

Format: https://github.com/thodan/bop_toolkit/blob/master/docs/bop_datasets_format.md.  A room and camera is a scene below ``train_pbr``,
``val`` or ``test``.  ``scene_gt.json`` lists the objects and openings that have at least one pixel of the frame; ``scene_gt_info.json``
tells of each what the toolkit's ``calc_gt_info.py`` computes, boxes as it has them: from the first to the last pixel, width and height are
their differences.  Models are in millimetres; equal ones of all rooms have one number.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.annotations.object_meshes import ObjectMeshes
from renderer.annotations.silhouettes import Silhouette, Silhouettes
from renderer.camera.config import CameraConfig
from renderer.scene.flatten import flatten
from scene_description.products import matmul
from scene_synth_ros.convert.camera import Lens, camera_from_world, camera_pose, lens_of, refuse_lens, refuse_rolling_shutter
from scene_synth_ros.convert.files import depth_steps, ply_mesh, write_json, write_picture, write_png
from scene_synth_ros.convert.formats.bop_models import ModelLibrary, ObjectPose
from scene_synth_ros.convert.writer import Sequence, Source, Writer
from scene_synth_ros.dataset import Frame

_SCALES_MM = (0.1, 0.2, 0.5, 1.0)
"""A frame's depth has the finest of these steps that its farthest pixel fits into."""
_MM = 1000.0
_FOLDERS = {None: "train_pbr", "train": "train_pbr"}
"""Split -> folder; others go by their own name."""


@dataclass(slots=True)
class _Scene:
    """A scene in the making."""

    path: Path
    lens: Lens
    meshes: ObjectMeshes
    silhouettes: Silhouettes
    objects: Mapping[int, ObjectPose]
    cameras: dict[str, Any] = field(default_factory=dict)
    truth: dict[str, Any] = field(default_factory=dict)
    info: dict[str, Any] = field(default_factory=dict)


class _Item(NamedTuple):
    """A frame: its number, and its rows of the three files."""

    number: str
    camera: dict[str, Any]
    truth: list[dict[str, Any]]
    info: list[dict[str, Any]]


class FormatWriter(Writer):
    """Writes BOP datasets."""

    def begin(self, out: Path, source: Source) -> None:
        """Make the folders."""
        super().begin(out, source)
        self._scenes = 0
        self._library = ModelLibrary()
        (out / "models").mkdir()
        self._models: dict[str, Any] = {}

    def begin_sequence(self, sequence: Sequence) -> _Scene:
        """Make the room again for its meshes, and write those models that are new.

        Raises:
            ConvertError: the camera is no pinhole, or its shutter rolls.
            SceneSynthError: the room cannot be made: its own models are not in the catalogue.
        """
        frame = self.source.frame(sequence, 0)
        refuse_rolling_shutter(frame, sequence.camera, self.name)
        lens = lens_of(frame.camera)
        if lens.model != "pinhole":
            raise refuse_lens(
                lens, sequence.camera, self.name, "without distortion", "choose --to coco, or record with camera.model pinhole"
            )
        flat = flatten(frame.scene, self.source.catalog)
        meshes = ObjectMeshes(flat)
        objects, fresh = self._library.add_room(frame.scene, flat, meshes)
        for model in fresh:
            data = ply_mesh(model.mesh.vertices * np.float32(_MM), model.mesh.normals, model.colors, model.mesh.faces)
            (self.out / "models" / f"obj_{model.number:06d}.ply").write_bytes(data)
            self._models[str(model.number)] = model.info()
        path = self.out / _FOLDERS.get(self.source.split, self.source.split or "") / f"{self._scenes:06d}"
        for name in ("rgb", "depth", "mask", "mask_visib"):
            (path / name).mkdir(parents=True)
        if not self._scenes:
            camera = {"cx": lens.cx, "cy": lens.cy, "depth_scale": _SCALES_MM[0], "fx": lens.fx, "fy": lens.fy}
            write_json(self.out / "camera.json", camera | {"height": lens.height, "width": lens.width})
        self._scenes += 1
        return _Scene(path, lens, meshes, Silhouettes(meshes, _camera_config(lens)), objects)

    def encode(self, frame: Frame, number: int, state: _Scene) -> _Item:
        """Write picture, depth and masks; return the frame's rows."""
        roles, pose = self.source.roles, camera_pose(frame)
        write_picture(frame, roles["picture"], state.path / "rgb" / f"{number:06d}")
        depth, scale = stored_depth(frame[roles["depth"]])
        write_png(state.path / "depth" / f"{number:06d}.png", depth)
        instance = np.asarray(frame[roles["instance"]], np.uint16)
        keys = [int(key) for key in np.unique(instance) if int(key) in state.objects]
        silhouettes = state.silhouettes.of_frame(pose, instance, keys)
        matrix = camera_from_world(pose)
        truth, info = [], []
        for place, key in enumerate(keys):
            visible, whole = instance == key, silhouettes[key]
            assert whole is not None  # it has pixels
            info.append(silhouette_info(visible, whole, depth))
            truth.append(_pose_row(state.objects[key], matrix))
            for name, mask in (("mask", whole.inside), ("mask_visib", visible)):
                write_png(state.path / name / f"{number:06d}_{place:06d}.png", mask.astype(np.uint8) * np.uint8(255))
        lens = state.lens
        camera = {
            "cam_K": [lens.fx, 0.0, lens.cx, 0.0, lens.fy, lens.cy, 0.0, 0.0, 1.0],
            "depth_scale": scale,
            "cam_R_w2c": matrix[:3, :3].ravel().tolist(),
            "cam_t_w2c": (matrix[:3, 3] * _MM).tolist(),
        }
        return _Item(str(number), camera, truth, info)

    def take(self, item: _Item, state: _Scene) -> None:
        """Keep the rows."""
        state.cameras[item.number], state.truth[item.number], state.info[item.number] = item.camera, item.truth, item.info

    def end_sequence(self, state: _Scene) -> None:
        """Write the files of a scene."""
        state.meshes.close()
        for name, rows in (("scene_camera", state.cameras), ("scene_gt", state.truth), ("scene_gt_info", state.info)):
            write_json(state.path / f"{name}.json", rows, indent=None)

    def finish(self) -> tuple[str, ...]:
        """Write the table of models."""
        write_json(self.out / "models" / "models_info.json", self._models)
        return super().finish()


def stored_depth(depth_m: NDArray[np.float32]) -> tuple[NDArray[np.uint16], float]:
    """Return depth (height, width) in steps, and how many millimetres a step has; where nothing is hit or known it is 0."""
    for scale in _SCALES_MM:
        found = depth_steps(depth_m, _MM / scale)
        if not found.beyond:
            break
    return found.stored, scale


def silhouette_info(visible: NDArray[np.bool_], whole: Silhouette, depth: NDArray[np.uint16]) -> dict[str, Any]:
    """Return an object's row of ``scene_gt_info.json``.

    Args:
        visible: (height, width), its pixels.
        whole: its silhouette, of which they are part.
        depth: (height, width), 0 where there is none.
    """
    rows, columns = np.flatnonzero(visible.any(axis=1)), np.flatnonzero(visible.any(axis=0))
    count = int(np.count_nonzero(visible))
    return {
        "px_count_all": whole.pixels,
        "px_count_valid": int(np.count_nonzero(depth[whole.inside])),
        "px_count_visib": count,
        "visib_fract": count / whole.pixels,
        "bbox_obj": [whole.left, whole.top, whole.right - whole.left, whole.bottom - whole.top],
        "bbox_visib": [int(columns[0]), int(rows[0]), int(columns[-1] - columns[0]), int(rows[-1] - rows[0])],
    }


def _pose_row(thing: ObjectPose, camera_from_map: NDArray[np.float64]) -> dict[str, Any]:
    """Return an object's row of ``scene_gt.json``."""
    rotation = matmul(camera_from_map[:3, :3], thing.rotation)
    place = matmul(camera_from_map[:3, :3], thing.place_m) + camera_from_map[:3, 3]
    return {"cam_R_m2c": rotation.ravel().tolist(), "cam_t_m2c": (place * _MM).tolist(), "obj_id": thing.model}


def _camera_config(lens: Lens) -> CameraConfig:
    return CameraConfig(
        width=lens.width,
        height=lens.height,
        focal_x_px=lens.fx,
        focal_y_px=lens.fy,
        principal_x_px=lens.cx,
        principal_y_px=lens.cy,
    )
