"""A SLAM gate for CI, to be copied: the wheels of a robot in two rooms, with its own errors, must end near where it really is.

    pytest -p scene_synth_ros.testing.plugin examples/slam_gate      # without -p where the package is installed

Put your own estimator in the place of ``wheel_odometry``, or run a program: ``judge.command("my_slam --bag {bag} --out {trajectory}")``.
"""

from pathlib import Path

from scene_description.tum_trajectory import trajectory_to_tum
from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.messages.poses import read_odometry_pose
from scene_synth_ros.testing.judge import Judge
from scene_synth_ros.testing.recordings import Recording
from scene_synth_ros.testing.room import room

ONLY_WHEELS = {f"streams.{layer}": False for layer in ("color", "normals", "semantic", "instance")} | {
    "camera.width": 32,
    "camera.height": 24,
}


def wheel_odometry(recording: Recording) -> Path:
    """Return the file of a trajectory, in TUM's form."""
    with BagReader(recording.bag) as reader:
        poses = [read_odometry_pose(message.data).camera_pose for message in reader.messages(["/synth/odom"])]
    file = recording.folder / "trajectory.txt"
    file.write_text(trajectory_to_tum(poses))
    return file


@room(seed=7, rooms=2, path="loop", rig="turtlebot", frames=300, truth="body", parameters=ONLY_WHEELS, ate_m=0.05, rpe_m=0.01, coverage=0.8)
def test_the_wheels_are_good_enough(judge: Judge) -> None:
    """Judge it in both rooms together."""
    judge(wheel_odometry)
