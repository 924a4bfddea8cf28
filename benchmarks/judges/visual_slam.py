"""ORB-SLAM3 in its six modes and OpenCV's RGB-D odometry, unmodified, on rooms that nobody has looked at, judged by evo.

python -m benchmarks.judges.visual_slam [--rooms N] [--frames N] [--seed S] [--modes NAMES] [--python EXE] [--exports DIR] [--write] ...

Each room is made offline with a stereo pair, depth and an inertial measurement unit (``config/rigs/euroc_stereo.yaml``), exported by
``convert --to euroc`` and ``--to tum``, and read from there, with the settings that stand in the export.  The vocabulary is trained on
some of the pictures.  A mode with inertia counts as initialised where the program says so; its trajectory is that of the device, the
others' that of the left camera, both as the program saves them at its end.  Monocular trajectories are compared after the best scale.
The extra is ``bench-visual``; pyorbslam3 (GPL 3) may be in the environment of another interpreter (``--python``).
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from evo.core.trajectory import PoseTrajectory3D
from evo.tools import file_interface

from benchmarks.judges.trajectory import Judged, judge
from benchmarks.judges.vocabulary import descriptors, train
from benchmarks.table import DOCS, Row, at_least, at_most, markdown_table, render_table, write_section

_OPENCV = "OPENCV_RGBD"
MODES = ("MONOCULAR", "STEREO", "RGBD", "IMU_MONOCULAR", "IMU_STEREO", "IMU_RGBD", _OPENCV)
_HELD, _LIMIT_M, _SCALE = "IMU_STEREO", 0.02, 0.01
_RUNNER, _OPENCV_RUNNER = (Path(__file__).with_name(f"{name}.py") for name in ("orb_slam", "rgbd_odometry"))
_LAYERS = ("normals", "semantic", "instance")
_NOISE = ("sensor.vignetting:=0.3", "sensor.full_well_e:=8000.0", "sensor.read_noise_e:=3.0", "streams.color_sensed:=true")
_MOST_S = 600.0


class Run(NamedTuple):
    """One mode in one room: share of frames with a pose, when inertia was initialised (s, None if never), and evo's words."""

    mode: str
    posed: float
    initialised_s: float | None
    judged: Judged | None


def make_bags(arguments: argparse.Namespace, folder: Path) -> None:
    """Make bags of rooms in a folder that is not there yet."""
    width, height = arguments.size.split("x")
    both = [f"camera.width:={width}", f"camera.height:={height}", "render.integrator:=cached", "render.samples_per_pixel:=1"]
    both += [f"streams.{layer}:=false" for layer in _LAYERS] + list(_NOISE if arguments.noise else ())
    words = [f"--rooms={arguments.rooms}", f"--frames={arguments.frames}", f"--seed={arguments.seed}", "--overlay=euroc_stereo"]
    words += [word for value in both for node in ("renderer_node", "renderer_node_right") for word in ("-p", f"{node}.{value}")]
    words += ["-p", "renderer_node_right.streams.depth:=false", *(word for value in arguments.p for word in ("-p", value))]
    _program("generate", *words, f"--out={folder}")


def _program(*words: str) -> None:
    subprocess.run([sys.executable, "-m", "scene_synth_ros", *words], check=True, stdout=subprocess.DEVNULL)


def export(arguments: argparse.Namespace, folder: Path) -> None:
    """Make rooms, and write them as ``euroc`` and ``tum`` of a folder."""
    make_bags(arguments, folder / "bags")
    picture = ["--layers=color_sensed,depth"] if arguments.noise else []
    _program("convert", str(folder / "bags"), "--to=euroc", f"--out={folder / 'euroc'}", *picture)
    _program("convert", str(folder / "bags"), "--to=tum", "--camera=left", f"--out={folder / 'tum'}", *picture)


def rooms_of(folder: Path) -> list[tuple[Path, Path]]:
    """Return of each exported room its folder in EuRoC's form and that in TUM's."""
    rooms = sorted(path for path in (folder / "euroc").iterdir() if (path / "mav0").is_dir())
    return list(zip(rooms, sorted(path.parent for path in (folder / "tum").glob("*/groundtruth.txt")), strict=True))


