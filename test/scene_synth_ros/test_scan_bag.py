"""A recorded run with a scanner and points: nothing lost, in order, true when read by others and put in place by /tf."""

import json
import struct
from collections import Counter, defaultdict
from pathlib import Path

import numpy as np
import pytest
import trimesh
from bag_readers import read_rosbags
from mesh_distance import distance_to_mesh_m
from rosbags.typesys import Stores, get_typestore
from scene_synth_ros_suite import run_suite
from shapely import STRtree, linestrings, points

from renderer import CameraConfig
from renderer.lidar.config import ScanConfig
from renderer.lidar.scanner import scan_stamp_ns, scans_of_path
from renderer.scene.flatten import flatten
from scene_description import scene_from_json
from scene_description.poses import rotation_from_quaternion
from scene_synth_ros.bags.bag_inspect import inspect_bag
from scene_synth_ros.messages.frame_messages import FrameMessages, StreamConfig
from scene_synth_ros.verify.bag_verify import verify_bag

SCANNER = ScanConfig(rate_hz=23.0, beams=240, angle_max_rad=np.pi * (1 - 2 / 240))
STORE = get_typestore(Stores.ROS2_JAZZY)


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("scan") / "bag"
    words = ["--rooms", 2, "--frames", 6, "--seed", 8]
    values = {
        "scan.enabled": "true",
        "streams.points": "true",
        "streams.points_color": "true",
        "streams.points_sensed": "true",
        "camera.row_time_s": 0.001,
    }
    values |= {"scan.rate_hz": SCANNER.rate_hz, "scan.beams": SCANNER.beams, "scan.angle_max_rad": SCANNER.angle_max_rad}
    for name, value in values.items():
        words += ["-p", f"renderer_node.{name}:={value}"]
    process = run_suite(folder, *words, timeout_s=600)
    assert process.returncode == 0, process.stderr + process.stdout
    return folder


@pytest.fixture(scope="module")
def messages(bag: Path) -> dict[str, list[tuple[int, object]]]:
    """Topic -> log time and message, decoded by rosbags."""
    rows, topics = read_rosbags(bag)
    found = defaultdict(list)
    for topic, log_ns, data in rows:
        if not topic.endswith("label_info"):  # of a package that rosbags does not know
            found[topic.removeprefix("/synth/")].append((log_ns, STORE.deserialize_cdr(data, topics[topic].msgtype)))
    return found


def stamp_of(message) -> int:
    return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec


def test_every_scan_of_every_room_is_there_once_and_logged_at_its_stamp(bag: Path, messages) -> None:
    expected = []
    for _, text in messages["scene"]:
        path = scene_from_json(text.data).camera_path
        expected += [scan_stamp_ns(SCANNER, path[0].stamp_ns, number) for number in scans_of_path(SCANNER, path)]
    assert len(expected) == 2 * 11
    for topic in ("scan", "scan_ideal"):
        assert [stamp_of(message) for _, message in messages[topic]] == expected
        assert [log_ns for log_ns, _ in messages[topic]] == expected
        assert {message.header.frame_id for _, message in messages[topic]} == {"laser"}
    logged = [log_ns for log_ns, _ in messages["laser/pose"]]
    assert logged == sorted(logged) == [stamp_of(message) for _, message in messages["laser/pose"]]
    assert len(logged) > 2 * len(expected)
    assert inspect_bag(bag).faults == ()
    sent = json.loads(messages["renderer_node/settings"][1][1].data)["sent"]
    assert sent["scan"] == max(stamp for stamp in expected if stamp <= messages["camera/pose"][1][0])


def test_verify_makes_scans_and_points_again(bag: Path, messages) -> None:
    report = verify_bag(bag)
    assert report.good, report
    own = sum(len(messages[topic]) for topic in ("scan", "scan_ideal", "laser/pose"))
    assert report.compared == 12 * (3 + 5 * 2 + 2 * 2 + 3) + own  # pose and two clouds; image and info; labels and classes; pictures


