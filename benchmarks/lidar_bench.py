"""Somebody else's lidar odometry on bags of rooms that nobody has looked at: KISS-ICP, unmodified, judged by the true poses.

python -m benchmarks.lidar_bench [--rooms N] [--frames N] [--seed S] [--overlay RIG] [--write]

Each room is made offline with a robot that carries a lidar.  KISS-ICP (I. Vizzo et al., "KISS-ICP: In Defense of Point-to-Point ICP",
RA-L 2023; the extra ``bench-lidar``) reads ``lidar/points`` and, for comparison, ``lidar/points_ideal``; with its deskewing by the times of
points, and without.  Its settings are for rooms: voxels of 10 cm.  What it says of a sweep is where the lidar is at its end, or in its
middle where it does not deskew.  The absolute trajectory error is the root mean square of what is left of positions after the best rotation
and shift (S. Umeyama, 1991, without scale); the true ones come from ``odom/ideal`` and ``/tf_static``.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.table import DOCS, Row, at_most, markdown_table, render_table, write_section
from scene_synth_ros.bags.indexed_bag import open_bag
from scene_synth_ros.messages import streams as roles
from scene_synth_ros.messages.cdr import CdrReader
from scene_synth_ros.prove.decode import cloud_row
from scene_synth_ros.prove.evidence import Evidence, Room

Floats = NDArray[np.float64]

_QUICK = ("camera.width:=64", "camera.height:=48", *(f"streams.{layer}:=false" for layer in ("color", "normals", "semantic", "instance")))
_VOXEL_M, _LIMIT_M = 0.1, 0.05


class Ride(NamedTuple):
    """One room: name; way gone (m) and turn made (rad); error (m) by whether the points err and whether KISS-ICP deskews them."""

    name: str
    way_m: float
    turned_rad: float
    errors_m: dict[tuple[bool, bool], float]


def rides(bag: Path) -> Iterator[Ride]:
    """Yield what KISS-ICP makes of each room of a bag."""
    evidence = Evidence(open_bag(bag))
    for number, room in enumerate(evidence.rooms):
        if room.curve is None or room.body is None:
            continue
        way = float(np.linalg.norm(np.diff(room.body.place, axis=0), axis=1).sum())
        turned = float(np.abs(room.body.spin[:-1, 2] * np.diff(room.body.stamps) * 1e-9).sum())
        errors = {
            (errs, deskewed): _error(evidence, room, roles.LIDAR_POINTS if errs else roles.LIDAR_IDEAL, deskewed)
            for errs in (True, False)
            for deskewed in (True, False)
        }
        yield Ride(f"{bag.name}, room {number}", way, turned, errors)


def _error(evidence: Evidence, room: Room, role: roles.Role, deskewed: bool) -> float:
    from kiss_icp.config import KISSConfig
    from kiss_icp.config.config import DataConfig, MappingConfig
    from kiss_icp.kiss_icp import KissICP

    data = DataConfig(min_range=0.2, max_range=30.0, deskew=deskewed)
    odometry = KissICP(KISSConfig(data=data, mapping=MappingConfig(voxel_size=_VOXEL_M)))
    said, true = [], []
    assert room.curve is not None
    clouds = [cloud_row(CdrReader(message)) for _, message in room.each(evidence.first(role))]
    period_s = 1e-9 * float(np.diff([cloud.stamp_ns for cloud in clouds]).min())
    for cloud in clouds:
        points = cloud.points.ravel()
        mount = evidence.mount(cloud.frame)
        assert mount is not None
        xyz = np.column_stack([points[axis] for axis in "xyz"]).astype(np.float64)
        odometry.register_frame(xyz, points["time"].astype(np.float64) / period_s)
        said.append(odometry.last_pose[:3, 3])
        true.append(mount.on(*room.curve.at(cloud.stamp_ns, period_s if deskewed else 0.5 * period_s))[0][0])
    return trajectory_error_m(np.array(said), np.array(true))


def trajectory_error_m(said: Floats, true: Floats) -> float:
    """Return the root mean square distance (m) of positions (n, 3) from the true ones, after the best rotation and shift."""
    a, b = said - said.mean(axis=0), true - true.mean(axis=0)
    u, _, v = np.linalg.svd(a.T @ b)
    turn = u @ np.diag([1.0, 1.0, np.linalg.det(u @ v)]) @ v
    return float(np.sqrt(((a @ turn - b) ** 2).sum(axis=1).mean()))


def measure(rooms: int, frames: int, seed: int, overlay: str) -> list[Row]:
    """Return the figures of rooms that are made for it."""
    with tempfile.TemporaryDirectory() as folder:
        words = [f"--rooms={rooms}", f"--frames={frames}", f"--seed={seed}", f"--overlay={overlay}", f"--out={folder}/bags"]
        words += [word for value in _QUICK for word in ("-p", f"renderer_node.{value}")]
        subprocess.run([sys.executable, "-m", "scene_synth_ros", "generate", *words], check=True, stdout=subprocess.DEVNULL)
        found = [ride for shard in sorted(Path(folder, "bags", "shards").iterdir()) if shard.is_dir() for ride in rides(shard)]
    rows = [Row("rooms", len(found), "")]
    rows += [Row("way gone in a room, mean", float(np.mean([ride.way_m for ride in found])), "m")]
    rows += [Row("turned in a room, mean", float(np.mean([ride.turned_rad for ride in found])), "rad")]
    for (errs, deskewed), name in (
        ((True, True), "as the lidar reads, deskewed"),
        ((True, False), "as the lidar reads, not deskewed"),
        ((False, True), "without noise and losses, deskewed"),
        ((False, False), "without noise and losses, not deskewed"),
    ):
        errors, judged = np.array([ride.errors_m[errs, deskewed] for ride in found]), errs and deskewed
        median, title = float(np.median(errors)), f"{name}: ATE, median"
        rows.append(at_most(title, median, "m", _LIMIT_M) if judged else Row(title, median, "m"))
        rows.append(Row(f" {name}: ATE, greatest", float(errors.max()), "m"))
    return rows


def main() -> None:
    """Measure, print, and with ``--write`` put the table into docs/lidar.md."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.lidar_bench")
    parser.add_argument("--rooms", type=int, default=10)
    parser.add_argument("--frames", type=int, default=300)
    parser.add_argument("--seed", type=int, default=time.time_ns() % 2**31, help="default: by the clock")
    parser.add_argument("--overlay", default="lidar_robot")
    parser.add_argument("--write", action="store_true", help="put the table into docs/lidar.md")
    arguments = parser.parse_args()
    rows = measure(arguments.rooms, arguments.frames, arguments.seed, arguments.overlay)
    print(render_table(f"KISS-ICP on {arguments.overlay}, seed {arguments.seed}, {arguments.frames} frames a room", rows))
    if arguments.write:
        told = f"Seed {arguments.seed}, {arguments.frames} frames a room.\n\n{markdown_table(rows)}"
        write_section(DOCS / "lidar.md", "odometry", told)


if __name__ == "__main__":
    main()
