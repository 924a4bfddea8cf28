"""What is rendered of a scene as files: frames (NPZ with every layer as it is, PNG of each for people, EXR of all), and laser scans."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grammar.drawing.shapes import dot, line
from grammar.drawing.top_view import top_view
from grammar.drawing.top_view_plan import Plan
from renderer import LAYERS, Frame
from renderer.camera.rig import rig_path
from renderer.files.exr_files import write_exr
from renderer.files.image_io import write_png
from renderer.film.layers import check_layers, layers_in
from renderer.lidar.config import ScanConfig
from renderer.lidar.mount import Floats, along_path, mounted_scanner
from renderer.lidar.scan import Scan
from scene_description import CameraPose, SceneDescription
from scene_description.label_standards import StandardName
from scene_description.products import matmul
from scene_synth_ros.cli.pictures.picture_grid import png_bytes


def write_frame(base: Path, frame: Frame, *, exr: bool = False, standard: StandardName = "nyu40") -> None:
    """Write ``<base>.npz``, ``<base>_<layer>.png`` and, if asked, ``<base>.exr``; ``standard`` is that of the class ids.

    Raises:
        RenderError: a layer is unknown or not what its row of the layer table says, before anything is written; or a file cannot be made.
        OSError: a file cannot be written.
    """
    shown, channels = pictures(frame.layers, standard), exr_channels(frame) if exr else {}
    layers: dict[str, Any] = dict(frame.layers)
    np.savez_compressed(base.with_suffix(".npz"), **layers)
    for name, picture in shown.items():
        write_png(base.with_name(f"{base.name}_{name}.png"), picture)
    if exr:
        write_exr(base.with_suffix(".exr"), channels)


def pictures(layers: Mapping[str, NDArray[Any]], standard: StandardName = "nyu40") -> dict[str, NDArray[Any]]:
    """Return what people can look at, by layer: uint8 or uint16 (height, width), or uint8 (height, width, 3).

    Raises:
        RenderError: a layer is unknown or not what its row says.
    """
    check_layers(layers)
    rows = layers_in(standard)
    return {name: rows[name].picture.of(image) for name, image in layers.items()}


def exr_channels(frame: Frame) -> dict[str, NDArray[Any]]:
    """Return the channels of an EXR file, float32 or uint32: R, G, B are the linear radiance in cd/m2, layers have names of their own.

    Raises:
        RenderError: a layer is unknown or not what its row says.
    """
    layers: dict[str, NDArray[Any]] = {} if frame.radiance is None else {"radiance": frame.radiance}
    layers |= frame.layers
    check_layers(layers)
    channels: dict[str, NDArray[Any]] = {}
    for name, image in layers.items():
        row = LAYERS[name]
        values = image.astype(np.float32 if row.dtype == "float32" else np.uint32, copy=False).reshape(*image.shape[:2], row.channels)
        channels |= {channel: values[..., i] for i, channel in enumerate(row.exr)}
    return channels


_BEAM, _HIT, _SCANNER = "#1f8a70", "#c40233", "#0057b8"


def write_scans(folder: Path, scans: Sequence[Scan], config: ScanConfig, scene: SceneDescription) -> None:
    """Write ``scans.npz`` and ``scan.png``.

    The arrays of k scans of n beams: ``stamps_ns`` (k,) int64 of the first beams; ``ranges``, ``ranges_ideal`` and ``intensities`` (k, n)
    float32, as ``Scan`` has them; ``angles_rad`` and ``times_s`` (n,) float64, of the beams in the scanner's frame and after the first one;
    ``origins_m`` (k, n, 3) and ``directions`` (k, n, 3) float64, where each beam began in the world and where it went.
    """
    times_s = np.arange(config.beams, dtype=np.float64) * config.time_increment_s
    rays = [beam_rays(config, rig_path(scene.camera_path, scene.motion), scan.stamp_ns) for scan in scans]
    np.savez_compressed(
        folder / "scans.npz",
        stamps_ns=np.array([scan.stamp_ns for scan in scans], np.int64),
        ranges=np.stack([scan.ranges for scan in scans]),
        ranges_ideal=np.stack([scan.ideal for scan in scans]),
        intensities=np.stack([scan.intensities for scan in scans]),
        angles_rad=config.angle_min_rad + np.arange(config.beams) * config.angle_increment_rad,
        times_s=times_s,
        origins_m=np.stack([origins for origins, _ in rays]),
        directions=np.stack([directions for _, directions in rays]),
    )
    (folder / "scan.png").write_bytes(scan_picture(scene, scans[0], *rays[0]))


def beam_rays(config: ScanConfig, path: Sequence[CameraPose], stamp_ns: int) -> tuple[Floats, Floats]:
    """Return origins in metres and unit directions, (n, 3) in the world, of the beams of a scan, each at its own time."""
    steps = np.arange(config.beams, dtype=np.float64)
    placed = mounted_scanner(config, along_path(path, stamp_ns, steps * config.time_increment_s))
    angles = config.angle_min_rad + steps * config.angle_increment_rad
    beams = np.array([(math.cos(angle), math.sin(angle), 0.0) for angle in angles.tolist()])
    return placed.position_m, matmul(placed.rotation, beams[:, :, None])[..., 0]


def scan_picture(scene: SceneDescription, scan: Scan, origins_m: Floats, directions: Floats) -> bytes:
    """Return a PNG: the room from above, every beam that came back, and what it hit as the scanner read it."""
    drawing, plan = top_view(scene), Plan(scene.room)
    seen = np.isfinite(scan.ranges)
    starts, ends = origins_m[seen], origins_m[seen] + directions[seen] * scan.ranges[seen, None].astype(np.float64)
    shapes = [line(plan.points([(a[0], a[1]), (b[0], b[1])]), _BEAM, 0.25) for a, b in zip(starts, ends, strict=True)]
    shapes += [dot(plan.point((b[0], b[1])), 1.8, _HIT) for b in ends]
    shapes.append(dot(plan.point((origins_m[0, 0], origins_m[0, 1])), 6.0, _SCANNER, "#ffffff", 1.5))
    return png_bytes(replace(drawing, shapes=(*drawing.shapes, *shapes)))
