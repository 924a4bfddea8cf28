"""A renderer of the suite without its node: the messages of the frames of room after room."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from typing import NamedTuple

from std_msgs.msg import String

from renderer.camera.rig import mounted, mounted_path
from renderer.exposure import exposed, needs_meter, sensor_ev100
from renderer.film.layers import PHOTOGRAPHS
from renderer.film.tone import Exposure
from renderer.lidar.scanner import Scanner
from renderer.scene.scene_key import scene_key
from scene_description import CameraPose, SceneDescription
from scene_synth_ros.messages.conversions import clock_to_msg
from scene_synth_ros.messages.frame_messages import SERIALISED, FrameMessages, StreamConfig
from scene_synth_ros.messages.frame_settings import FrameSettings, settings_to_json
from scene_synth_ros.messages.scan_messages import LASER_POSE, SCAN, SCAN_IDEAL, laser_pose_to_msgs, scan_to_msgs
from scene_synth_ros.messages.streams import laser_frame
from scene_synth_ros.offline.settings import Groups, catalog_of
from scene_synth_ros.render.frame_index import frame_index
from scene_synth_ros.render.renderer_config import RendererNodeConfig
from scene_synth_ros.render.room import Room, room_settings
from scene_synth_ros.render.room_renderer import RoomRenderer
from scene_synth_ros.render.room_scans import RoomScans
from scene_synth_ros.render.stream_topics import CLOCK, SETTINGS, stream_topics

Message = tuple[str, object]
"""Topic as in ``stream_topics``, and message; images and camera infos as CDR bytes."""


class _Work(NamedTuple):
    """The room at work, what renders and scans it, the camera's path through it, and the exposure of its frames."""

    scene: SceneDescription
    renderer: RoomRenderer
    scans: RoomScans
    path: Sequence[CameraPose]
    exposure: Exposure


class OfflineRenderer:
    """Renders the frames of rooms with the parameters of one renderer; what it says of a frame is what the node publishes.

    Threads: one calls every method; kernels have their own.

    Args:
        groups: the parameters.
        is_recorded: whether a topic, as in ``topics``, is wanted.

    Attributes:
        topics: what the node would publish: name -> type, QoS, layers.
    """

    def __init__(self, groups: Groups, is_recorded: Callable[[str], bool]) -> None:
        self._groups, self._is_recorded = groups, is_recorded
        self._catalog_dir = catalog_of(groups)
        self._streams: StreamConfig = groups["streams"]
        self.topics = stream_topics(self._streams, groups["camera"], groups["scan"])
        self._messages = FrameMessages(self._streams, groups["camera"], SERIALISED)
        self._layers = {layer for name, topic in self.topics.items() if topic.layers and is_recorded(name) for layer in topic.layers}
        self._sent: dict[str, int] = {}
        self._held = ExitStack()
        self._work: _Work | None = None

    def renders(self, scene: SceneDescription) -> bool:
        """Return whether a room is this renderer's, where several share the rooms."""
        config: RendererNodeConfig = self._groups[""]
        return scene.index % config.share_count == config.share_index

    def begin_room(self, scene: SceneDescription, metered: Callable[[], Exposure] | None = None) -> None:
        """Take a room.

        Args:
            scene: the room.
            metered: returns its exposure as it is metered, where that is asked for; None meters the room.

        Raises:
            SceneSynthError: the room cannot be made.
        """
        self.end_room()
        room = Room(scene, room_settings(self._groups, self._catalog_dir))
        self._held.callback(room.close)
        renderer = RoomRenderer(lambda: room.renderer, lambda: room.annotator)
        renderer.prepare()
        self._messages.begin_room(scene)
        path, scan = mounted_path(self._groups["camera"], scene.camera_path), self._groups["scan"]
        scans = RoomScans(scan, scene.camera_path, lambda: Scanner(room.renderer.tree, room.flat, scan, scene_key(scene)))
        self._work = _Work(scene, renderer, scans, path, self._exposed(metered or (lambda: room.metered)))

    def frame(self, index: int) -> Iterator[Message]:
        """Render a frame of the room's path; yield its messages, and those of the scans that begin up to it.

        Raises:
            SceneSynthError: it cannot be rendered.
        """
        work = self._work
        assert work is not None
        camera, pose = self._groups["camera"], work.scene.camera_path[index]
        placed, number = mounted(camera, pose), frame_index(work.scene, pose)
        if self._groups["scan"].enabled:
            work.scans.go(pose)
        frame = work.renderer.render(placed, number, self._layers, exposure=work.exposure, path=work.path)
        yield from self._due_scans(work.scans, pose.stamp_ns)
        if CLOCK in self.topics:
            yield CLOCK, clock_to_msg(pose.stamp_ns)
        settings = FrameSettings(
            stamp_ns=pose.stamp_ns,
            scene=work.scene.id,
            frame=number,
            exposure_ev100=work.exposure.ev100,
            white_xy=work.exposure.white_xy,
            sent=self._sent,
            **{group: self._groups[group] for group in ("camera", "render", "sensor", "depth_sensor", "streams", "scan")},
        )
        yield SETTINGS, String(data=settings_to_json(settings))
        yield from self._messages.of_frame(frame, placed, self._is_recorded)

    def end_room(self) -> None:
        """Release what the room has taken, so that no more than one is in memory; harmless when repeated."""
        self._held.close()
        self._work = None

    def _exposed(self, meter: Callable[[], Exposure]) -> Exposure:
        """Return the exposure of the room's frames: metered only where colour is wanted, as in the node."""
        render = self._groups["render"]
        metered = meter() if needs_meter(render) and any(layer in PHOTOGRAPHS for layer in self._layers) else None
        return exposed(render, metered, sensor_ev100(self._groups["camera"], self._groups["sensor"]))

    def _due_scans(self, scans: RoomScans, stamp_ns: int) -> Iterator[Message]:
        """Yield the scans that begin up to a frame's stamp, and remember the stamps of the last ones."""
        laser = laser_frame(self._streams.frame_prefix)
        for poses, scan in scans.due(stamp_ns, lambda: self._is_recorded(SCAN) or self._is_recorded(SCAN_IDEAL)):
            sent = {}
            for pose in poses:
                yield LASER_POSE, laser_pose_to_msgs(pose, self._streams.world_frame, laser)[0]
                sent[LASER_POSE] = pose.stamp_ns
            for topic, message in scan_to_msgs(scan, self._groups["scan"], laser) if scan is not None else ():
                if self._is_recorded(topic):
                    yield topic, message
                    sent[topic] = scan.stamp_ns if scan is not None else 0
            self._sent = self._sent | sent


def meter_room(scene: SceneDescription, groups: Groups) -> Exposure:
    """Return the exposure of a room as it is metered for a renderer, before compensation.

    Raises:
        SceneSynthError: the room cannot be made.
    """
    return Room(scene, room_settings(groups, catalog_of(groups))).metered
