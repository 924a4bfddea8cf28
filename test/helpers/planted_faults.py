"""Faults planted in the messages of a bag, each of a kind that a check must name.

``python test/helpers/planted_faults.py BAG --cases 5`` plants so many of each kind, drawn from the clock, and prints what was not named.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Collection, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation

from scene_synth_ros.bags.indexed_bag import open_bag
from scene_synth_ros.prove.prove import CHECKS, prove_messages

STORE = get_typestore(Stores.ROS2_JAZZY)


class Recorded(NamedTuple):
    """Messages of a bag in memory: topic -> type, topic -> log time and bytes of each."""

    types: Mapping[str, str]
    rows: Mapping[str, list[tuple[int, bytes]]]

    def messages(self, topic: str, wanted: Collection[int] | None = None) -> Iterator[tuple[int, memoryview]]:
        return ((log_ns, memoryview(data)) for log_ns, data in self.rows[topic] if wanted is None or log_ns in wanted)

    def all(self) -> Iterator[tuple[str, int, memoryview]]:
        return ((topic, log_ns, memoryview(data)) for topic, rows in self.rows.items() for log_ns, data in rows)

    def topic(self, end: str) -> str:
        """The topic that ends so; empty if there is none."""
        return next((topic for topic in self.rows if topic.endswith(end)), "")

    def with_rows(self, end: str, rows: list[tuple[int, bytes]]) -> Recorded:
        return self._replace(rows={**self.rows, self.topic(end): rows})

    def changed(self, end: str, change: Callable[[Any, int], None], only: range | None = None) -> Recorded:
        """The same with the messages of a topic changed, by the message and its number."""
        topic = self.topic(end)
        kind, rows = self.types[topic], []
        for number, (log_ns, data) in enumerate(self.rows[topic]):
            if only is None or number in only:
                message = STORE.deserialize_cdr(data, kind)
                change(message, number)
                data = bytes(STORE.serialize_cdr(message, kind))
            rows.append((log_ns, data))
        return self.with_rows(end, rows)


def read(bag: Path) -> Recorded:
    """All messages of a bag."""
    found = open_bag(bag)
    return Recorded(dict(found.types), {topic: [(log_ns, bytes(data)) for log_ns, data in found.messages(topic)] for topic in found.types})


Random = np.random.Generator


def pixels(message: Any) -> np.ndarray:
    """The pixels of an image, which may be written."""
    kinds = {"32FC1": "<f4", "32FC2": "<f4", "32FC3": "<f4", "16UC1": "<u2", "mono8": "u1", "rgb8": "u1"}
    message.data = np.array(message.data)
    return message.data.view(kinds[message.encoding]).reshape(message.height, message.width, -1)


def images(end: str, change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Recorded, Random], Recorded]:
    def every(message: Any, _: int) -> None:
        shown = pixels(message)
        shown[:] = change(shown.copy())

    return lambda bag, random: bag.changed(end, every)


def some(bag: Recorded, end: str, random: Random) -> int:
    """The number of a message of a topic, not the first or last few."""
    count = len(bag.rows[bag.topic(end)])
    return int(random.integers(count // 3, max(2 * count // 3, count // 3 + 1)))


def scale_depth(bag: Recorded, random: Random) -> Recorded:
    share = 1.0 + random.choice([-1, 1]) * random.uniform(0.005, 0.03)
    return images("depth/image_raw", lambda shown: shown * np.float32(share))(bag, random)


def shift_depth(bag: Recorded, random: Random) -> Recorded:
    by = int(random.integers(1, 4)) * int(random.choice([-1, 1]))
    return images("depth/image_raw", lambda shown: np.roll(shown, by, axis=1))(bag, random)


def swap_frame(bag: Recorded, random: Random) -> Recorded:
    one = some(bag, "depth/image_raw", random)
    other = STORE.deserialize_cdr(bag.rows[bag.topic("depth/image_raw")][one - 2][1], "sensor_msgs/msg/Image").data
    return bag.changed("depth/image_raw", lambda message, _: setattr(message, "data", other), range(one, one + 1))


def move_poses(bag: Recorded, random: Random) -> Recorded:
    off = random.normal(size=3)
    off *= random.uniform(0.005, 0.03) / np.linalg.norm(off)

    def change(message: Any, _: int) -> None:
        for axis, by in zip("xyz", off, strict=True):
            setattr(message.pose.position, axis, getattr(message.pose.position, axis) + by)

    return bag.changed("camera/pose", change)


def turn(quaternion: Any, by: Rotation) -> None:
    turned = (Rotation.from_quat([getattr(quaternion, k) for k in "xyzw"]) * by).as_quat()
    for k, value in zip("xyzw", turned, strict=True):
        setattr(quaternion, k, float(value))


def turn_pose(bag: Recorded, random: Random) -> Recorded:
    by = Rotation.from_rotvec(np.radians(random.uniform(0.5, 2.0)) * np.eye(3)[random.integers(3)])
    one = some(bag, "camera/pose", random)
    return bag.changed("camera/pose", lambda message, _: turn(message.pose.orientation, by), range(one, one + 1))


def infos(change: Callable[[Any], None]) -> Callable[[Recorded], Recorded]:
    def every(bag: Recorded) -> Recorded:
        for topic in [topic for topic in bag.rows if topic.endswith("camera_info")]:
            bag = bag.changed(topic, lambda message, _: change(message))
        return bag

    return every


def change_focal(bag: Recorded, random: Random) -> Recorded:
    share = 1.0 + random.choice([-1, 1]) * random.uniform(0.006, 0.03)

    def change(message: Any) -> None:
        message.k = message.k * np.array([share, 1, 1, 1, share, 1, 1, 1, 1])

    return infos(change)(bag)


def change_center(bag: Recorded, random: Random) -> Recorded:
    by = random.choice([-1, 1]) * random.uniform(1.0, 4.0)

    def change(message: Any) -> None:
        message.k = message.k + np.array([0, 0, by, 0, 0, 0, 0, 0, 0])

    return infos(change)(bag)


def change_one_info(bag: Recorded, random: Random) -> Recorded:
    one = some(bag, "depth/camera_info", random)
    return bag.changed("depth/camera_info", lambda message, _: setattr(message, "k", message.k * 1.01), range(one, one + 1))


def swap_ids(end: str) -> Callable[[Recorded, Random], Recorded]:
    """The two most frequent ids change places."""

    def change(bag: Recorded, random: Random) -> Recorded:
        seen = np.concatenate(
            [pixels(STORE.deserialize_cdr(data, bag.types[bag.topic(end)])).ravel() for _, data in bag.rows[bag.topic(end)]]
        )
        values, counts = np.unique(seen, return_counts=True)
        one, other = values[np.argsort(counts)[-2:]]
        return images(end, lambda shown: np.where(shown == one, other, np.where(shown == other, one, shown)))(bag, random)

    return change


def late_color(bag: Recorded, random: Random) -> Recorded:
    return colors_of_another(bag, int(random.choice([-1, 1])))


def colors_of_another(bag: Recorded, by: int) -> Recorded:
    """The pictures of the frame so many later."""
    topic = bag.topic("color/image_raw")
    data = [STORE.deserialize_cdr(row, bag.types[topic]).data for _, row in bag.rows[topic]]
    return bag.changed("color/image_raw", lambda message, number: setattr(message, "data", data[min(max(number + by, 0), len(data) - 1)]))


def drop(end: str) -> Callable[[Recorded, Random], Recorded]:
    def change(bag: Recorded, random: Random) -> Recorded:
        rows = list(bag.rows[bag.topic(end)])
        del rows[some(bag, end, random)]
        return bag.with_rows(end, rows)

    return change


def restamp(bag: Recorded, random: Random) -> Recorded:
    one, by = some(bag, "imu/data", random), int(random.integers(200_000, 2_000_000))

    def change(message: Any, _: int) -> None:
        message.header.stamp.nanosec = int(message.header.stamp.nanosec) + by

    return bag.changed("imu/data", change, range(one, one + 1))


def flip_gyro(bag: Recorded, random: Random) -> Recorded:
    return bag.changed("imu/ideal", lambda message, _: setattr(message.angular_velocity, "z", -message.angular_velocity.z))


def weightless(end: str) -> Callable[[Recorded, Random], Recorded]:
    def change(message: Any, _: int) -> None:
        message.linear_acceleration.z -= 9.80665

    return lambda bag, random: bag.changed(end, change)


def late_imu(bag: Recorded, random: Random) -> Recorded:
    by, topic = int(random.integers(3, 12)), bag.topic("imu/ideal")
    old = [STORE.deserialize_cdr(data, bag.types[topic]) for _, data in bag.rows[topic]]

    def change(message: Any, number: int) -> None:
        source = old[max(number - by, 0)]
        message.orientation = source.orientation
        message.angular_velocity, message.linear_acceleration = source.angular_velocity, source.linear_acceleration

    return bag.changed("imu/ideal", change)


def sure_imu(bag: Recorded, random: Random) -> Recorded:
    share = random.uniform(0.01, 0.2)
    return bag.changed(
        "imu/data", lambda message, _: setattr(message, "angular_velocity_covariance", message.angular_velocity_covariance * share)
    )


def biased_imu(bag: Recorded, random: Random) -> Recorded:
    by = random.choice([-1, 1]) * random.uniform(0.5, 2.0)

    def change(message: Any, _: int) -> None:
        message.angular_velocity.x += by

    return bag.changed("imu/data", change)


def sure_odometry(bag: Recorded, random: Random) -> Recorded:
    share = random.uniform(1e-5, 1e-4)

    def change(message: Any, number: int) -> None:
        message.pose.covariance = message.pose.covariance * share
        message.pose.pose.position.x += 2e-4 * number  # so that there is an error that it ought to cover

    return bag.changed("/odom", change)


def frozen_odometry(bag: Recorded, random: Random) -> Recorded:
    one, topic = some(bag, "/odom", random), bag.topic("/odom")
    pose = STORE.deserialize_cdr(bag.rows[topic][one][1], bag.types[topic]).pose.pose
    return bag.changed("/odom", lambda message, _: setattr(message.pose, "pose", pose), range(one, len(bag.rows[topic])))


def large_wheels(bag: Recorded, random: Random) -> Recorded:
    share = random.uniform(1.03, 1.1)
    return bag.changed("joint_states", lambda message, _: setattr(message, "position", message.position * share))


def turned_scan(bag: Recorded, random: Random) -> Recorded:
    return bag.changed("scan_ideal", lambda message, _: setattr(message, "ranges", message.ranges[::-1].copy()))


def turned_mirror(bag: Recorded, random: Random) -> Recorded:
    by = random.choice([-1, 1]) * random.uniform(0.01, 0.05)
    return bag.changed("scan_ideal", lambda message, _: setattr(message, "angle_min", message.angle_min + by))


def noisy(end: str) -> Callable[[Recorded, Random], Recorded]:
    def change(bag: Recorded, random: Random) -> Recorded:
        def every(message: Any, _: int) -> None:
            if end == "/scan":
                message.ranges = (message.ranges + random.normal(0, 0.05, len(message.ranges))).astype(np.float32)
            else:
                xyz = points(message)
                far = np.sqrt(xyz["x"] ** 2 + xyz["y"] ** 2 + xyz["z"] ** 2)
                share = 1.0 + random.normal(0, 0.05, len(far)) / far
                for axis in "xyz":
                    xyz[axis] *= share

        return bag.changed(end, every)

    return change


def points(message: Any) -> np.ndarray:
    """The points of a cloud, which may be written."""
    kinds = {7: "<f4", 4: "<u2", 2: "u1"}
    message.data = np.array(message.data)
    record = {"names": [f.name for f in message.fields], "formats": [kinds[f.datatype] for f in message.fields]}
    return message.data.view(np.dtype({**record, "offsets": [f.offset for f in message.fields], "itemsize": message.point_step}))


def timeless_points(bag: Recorded, random: Random) -> Recorded:
    def change(message: Any, _: int) -> None:
        points(message)["time"] = 0.0

    return bag.changed("lidar/points_ideal", change)


def swapped_rings(bag: Recorded, random: Random) -> Recorded:
    one, other = random.choice(16, 2, replace=False)

    def change(message: Any, _: int) -> None:
        cloud = points(message)
        ring = cloud["ring"].copy()
        cloud["ring"][ring == one], cloud["ring"][(ring == other) & (np.arange(len(ring)) % 2 == 0)] = other, one

    return bag.changed("lidar/points_ideal", change)


def move_mount(child: str) -> Callable[[Recorded, Random], Recorded]:
    def change(bag: Recorded, random: Random) -> Recorded:
        axis, by = "xyz"[random.integers(3)], random.choice([-1, 1]) * random.uniform(0.01, 0.05)

        def every(message: Any, _: int) -> None:
            for item in message.transforms:
                if item.child_frame_id == child:
                    setattr(item.transform.translation, axis, getattr(item.transform.translation, axis) + by)

        return bag.changed("tf_static", every)

    return change


def wrong_frame(bag: Recorded, random: Random) -> Recorded:
    end = str(random.choice(["depth/image_raw", "imu/ideal", "lidar/points", "/scan"]))
    return bag.changed(end, lambda message, _: setattr(message.header, "frame_id", message.header.frame_id + "_"))


def fast_body(bag: Recorded, random: Random) -> Recorded:
    share = random.uniform(1.15, 1.5)

    def change(message: Any, _: int) -> None:
        message.twist.twist.linear.x *= share

    return bag.changed("odom/ideal", change)


def clock_back(bag: Recorded, random: Random) -> Recorded:
    one = some(bag, "/clock", random)

    def change(message: Any, _: int) -> None:
        message.clock.nanosec = max(int(message.clock.nanosec) - 30_000_000, 0)

    return bag.changed("/clock", change, range(one, one + 1))


KINDS: Mapping[str, tuple[Callable[[Recorded, Random], Recorded], str]] = {
    "depth is scaled": (scale_depth, "depth"),
    "depth is shifted by columns": (shift_depth, "depth"),
    "a frame's depth is another's": (swap_frame, "depth"),
    "poses are moved": (move_poses, "frames"),
    "a pose is turned": (turn_pose, "frames"),
    "the focal length is another": (change_focal, "depth"),
    "the principal point is another": (change_center, "depth"),
    "a camera info differs": (change_one_info, "camera_info"),
    "objects are swapped": (swap_ids("instance/image_raw"), "ids"),
    "classes are swapped": (swap_ids("semantic/image_raw"), "ids"),
    "normals look away": (images("normals/image_raw", np.negative), "normals"),
    "normals are too long": (images("normals/image_raw", lambda shown: shown * np.float32(1.1)), "normals"),
    "flow is turned round": (images("flow/image_raw", np.negative), "reprojection"),
    "colours are those of the next frame": (late_color, "color"),
    "an image is lost": (drop("depth/image_raw"), "stamps"),
    "a sample is lost": (drop("imu/data"), "stamps"),
    "a stamp is late": (restamp, "stamps"),
    "the gyroscope turns the other way": (flip_gyro, "imu"),
    "gravity is missing": (weightless("imu/ideal"), "imu"),
    "the device reads no gravity": (weightless("imu/data"), "imu_noise"),
    "the device is late": (late_imu, "imu"),
    "the device is too sure": (sure_imu, "imu_noise"),
    "the device is biased beyond measure": (biased_imu, "imu_noise"),
    "odometry is too sure": (sure_odometry, "odometry"),
    "odometry stands still": (frozen_odometry, "odometry"),
    "wheels are larger than said": (large_wheels, "wheels"),
    "a scan is turned round": (turned_scan, "scan"),
    "a scan begins elsewhere": (turned_mirror, "scan"),
    "a scan is noisier than said": (noisy("/scan"), "scan_noise"),
    "points have no times": (timeless_points, "lidar"),
    "rings are mixed up": (swapped_rings, "lidar"),
    "the lidar is mounted elsewhere": (move_mount("lidar_link"), "lidar"),
    "the device is mounted elsewhere": (move_mount("camera_link"), "frames"),
    "points are noisier than said": (noisy("lidar/points"), "lidar_noise"),
    "a frame is misspelt": (wrong_frame, "frames"),
    "the body is faster than it moves": (fast_body, "motion"),
    "a transform is lost": (drop("/tf"), "frames"),
    "the clock goes back": (clock_back, "clock"),
}
"""Kind of fault -> what plants it, and the check that must name it."""


def named(bag: Recorded) -> set[str]:
    """Checks that find a fault."""
    proof = prove_messages(bag)
    return {verdict.check for verdict in proof.faults} | {note.partition(":")[0] for note in proof.notes}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("bag", type=Path)
    parser.add_argument("--cases", type=int, default=5)
    parser.add_argument("--seed", type=int, default=time.time_ns() % 2**32)
    arguments = parser.parse_args()
    bag = read(arguments.bag)
    sys.stdout.write(f"seed {arguments.seed}; without a fault: {sorted(named(bag)) or 'none named'}\n")
    missed = planted = 0
    for number, (kind, (plant, check)) in enumerate(KINDS.items()):
        for case in range(arguments.cases):
            found = named(plant(bag, np.random.default_rng([arguments.seed, number, case])))
            planted, missed = planted + 1, missed + (check not in found)
            if check not in found:
                sys.stdout.write(f"missed: {kind}, case {case}: expected {check}, named {sorted(found)}\n")
    sys.stdout.write(f"{planted - missed} of {planted} faults of {len(KINDS)} kinds named; {len(CHECKS)} checks\n")


if __name__ == "__main__":
    main()
