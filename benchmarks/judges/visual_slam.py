"""ORB-SLAM3 in its six modes and OpenCV's RGB-D odometry, unmodified, on rooms that nobody has looked at, judged by evo.

python -m benchmarks.judges.visual_slam [--rooms N] [--frames N] [--seed S] [--modes NAMES] [--python EXE] [--exports DIR] [--at-once N] ...

Each room is made offline with a stereo pair, depth and an inertial measurement unit (``config/rigs/euroc_stereo.yaml``), exported by
``convert --to euroc`` and ``--to tum``, and read from there, with the settings that stand in the export: pictures as the camera's sensor
reads them and, for comparison, without noise.  The vocabulary is trained on some of them.  A mode with inertia counts as initialised
where the program says so; its trajectory is that of the device, the others' that of the left camera, both as the program saves them at
its end.  Monocular trajectories are compared after the best scale.
The extra is ``bench-visual``; pyorbslam3 (GPL 3) may be in the environment of another interpreter (``--python``).
"""

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

import numpy as np
from evo.core.trajectory import PoseTrajectory3D
from evo.tools import file_interface

from benchmarks.judges.rooms import PICTURES_OFF, make_bags, program, tell, words_of
from benchmarks.judges.trajectory import Judged, judge
from benchmarks.judges.vocabulary import descriptors, train
from benchmarks.table import Row, at_least, at_most

_OPENCV = "OPENCV_RGBD"
MODES = ("MONOCULAR", "STEREO", "RGBD", "IMU_MONOCULAR", "IMU_STEREO", "IMU_RGBD", _OPENCV)
_HELD, _LIMIT_M, _SCALE = "IMU_STEREO", 0.02, 0.01
_RUNNER, _OPENCV_RUNNER = (Path(__file__).with_name(f"{name}.py") for name in ("orb_slam", "rgbd_odometry"))
PICTURES = {"color_sensed": "as the camera reads", "color": "without noise"}
"""Layer -> what pictures are."""
_CACHED = ("render.integrator:=cached", "render.samples_per_pixel:=1", *PICTURES_OFF)
_NOISE = ("sensor.vignetting:=0.3", "sensor.full_well_e:=8000.0", "sensor.read_noise_e:=3.0", "streams.color_sensed:=true")
_MOST_S = 3600.0


class Exported(NamedTuple):
    """A room as it was exported, with the pictures of a layer: its folder in EuRoC's form, and that in TUM's."""

    layer: str
    euroc: Path
    tum: Path


class Run(NamedTuple):
    """One mode in one room, by the layer of its pictures.

    Share of frames with a pose, when inertia was initialised (s, None if never), and evo's words: of all, and of what came after that.
    """

    layer: str
    mode: str
    posed: float
    initialised_s: float | None
    judged: Judged | None
    after: Judged | None = None


def export(arguments: argparse.Namespace, folder: Path) -> None:
    """Make the rooms that are not in a folder yet, and write of each layer of pictures what is not there in EuRoC's and in TUM's form."""
    width, height = arguments.size.split("x")
    values = [f"camera.width:={width}", f"camera.height:={height}", *_CACHED, *_NOISE]
    nodes = [f"{node}.{value}" for node in ("renderer_node", "renderer_node_right") for value in values]
    if not (folder / "bags").exists():
        make_bags(arguments, "euroc_stereo", [*nodes, "renderer_node_right.streams.depth:=false"], folder / "bags")
    for layer in PICTURES:
        (folder / layer).mkdir(exist_ok=True)
        for form, words in {"euroc": [f"--layers={layer}"], "tum": ["--camera=left", f"--layers={layer},depth"]}.items():
            if not (folder / layer / form).exists():
                program("convert", str(folder / "bags"), f"--to={form}", f"--out={folder / layer / form}", *words)


def rooms_of(folder: Path) -> list[Exported]:
    """Return the exported rooms of a folder."""
    found = []
    for layer in PICTURES:
        rooms = sorted(path for path in (folder / layer / "euroc").iterdir() if (path / "mav0").is_dir())
        truths = sorted(path.parent for path in (folder / layer / "tum").glob("*/groundtruth.txt"))
        found += [Exported(layer, *both) for both in zip(rooms, truths, strict=True)]
    return found


