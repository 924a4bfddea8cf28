"""A bag of a body on wheels: every stream at its own rate and in order, frames that agree, and the same when made again."""

import math
from collections import defaultdict
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from bag_readers import read_rosbags
from body_bag import moving_scene, stamp_of, write_bag
from rosbags.typesys import Stores, get_typestore

from scene_description import scene_from_json
from scene_description.kinematics import kinematics
from scene_description.poses import rotation_from_quaternion
from scene_synth_ros.bags.bag_inspect import inspect_bag
from scene_synth_ros.cli.parameters.run_parameters import RunWords, run_parameters
from scene_synth_ros.messages.room_body import RoomBody
from scene_synth_ros.messages.senses import senses_of
from scene_synth_ros.offline.settings import read_settings
from scene_synth_ros.render.stream_topics import stream_topics
from scene_synth_ros.suite.parameters import ParameterError
from scene_synth_ros.verify.bag_verify import verify_bag

STORE = get_typestore(Stores.ROS2_JAZZY)
WORDS = (
    "camera.width:=16", "camera.height:=12", "camera.mount_m:=[0.03,0.0,0.0]", "body.enabled:=true", "body.rate_hz:=40.0", 
    "imu.enabled:=true",
    "imu.mount_m:=[0.1,0.0,0.2]", "imu.clock_offset_s:=0.0012", "wheels.enabled:=true", "wheels.rate_hz:=30.0",
    *(f"streams.{layer}:=false" for layer in ("color", "depth", "normals", "semantic", "instance")),
)  # fmt: skip


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_bag(tmp_path_factory.mktemp("body") / "bag", *WORDS)


@pytest.fixture(scope="module")
def messages(bag: Path) -> dict[str, list[tuple[int, object]]]:
    """Topic -> log time and message, decoded by rosbags."""
    rows, topics = read_rosbags(bag)
    found = defaultdict(list)
    for topic, log_ns, data in rows:
        found[topic.removeprefix("/synth/")].append((log_ns, STORE.deserialize_cdr(data, topics[topic].msgtype)))
    return found


def test_every_stream_has_its_rate_and_its_place_in_time(bag: Path, messages) -> None:
    start, end = 10**9, 2 * 10**9
    grids = {"imu/data": 200, "imu/ideal": 200, "joint_states": 30, "odom": 30}
    for topic, rate in grids.items():
        offset = 1_200_000 if topic == "imu/data" else 0
        expected = [start + round(k * 1e9 / rate) + offset for k in range(rate + 1)]
        assert [stamp_of(message) for _, message in messages[topic]] == [stamp for stamp in expected if stamp <= end], topic
    frames = [stamp_of(message) for _, message in messages["camera/pose"]]
    grid = {start + round(k * 1e9 / 40) for k in range(41)}
    assert [stamp_of(message) for _, message in messages["odom/ideal"]] == sorted(grid | set(frames))
    for topic in (*grids, "odom/ideal", "camera/pose"):
        assert [log_ns for log_ns, _ in messages[topic]] == [stamp_of(message) for _, message in messages[topic]], topic
    ticks = [message.clock.sec * 10**9 + message.clock.nanosec for _, message in messages["/clock"]]
    assert ticks == sorted({start + k * 5_000_000 for k in range(200)} | set(frames))
    report = inspect_bag(bag)
    assert report.faults == ()
    rates = {topic.name: round(topic.rate_hz) for topic in report.topics}
    assert (rates["/synth/imu/data"], rates["/synth/odom"]) == (200, 30)


def test_odometry_and_imu_say_what_the_motion_is(messages) -> None:
    scene = scene_from_json(messages["scene"][0][1].data)
    ideal = [message for _, message in messages["odom/ideal"]]
    at = kinematics(scene.motion, [(stamp_of(message) - 10**9) * 1e-9 for message in ideal])
    places = np.array([[m.pose.pose.position.x, m.pose.pose.position.y, m.pose.pose.position.z] for m in ideal])
    np.testing.assert_array_equal(places, at.position_m)
    forward = [m.twist.twist.linear.x for m in ideal]
    np.testing.assert_allclose(forward, np.linalg.norm(at.velocity_m_s, axis=1), atol=1e-12)
    assert {(m.header.frame_id, m.child_frame_id) for m in ideal} == {("odom", "base_footprint")}
    odom = messages["odom"][-1][1]
    assert math.dist((odom.pose.pose.position.x, odom.pose.pose.position.y), places[-1, :2]) < 0.01
    covariance = odom.pose.covariance.reshape(6, 6)
    np.testing.assert_array_equal(covariance, covariance.T)
    assert (np.linalg.eigvalsh(covariance) > 0).all()
    data, truth = messages["imu/data"][100][1], messages["imu/ideal"][100][1]
    assert data.orientation_covariance[0] == -1.0
    assert data.angular_velocity_covariance[0] == pytest.approx(1.7e-4**2 * 200)
    assert truth.linear_acceleration.z == pytest.approx(9.80665)
    assert data.linear_acceleration.z == pytest.approx(9.80665, abs=0.5)
    wheels = messages["joint_states"][-1][1]
    assert list(wheels.name) == ["wheel_left_joint", "wheel_right_joint"]
    assert (wheels.position / (2 * math.pi / 4096) % 1.0).round(6).tolist() in ([0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0])
    assert wheels.position.mean() * 0.033 == pytest.approx(at.velocity_m_s[0, 0] * 0 + 0.2, rel=0.05)


