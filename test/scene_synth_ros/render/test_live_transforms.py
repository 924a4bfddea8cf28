"""The transforms of a live camera, as a node of its own process publishes them where ``tf2_msgs`` is installed."""

from collections.abc import Iterator

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped, Quaternion
from rclpy.context import Context
from rclpy.qos import QoSProfile
from sample_scene import sample_scene
from scene_synth_ros_suite import Peer, node_process, without
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from scene_description import scene_to_json
from scene_description.poses import rotation_from_quaternion
from scene_synth_ros.suite.qos import latched_qos, stream_qos

SETTINGS = {"camera.width": 32, "camera.height": 24, "render.samples_per_pixel": 1, "streams.camera": "eye"}
FRAMES = len(sample_scene().camera_path)


class TransformPeer(Peer):
    """Sends a room and hears poses and transforms, by topic."""

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self.heard: dict[str, list[object]] = {}
        self._scene = self.node.create_publisher(String, "scene", latched_qos())

    def send(self, text: str) -> None:
        self._scene.publish(String(data=text))

    def listen(self, kind: type, topic: str, qos: QoSProfile) -> list[object]:
        heard = self.heard[topic] = []
        self.node.create_subscription(kind, topic, heard.append, qos)
        return heard


@pytest.fixture(scope="module")
def peer() -> Iterator[TransformPeer]:
    with node_process("renderer_node", SETTINGS) as context:
        peer = TransformPeer(context)
        poses = peer.listen(PoseStamped, "eye/pose", stream_qos(100))
        moving = peer.listen(TFMessage, "/tf", stream_qos(100))
        fixed = peer.listen(TFMessage, "/tf_static", latched_qos(100))
        peer.meet("renderer_node")
        peer.send(scene_to_json(sample_scene()))
        peer.spin_until(lambda: len(poses) == len(moving) == FRAMES, 120, "all poses and transforms")
        peer.spin_until(lambda: fixed, 120, "the static transforms")
        yield peer


def rotation(quaternion: Quaternion) -> np.ndarray:
    return rotation_from_quaternion((quaternion.x, quaternion.y, quaternion.z, quaternion.w))


def test_the_static_transforms_come_once_and_turn_the_link_into_the_optical_frame(peer: TransformPeer) -> None:
    peer.spin_for(1.0)
    (message,) = peer.heard["/tf_static"]
    (transform,) = message.transforms
    assert (transform.header.frame_id, transform.child_frame_id) == ("eye_link", "eye_optical_frame")
    right, down, forward = rotation(transform.transform.rotation).T
    assert (right.tolist(), down.tolist(), forward.tolist()) == ([0, -1, 0], [0, 0, -1], [1, 0, 0])  # x forward, y left, z up: REP 103
    shift = transform.transform.translation
    assert (shift.x, shift.y, shift.z) == (0.0, 0.0, 0.0)


def test_a_late_subscriber_gets_the_static_transforms(peer: TransformPeer) -> None:
    before = list(peer.heard["/tf_static"])
    late = peer.listen(TFMessage, "/tf_static", latched_qos(100))
    peer.spin_until(lambda: late, 120, "the latched message")
    assert late == before


def test_the_chain_from_the_world_to_the_optical_frame_is_the_pose(peer: TransformPeer) -> None:
    ((fixed,),) = (message.transforms for message in peer.heard["/tf_static"])
    for message, pose in zip(peer.heard["/tf"], peer.heard["eye/pose"], strict=True):
        (moving,) = message.transforms
        assert (moving.header, moving.child_frame_id) == (pose.header, fixed.header.frame_id)
        chain = rotation(moving.transform.rotation) @ rotation(fixed.transform.rotation)
        np.testing.assert_allclose(chain, rotation(pose.pose.orientation), atol=1e-12)
        position, shift = pose.pose.position, moving.transform.translation
        assert (position.x, position.y, position.z) == (shift.x, shift.y, shift.z)


def test_without_tf2_msgs_there_are_poses_and_no_transforms(tmp_path) -> None:
    with node_process("renderer_node", SETTINGS, without("tf2_msgs", tmp_path)) as context:
        peer = TransformPeer(context)
        poses = peer.listen(PoseStamped, "eye/pose", stream_qos(100))
        peer.meet("renderer_node")
        peer.send(scene_to_json(sample_scene()))
        peer.spin_until(lambda: len(poses) == FRAMES, 120, "all poses")
        assert peer.node.count_publishers("/tf") == peer.node.count_publishers("/tf_static") == 0
