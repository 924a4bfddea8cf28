"""What the body of each room of a bag senses, made again from the settings of its frames."""

from bisect import bisect_right
from collections import OrderedDict
from collections.abc import Callable

from scene_description import SceneDescription
from scene_synth_ros.messages.driven_base import DrivenRooms
from scene_synth_ros.messages.frame_settings import FrameSettings
from scene_synth_ros.messages.room_body import RoomBody
from scene_synth_ros.render.room import RenderedRoom

_ROOMS_HELD = 3


class BodiesAgain:
    """Makes the messages of bodies again.

    Rooms whose camera was driven alone, or asked for frames off its path, are left out: where the body has gone is not in the bag.
    """

    def __init__(
        self, scene_of: Callable[[str], SceneDescription], room_of: Callable[[FrameSettings], RenderedRoom], drives: DrivenRooms
    ) -> None:
        self._scene_of, self._room_of, self._drives = scene_of, room_of, drives
        self._rooms: dict[str, FrameSettings] = {}
        self._starts: list[tuple[int, str]] | None = None
        self._bodies: OrderedDict[str, RoomBody] = OrderedDict()

    def take(self, settings: FrameSettings) -> None:
        """Take the settings of a frame."""
        if settings.senses.tells_body:
            known = self._rooms.setdefault(settings.scene, settings)
            if settings.frame > known.frame:
                self._rooms[settings.scene] = settings

    def message(self, name: str, stamp_ns: int) -> tuple[object, FrameSettings] | None:
        """Return the message of a topic below the namespace at a stamp, and settings of its room; None if no body has it.

        A clock of its own may put a sample a little before or after its room.
        """
        if self._starts is None:
            self._starts = sorted(self._find_starts())
        place = bisect_right(self._starts, (stamp_ns, "~"))
        for _, scene_id in self._starts[max(place - 2, 0) : place + 1][::-1]:
            made = self._body(scene_id).message_at(name, stamp_ns)
            if made is not None:
                return made, self._rooms[scene_id]
        return None

    def _find_starts(self) -> list[tuple[int, str]]:
        paths = ((scene_id, settings, self._scene_of(scene_id).camera_path) for scene_id, settings in self._rooms.items())
        return [
            (path[0].stamp_ns, scene_id) for scene_id, settings, path in paths if settings.frame < len(path) or scene_id in self._drives
        ]

    def _body(self, scene_id: str) -> RoomBody:
        if scene_id not in self._bodies:
            settings, scene = self._rooms[scene_id], self._scene_of(scene_id)
            self._bodies[scene_id] = RoomBody(
                scene,
                settings.camera,
                settings.streams,
                settings.senses,
                lambda config, motion: self._room_of(settings).lidar(config, motion),  # which may have been another's meanwhile
                self._drives.way(scene),
            )
            if len(self._bodies) > _ROOMS_HELD:
                self._bodies.popitem(last=False)
        return self._bodies[scene_id]
