"""ORB-SLAM3 by pyorbslam3 on one room in EuRoC's form, in one of its six modes, in a process of its own, because it may end that.

python orb_slam.py MODE ROOM DEPTH VOCABULARY OUT [--pace P]

ROOM is what ``convert --to euroc`` has written, DEPTH the folder of 16-bit pictures that ``convert --to tum`` has.  Frames are fed at P
of their own rate, as a camera would: mapping has threads of its own, and nothing tells when they are done.  OUT gets ``trajectory.csv``,
as ORB-SLAM3 saves it at its end, and ``said.json``: how many frames had a pose, and when its inertial measurement unit was initialised.
It imports nothing of this program, so that any interpreter that has pyorbslam3 (GPL 3) runs it.
"""

import argparse
import json
import time
from pathlib import Path

import cv2
import numpy as np
import pyorbslam3


def main() -> None:
    """Run one mode."""
    parser = argparse.ArgumentParser(prog="orb_slam.py")
    parser.add_argument("mode", choices=sorted(pyorbslam3.Sensor.__members__))
    for name in ("room", "depth", "vocabulary", "out"):
        parser.add_argument(name, type=Path)
    parser.add_argument("--pace", type=float, default=1.0)
    arguments = parser.parse_args()
    mav, inertial = arguments.room / "mav0", arguments.mode.startswith("IMU_")
    imu = np.loadtxt(mav / "imu0" / "data.csv", delimiter=",") if inertial else np.zeros((0, 7))
    imu[:, 0] *= 1e-9
    lefts, rights, depths = (sorted(folder.glob("*.png")) for folder in (mav / "cam0/data", mav / "cam1/data", arguments.depth))
    sensor = pyorbslam3.Sensor.__members__[arguments.mode]
    slam = pyorbslam3.Slam(arguments.vocabulary, arguments.room / "orb_slam3.yaml", sensor)
    track = {"MONOCULAR": slam.track_monocular, "STEREO": slam.track_stereo, "RGBD": slam.track_rgbd}[arguments.mode.removeprefix("IMU_")]
    beside = {"MONOCULAR": None, "STEREO": rights, "RGBD": depths}[arguments.mode.removeprefix("IMU_")]
    before, begun, posed, initialised = -np.inf, time.monotonic(), 0, None
    first = int(lefts[0].stem) * 1e-9
    for number, left in enumerate(lefts):
        stamp = int(left.stem) * 1e-9
        pictures = [cv2.imread(str(left), cv2.IMREAD_GRAYSCALE)]
        if beside is not None:
            other = cv2.imread(str(beside[number]), cv2.IMREAD_UNCHANGED)
            pictures.append(other.astype(np.float32) if beside is depths else other)
        chunk = imu[(imu[:, 0] > before) & (imu[:, 0] <= stamp + 1e-9)]
        time.sleep(max(0.0, begun + (stamp - first) / arguments.pace - time.monotonic()))
        posed += bool(track(*pictures, stamp, imu=chunk if inertial else None).pose_valid)
        if initialised is None and inertial and slam.imu_initialized():
            initialised = stamp - first
        before = stamp + 1e-9
    slam.shutdown()
    slam.save_trajectory_euroc(str(arguments.out / "trajectory.csv"))
    said = {"frames": len(lefts), "posed": posed, "initialised_s": initialised}
    (arguments.out / "said.json").write_text(json.dumps(said), encoding="utf-8")


if __name__ == "__main__":
    main()
