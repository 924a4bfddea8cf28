"""In real time a room's clock begins with its first frame: what is made before it costs none of the others."""

import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pytest
from rclpy.context import Context
from rclpy.parameter import Parameter
from sample_scene import sample_scene
from scene_synth_ros_suite import Peer, claim_domain, dds_context
from sensor_msgs.msg import Image
from std_msgs.msg import String

from scene_description import SceneDescription, scene_to_json
from scene_synth_ros.render import room, room_loop
from scene_synth_ros.render.renderer_node import RendererNode
from scene_synth_ros.suite.qos import latched_qos, stream_qos
from scene_synth_ros.suite.status import NodeStatus, status_to_json

SETTINGS = {"camera.width": 32, "camera.height": 24, "realtime": True, "streams.color": False}
FRAMES, PERIOD_NS, LOADING_S = 6, 300_000_000, 2.0


def scene(index: int = 0) -> SceneDescription:
    first = sample_scene().camera_path[0]
    return replace(sample_scene(), index=index, camera_path=tuple(replace(first, stamp_ns=10**9 + k * PERIOD_NS) for k in range(FRAMES)))


class Viewer(Peer):
    """Looks at a renderer in this process, beside which there is another that tells what it is given here."""

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self.seen: list[tuple[int, float]] = []
        self.scene = self.node.create_publisher(String, "scene", latched_qos(10))
        self.other = self.node.create_publisher(String, "status", latched_qos(10))
        self.node.create_subscription(Image, "camera/depth/image_raw", self._take, stream_qos(100))
        parameters = [Parameter(name, value=value) for name, value in SETTINGS.items()]
        self.renderer = RendererNode(context=context, namespace="/synth", parameter_overrides=parameters)
        self.spin_too(self.renderer)

    def _take(self, image: Image) -> None:
        self.seen.append((image.header.stamp.sec * 10**9 + image.header.stamp.nanosec, time.monotonic()))

    def tell(self, begun: int) -> None:
        status = NodeStatus(node="/synth/other", role="renderer", state="ready", begun_scene=begun)
        self.other.publish(String(data=status_to_json(status)))

    def show(self, index: int = 0) -> None:
        self.spin_until(lambda: self.values.get("state") == "ready", 120, "a renderer that is ready")
        self.scene.publish(String(data=scene_to_json(scene(index))))


@pytest.fixture
def viewer(monkeypatch: pytest.MonkeyPatch) -> Iterator[Viewer]:
    made = room.flatten

    def slowly(*words: Any) -> Any:
        time.sleep(LOADING_S)
        return made(*words)

    monkeypatch.setattr(room, "flatten", slowly)
    with dds_context(claim_domain()) as context:
        viewer = Viewer(context)
        yield viewer
        viewer.renderer.close()


def test_no_frame_is_lost_while_a_room_is_loaded(viewer: Viewer) -> None:
    viewer.show()
    viewer.spin_until(lambda: len(viewer.seen) == FRAMES, 60, "every frame")
    assert [stamp_ns for stamp_ns, _ in viewer.seen] == [pose.stamp_ns for pose in scene().camera_path]
    shown_s = viewer.seen[-1][1] - viewer.seen[0][1]
    assert shown_s > 0.8 * (FRAMES - 1) * PERIOD_NS * 1e-9, "they come at their rate, not all at once"
    viewer.spin_until(lambda: viewer.values["frames_skipped"] == "0", 10, "a report of nothing skipped")


def test_cameras_of_a_suite_begin_together_but_wait_for_none_for_ever(viewer: Viewer, monkeypatch: pytest.MonkeyPatch) -> None:
    viewer.tell(begun=-1)
    viewer.show()
    waits = "the first frame of room 0 of /synth/other"
    viewer.spin_until(lambda: viewer.values.get("waits_for") == waits, 60, waits)
    assert not viewer.seen
    viewer.tell(begun=0)
    viewer.spin_until(lambda: len(viewer.seen) == FRAMES, 60, "every frame")
    monkeypatch.setattr(room_loop, "BEGIN_PATIENCE_S", 0.5)
    viewer.show(1)
    gone = "room 1 begins without /synth/other: no first frame in 0.5 s"
    viewer.spin_until(lambda: gone in viewer.errors, 60, gone)
    viewer.spin_until(lambda: len(viewer.seen) == 2 * FRAMES, 60, "every frame of the next")
