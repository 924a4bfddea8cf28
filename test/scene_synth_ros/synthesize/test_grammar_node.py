"""A grammar node in its own process: keeps step with its peers, changes while it runs, and says what it cannot do."""

from collections.abc import Iterator

import pytest
from nav_msgs.msg import OccupancyGrid
from rclpy.context import Context
from scene_synth_ros_suite import Peer, node_process
from std_msgs.msg import String
from visualization_msgs.msg import Marker, MarkerArray

from scene_description import SceneDescription, scene_from_json
from scene_synth_ros.suite.qos import latched_qos
from scene_synth_ros.suite.status import NodeStatus, status_from_json, status_to_json

SETTINGS = {"seed": 3, "frames_per_room": 2, "rate_hz": 10.0, "expected_recorders": 1}


class RunPeer(Peer):
    """Plays the renderer and the recorder of a run."""

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self.scenes: list[SceneDescription] = []
        self.announced: list[str] = []
        self._roles: set[str] = set()
        self.maps: list[OccupancyGrid] = []
        self.markers: list[MarkerArray] = []
        self._run = ""
        self._status = self.node.create_publisher(String, "status", latched_qos(10))
        self.node.create_subscription(String, "status", self._hear, latched_qos(10))
        self.node.create_subscription(String, "scene", lambda message: self.scenes.append(scene_from_json(message.data)), latched_qos(10))
        self.node.create_subscription(String, "scene/next", lambda message: self.announced.append(message.data), latched_qos())
        self.node.create_subscription(OccupancyGrid, "scene/map", self.maps.append, latched_qos(10))
        self.node.create_subscription(MarkerArray, "scene/markers", self.markers.append, latched_qos(10))

    def _hear(self, message: String) -> None:
        status = status_from_json(message.data)
        if status.role == "grammar" and status.run != self._run:
            self._run = status.run
            for role in self._roles:
                self.report(role, -1)

    def report(self, role: str, done: int) -> None:
        self._roles.add(role)
        status = NodeStatus(node=f"/synth/{role}", role=role, state="ready", done_scene=done, run=self._run)
        self._status.publish(String(data=status_to_json(status)))

    def finish_rooms(self) -> None:
        for role in ("renderer", "recorder"):
            self.report(role, self.scenes[-1].index if self.scenes else -1)

    def next_scene(self) -> SceneDescription:
        seen = len(self.scenes)
        self.finish_rooms()
        self.spin_until(lambda: len(self.scenes) > seen, 120, "the next room")
        return self.scenes[-1]


@pytest.fixture(scope="module")
def peer() -> Iterator[RunPeer]:
    with node_process("grammar_node", SETTINGS) as context:
        yield RunPeer(context)


def test_rooms_wait_for_renderer_and_recorder(peer: RunPeer) -> None:
    peer.report("renderer", -1)
    peer.spin_for(1.0)
    assert not peer.scenes, "a recorder is expected and not there yet"
    first = peer.next_scene()
    peer.report("renderer", 0)
    peer.spin_for(1.0)
    assert [scene.index for scene in peer.scenes] == [0], "the recorder has not finished room 0"
    second = peer.next_scene()
    assert (first.index, second.index, first.seed) == (0, 1, 3)
    assert [pose.stamp_ns for scene in (first, second) for pose in scene.camera_path] == [10**9 + k * 10**8 for k in range(4)]


def test_a_room_is_told_of_before_it_comes(peer: RunPeer) -> None:
    newest = peer.scenes[-1].index
    peer.spin_until(lambda: peer.announced and scene_from_json(peer.announced[-1]).index == newest + 1, 120, "the room after the newest")
    assert scene_from_json(peer.announced[-1]) == peer.next_scene()


def test_map_and_markers_belong_to_the_room(peer: RunPeer) -> None:
    scene = peer.next_scene()
    peer.spin_until(lambda: len(peer.maps) == len(peer.scenes) == len(peer.markers), 120, "map and markers")
    grid, markers = peer.maps[-1], peer.markers[-1].markers
    stamp = grid.header.stamp.sec * 10**9 + grid.header.stamp.nanosec
    assert (stamp, grid.header.frame_id) == (scene.camera_path[0].stamp_ns, "map")
    area = sum(cell == 0 for cell in grid.data) * grid.info.resolution**2
    polygon = scene.room.polygon_m
    whole = 0.5 * sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(polygon, (*polygon[1:], polygon[0]), strict=True))
    assert 0.2 * whole < area < whole
    assert sum(marker.type == Marker.CUBE and marker.action == Marker.ADD for marker in markers) == len(scene.objects) + len(
        scene.room.openings
    )


def test_number_of_objects_and_seed_change_with_the_next_room(peer: RunPeer) -> None:
    assert peer.set_parameter("grammar_node", "scene.max_objects", 12) == (True, "")
    assert peer.set_parameter("grammar_node", "seed", 77) == (True, "")
    scene = peer.next_scene()
    assert len(scene.objects) <= 12
    assert scene.seed == 77


def test_rate_changes_without_a_jump_in_time(peer: RunPeer) -> None:
    before = peer.next_scene().camera_path[-1].stamp_ns
    assert peer.set_parameter("grammar_node", "rate_hz", 20.0) == (True, "")
    stamps = [pose.stamp_ns for pose in peer.next_scene().camera_path]
    assert stamps == [before + 100_000_000, before + 150_000_000]


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("scene.room_type", "dungeon", "scene.room_type: expected one of bathroom, bedroom"),
        ("scene.room_width_m", 0.1, "scene.room_width_m: expected 0."),
        ("scene.min_objects", 30, "scene.min_objects: expected at most max_objects = 12, got 30"),
        ("first_index", 5, "first_index cannot change in a running node: rooms are counted from it"),
        ("world_frame", "odom", "world_frame cannot change in a running node"),
    ],
)
def test_changes_that_cannot_be_are_refused_with_the_reason(peer: RunPeer, name: str, value: object, reason: str) -> None:
    successful, answer = peer.set_parameter("grammar_node", name, value)
    assert not successful
    assert answer.startswith(reason)


def test_a_request_that_cannot_be_met_is_a_diagnostic_and_the_node_goes_on(peer: RunPeer) -> None:
    smallest = [0.0, 0.0, 1.6, 0.0, 1.6, 1.6, 0.0, 1.6]  # where a bed would fit, but no room has been drawn with so little else
    assert peer.set_parameter("grammar_node", "scene.room_polygon_m", smallest) == (True, "")
    peer.finish_rooms()
    peer.spin_until(lambda: any("could not be synthesised" in error for error in peer.errors), 120, "a diagnostic")
    assert peer.set_parameter("grammar_node", "scene.room_polygon_m", []) == (True, "")
    peer.next_scene()


def test_free_running_needs_no_peers(peer: RunPeer) -> None:
    assert peer.set_parameter("grammar_node", "lock_step", False) == (True, "")
    seen = len(peer.scenes)
    peer.spin_until(lambda: len(peer.scenes) >= seen + 3, 120, "rooms without an answer")
