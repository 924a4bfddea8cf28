"""Laser scans of a rendered scene as files: NPZ with all of them, a drawing of the first one over the room from above."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from grammar.drawing.shapes import dot, line
from grammar.drawing.top_view import top_view
from grammar.drawing.top_view_plan import Plan
from renderer.lidar.config import ScanConfig
from renderer.lidar.mount import Floats, along_path, mounted_scanner
from renderer.lidar.scan import Scan
from scene_description import CameraPose, SceneDescription
from scene_synth_ros.cli.pictures.drawing_png import png_bytes

_BEAM, _HIT, _SCANNER = "#1f8a70", "#c40233", "#0057b8"


def write_scans(folder: Path, scans: Sequence[Scan], config: ScanConfig, scene: SceneDescription) -> None:
    """Write ``scans.npz`` and ``scan.png``.

    The arrays of k scans of n beams: ``stamps_ns`` (k,) int64 of the first beams; ``ranges``, ``ranges_ideal`` and ``intensities`` (k, n)
    float32, as ``Scan`` has them; ``angles_rad`` and ``times_s`` (n,) float64, of the beams in the scanner's frame and after the first one;
    ``origins_m`` (k, n, 3) and ``directions`` (k, n, 3) float64, where each beam began in the world and where it went.
    """
    times_s = np.arange(config.beams, dtype=np.float64) * config.time_increment_s
    rays = [beam_rays(config, scene.camera_path, scan.stamp_ns) for scan in scans]
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
    beams = np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=1)
    return placed.position_m, np.einsum("nij,nj->ni", placed.rotation, beams)


def scan_picture(scene: SceneDescription, scan: Scan, origins_m: Floats, directions: Floats) -> bytes:
    """Return a PNG: the room from above, every beam that came back, and what it hit as the scanner read it."""
    drawing, plan = top_view(scene), Plan(scene.room)
    seen = np.isfinite(scan.ranges)
    starts, ends = origins_m[seen], origins_m[seen] + directions[seen] * scan.ranges[seen, None].astype(np.float64)
    shapes = [line(plan.points([(a[0], a[1]), (b[0], b[1])]), _BEAM, 0.25) for a, b in zip(starts, ends, strict=True)]
    shapes += [dot(plan.point((b[0], b[1])), 1.8, _HIT) for b in ends]
    shapes.append(dot(plan.point((origins_m[0, 0], origins_m[0, 1])), 6.0, _SCANNER, "#ffffff", 1.5))
    return png_bytes(replace(drawing, shapes=(*drawing.shapes, *shapes)))
