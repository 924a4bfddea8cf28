"""The bags of a test's rooms, and of counterfactual ones: a sweep, made once for what it is made of."""

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from evaluation.metrics.poses import Trajectory, trajectory_of
from scene_description import CameraPose, SceneSynthError
from scene_description.share import config_path
from scene_description.tum_trajectory import read_tum_trajectory
from scene_description.yaml_text import read_yaml
from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.cli.commands.sweep_command import read_plan
from scene_synth_ros.messages import streams as roles
from scene_synth_ros.messages.poses import read_odometry_pose, read_pose
from scene_synth_ros.messages.streams import find_streams
from scene_synth_ros.suite.parameters import parameter_values
from scene_synth_ros.sweep.run_sweep import run_sweep
from scene_synth_ros.sweep.variant import SweepPlan, Variant
from scene_synth_ros.testing.room import PATHS, RoomTest

_HARMLESS = {"camera.shutter_s": {"values": [0.0]}}
"""A factor for sweeps of rooms as they are, of which only those are made where nothing is changed."""
_SAME_NS = 2_000_000
"""An estimate is of the true pose whose stamp is so near."""


class TestError(SceneSynthError):
    """A recording or an estimate that cannot be judged; one line."""

    __test__ = False


class Recording(NamedTuple):
    """What an estimator is given.

    Attributes:
        bag: folder of an MCAP bag.
        folder: for what the estimator writes; empty.
        name: room type, seed and index, and what was changed.
    """

    bag: Path
    folder: Path
    name: str


def base_plan(test: RoomTest, folder: Path) -> SweepPlan:
    """Return the sweep whose unchanged variants are the rooms of a test.

    Raises:
        SceneSynthError: a room cannot be sampled, or a parameter does not fit.
    """
    return _plan(test, folder, {"seeds": [test.seed], "count": test.rooms}, _HARMLESS)


def blame_plan(test: RoomTest, folder: Path, broken: Variant) -> SweepPlan:
    """Return the sweep of one room, each of whose variants is without one of what may have broken an estimator.

    Raises:
        SceneSynthError: a room cannot be sampled.
    """
    own = parameter_values(broken.base.settings.renderers[min(broken.base.settings.renderers)])
    rows: Mapping[str, Mapping[str, Any]] = read_yaml(config_path("blame.yaml"), TestError)
    factors = {
        name: {"values": row["values"]}
        for name, row in rows.items()
        if own.get(row.get("when", ""), True) and not own.get(row.get("unless", ""))
    }
    base = {"seeds": [test.seed], "count": broken.base.scene.index + 1}
    return _plan(test, folder, base, factors)


def record(plan: SweepPlan, folder: Path, ids: list[str], tell: Callable[[str], None]) -> None:
    """Make the bags of some variants that are not there yet.

    Raises:
        SceneSynthError: one cannot be made.
    """
    for made in run_sweep(plan, folder, ids).made:
        if made.refused:
            tell(f"{made.id}: {made.refused}")


def _plan(test: RoomTest, folder: Path, base: Mapping[str, object], factors: Mapping[str, object]) -> SweepPlan:
    run: dict[str, object] = {"frames": test.frames, "parameters": {**PATHS[test.path], **test.parameters}}
    run |= {"overlays": test.rig.split(",")} if test.rig else {}
    run |= {"rate_hz": test.rate_hz} if test.rate_hz is not None else {}
    data = {"design": "one_at_a_time", "base": {"room_types": [test.room_type], **base}, "run": run, "factors": factors}
    text = json.dumps(data, indent=1)
    file = folder / f"{hashlib.sha256(text.encode()).hexdigest()[:16]}.yaml"
    folder.mkdir(parents=True, exist_ok=True)
    file.write_text(text + "\n", encoding="utf-8")
    return read_plan(file)


def sweep_folder(plan: SweepPlan, folder: Path) -> Path:
    """Return where the bags of a sweep of a test are kept: its name tells what it is made of."""
    return folder / Path(plan.variants[0].file).stem


_POSES = {roles.POSE: read_pose, roles.ODOM_IDEAL: read_odometry_pose}
"""Role of a topic -> what reads the pose of its messages."""


def true_trajectory(bag: Path, test: RoomTest) -> Trajectory:
    """Return where the camera, or the body, was.

    Raises:
        TestError: the bag does not tell, never, or of several cameras.
    """
    with BagReader(bag) as reader:
        role = roles.ODOM_IDEAL if test.truth == "body" else roles.POSE
        found = {topic: stream for topic, stream in find_streams(reader.types, role).items() if stream.camera != roles.LASER}
        topics = [topic for topic, stream in found.items() if test.camera in ("", stream.camera) or test.truth == "body"]
        if len(topics) != 1:
            expected = "a body: a rig with body.enabled" if test.truth == "body" else "one camera; name it with camera="
            raise TestError(f"{bag}: truth of {test.truth}: expected {expected}, got {', '.join(found) or 'none'}")
        poses = [_POSES[role](message.data).camera_pose for message in reader.messages(topics)]
    if not poses:
        raise TestError(f"{bag}: truth of {test.truth}: expected poses on {topics[0]}, got no message; record it")
    return trajectory_of(poses)


def estimated_trajectory(estimate: object, true: Trajectory) -> Trajectory:
    """Return what an estimator gave, at the stamps of the true poses that are nearest to its own: a trajectory, poses, or a TUM file.

    Raises:
        TestError: it is something else.
        FieldError, OSError: the file is none of a trajectory.
    """
    if isinstance(estimate, Path):
        estimate = read_tum_trajectory(estimate, TestError)
    if not isinstance(estimate, Trajectory):
        if not isinstance(estimate, (tuple, list)) or not all(isinstance(pose, CameraPose) for pose in estimate):
            got = type(estimate).__name__
            raise TestError(
                f"estimate: expected the Path of a TUM file, CameraPoses or a Trajectory, got {got}; return it from the function"
            )
        estimate = trajectory_of(estimate)
    return _at_true_stamps(estimate, true.stamps_ns)


def _at_true_stamps(found: Trajectory, true_ns: np.ndarray[Any, np.dtype[np.int64]]) -> Trajectory:
    """Return the poses of a trajectory that are of a true one, at its stamp; of several the first."""
    stamps = np.asarray(found.stamps_ns, np.int64)
    after = np.minimum(np.searchsorted(true_ns, stamps), len(true_ns) - 1)
    before = np.maximum(after - 1, 0)
    nearest = np.where(np.abs(stamps - true_ns[before]) <= np.abs(true_ns[after] - stamps), before, after)
    rows = np.flatnonzero(np.abs(true_ns[nearest] - stamps) <= _SAME_NS)
    _, first = np.unique(nearest[rows], return_index=True)
    chosen = rows[first]
    return Trajectory(stamps_ns=true_ns[nearest[chosen]], positions_m=found.positions_m[chosen], orientations=found.orientations[chosen])


def unchanged(plan: SweepPlan) -> Iterator[Variant]:
    """Yield the variants that are the rooms as they are."""
    yield from (variant for variant in plan.variants if not variant.changed)