def transforms(messages, child: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rows = [
        (stamp_of(item), item.transform.translation, item.transform.rotation)
        for _, message in messages["/tf"]
        for item in message.transforms
        if item.child_frame_id == child
    ]
    times = np.array([row[0] for row in rows])
    places = np.array([[row[1].x, row[1].y, row[1].z] for row in rows])
    turns = np.array([[row[2].x, row[2].y, row[2].z, row[2].w] for row in rows])
    return times, places, turns


def test_scans_that_tf_puts_in_place_lie_on_the_mesh(messages) -> None:
    """Interpolated between transforms, as tf2 does; the reference is the mesh's section at the scanner's height, by trimesh."""
    times, places, turns = transforms(messages, "laser")
    assert len(times) == len(messages["laser/pose"])
    misses = []
    for _, text in messages["scene"]:
        scene = scene_from_json(text.data)
        flat = flatten(scene)
        mesh = trimesh.Trimesh(flat.mesh.vertices, flat.mesh.faces, process=False)
        section = trimesh.intersections.mesh_plane(mesh, (0, 0, 1), (0, 0, SCANNER.height_m))
        tree = STRtree(linestrings(section[:, :, :2]))
        room = range(scene.camera_path[0].stamp_ns, scene.camera_path[-1].stamp_ns + 1)
        for _, scan in messages["scan_ideal"]:
            if stamp_of(scan) not in room:
                continue
            at = stamp_of(scan) + np.arange(len(scan.ranges)) * scan.time_increment * 1e9
            after = np.clip(np.searchsorted(times, at), 1, len(times) - 1)
            share = ((at - times[after - 1]) / (times[after] - times[after - 1]))[:, None]
            place = places[after - 1] + share * (places[after] - places[after - 1])
            side = np.sign(np.sum(turns[after] * turns[after - 1], axis=1))[:, None]
            turn = (1 - share) * turns[after - 1] + share * side * turns[after]
            turn /= np.linalg.norm(turn, axis=1)[:, None]
            angles = scan.angle_min + np.arange(len(scan.ranges)) * scan.angle_increment
            beams = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1) * scan.ranges[:, None]
            hits = np.array([p + rotation_from_quaternion(tuple(q)) @ b for p, q, b in zip(place, turn, beams, strict=True)])
            hits = hits[np.isfinite(scan.ranges)]
            assert np.abs(hits[:, 2] - SCANNER.height_m).max() < 1e-6
            misses.append(tree.query_nearest(points(hits[:, :2]), return_distance=True, all_matches=False)[1])
    far = np.concatenate(misses)
    assert len(far) > 4000
    assert np.quantile(far, 0.999) < 0.002


def test_points_with_the_poses_of_the_bag_lie_on_the_mesh(messages) -> None:
    """Read by the fields that the message declares; the camera moves while its rows are exposed."""
    scene = scene_from_json(messages["scene"][0][1].data)
    flat = flatten(scene)
    mesh = trimesh.Trimesh(flat.mesh.vertices, flat.mesh.faces, process=False)
    (_, cloud), (_, pose) = messages["camera/points"][2], messages["camera/pose"][2]
    semantic, color = messages["camera/semantic/image_raw"][2][1], messages["camera/color/image_raw"][2][1]
    assert stamp_of(cloud) == stamp_of(pose) == stamp_of(semantic)
    assert (cloud.height, cloud.width, cloud.is_dense, cloud.is_bigendian) == (72, 96, False, False)
    assert cloud.header.frame_id == semantic.header.frame_id == "camera_optical_frame"
    fields = {field.name: (field.offset, field.datatype) for field in cloud.fields}
    assert fields == {"x": (0, 7), "y": (4, 7), "z": (8, 7), "rgb": (12, 7), "label": (16, 4), "instance": (18, 4)}
    assert cloud.row_step == 96 * cloud.point_step
    offsets = [offset for offset, _ in fields.values()]
    record = np.dtype({"names": list(fields), "formats": ["<f4"] * 3 + ["<u4", "<u2", "<u2"], "offsets": offsets, "itemsize": 20})
    found = np.frombuffer(cloud.data.tobytes(), record)
    assert Counter(found["label"].tolist()) == Counter(semantic.data.tolist())
    np.testing.assert_array_equal(found["rgb"] >> 16, color.data.reshape(-1, 3)[:, 0])
    optical = np.stack([found["x"], found["y"], found["z"]], axis=1)
    optical = optical[np.isfinite(optical[:, 0])][::23].astype(np.float64)
    q, p = pose.pose.orientation, pose.pose.position
    world = optical @ rotation_from_quaternion((q.x, q.y, q.z, q.w)).T + (p.x, p.y, p.z)
    assert distance_to_mesh_m(mesh, world).max() < 0.001


def test_a_scan_in_bytes_is_what_laserscan_msg_says(bag: Path, messages) -> None:
    """Header, seven float32, two sequences of float32: little-endian plain CDR, taken apart by hand."""
    rows, _ = read_rosbags(bag)
    data = next(data for topic, _, data in rows if topic == "/synth/scan")
    assert data[:2] == b"\x00\x01"
    sec, nanosec, length = struct.unpack_from("<iII", data, 4)
    assert data[16 : 16 + length] == b"laser\x00"
    at = 16 + length + -(16 + length) % 4
    numbers = struct.unpack_from("<7fI", data, at)
    ranges = np.frombuffer(data, "<f4", numbers[7], at + 32)
    (count,) = struct.unpack_from("<I", data, at + 32 + ranges.nbytes)
    _, first = messages["scan"][0]
    assert (sec, nanosec) == (first.header.stamp.sec, first.header.stamp.nanosec)
    expected = [-np.pi, SCANNER.angle_max_rad, 2 * np.pi / 240, 1 / (240 * 23), 1 / 23, 0.1, 12.0]
    np.testing.assert_allclose(numbers[:7], expected, rtol=1e-6)
    assert numbers[7] == count == 240
    np.testing.assert_array_equal(ranges, first.ranges)


def test_points_and_scans_are_off_unless_asked_for() -> None:
    assert not ScanConfig().enabled
    assert FrameMessages(StreamConfig(), CameraConfig()).camera_streams == {}
