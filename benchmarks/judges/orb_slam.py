"""ORB-SLAM3 by pyorbslam3 on one room in EuRoC's form, in one of its six modes, in a process of its own, because it may end that.

python orb_slam.py MODE ROOM DEPTH VOCABULARY OUT

ROOM is what ``convert --to euroc`` has written, DEPTH the folder of 16-bit pictures that ``convert --to tum`` has.  A frame is fed when
the threads of mapping and loop closing sleep, as if the computer were fast enough for the camera, however busy it is.  OUT gets
``trajectory.csv``, as ORB-SLAM3 saves it at its end, and ``said.json``: how many frames had a pose, and when inertia was initialised.
It imports nothing of this program, so that any interpreter that has pyorbslam3 (GPL 3) runs it.
"""

import argparse
import json
import os
import time
from pathlib import Path

import cv2
import numpy as np
import pyorbslam3

_POLL_S, _ASLEEP = 0.006, 3
"""Other threads look for work every 3 and 5 ms: they have none when they slept at so many looks, this far apart."""


def main() -> None:
    """Run one mode."""
    parser = argparse.ArgumentParser(prog="orb_slam.py")
    parser.add_argument("mode", choices=sorted(pyorbslam3.Sensor.__members__))
    for name in ("room", "depth", "vocabulary", "out"):
        parser.add_argument(name, type=Path)
    arguments = parser.parse_args()
    mav, inertial = arguments.room / "mav0", arguments.mode.startswith("IMU_")
    imu = np.loadtxt(mav / "imu0" / "data.csv", delimiter=",") if inertial else np.zeros((0, 7))
    imu[:, 0] *= 1e-9
    lefts, rights, depths = (sorted(folder.glob("*.png")) for folder in (mav / "cam0/data", mav / "cam1/data", arguments.depth))
    sensor = pyorbslam3.Sensor.__members__[arguments.mode]
    slam = pyorbslam3.Slam(arguments.vocabulary, arguments.room / "orb_slam3.yaml", sensor)
    track = {"MONOCULAR": slam.track_monocular, "STEREO": slam.track_stereo, "RGBD": slam.track_rgbd}[arguments.mode.removeprefix("IMU_")]
    beside = {"MONOCULAR": None, "STEREO": rights, "RGBD": depths}[arguments.mode.removeprefix("IMU_")]
    before, posed, initialised = -np.inf, 0, None
    first = int(lefts[0].stem) * 1e-9
    for number, left in enumerate(lefts):
        stamp = int(left.stem) * 1e-9
        pictures = [cv2.imread(str(left), cv2.IMREAD_GRAYSCALE)]
        if beside is not None:
            other = cv2.imread(str(beside[number]), cv2.IMREAD_UNCHANGED)
            pictures.append(other.astype(np.float32) if beside is depths else other)
        chunk = imu[(imu[:, 0] > before) & (imu[:, 0] <= stamp + 1e-9)]
        _wait_for_others()
        posed += bool(track(*pictures, stamp, imu=chunk if inertial else None).pose_valid)
        if initialised is None and inertial and slam.imu_initialized():
            initialised = stamp - first
        before = stamp + 1e-9
    slam.shutdown()
    slam.save_trajectory_euroc(str(arguments.out / "trajectory.csv"))
    said = {"frames": len(lefts), "posed": posed, "initialised_s": initialised}
    (arguments.out / "said.json").write_text(json.dumps(said), encoding="utf-8")


def _wait_for_others() -> None:
    """Return when no other thread of this process has anything to do."""
    own, asleep = str(os.getpid()), 0
    while asleep < _ASLEEP:
        time.sleep(_POLL_S)
        tasks = (task for task in Path("/proc/self/task").iterdir() if task.name != own)
        asleep = 0 if any(_runs(task) for task in tasks) else asleep + 1


def _runs(task: Path) -> bool:
    try:
        return (task / "stat").read_text(encoding="utf-8").rpartition(")")[2].split()[0] in "RD"
    except OSError:  # it has just ended
        return False


if __name__ == "__main__":
    main()