def run(mode: str, room: Exported, vocabulary: Path, arguments: argparse.Namespace) -> Run:
    """Run a mode on a room; a run that ends badly has no pose."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        runner = _OPENCV_RUNNER if mode == _OPENCV else _RUNNER
        paths = map(str, (room.euroc, room.tum / "depth", vocabulary, folder))
        words = [arguments.python, str(runner), mode, *paths]
        try:
            subprocess.run(words, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=_MOST_S)
            said = json.loads((out / "said.json").read_text(encoding="utf-8"))
            rows = np.loadtxt(out / "trajectory.csv", ndmin=2)
        except (subprocess.SubprocessError, OSError, ValueError):
            return Run(room.layer, mode, 0.0, None, None)
    whole = Run(room.layer, mode, said["posed"] / said["frames"], said["initialised_s"], None)
    if len(rows) < 3:
        return whole
    trajectory = PoseTrajectory3D(rows[:, 1:4], rows[:, [7, 4, 5, 6]], rows[:, 0] * 1e-9)
    if mode.startswith("IMU_"):
        true = file_interface.read_euroc_csv_trajectory(str(room.euroc / "mav0/state_groundtruth_estimate0/data.csv"))
    else:
        true = file_interface.read_tum_trajectory_file(str(room.tum / "groundtruth.txt"))
    begun_s = true.timestamps[0] + (said["initialised_s"] or 0.0)
    after = PoseTrajectory3D(rows[:, 1:4], rows[:, [7, 4, 5, 6]], rows[:, 0] * 1e-9)
    after.reduce_to_time_range(begun_s, true.timestamps[-1])
    known = mode.startswith("IMU_") and said["initialised_s"] is not None and after.num_poses >= 3
    return whole._replace(
        judged=judge(trajectory, true, scaled=mode == "MONOCULAR"),
        after=judge(after, true) if known else None,
    )


def measure(runs: list[Run]) -> Iterator[Row]:
    """Yield the figures of each mode and layer of pictures over rooms."""
    for mode, layer in dict.fromkeys((one.mode, one.layer) for one in runs):
        of = [one for one in runs if (one.mode, one.layer) == (mode, layer)]
        judged = [one.judged for one in of if one.judged is not None]
        held, name = mode == _HELD, f"{mode.lower().replace('_', '-')}, {PICTURES[layer]}"
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
        if later := [one.after for one in of if one.after is not None]:
            yield Row(f" {name}: ATE once initialised, median", float(np.median([after.ate_m for after in later])), "m")
            yield Row(f" {name}: ATE once initialised, greatest", max(after.ate_m for after in later), "m")
            yield Row(f" {name}: scale off once initialised, greatest", max(abs(after.scale - 1.0) for after in later), "")
        if mode != "MONOCULAR" and judged:
            off = max(abs(one.scale - 1.0) for one in judged)
            yield at_most(f"{name}: scale off, greatest", off, "", _SCALE) if held else Row(f"{name}: scale off, greatest", off, "")


def main() -> None:
    """Measure, print, and with ``--write`` put the table into docs/body.md."""
    parser = words_of("visual_slam", 500)
    parser.add_argument("--size", default="480x360", help="of images, WIDTHxHEIGHT")
    parser.add_argument("--modes", default=",".join(MODES), help="with commas between")
    parser.add_argument("--at-once", type=int, default=1, help="runs beside each other")
    parser.add_argument("--python", default=sys.executable, help="interpreter that has pyorbslam3")
    parser.add_argument("--exports", type=Path, help="folder for the rooms; what is there already is taken as it is")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as text:
        folder = arguments.exports or Path(text)
        export(arguments, folder)
        rooms, vocabulary = rooms_of(folder), Path(text, "vocabulary.txt")
        pictures = [path for room in rooms for path in sorted((room.euroc / "mav0/cam0/data").glob("*.png"))]
        vocabulary.write_text(train(*descriptors(pictures[:: max(1, len(pictures) // 150)])), encoding="utf-8")
        asked = [(mode, room) for room in rooms for mode in arguments.modes.split(",")]
        with ThreadPoolExecutor(arguments.at_once) as pool:
            runs = []
            for (_, room), ended in zip(asked, pool.map(lambda one: run(one[0], one[1], vocabulary, arguments), asked), strict=True):
                runs.append(ended)
                print(f"{room.euroc.name}: {ended}", flush=True)
    tell(arguments, list(measure(runs)), f"Visual SLAM, {arguments.size}", "body.md", "visual")


if __name__ == "__main__":
    main()