def pose_matrix(transform) -> np.ndarray:
    matrix, t, q = np.eye(4), transform.translation, transform.rotation
    matrix[:3, :3], matrix[:3, 3] = rotation_from_quaternion((q.x, q.y, q.z, q.w)), (t.x, t.y, t.z)
    return matrix


def test_the_tree_of_frames_puts_the_camera_where_its_pose_says(messages) -> None:
    (_, static), *others = messages["/tf_static"]
    assert not others
    parents = {item.child_frame_id: (item.header.frame_id, pose_matrix(item.transform)) for item in static.transforms}
    assert {child: parent for child, (parent, _) in parents.items()} == {
        "odom": "map", "base_link": "base_footprint", "imu_link": "base_link", "camera_link": "base_link",
        "camera_optical_frame": "camera_link",
    }  # fmt: skip
    moving = {stamp_of(item): item for _, message in messages["/tf"] for item in message.transforms}
    assert {item.child_frame_id for item in moving.values()} == {"base_footprint"}
    for _, pose in messages["camera/pose"]:
        base = pose_matrix(moving[stamp_of(pose)].transform)
        camera = parents["odom"][1] @ base
        for child in ("base_link", "camera_link", "camera_optical_frame"):
            camera = camera @ parents[child][1]
        p, q = pose.pose.position, pose.pose.orientation
        np.testing.assert_allclose(camera[:3, 3], (p.x, p.y, p.z), atol=1e-8)
        np.testing.assert_allclose(camera[:3, :3], rotation_from_quaternion((q.x, q.y, q.z, q.w)), atol=1e-8)


def test_the_robots_description_has_the_same_frames(messages) -> None:
    ((_, description),) = messages["robot_description"]
    robot = ElementTree.fromstring(description.data)
    links = {link.get("name") for link in robot.iter("link")}
    joints = {joint.find("child").get("link"): joint for joint in robot.iter("joint")}
    assert links - joints.keys() == {"base_footprint"}
    assert {name for name, joint in joints.items() if joint.get("type") == "continuous"} == {"wheel_left_link", "wheel_right_link"}
    (_, static), *_ = messages["/tf_static"]
    for item in static.transforms:
        if item.child_frame_id != "odom":
            joint, t = joints[item.child_frame_id], item.transform.translation
            assert joint.find("parent").get("link") == item.header.frame_id
            np.testing.assert_allclose([float(x) for x in joint.find("origin").get("xyz").split()], (t.x, t.y, t.z), atol=1e-9)
            roll, pitch, yaw = (float(x) for x in joint.find("origin").get("rpy").split())
            (cr, cp, cy), (sr, sp, sy) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
            about = [np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]]), np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])]
            turn = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]]) @ about[1] @ about[0]
            np.testing.assert_allclose(turn, pose_matrix(item.transform)[:3, :3], atol=1e-9)


def test_the_same_room_is_the_same_bytes_and_verify_makes_it_again(bag: Path, messages, tmp_path: Path) -> None:
    again = write_bag(tmp_path / "bag", *WORDS)
    assert [file.read_bytes() for file in sorted(again.iterdir())] == [file.read_bytes() for file in sorted(bag.iterdir())]
    report = verify_bag(bag)
    assert report.good, report
    assert report.compared >= sum(len(messages[topic]) for topic in ("imu/data", "imu/ideal", "odom", "odom/ideal", "joint_states"))


def test_a_sensor_without_its_body_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"renderer_node: parameter imu.enabled: expected body.enabled and body.publish with it"):
        read_settings(run_parameters(RunWords(record=Path("bag"), overrides=("renderer_node.imu.enabled:=true",))))


@pytest.mark.parametrize("qos", ["reliable", "latest", "sensor_data"])
def test_all_that_goes_out_with_a_frame_is_kept_until_it_is_taken(qos: str) -> None:
    overrides = tuple(f"renderer_node.{word}" for word in (*WORDS, f"streams.qos:={qos}"))
    groups = read_settings(run_parameters(RunWords(record=Path("bag"), overrides=overrides))).renderers["renderer_node"]
    senses = senses_of(groups)
    body = RoomBody(moving_scene(), groups["camera"], groups["streams"], senses)
    assert max(body.bursts.values()) == 29  # of 200 Hz in a seventh of a second
    topics = stream_topics(groups["streams"], groups["camera"], senses)
    for name in ("imu/data", "imu/ideal", "odom", "odom/ideal", "joint_states", "/clock", "/tf"):
        assert topics[name].qos.depth >= body.bursts["odom/ideal" if name == "/tf" else name], name
    assert topics["camera/pose"].qos.depth <= 10
