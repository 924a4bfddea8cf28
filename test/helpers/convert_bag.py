"""A bag of the sample room with true depth, classes and objects, and what a test needs to check an export of it."""

from __future__ import annotations

import dataclasses
import tempfile
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from room_bag import START_NS, write
from sample_scene import sample_scene
from std_msgs.msg import String

from renderer import LAYERS, CameraConfig, RenderConfig, Renderer
from renderer.camera.cameras import unproject
from renderer.camera.rig import mounted_path
from renderer.scene.flatten import flatten
from scene_description import CameraPose, SceneDescription, scene_to_json
from scene_description.labels import instance_labels, semantic_labels
from scene_description.poses import look_at
from scene_synth_ros.bags.bag_writer import BagWriter
from scene_synth_ros.convert.formats import FORMATS, writer_of
from scene_synth_ros.convert.source import Choice, open_source
from scene_synth_ros.convert.writer import convert
from scene_synth_ros.messages.conversions import camera_info_to_msg, image_to_msg, labels_to_msg, layer_encoding, pose_to_msg

TRUTH = ("depth", "semantic", "instance")
PERIOD_NS = 33_333_333
SIZE = {"width": 80, "height": 60}
PINHOLE = CameraConfig(**SIZE, focal_x_px=70.0, focal_y_px=72.0, principal_x_px=41.3, principal_y_px=28.2)
BROWN = CameraConfig(
    **SIZE, model="brown_conrady", focal_x_px=70.0, principal_x_px=38.6, principal_y_px=30.1, distortion=(-0.12, 0.03, 0.002, -0.0015)
)
BROWN_K3 = dataclasses.replace(BROWN, distortion=(-0.12, 0.03, 0.002, -0.0015, 0.004))
RATIONAL = dataclasses.replace(BROWN, model="rational", distortion=(0.1, -0.02, 0.001, 0.0005, 0.001, 0.2, 0.01, 0.002))
FISHEYE = CameraConfig(**SIZE, model="kannala_brandt", horizontal_fov_rad=2.4, distortion=(0.02, -0.004, 0.001, -0.0002))
PANORAMA = CameraConfig(width=96, height=48, model="equirectangular")


class Truth(NamedTuple):
    """A frame as it was recorded: its room, camera and pose, and the pixels of its layers, with the colour."""

    room: int
    config: CameraConfig
    pose: CameraPose
    layers: dict[str, np.ndarray]

    def points(self, count: int = 200) -> tuple[np.ndarray, np.ndarray]:
        """Return pixels (n, 2), column and row, centres at integers, and the world points (n, 3) there; by the renderer's own lenses."""
        rows, columns = np.nonzero(np.isfinite(self.layers["depth"]))
        chosen = np.random.default_rng(self.pose.stamp_ns % 1000).permutation(len(rows))[:count]
        pixels = np.stack([columns, rows], axis=1)[chosen].astype(np.float64)
        depth = self.layers["depth"][rows[chosen], columns[chosen]].astype(np.float64)
        return pixels, unproject(self.config, self.pose, np.column_stack([pixels + 0.5, depth]))


class ConvertBag(NamedTuple):
    """A bag: where it is, camera -> its frames by stamp, the rooms."""

    path: Path
    frames: dict[str, list[Truth]]
    scenes: list[SceneDescription]


def room(index: int, frames: int) -> SceneDescription:
    """Return the sample room with a path of its own, on an arc that sees the bed from the window's side."""
    scene, poses = sample_scene(), []
    for k in range(frames):
        number = index * frames + k
        eye = (3.5 - 0.1 * number, 0.6 + 0.15 * number, 1.5 + 0.05 * number)
        target = (1.0, 2.0 - 0.1 * number, 0.6)
        poses.append(CameraPose(stamp_ns=START_NS + number * PERIOD_NS, position_m=eye, orientation=look_at(eye, target)))
    return dataclasses.replace(scene, id=f"sample-{index}", index=index, camera_path=tuple(poses))


@cache
def convert_bag(rooms: int = 2, frames: int = 3, layers: tuple[str, ...] = TRUTH, **cameras: CameraConfig) -> ConvertBag:
    """Write a bag, once for the same arguments; cameras by name, one pinhole unless told otherwise."""
    folder = Path(tempfile.mkdtemp(prefix="convert_bag_")) / "bag"
    cameras = cameras or {"camera": PINHOLE}
    scenes = [room(index, frames) for index in range(rooms)]
    flat = flatten(scenes[0])
    found: dict[str, list[Truth]] = {name: [] for name in cameras}
    renderers = {name: Renderer(flat, config, RenderConfig(threads=1), 1) for name, config in cameras.items()}
    rng = np.random.default_rng(5)
    with BagWriter(folder) as writer:
        for scene in scenes:
            write(writer, "/synth/scene", String(data=scene_to_json(scene)), scene.camera_path[0].stamp_ns)
            for number in range(frames):
                for name, config in cameras.items():
                    pose = mounted_path(config, scene.camera_path)[number]
                    images = dict(renderers[name].render(pose, number, layers).layers) if layers else {}
                    images["color"] = rng.integers(0, 256, (config.height, config.width, 3), np.uint8)
                    _write_frame(writer, f"/synth/{name}", config, pose, images, scene)
                    found[name].append(Truth(scene.index, config, pose, images))
    for renderer in renderers.values():
        renderer.close()
    return ConvertBag(folder, found, scenes)


def export(bag: ConvertBag, name: str, out: Path, **choice: object) -> tuple[str, ...]:
    """Convert a bag into a new folder, as the command does; return the notes."""
    out.mkdir()
    source = open_source(str(bag.path), name, FORMATS[name], Choice(**choice))  # type: ignore[arg-type]
    return convert(out, source, writer_of(name))


def _write_frame(
    writer: BagWriter, camera: str, config: CameraConfig, pose: CameraPose, images: dict[str, np.ndarray], scene: SceneDescription
) -> None:
    stamp = pose.stamp_ns
    for layer, pixels in images.items():
        write(writer, f"{camera}/{layer}/image_raw", image_to_msg(pixels, layer_encoding(LAYERS[layer]), stamp, "eye"), stamp)
        write(writer, f"{camera}/{layer}/camera_info", camera_info_to_msg(config, stamp, "eye"), stamp)
    write(writer, f"{camera}/pose", pose_to_msg(pose, "map"), stamp)
    for layer, table in (("semantic", semantic_labels()), ("instance", instance_labels(scene))):
        if layer in images:
            write(writer, f"{camera}/{layer}/labels", labels_to_msg(table, stamp), stamp)
