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

_LOOK_S, _LOOKS = 0.005, 4
"""Other threads look for work every 3 and 5 ms; whether they find any is looked at so often, this far apart, before a frame is fed."""
_IDLE_NS = 300_000
"""A thread that runs for less at a time finds none."""


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
    """Return when no other thread of this process has anything to do: each sleeps on, or has woken since for moments only."""
    before, calm = _times(), 0
    while calm < _LOOKS:
        time.sleep(_LOOK_S)
        now = _times()
        worked = now.keys() != before.keys() or any(
            ran - before[thread][0] > _IDLE_NS * (turns - before[thread][1]) for thread, (ran, turns, _) in now.items()
        )
        if worked:
            before, calm = now, 0
        elif not any(runs and turns - before[thread][1] < 2 for thread, (_, turns, runs) in now.items()):
            calm += 1


def _times() -> dict[str, tuple[int, int, bool]]:
    """Return other thread -> for how long (ns) and how often it has run, and whether it wants to."""
    found = {}
    for task in Path("/proc/self/task").iterdir():
        try:
            ran, _, turns = map(int, (task / "schedstat").read_text(encoding="utf-8").split())
            state = (task / "stat").read_text(encoding="utf-8").rpartition(")")[2].split()[0]
        except OSError:  # it has just ended
            continue
        if task.name != str(os.getpid()):
            found[task.name] = ran, turns, state in "RD"
    return found


if __name__ == "__main__":
    main()