def run(mode: str, room: Path, tum: Path, vocabulary: Path, arguments: argparse.Namespace) -> Run:
    """Run a mode on a room; a run that ends badly has no pose."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        runner = _OPENCV_RUNNER if mode == _OPENCV else _RUNNER
        words = [arguments.python, str(runner), mode, str(room), str(tum / "depth"), str(vocabulary), folder, f"--pace={arguments.pace}"]
        try:
            subprocess.run(words, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=_MOST_S)
            said = json.loads((out / "said.json").read_text(encoding="utf-8"))
            rows = np.loadtxt(out / "trajectory.csv", ndmin=2)
        except (subprocess.SubprocessError, OSError, ValueError):
            return Run(mode, 0.0, None, None)
    if len(rows) < 3:
        return Run(mode, said["posed"] / said["frames"], said["initialised_s"], None)
    trajectory = PoseTrajectory3D(rows[:, 1:4], rows[:, [7, 4, 5, 6]], rows[:, 0] * 1e-9)
    if mode.startswith("IMU_"):
        true = file_interface.read_euroc_csv_trajectory(str(room / "mav0/state_groundtruth_estimate0/data.csv"))
    else:
        true = file_interface.read_tum_trajectory_file(str(tum / "groundtruth.txt"))
    judged = judge(trajectory, true, scaled=mode == "MONOCULAR")
    return Run(mode, said["posed"] / said["frames"], said["initialised_s"], judged)


def measure(runs: list[Run]) -> Iterator[Row]:
    """Yield the figures of each mode over rooms."""
    for mode in dict.fromkeys(one.mode for one in runs):
        of = [one for one in runs if one.mode == mode]
        judged = [one.judged for one in of if one.judged is not None]
        held, name = mode == _HELD, mode.lower().replace("_", "-")
        if mode.startswith("IMU_"):
            begun = [one.initialised_s for one in of if one.initialised_s is not None]
            row = at_least(f"{name}: initialised", len(begun), f"of {len(of)}", len(of)) if held else None
            yield row or Row(f"{name}: initialised", len(begun), f"of {len(of)}")
            yield Row(f" {name}: after, median", float(np.median(begun)) if begun else np.nan, "s")
        yield Row(f"{name}: frames with a pose, mean", 100.0 * float(np.mean([one.posed for one in of])), "%")
        errors = np.array([one.ate_m for one in judged]) if judged else np.array([np.inf])
        median, most = f"{name}: ATE, median", f"{name}: ATE, greatest"
        yield at_most(median, float(np.median(errors)), "m", _LIMIT_M) if held else Row(median, float(np.median(errors)), "m")
        yield Row(f" {most}", float(errors.max()), "m")
        if mode != "MONOCULAR" and judged:
            off = max(abs(one.scale - 1.0) for one in judged)
            yield at_most(f"{name}: scale off, greatest", off, "", _SCALE) if held else Row(f"{name}: scale off, greatest", off, "")


def main() -> None:
    """Measure, print, and with ``--write`` put the table into docs/body.md."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.judges.visual_slam")
    parser.add_argument("--rooms", type=int, default=10)
    parser.add_argument("--frames", type=int, default=400)
    parser.add_argument("--seed", type=int, default=time.time_ns() % 2**31, help="default: by the clock")
    parser.add_argument("--size", default="640x480", help="of images, WIDTHxHEIGHT")
    parser.add_argument("--noise", action="store_true", help="pictures as a sensor reads them")
    parser.add_argument("--modes", default=",".join(MODES), help="with commas between")
    parser.add_argument("--pace", type=float, default=1.0, help="share of their own rate at which frames are fed")
    parser.add_argument("--python", default=sys.executable, help="interpreter that has pyorbslam3")
    parser.add_argument("--exports", type=Path, help="folder for the rooms; what is there already is taken as it is")
    parser.add_argument("-p", action="append", default=[], metavar="NODE.NAME:=VALUE", help="further parameters of the rooms")
    parser.add_argument("--write", action="store_true", help="put the table into docs/body.md")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as text:
        folder = arguments.exports or Path(text)
        if not (folder / "tum").exists():
            export(arguments, folder)
        rooms, vocabulary = rooms_of(folder), Path(text, "vocabulary.txt")
        pictures = [path for room, _ in rooms for path in sorted((room / "mav0/cam0/data").glob("*.png"))]
        vocabulary.write_text(train(*descriptors(pictures[:: max(1, len(pictures) // 150)])), encoding="utf-8")
        runs = []
        for number, (room, tum) in enumerate(rooms):
            for mode in arguments.modes.split(","):
                runs.append(run(mode, room, tum, vocabulary, arguments))
                print(f"room {number}: {runs[-1]}", flush=True)
    rows = list(measure(runs))
    print(render_table(f"Visual SLAM, seed {arguments.seed}, {arguments.frames} frames a room, {arguments.size}", rows))
    if arguments.write:
        told = f"Seed {arguments.seed}, {arguments.frames} frames a room, {arguments.size}.\n\n{markdown_table(rows)}"
        write_section(DOCS / "body.md", "visual", told)


if __name__ == "__main__":
    main()
