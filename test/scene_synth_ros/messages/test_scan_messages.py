"""Scans, poses of the scanner and clouds as messages; settings say of them only where they are asked for."""

import json
from dataclasses import replace

import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from sample_scene import sample_scene
from sensor_msgs.msg import LaserScan
from std_msgs.msg import String

from renderer import CameraConfig, Frame, RenderConfig
from renderer.lidar.config import ScanConfig
from renderer.lidar.scan import Scan
from scene_description import CameraPose
from scene_synth_ros.messages.frame_messages import FrameMessages, StreamConfig
from scene_synth_ros.messages.frame_settings import FrameSettings, settings_from_json, settings_to_json
from scene_synth_ros.messages.scan_messages import laser_pose_to_msgs, scan_to_msgs
from scene_synth_ros.messages.stamps import frame_place
from scene_synth_ros.messages.streams import has_own_stamps, laser_frame

CONFIG = ScanConfig(enabled=True, beams=3, angle_min_rad=-0.5, angle_max_rad=0.5, rate_hz=8.0)
POSE = CameraPose(stamp_ns=1_500_000_000, position_m=(1.0, 2.0, 0.25), orientation=(0.0, 0.0, 1.0, 0.0))
SCAN = Scan(4, POSE.stamp_ns, (POSE,), *(np.array(values, np.float32) for values in ([1, np.inf, 3], [1, 2, 3], [0.5, 0, 0.2])))


def test_a_scan_has_what_it_read_and_its_twin_what_is_true() -> None:
    (topic, read), (twin_topic, ideal) = scan_to_msgs(SCAN, CONFIG, laser_frame("robot1/"))
    assert (topic, twin_topic) == ("scan", "scan_ideal")
    assert read.header == ideal.header and read.header.frame_id == "robot1/laser"
    assert (read.header.stamp.sec, read.header.stamp.nanosec) == (1, 500_000_000)
    assert read.angle_increment == 0.5 and read.scan_time == 0.125
    assert read.time_increment == pytest.approx(0.5 / (2 * np.pi * 8.0))
    assert list(read.ranges) == [1, np.inf, 3] and list(ideal.ranges) == [1, 2, 3]
    assert read.intensities.tolist() == SCAN.intensities.tolist() and len(ideal.intensities) == 0
    assert deserialize_message(serialize_message(read), LaserScan) == read


def test_pose_and_transform_of_the_scanner_say_the_same() -> None:
    pose, transform = laser_pose_to_msgs(POSE, "map", "laser")
    assert pose.header == transform.header and pose.header.frame_id == "map"
    assert transform.child_frame_id == "laser"
    assert (
        (transform.transform.translation.x, transform.transform.translation.z) == (pose.pose.position.x, pose.pose.position.z) == (1, 0.25)
    )
    assert transform.transform.rotation == pose.pose.orientation


def settings(**changes: object) -> FrameSettings:
    base = {"stamp_ns": 7, "scene": "s", "frame": 0, "exposure_ev100": 3.0}
    return FrameSettings(**base, camera=CameraConfig(), render=RenderConfig(), **{"streams": StreamConfig()} | changes)


def test_settings_name_scanner_and_points_only_where_they_are_on() -> None:
    plain = settings(sent={})
    data = json.loads(settings_to_json(plain))
    assert {"scan", "sent"}.isdisjoint(data) and {"points", "points_color"}.isdisjoint(data["streams"])
    assert settings_from_json(settings_to_json(plain)) == plain
    full = settings(scan=CONFIG, sent={"scan": 5}, streams=StreamConfig(points=True))
    assert settings_from_json(settings_to_json(full)) == full
    before = frame_place(bytes(serialize_message(String(data=settings_to_json(full)))))
    assert before == (7, {"scan": 5}, False)
    assert frame_place(bytes(serialize_message(String(data=settings_to_json(plain))))) is None
    assert frame_place(bytes(serialize_message(String(data='"sent" in no JSON')))) is None
    asked = frame_place(bytes(serialize_message(String(data=settings_to_json(replace(plain, asked=True))))))
    assert asked == (plain.stamp_ns, {}, True)


def test_topics_with_stamps_of_their_own_are_known_by_their_names() -> None:
    own = ["/synth/scan", "/a/b/scan_ideal", "/synth/laser/pose"]
    assert [topic for topic in [*own, "/synth/camera/pose", "/synth/camera/points", "/scanner"] if has_own_stamps(topic)] == own


def test_points_need_layers_that_are_not_published_for_them() -> None:
    camera = CameraConfig(width=4, height=3)
    maker = FrameMessages(StreamConfig(semantic=False, points=True), camera)
    maker.begin_room(sample_scene())
    assert {stream.topic: layers for stream, layers in maker.camera_streams.items()} == {"camera/points": ("range", "semantic", "instance")}
    layers = {"range": np.ones((3, 4), np.float32), "semantic": np.ones((3, 4), np.uint8), "instance": np.ones((3, 4), np.uint16)}
    made = dict(maker.of_frame(Frame(layers, None), POSE, lambda _: True))
    cloud = made["camera/points"]
    assert (cloud.height, cloud.width, cloud.point_step, cloud.row_step, len(cloud.data)) == (3, 4, 16, 64, 192)
    assert [field.name for field in cloud.fields] == ["x", "y", "z", "label", "instance"]
    assert "camera/range/image_raw" not in made and "camera/semantic/image_raw" not in made
    assert "camera/instance/image_raw" in made
    assert "camera/points" not in dict(maker.of_frame(Frame(layers, None), POSE, lambda topic: topic != "camera/points"))


def test_points_of_what_a_sensor_reads_lie_at_its_depth() -> None:
    camera = CameraConfig(width=4, height=3)
    maker = FrameMessages(StreamConfig(points_sensed=True, points=True), camera)
    maker.begin_room(sample_scene())
    sensed = np.full((3, 4), 2.0, np.float32)
    sensed[0, :3] = np.nan, np.inf, -np.inf
    ids = {"semantic": np.ones((3, 4), np.uint8), "instance": np.ones((3, 4), np.uint16)}
    made = dict(maker.of_frame(Frame({"depth_sensed": sensed, **ids}, None), POSE, lambda _: True))
    assert "camera/points" not in made, "its range is not there"
    z = np.frombuffer(made["camera/points_sensed"].data, np.float32).reshape(3, 4, 4)[..., 2]
    assert np.isnan(z[0, :3]).all() and (z.ravel()[3:] == 2.0).all()


def test_a_panorama_has_no_sensed_points() -> None:
    maker = FrameMessages(StreamConfig(points_sensed=True, points=True), CameraConfig(model="equirectangular"))
    assert [stream.topic for stream in maker.camera_streams] == ["camera/points"]
