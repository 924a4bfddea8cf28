"""Frames of poses that are asked for, and a camera that is driven, over DDS."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped, Twist
from nav_msgs.msg import OccupancyGrid
from rclpy.context import Context
from rosgraph_msgs.msg import Clock
from sample_scene import sample_scene
from scene_synth_ros_suite import Peer, node_process
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from renderer import CameraConfig, RenderConfig, Renderer
from renderer.film.tone import Exposure
from renderer.scene.flatten import flatten
from renderer.scene.scene_key import scene_key
from scene_description import CameraPose, scene_to_json
from scene_description.poses import look_at
from scene_synth_ros.messages.conversions import msg_to_image, occupancy_to_msg, pose_to_msg
from scene_synth_ros.render.room import OFF_PATH
from scene_synth_ros.suite.qos import latched_qos, stream_qos

LAYERS = ("color", "depth", "normals", "semantic", "instance")
SETTINGS = {
    "camera.width": 48,
    "camera.height": 36,
    "render.samples_per_pixel": 1,
    "render.exposure_ev100": 6.0,
    "render.white_balance": "none",
}


class Asker(Peer):
    """Sends a scene, asks for poses, and hears every layer."""

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self.images: dict[int, dict[str, Image]] = {}
        self.poses: dict[int, PoseStamped] = {}
        self.infos: dict[int, int] = {}
        self.scene = self.node.create_publisher(String, "scene", latched_qos())
        self.map = self.node.create_publisher(OccupancyGrid, "scene/map", latched_qos())
        self.request = self.node.create_publisher(PoseStamped, "camera/request", stream_qos(100))
        self.twist = self.node.create_publisher(Twist, "cmd_vel", stream_qos(1))
        self.node.create_subscription(PoseStamped, "camera/pose", lambda m: self.poses.update({stamp(m): m}), stream_qos(100))
        for layer in LAYERS:
            self.node.create_subscription(Image, f"camera/{layer}/image_raw", lambda m, layer=layer: self.take(layer, m), stream_qos(100))
            self.node.create_subscription(CameraInfo, f"camera/{layer}/camera_info", self.count, stream_qos(100))

        self.clocks: list[int] = []
        self.transforms: list[TFMessage] = []
        self.node.create_subscription(Clock, "/clock", lambda m: self.clocks.append(m.clock.sec * 10**9 + m.clock.nanosec), stream_qos(100))
        self.node.create_subscription(TFMessage, "/tf", self.transforms.append, stream_qos(100))

    def take(self, layer: str, image: Image) -> None:
        self.images.setdefault(stamp(image), {})[layer] = image

    def count(self, info: CameraInfo) -> None:
        self.infos[stamp(info)] = self.infos.get(stamp(info), 0) + 1

    def whole(self, at: int) -> bool:
        return set(self.images.get(at, ())) == set(LAYERS) and at in self.poses and self.infos.get(at) == len(LAYERS)


def stamp(message: object) -> int:
    return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec


@pytest.fixture(scope="module")
def asker() -> Iterator[Asker]:
    with node_process("renderer_node", {**SETTINGS, "realtime": True, "drive.enabled": True}) as context:
        peer = Asker(context)
        scene = sample_scene()
        room_map = occupancy_to_msg(np.zeros((120, 120), np.int8), 0.05, (-1.0, -1.0), 0, "map")
        peer.meet("renderer_node")
        peer.map.publish(room_map)
        peer.scene.publish(String(data=scene_to_json(scene)))
        first = scene.camera_path[0].stamp_ns
        peer.spin_until(lambda: peer.whole(scene.camera_path[-1].stamp_ns), 120, f"the frames of the path from {first} on")
        yield peer


def test_a_pose_asked_for_gives_the_frame_of_it_in_every_layer(asker: Asker) -> None:
    scene = sample_scene()
    eye = tuple(value + 0.05 for value in scene.camera_path[0].position_m)
    pose = CameraPose(stamp_ns=77 * 10**9 + 5, position_m=eye, orientation=look_at(eye, (eye[0] + 0.6, eye[1] + 0.8, eye[2] - 0.3)))
    asker.request.publish(pose_to_msg(pose, "map"))
    asker.spin_until(lambda: asker.whole(pose.stamp_ns), 120, "the frame asked for")
    camera, config = CameraConfig(width=48, height=36), RenderConfig(samples_per_pixel=1)
    with Renderer(flatten(scene), camera, config, scene_key(scene)) as renderer:
        offline = renderer.render(pose, OFF_PATH + pose.stamp_ns, LAYERS, exposure=Exposure(6.0))
    for layer in LAYERS:
        np.testing.assert_array_equal(msg_to_image(asker.images[pose.stamp_ns][layer]), offline.layers[layer], layer)
    assert asker.poses[pose.stamp_ns].pose == pose_to_msg(pose, "map").pose


def test_a_pose_without_a_stamp_gets_the_next_one_of_simulated_time(asker: Asker) -> None:
    path = sample_scene().camera_path
    for number in (1, 2):
        asker.request.publish(pose_to_msg(replace(path[0], stamp_ns=0), "map"))
        asker.spin_until(lambda number=number: asker.whole(path[-1].stamp_ns + number), 120, "the frame asked for")


def test_time_does_not_pass_with_what_is_asked_for(asker: Asker) -> None:
    stamps = [pose.stamp_ns for pose in sample_scene().camera_path]
    early = replace(sample_scene().camera_path[0], stamp_ns=5)
    asker.request.publish(pose_to_msg(early, "map"))
    asker.spin_until(lambda: asker.whole(5), 120, "the frame asked for")
    asker.spin_for(0.2)
    assert asker.clocks == sorted(asker.clocks) and set(asker.clocks) <= set(stamps)
    assert {stamp(transform) for message in asker.transforms for transform in message.transforms} <= set(stamps)


def test_a_pose_in_the_bed_is_told_while_its_frame_is_the_newest(asker: Asker) -> None:
    pose = sample_scene().camera_path[0]
    for position_m, place in (((1.4, 1.8, 0.42), "inside object 3 (bed)"), (pose.position_m, "in the room")):
        asker.request.publish(pose_to_msg(replace(pose, stamp_ns=0, position_m=position_m), "map"))
        asker.spin_until(lambda place=place: asker.values.get("camera_place") == place, 120, f"a camera {place}")
    assert "the camera is inside object 3 (bed)" in asker.warnings


def test_what_is_no_pose_of_the_room_is_refused(asker: Asker) -> None:
    pose = replace(sample_scene().camera_path[0], stamp_ns=88 * 10**9)
    good, wrong_frame, no_number, no_rotation = (pose_to_msg(pose, "map") for _ in range(4))
    wrong_frame.header.frame_id = "odom"
    no_number.pose.position.x = float("nan")
    no_rotation.pose.orientation.w = 9.0
    cases = ((wrong_frame, "expected frame_id 'map'"), (no_number, "expected a position"), (no_rotation, "unit quaternion"))
    for message, reason in cases:
        asker.errors.clear()
        asker.request.publish(message)
        asker.spin_until(lambda reason=reason: any(reason in error for error in asker.errors), 20, reason)
    asker.request.publish(good)
    asker.spin_until(lambda: asker.whole(88 * 10**9), 120, "a good pose after the bad ones")


def test_a_twist_moves_the_camera_until_it_times_out(asker: Asker) -> None:
    before = set(asker.poses)
    last_ns = sample_scene().camera_path[-1].stamp_ns
    message = Twist()
    message.linear.x, message.angular.z = 0.6, 0.3

    def moved() -> bool:
        asker.twist.publish(message)
        newer = [asker.poses[at].pose.position for at in sorted(asker.poses) if at not in before]
        return len(newer) > 5 and abs(newer[-1].x - newer[0].x) + abs(newer[-1].y - newer[0].y) > 0.1

    asker.spin_until(moved, 120, "a driven camera that has moved")
    times = [at for at in asker.poses if at not in before]
    assert times == sorted(times) and times[0] - last_ns < 10**9, "simulated time goes on from the path, not from what was asked for"
    assert max(asker.clocks) == asker.clocks[-1] < 10 * 10**9

    def rests() -> bool:
        resting = [asker.poses[at].pose.position for at in list(asker.poses)[-3:]]
        return resting[0] == resting[-1]

    asker.spin_until(rests, 120, "a camera that stands still when no Twist comes")
    place = asker.poses[[*asker.poses][-1]].pose.position
    asker.spin_for(1.0)
    assert asker.poses[[*asker.poses][-1]].pose.position == place, "it does not go on"
