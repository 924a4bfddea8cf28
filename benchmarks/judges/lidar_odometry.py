"""Other people's lidar odometry on bags of rooms that nobody has looked at, unmodified, judged by the true poses.

python -m benchmarks.judges.lidar_odometry [--rooms N] [--frames N] [--seed S] [--overlay RIG] [--bags DIR] [--write]

Each room is made offline with a robot that carries a lidar.  Each of ``JUDGES`` (the extra ``bench-lidar``) reads ``lidar/points`` and,
for comparison, ``lidar/points_ideal``: KISS-ICP (I. Vizzo et al., "KISS-ICP: In Defense of Point-to-Point ICP", RA-L 2023) with its
deskewing by the times of points, and without; RKO-LIO (M. Malladi et al., 2025) with ``imu/data`` or ``imu/ideal``, likewise;
small_gicp (K. Koide, JOSS 2024), each sweep onto the map of those before, which does not deskew.  Settings are for rooms: voxels of
10 cm; RKO-LIO expects jerks of 30 m/s3, as in a hand: by its default of 3 it takes a tremor for a tilt.  What is said of a sweep is where
the lidar is at its end, or in its middle where it is not deskewed.  Errors are those that evo tells; the true places come from
``odom/ideal`` and ``/tf_static``.
"""

import tempfile
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.judges.rooms import PICTURES_OFF, make_bags, tell, words_of
from benchmarks.judges.trajectory import judge, places_only
from benchmarks.table import Row, at_most
from scene_synth_ros.messages import streams as roles
from scene_synth_ros.messages.cdr import CdrReader
from scene_synth_ros.prove.bag import ReadBag
from scene_synth_ros.prove.decode import CloudRow, ImuRows, cloud_row, imu_rows, xyz_of
from scene_synth_ros.prove.evidence import Evidence, Room

Floats = NDArray[np.float64]

_QUICK = ("camera.width:=64", "camera.height:=48", "streams.color:=false", *PICTURES_OFF)
_VOXEL_M, _COARSE_M, _NEAR_M, _FAR_M, _LIMIT_M = 0.1, 0.3, 0.2, 30.0, 0.05
_JERK_M_S3 = 30.0


class Sensed(NamedTuple):
    """What a judge reads of a room: sweeps, how long one takes, and the IMU with its pose in the lidar's frame (4, 4)."""

    sweeps: list[CloudRow]
    period_s: float
    imu: ImuRows | None
    lidar_from_imu: Floats


class Judge(NamedTuple):
    """Somebody's odometry: where it says that the lidar is in each sweep, (n, 3), and at which share of a sweep that is."""

    places: Callable[[Sensed], Floats]
    at: float


class Ride(NamedTuple):
    """One room: name; way gone (m) and turn made (rad); error (m) by the judge's name and whether what is sensed errs."""

    name: str
    way_m: float
    turned_rad: float
    errors_m: dict[tuple[str, bool], float]


def rides(bag: Path) -> Iterator[Ride]:
    """Yield what each judge makes of each room of a bag."""
    with closing(ReadBag(bag, print)) as messages:
        evidence = Evidence(messages)
        for number, room in enumerate(evidence.rooms):
            if room.curve is None or room.body is None:
                continue
            way = float(np.linalg.norm(np.diff(room.body.place, axis=0), axis=1).sum())
            turned = float(np.abs(room.body.spin[:-1, 2] * np.diff(room.body.stamps) * 1e-9).sum())
            errors = {}
            for errs in (True, False):
                sensed = _sensed(evidence, room, errs)
                stamps = 1e-9 * np.array([sweep.stamp_ns for sweep in sensed.sweeps])
                for title, (places, at) in JUDGES.items():
                    true = places_only(stamps, _true_places(evidence, room, sensed, at))
                    errors[title, errs] = judge(places_only(stamps, places(sensed)), true).ate_m
            yield Ride(f"{bag.name}, room {number}", way, turned, errors)


def _sensed(evidence: Evidence, room: Room, errs: bool) -> Sensed:
    """Return what the lidar and the IMU read, or would without any error."""
    cloud, imu = (roles.LIDAR_POINTS, roles.IMU_DATA) if errs else (roles.LIDAR_IDEAL, roles.IMU_IDEAL)
    sweeps = [cloud_row(CdrReader(message)) for _, message in room.each(evidence.first(cloud))]
    rows: ImuRows | None = room.table(imu, imu_rows, ImuRows)
    between = np.eye(4)
    lidar, device = evidence.mount(sweeps[0].frame), evidence.mount(str(rows.frames[0])) if rows is not None else None
    if lidar is not None and device is not None:
        between[:3, :3] = (lidar.turn.inv() * device.turn).as_matrix()
        between[:3, 3] = lidar.turn.inv().apply(device.place - lidar.place)
    return Sensed(sweeps, 1e-9 * float(np.diff([sweep.stamp_ns for sweep in sweeps]).min()), rows, between)


def _true_places(evidence: Evidence, room: Room, sensed: Sensed, at: float) -> Floats:
    mount = evidence.mount(sensed.sweeps[0].frame)
    assert mount is not None and room.curve is not None
    return np.array([mount.on(*room.curve.at(sweep.stamp_ns, at * sensed.period_s))[0][0] for sweep in sensed.sweeps])


