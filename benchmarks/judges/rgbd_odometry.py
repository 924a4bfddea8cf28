"""OpenCV's RGB-D odometry on one room in EuRoC's form, from frame to frame, without a map; runs as ``orb_slam.py`` does.

python rgbd_odometry.py MODE ROOM DEPTH VOCABULARY OUT

Pictures are those of the left camera, grey; DEPTH has 16-bit pictures as ``convert --to tum`` writes them.  Needs OpenCV 5.
"""

import argparse
import json
from pathlib import Path

import cv2
import numpy as np


def main() -> None:
    """Follow the camera from frame to frame, and write its poses."""
    parser = argparse.ArgumentParser(prog="rgbd_odometry.py")
    parser.add_argument("mode")
    for name in ("room", "depth", "vocabulary", "out"):
        parser.add_argument(name, type=Path)
    arguments = parser.parse_args()
    told = cv2.FileStorage(str(arguments.room / "orb_slam3.yaml"), cv2.FILE_STORAGE_READ)
    names = ("Camera1.fx", "Camera1.fy", "Camera1.cx", "Camera1.cy", "RGBD.DepthMapFactor")
    fx, fy, cx, cy, steps = (told.getNode(name).real() for name in names)
    settings = cv2.OdometrySettings()  # type: ignore[attr-defined]
    settings.setCameraMatrix(np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]], np.float32))
    odometry = cv2.Odometry(cv2.OdometryType_RGB_DEPTH, settings, cv2.OdometryAlgoType_COMMON)  # type: ignore[attr-defined]
    pose, before, rows, posed = np.eye(4), None, [], 0
    pictures = sorted((arguments.room / "mav0/cam0/data").glob("*.png"))
    for picture, depth in zip(pictures, sorted(arguments.depth.glob("*.png")), strict=True):
        metres = cv2.imread(str(depth), cv2.IMREAD_UNCHANGED).astype(np.float32) / np.float32(steps)
        metres[metres == 0.0] = np.nan
        frame = cv2.OdometryFrame(metres, cv2.imread(str(picture), cv2.IMREAD_GRAYSCALE))  # type: ignore[attr-defined]
        odometry.prepareFrame(frame)
        if before is not None:
            found, step = odometry.compute(before, frame)
            posed += bool(found)
            pose = pose @ np.linalg.inv(step) if found else pose
        rows.append(f"{int(picture.stem)} {' '.join(map(repr, pose[:3, 3].tolist()))} 0 0 0 1")
        before = frame
    (arguments.out / "trajectory.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    said = {"frames": len(rows), "posed": posed + 1, "initialised_s": None}
    (arguments.out / "said.json").write_text(json.dumps(said), encoding="utf-8")


if __name__ == "__main__":
    main()
