"""Rooms as unit tests: a good estimator passes, a bad one fails with what broke it, and a test file says so by the plugin."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from rclpy.serialization import deserialize_message

from evaluation.metrics.poses import Trajectory
from grammar.counterfactual import FACTORS
from scene_description import CameraPose, FieldError
from scene_description.share import config_path
from scene_description.strict import read_value
from scene_description.tum_trajectory import trajectory_to_tum
from scene_description.yaml_text import read_yaml
from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.bags.bag_writer import BagWriter
from scene_synth_ros.messages.message_definitions import message_class
from scene_synth_ros.render.renderer_config import RENDERER_GROUPS
from scene_synth_ros.suite.parameters import annotations_of
from scene_synth_ros.testing.judge import GateFailure, Judge
from scene_synth_ros.testing.recordings import Recording, TestError, base_plan, estimated_trajectory, true_trajectory, unchanged
from scene_synth_ros.testing.room import RoomTest, room

pytestmark = pytest.mark.slow

SMALL = {
    "grammar_node.motion.rest_s": 0.2, "grammar_node.motion.speed_m_s": 1.0, "grammar_node.motion.acceleration_m_s2": 3.0,
    "grammar_node.motion.jerk_m_s3": 30.0, "grammar_node.motion.turn_rad_s": 3.0, "grammar_node.motion.turn_acceleration_rad_s2": 12.0,
    "camera.width": 32, "camera.height": 24, "wheels.radius_error": 0.0, "wheels.slip_m": 0.0, "wheels.track_error": 0.1,
    "scan.enabled": False,
    **{f"streams.{layer}": False for layer in ("color", "normals", "semantic", "instance")},
}  # fmt: skip
ROOMS = RoomTest(seed=11, rooms=2, rig="turtlebot", path="base", frames=150, truth="body", parameters=SMALL, ate_m=0.002, coverage=0.8)
FILE = """
import numpy as np
from test_judge import SMALL, wheel_odometry
from scene_synth_ros.testing.room import room

@room(seed=11, rooms=2, rig="turtlebot", path="base", frames=150, truth="body", parameters=SMALL, ate_m={bar}, coverage=0.8)
def test_wheels(judge):
    judge(wheel_odometry)
"""


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("kept")


def wheel_odometry(recording: Recording) -> Path:
    """Return what the wheels say, as somebody's estimator writes it."""
    with BagReader(recording.bag) as reader:
        said = [deserialize_message(found.data, message_class(found.type_name)) for found in reader.messages(["/synth/odom"])]
    poses = []
    for message in said:
        p, q = message.pose.pose.position, message.pose.pose.orientation
        stamp_ns = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
        poses.append(CameraPose(stamp_ns=stamp_ns, position_m=(p.x, p.y, p.z), orientation=(q.x, q.y, q.z, q.w)))
    file = recording.folder / "said.txt"
    file.write_text(trajectory_to_tum(poses))
    return file


def test_a_rig_may_have_a_preset_over_it(tmp_path: Path) -> None:
    test = RoomTest(seed=11, rig="realsense_d435i,realtime", frames=3, ate_m=1.0)
    (variant,) = unchanged(base_plan(test, tmp_path))
    renderers = variant.base.settings.renderers
    assert len(renderers) == 2 and {values["render"].integrator for values in renderers.values()} == {"cached"}


def test_what_is_not_good_enough_fails_with_the_factor_that_broke_it(kept: Path) -> None:
    told: list[str] = []
    with pytest.raises(GateFailure) as failure:
        Judge(ROOMS, kept, told.append)(wheel_odometry)
    lines = str(failure.value).splitlines()
    assert lines[0] == "not good enough:" and lines[1].startswith("  ate_rmse 0.") and "at most 0.002 m" in lines[1] and "[" in lines[1]
    assert [line.partition(":")[0] for line in lines[2:4]] == ["  living_room 0 of seed 11", "  living_room 1 of seed 11"]
    begin = next(k for k, line in enumerate(lines) if line.startswith("what broke it in living_room "))
    assert lines[begin + 1].startswith("  wheels.track_error 0.0 in place of 0.1: ") and lines[begin + 1].endswith(", good")
    assert not any(line.endswith(", good") for line in lines[begin + 2 :])
    assert any(line.startswith("coverage ") for line in told)


