"""A bag of a lidar on a body: by others' tools, points lie on the exported mesh at their own times, and on what the camera sees."""

import io
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest
import trimesh
from bag_readers import read_rosbags
from body_bag import moving_scene, stamp_of, write_bag
from mesh_distance import distance_to_mesh_m
from rosbags.typesys import Stores, get_typestore
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation, RotationSpline

from renderer.camera.config import CameraConfig
from renderer.export.scene_glb import scene_to_glb
from renderer.scene.flatten import flatten
from scene_synth_ros.bags.bag_inspect import inspect_bag
from scene_synth_ros.cli.parameters.run_parameters import RunWords, run_parameters
from scene_synth_ros.messages.frame_settings import FrameSettings, settings_from_json, settings_to_json
from scene_synth_ros.messages.streams import parse
from scene_synth_ros.offline.settings import read_settings
from scene_synth_ros.suite.parameters import ParameterError
from scene_synth_ros.suite.qos import CLOUD_DEPTH
from scene_synth_ros.verify.bag_verify import verify_bag

STORE = get_typestore(Stores.ROS2_JAZZY)
WORDS = (
    "camera.width:=160", "camera.height:=120", "camera.horizontal_fov_rad:=1.2", "body.enabled:=true", "body.rate_hz:=100.0",
    "scan.enabled:=true", "scan.level:=false", "scan.rate_hz:=7.0", "scan.beams:=360", "scan.noise_m:=0.0", "scan.resolution_m:=0.0",
    "lidar.enabled:=true", "lidar.mount_m:=[0.05,0.0,0.6]", "lidar.mount_rotation_rad:=[0.02,0.1,0.3]", "lidar.columns:=300",
    "lidar.rate_hz:=8.0", "lidar.returns:=dual",
    *(f"streams.{layer}:=false" for layer in ("color", "normals", "semantic")),
)  # fmt: skip
FIELDS = {"x": 7, "y": 7, "z": 7, "intensity": 7, "time": 7, "ring": 4, "return": 2}


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_bag(tmp_path_factory.mktemp("lidar") / "bag", *WORDS)


@pytest.fixture(scope="module")
def messages(bag: Path) -> dict[str, list[tuple[int, object]]]:
    """Topic -> log time and message, decoded by rosbags."""
    rows, topics = read_rosbags(bag)
    found = defaultdict(list)
    for topic, log_ns, data in rows:
        if not topic.endswith("label_info"):  # of a package that rosbags does not know
            found[topic.removeprefix("/synth/")].append((log_ns, STORE.deserialize_cdr(data, topics[topic].msgtype)))
    return found


@pytest.fixture(scope="module")
def mesh() -> trimesh.Trimesh:
    """The exported room, read back by trimesh, z up."""
    scene = moving_scene()
    glb = scene_to_glb(scene, flatten(scene), CameraConfig())
    found = trimesh.load_scene(io.BytesIO(glb), file_type="glb").to_mesh()
    return trimesh.Trimesh(found.vertices[:, [0, 2, 1]] * (1.0, -1.0, 1.0), found.faces, process=False)


def points_of(cloud) -> np.ndarray:
    kinds = {7: "<f4", 4: "<u2", 2: "u1"}
    names, formats = [field.name for field in cloud.fields], [kinds[field.datatype] for field in cloud.fields]
    record = {"names": names, "formats": formats, "offsets": [field.offset for field in cloud.fields], "itemsize": cloud.point_step}
    return np.frombuffer(cloud.data.tobytes(), np.dtype(record))