def _by_kiss_icp(sensed: Sensed, *, deskewed: bool) -> Floats:
    from kiss_icp.config import KISSConfig
    from kiss_icp.config.config import DataConfig, MappingConfig
    from kiss_icp.kiss_icp import KissICP

    data = DataConfig(min_range=_NEAR_M, max_range=_FAR_M, deskew=deskewed)
    odometry, said = KissICP(KISSConfig(data=data, mapping=MappingConfig(voxel_size=_VOXEL_M))), []
    for sweep in sensed.sweeps:
        points = sweep.points.ravel()
        odometry.register_frame(xyz_of(points), points["time"].astype(np.float64) / sensed.period_s)
        said.append(odometry.last_pose[:3, 3])
    return np.array(said)


def _by_rko_lio(sensed: Sensed, *, deskewed: bool) -> Floats:
    from rko_lio.config import LIOConfig
    from rko_lio.lio import LIO

    assert sensed.imu is not None
    room = LIOConfig(deskew=deskewed, voxel_size=_VOXEL_M, min_range=_NEAR_M, max_range=_FAR_M, max_expected_jerk=_JERK_M_S3)
    odometry = LIO(replace(room, max_num_threads=1, initialization_phase=True))
    said, fed = [], 0
    for sweep in sensed.sweeps:
        points = sweep.points.ravel()
        end_ns = sweep.stamp_ns + round(sensed.period_s * 1e9)
        while fed < len(sensed.imu.stamps) and sensed.imu.stamps[fed] <= end_ns:
            odometry.add_imu_measurement(sensed.imu.force[fed], sensed.imu.rate[fed], int(sensed.imu.stamps[fed]), sensed.lidar_from_imu)
            fed += 1
        times = sweep.stamp_ns + np.rint(points["time"].astype(np.float64) * 1e9).astype(np.int64)
        odometry.register_scan(xyz_of(points), times, np.eye(4), sweep.stamp_ns, end_ns)
        said.append(odometry.pose()[:3, 3])
    return np.array(said)


def _by_small_gicp(sensed: Sensed) -> Floats:
    import small_gicp

    model, pose, step, said = small_gicp.GaussianVoxelMap(_COARSE_M), np.eye(4), np.eye(4), []
    for number, sweep in enumerate(sensed.sweeps):
        cloud, _ = small_gicp.preprocess_points(xyz_of(sweep.points.ravel()), downsampling_resolution=_VOXEL_M)
        if number:
            found = small_gicp.align(model, cloud, init_T_target_source=pose @ step).T_target_source
            step, pose = np.linalg.inv(pose) @ found, found
        model.insert(cloud, pose)
        said.append(pose[:3, 3])
    return np.array(said)


JUDGES: dict[str, Judge] = {
    "KISS-ICP": Judge(partial(_by_kiss_icp, deskewed=True), 1.0),
    "KISS-ICP, not deskewed": Judge(partial(_by_kiss_icp, deskewed=False), 0.5),
    "RKO-LIO": Judge(partial(_by_rko_lio, deskewed=True), 1.0),
    "RKO-LIO, not deskewed": Judge(partial(_by_rko_lio, deskewed=False), 0.5),
    "small_gicp, not deskewed": Judge(_by_small_gicp, 0.5),
}
HELD = ("KISS-ICP", "RKO-LIO")
"""Judges whose median error is held to a limit."""


def measure(bags: Path) -> list[Row]:
    """Return the figures of the rooms of a folder of bags."""
    found = [ride for shard in sorted((bags / "shards").iterdir()) if shard.is_dir() for ride in rides(shard)]
    rows = [Row("rooms", len(found), "")]
    rows += [Row("way gone in a room, mean", float(np.mean([ride.way_m for ride in found])), "m")]
    rows += [Row("turned in a room, mean", float(np.mean([ride.turned_rad for ride in found])), "rad")]
    for errs, of in ((True, "as the devices read"), (False, "without noise and losses")):
        for name in JUDGES:
            errors = np.array([ride.errors_m[name, errs] for ride in found])
            median, title = float(np.median(errors)), f"{name}, {of}: ATE, median"
            rows.append(at_most(title, median, "m", _LIMIT_M) if errs and name in HELD else Row(title, median, "m"))
            rows.append(Row(f" {name}, {of}: ATE, greatest", float(errors.max()), "m"))
    return rows


def main() -> None:
    """Measure, print, and with ``--write`` put the table into docs/lidar.md."""
    parser = words_of("lidar_odometry", 300)
    parser.add_argument("--overlay", default="lidar_robot")
    parser.add_argument("--bags", type=Path, help="folder of bags that are there already; then nothing is made")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        bags = arguments.bags or Path(folder, "bags")
        if arguments.bags is None:
            make_bags(arguments, arguments.overlay, (f"renderer_node.{value}" for value in _QUICK), bags)
        rows = measure(bags)
    tell(arguments, rows, f"Lidar odometry on {arguments.overlay}", "lidar.md", "odometry")


if __name__ == "__main__":
    main()