def test_the_plugin_runs_a_test_file_and_keeps_its_bags(kept: Path, tmp_path: Path) -> None:
    bags = {path: path.stat().st_mtime_ns for path in kept.rglob("*.mcap")}
    assert bags
    for bar, status in (("9.0", 0), ("0.0001", 1)):
        (tmp_path / "test_slam.py").write_text(FILE.replace("{bar}", bar))
        words = [sys.executable, "-m", "pytest", "-q", "--rootdir", str(tmp_path), "--scene-synth-bags", str(kept)]
        words += ["-p", "no:cacheprovider", str(tmp_path / "test_slam.py")]
        root = Path(__file__).parents[3]
        env = os.environ | {"PYTHONPATH": os.pathsep.join([str(root), str(Path(__file__).parent)])}
        done = subprocess.run(words, cwd=tmp_path, env=env, capture_output=True, text=True, check=False)
        assert done.returncode == status, done.stdout + done.stderr
        assert "test_wheels: ate_rmse 0." in done.stdout and ("what broke it in" in done.stdout) == bool(status)
    assert {path: path.stat().st_mtime_ns for path in kept.rglob("*.mcap")} == bags


def test_a_command_writes_the_trajectory(kept: Path, tmp_path: Path) -> None:
    script = tmp_path / "slam.py"
    script.write_text(
        "import sys\nfrom pathlib import Path\nfrom test_judge import wheel_odometry\n"
        "from scene_synth_ros.testing.recordings import Recording\n"
        "wheel_odometry(Recording(Path(sys.argv[1]), Path(sys.argv[2]).parent, '')).rename(sys.argv[2])\n"
    )
    loose = Judge(RoomTest(**{name: getattr(ROOMS, name) for name in ROOMS.__dataclass_fields__} | {"ate_m": 9.0}), kept)
    words = f"env PYTHONPATH={Path(__file__).parents[3]}:{Path(__file__).parent} {sys.executable} {script}"
    assert all(score.good for score in loose.command(f"{words} {{bag}} {{trajectory}}"))
    with pytest.raises(TestError, match=r"expected a trajectory in .*, got exit status 3; no map"):
        loose.command(f"""{sys.executable} -c "import sys; print('no map', file=sys.stderr); sys.exit(3)" """)


def test_estimates_are_taken_at_the_stamps_of_the_truth() -> None:
    true = Trajectory(stamps_ns=np.arange(5) * 10**8, positions_m=np.zeros((5, 3)), orientations=np.tile([0.0, 0.0, 0.0, 1.0], (5, 1)))
    stamps = [0, 100_500_000, 101_000_000, 250_000_000, 399_000_001]
    said = [CameraPose(stamp_ns=at, position_m=(float(k), 0.0, 0.0), orientation=(0.0, 0.0, 0.0, 1.0)) for k, at in enumerate(stamps)]
    found = estimated_trajectory(said, true)
    assert found.stamps_ns.tolist() == [0, 100_000_000, 400_000_000] and found.positions_m[:, 0].tolist() == [0.0, 1.0, 4.0]
    with pytest.raises(TestError, match=r"estimate: expected the Path of a TUM file, CameraPoses or a Trajectory, got NoneType"):
        estimated_trajectory(None, true)
    one = Trajectory(stamps_ns=true.stamps_ns[1:2], positions_m=true.positions_m[1:2], orientations=true.orientations[1:2])
    alone = estimated_trajectory(said[1:4], one)
    assert alone.stamps_ns.tolist() == [100_000_000] and alone.positions_m[:, 0].tolist() == [1.0]


def test_a_bag_without_a_true_pose_is_refused_in_one_line(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "bag") as writer:
        writer.add_topic("/synth/camera/pose", "geometry_msgs/msg/PoseStamped")
    with pytest.raises(TestError, match=r"expected poses on /synth/camera/pose, got no message; record it$"):
        true_trajectory(tmp_path / "bag", RoomTest(seed=1, ate_m=1.0))


@pytest.mark.parametrize(
    ("words", "error"), [({"seed": 1}, "at least one of ate_m"), ({"seed": 1, "ate": 1.0}, "ate"), ({"seed": -1, "ate_m": 1.0}, "seed")]
)
def test_words_that_do_not_fit_are_refused(words: dict[str, object], error: str) -> None:
    with pytest.raises(FieldError, match=error):
        room(**words)


def test_what_may_be_blamed_are_factors_of_sweeps_and_parameters_of_the_renderer() -> None:
    parameters = annotations_of(RENDERER_GROUPS)
    rows = read_yaml(config_path("blame.yaml"), TestError)
    assert len(rows) > 10
    for name, row in rows.items():
        assert name in parameters or name in FACTORS, name
        assert row.keys() <= {"values", "when", "unless"} and len(row["values"]) == 1
        assert {row.get(key) for key in ("when", "unless")} - {None} <= parameters.keys()
        if name in parameters:
            read_value(parameters[name], row["values"][0], name)