def placed(messages, child: str, at_s: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Points of a frame of the robot, each at its own time, in the map: by curves through odom/ideal and by /tf_static."""
    ideal = [message for _, message in messages["odom/ideal"]]
    times = np.array([(stamp_of(message) - 10**9) * 1e-9 for message in ideal])
    places = np.array([[m.pose.pose.position.x, m.pose.pose.position.y, m.pose.pose.position.z] for m in ideal])
    turns = Rotation.from_quat([[getattr(m.pose.pose.orientation, k) for k in "xyzw"] for m in ideal])
    forward = np.array([[m.twist.twist.linear.x, m.twist.twist.linear.y, m.twist.twist.linear.z] for m in ideal])
    static = {item.child_frame_id: item for _, message in messages["/tf_static"] for item in message.transforms}
    while child != "base_footprint":
        item = static[child]
        t, q = item.transform.translation, item.transform.rotation
        points = Rotation.from_quat((q.x, q.y, q.z, q.w)).apply(points) + np.array((t.x, t.y, t.z))
        child = item.header.frame_id
    return RotationSpline(times, turns)(at_s).apply(points) + CubicHermiteSpline(times, places, turns.apply(forward))(at_s)


def test_sweeps_come_at_their_rate_with_the_fields_of_drivers(bag: Path, messages) -> None:
    clouds = messages["lidar/points"]
    assert [stamp_of(cloud) for _, cloud in clouds] == [10**9 + k * 125_000_000 for k in range(8)]
    assert [log_ns for log_ns, _ in clouds] == [stamp_of(cloud) for _, cloud in clouds]
    for _, cloud in clouds:
        assert (cloud.header.frame_id, cloud.height, cloud.is_dense) == ("lidar_link", 1, True)
        assert {field.name: field.datatype for field in cloud.fields} == FIELDS
        assert cloud.point_step * cloud.width == cloud.row_step == len(cloud.data)
    points = points_of(clouds[3][1])
    assert (np.diff(points["time"]) >= 0).all() and points["time"].max() < 0.125
    assert set(points["ring"]) == set(range(16)) and set(points["return"]) <= {1, 2}
    assert points["intensity"].max() > 0.1
    (_, ideal), *_ = messages["lidar/points_ideal"]
    assert [field.name for field in ideal.fields] == ["x", "y", "z", "time", "ring"]
    report = inspect_bag(bag)
    assert report.faults == () and {round(t.rate_hz) for t in report.topics if "lidar" in t.name} == {8}


def test_points_lie_on_the_exported_mesh_at_their_own_times(messages, mesh: trimesh.Trimesh) -> None:
    worst = []
    for _, cloud in messages["lidar/points_ideal"][::3]:
        points = points_of(cloud)[::29]
        xyz = np.column_stack([points[axis] for axis in "xyz"]).astype(np.float64)
        at_s = (stamp_of(cloud) - 10**9) * 1e-9 + points["time"]
        worst.append(distance_to_mesh_m(mesh, placed(messages, "lidar_link", at_s, xyz)).max())
        at_stamp = distance_to_mesh_m(mesh, placed(messages, "lidar_link", np.full(len(points), at_s[0]), xyz))
        assert (at_stamp > 0.005).mean() > 0.3, "put in place at the stamp they would not"
    assert max(worst) < 0.001


def test_what_the_lidar_reads_errs_by_its_noise_about_the_mesh(messages) -> None:
    (_, ideal), (_, cloud) = messages["lidar/points_ideal"][2], messages["lidar/points"][2]
    true, read = points_of(ideal), points_of(cloud)
    read = read[read["return"] == 1]
    ranges = [
        dict(zip(zip(p["time"], p["ring"], strict=True), np.hypot(np.hypot(p["x"], p["y"]), p["z"]), strict=True)) for p in (true, read)
    ]
    errors = np.array([ranges[1][ray] - ranges[0][ray] for ray in ranges[1].keys() & ranges[0].keys()])
    assert np.std(errors[np.abs(errors) < 0.06]) == pytest.approx(0.015, rel=0.1)


def test_points_at_a_frames_time_are_on_the_surface_that_the_camera_sees_there(messages, mesh: trimesh.Trimesh) -> None:
    """Points go through pose and CameraInfo to pixels; the recorded depth about there is theirs, unless something nearer hides them."""
    (_, info), *_ = messages["camera/depth/camera_info"]
    k = np.array(info.k).reshape(3, 3)
    checked = 0
    for (_, pose), (_, image) in zip(messages["camera/pose"], messages["camera/depth/image_raw"], strict=True):
        p, q = pose.pose.position, pose.pose.orientation
        turn = Rotation.from_quat((q.x, q.y, q.z, q.w))
        depth = np.frombuffer(image.data.tobytes(), "<f4").reshape(image.height, image.width)
        for _, cloud in messages["lidar/points_ideal"]:
            points = points_of(cloud)[::7]
            xyz = np.column_stack([points[axis] for axis in "xyz"]).astype(np.float64)
            world = placed(messages, "lidar_link", (stamp_of(cloud) - 10**9) * 1e-9 + points["time"], xyz)
            optical = turn.inv().apply(world - (p.x, p.y, p.z))
            pixel = optical @ k.T
            column, row = (pixel[:, :2] / pixel[:, 2:]).T
            inside = (optical[:, 2] > 0.1) & (column > 1) & (column < image.width - 2) & (row > 1) & (row < image.height - 2)
            column, row, z = np.rint(column[inside]).astype(int), np.rint(row[inside]).astype(int), optical[inside, 2]
            around = np.stack([depth[row + i, column + j] for i in (-1, 0, 1) for j in (-1, 0, 1)])
            near, far = around.min(axis=0), around.max(axis=0)
            seen = far < 1.5 * near  # a pixel about: no edge
            hidden = z > far * 1.002
            assert (z[seen & ~hidden] > near[seen & ~hidden] * 0.998).all(), "in front of what the camera sees, by more than a pixel"
            checked += int((seen & ~hidden).sum())
            assert hidden[seen].mean() < 0.5 if seen.any() else True
    assert checked > 3000


def test_a_planar_scan_lies_on_the_mesh_between_frames_too(messages, mesh: trimesh.Trimesh) -> None:
    """Its poses are those of the body's motion; interpolated between as tf2 does."""
    poses = [pose for _, pose in messages["laser/pose"]]
    times = np.array([stamp_of(pose) for pose in poses])
    places = np.array([[pose.pose.position.x, pose.pose.position.y, pose.pose.position.z] for pose in poses])
    turns = np.array([[getattr(pose.pose.orientation, k) for k in "xyzw"] for pose in poses])
    for _, scan in messages["scan_ideal"][1:4:2]:
        seen = np.isfinite(scan.ranges)
        at = stamp_of(scan) + np.arange(len(scan.ranges)) * scan.time_increment * 1e9
        after = np.clip(np.searchsorted(times, at), 1, len(times) - 1)
        share = ((at - times[after - 1]) / (times[after] - times[after - 1]))[:, None]
        place = places[after - 1] + share * (places[after] - places[after - 1])
        side = np.sign(np.sum(turns[after] * turns[after - 1], axis=1))[:, None]
        turn = Rotation.from_quat((1 - share) * turns[after - 1] + share * side * turns[after])
        angles = scan.angle_min + np.arange(len(scan.ranges)) * scan.angle_increment
        beams = np.column_stack([np.cos(angles), np.sin(angles), 0 * angles]) * np.where(seen, scan.ranges, 0.0)[:, None]
        assert distance_to_mesh_m(mesh, (place + turn.apply(beams))[seen][::3]).max() < 0.0005


def test_the_same_room_is_the_same_bytes_and_verify_makes_it_again(bag: Path, tmp_path: Path) -> None:
    again = write_bag(tmp_path / "bag", *WORDS)
    assert [file.read_bytes() for file in sorted(again.iterdir())] == [file.read_bytes() for file in sorted(bag.iterdir())]
    report = verify_bag(bag)
    assert report.good, report


def test_the_lidars_topics_are_not_those_of_a_camera() -> None:
    points = parse("/synth/lidar/points", "sensor_msgs/msg/PointCloud2")
    assert points is not None and points.role.name == "lidar/points" and points.has_own_stamps
    assert points.frame_id("robot1/") == "robot1/lidar_link"
    camera = parse("/synth/camera/points", "sensor_msgs/msg/PointCloud2")
    assert camera is not None and camera.role.name == "points" and not camera.has_own_stamps
    assert CLOUD_DEPTH * 24 * 300_000 < 2**30, "no more waits for a reader that sleeps"


def test_a_camera_that_is_called_as_the_lidar_is_refused_and_its_settings_go_there_and_back() -> None:
    with pytest.raises(ParameterError, match=r"renderer_node: parameter streams.camera: expected another name than .*, got 'lidar'"):
        read_settings(run_parameters(RunWords(record=Path("bag"), overrides=("renderer_node.streams.camera:=lidar",))))
    overrides = tuple(f"renderer_node.{word}" for word in WORDS)
    groups = read_settings(run_parameters(RunWords(record=Path("bag"), overrides=overrides))).renderers["renderer_node"]
    names = ("camera", "render", "streams", "body", "lidar", "scan")
    settings = FrameSettings(stamp_ns=1, scene="a", frame=0, exposure_ev100=1.0, **{name: groups[name] for name in names})
    assert settings.lidar.returns == "dual" and settings_from_json(settings_to_json(settings)) == settings


def test_a_rosette_has_lines_and_no_rings(tmp_path: Path) -> None:
    words = [word for word in WORDS if not word.startswith(("lidar.returns", "scan."))]
    bag = write_bag(tmp_path / "bag", *words, "lidar.pattern:=rosette", "lidar.columns:=2000")
    rows, topics = read_rosbags(bag)
    clouds = [STORE.deserialize_cdr(data, topics[topic].msgtype) for topic, _, data in rows if topic == "/synth/lidar/points"]
    assert {field.name: field.datatype for field in clouds[0].fields} == {
        **{name: 7 for name in ("x", "y", "z", "intensity", "time")},
        "line": 2,
    }
    assert len(points_of(clouds[0])) > 500
