"""A renderer of the suite without its node: the messages of the frames of room after room."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from typing import NamedTuple

from std_msgs.msg import String

from renderer.camera.rig import mounted, mounted_path, rig_path
from renderer.exposure import LightReading
from renderer.film.layers import PHOTOGRAPHS
from renderer.film.tone import Exposure
from scene_description import CameraPose, SceneDescription
from scene_synth_ros.messages.conversions import clock_to_msg
from scene_synth_ros.messages.frame_messages import SERIALISED, FrameMessages, StreamConfig
from scene_synth_ros.messages.frame_settings import FrameSettings, settings_to_json
from scene_synth_ros.messages.room_body import RoomBody
from scene_synth_ros.messages.senses import senses_of
from scene_synth_ros.render.renderer_config import RendererNodeConfig, catalog_folder
from scene_synth_ros.render.room import RenderedRoom, RoomMeter, frame_index, room_settings
from scene_synth_ros.render.room_scans import RoomScans, scan_messages, scans_wanted
from scene_synth_ros.render.stream_topics import CLOCK, SETTINGS, stream_topics
from scene_synth_ros.suite.parameters import Groups

Message = tuple[str, object]
"""Topic as in ``stream_topics``, and message; images and camera infos as CDR bytes."""


class _Work(NamedTuple):
    """The room at work, its scans, its body, the camera's path through it, and the exposure of its frames."""

    scene: SceneDescription
    rendered: RenderedRoom
    scans: RoomScans
    body: RoomBody
    path: Sequence[CameraPose]
    exposure: Exposure


class OfflineRenderer:
    """Renders the frames of rooms with the parameters of one renderer; what it says of a frame is what the node publishes.

    Threads: one calls every method; kernels have their own.

    Attributes:
        topics: what the node would publish: name -> type, QoS, layers.
    """

    def __init__(self, groups: Groups, is_recorded: Callable[[str], bool]) -> None:
        self._groups, self._is_recorded = groups, is_recorded
        self._catalog_dir = catalog_folder("renderer_node", groups)
        self._streams: StreamConfig = groups["streams"]
        self._senses = senses_of(groups)
        self.topics = stream_topics(self._streams, groups["camera"], self._senses)
        self._messages = FrameMessages(self._streams, groups["camera"], SERIALISED)
        self._layers = {layer for name, topic in self.topics.items() if topic.layers and is_recorded(name) for layer in topic.layers}
        self._sent: dict[str, int] = {}
        self._held = ExitStack()
        self._work: _Work | None = None

    def renders(self, scene: SceneDescription) -> bool:
        """Return whether a room is this renderer's, where several share the rooms."""
        config: RendererNodeConfig = self._groups[""]
        return scene.index % config.share_count == config.share_index

    def begin_room(
        self, scene: SceneDescription, metered: Callable[[], LightReading] | None = None, former: RenderedRoom | None = None
    ) -> RenderedRoom:
        """Take a room, and return it as it is rendered until it ends.

        ``metered``: returns what the meter tells of it, where that is asked for; None meters the room.

        Raises:
            SceneSynthError: the room cannot be made.
        """
        self.end_room()
        room = RenderedRoom(scene, room_settings(self._groups, self._catalog_dir), former)
        self._held.callback(room.close)
        room.make()
        self._messages.begin_room(scene)
        path = mounted_path(self._groups["camera"], scene.camera_path, scene.motion)
        scan, meter = self._groups["scan"], RoomMeter(self._groups)
        scans = RoomScans(scan, rig_path(scene.camera_path, scene.motion), lambda: room.scanner(scan))
        meter.begin_room(self._groups["render"], metered or (lambda: room.metered))
        body = RoomBody(scene, self._groups["camera"], self._streams, self._senses, room.lidar)
        self._work = _Work(scene, room, scans, body, path, meter.exposure(any(layer in PHOTOGRAPHS for layer in self._layers)))
        return room

    def frame(self, index: int) -> Iterator[Message]:
        """Render a frame of the room's path; yield its messages, and those of the scans that begin and of what the body senses up to it.

        Raises:
            SceneSynthError: it cannot be rendered.
        """
        work = self._work
        assert work is not None
        camera, pose = self._groups["camera"], work.scene.camera_path[index]
        placed, number = mounted(camera, pose), frame_index(work.scene, pose)
        if self._senses.scan.enabled:
            work.scans.go(pose)
        frame = work.rendered.render(placed, number, self._layers, exposure=work.exposure, path=work.path)
        yield from self._of_body(work.body, index, pose.stamp_ns)
        for due in work.scans.due(pose.stamp_ns, lambda: scans_wanted(self._is_recorded)):
            messages = list(scan_messages(due, self._groups["scan"], self._streams, self._is_recorded))
            self._sent = self._sent | {message.topic: message.stamp_ns for message in messages}
            yield from ((message.topic, message.message) for message in messages)
        if CLOCK in self.topics:
            yield CLOCK, clock_to_msg(pose.stamp_ns)
        settings = FrameSettings(
            stamp_ns=pose.stamp_ns,
            scene=work.scene.id,
            frame=number,
            exposure_ev100=work.exposure.ev100,
            white_xy=work.exposure.white_xy,
            black=work.exposure.black,
            sent=self._sent,
            frames=work.body.frames,
            **{group: self._groups[group] for group in ("camera", "render", "sensor", "depth_sensor", "streams")},
            **self._senses._asdict(),
        )
        yield SETTINGS, String(data=settings_to_json(settings))
        yield from self._messages.of_frame(frame, placed, self._is_recorded)

    def _of_body(self, body: RoomBody, index: int, stamp_ns: int) -> Iterator[Message]:
        """Yield what a body says of itself before its first frame, and what it senses up to a frame."""
        description = body.description
        if index == 0 and description is not None:
            yield description.topic, description.message
        sent: dict[str, int] = {}
        for message in body.due(stamp_ns, lambda topic: topic in self.topics and (topic == CLOCK or self._is_recorded(topic))):
            sent[message.topic] = message.stamp_ns
            yield message.topic, message.message
        if CLOCK in sent:
            sent[CLOCK] = stamp_ns  # its tick comes with the frame
        self._sent = self._sent | sent

    def end_room(self) -> None:
        """Release what the room has taken, so that no more than one is in memory; harmless when repeated."""
        self._held.close()
        self._work = None
