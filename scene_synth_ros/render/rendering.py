"""One life of the rendering thread: it loads the kernels, then renders room after room until it is stopped."""

import time
from contextlib import closing

from renderer import RenderCancelled, RenderConfig, warm_up
from renderer.annotations import warm_up as warm_up_annotations
from renderer.exposure import metered_layers, needs_meter
from renderer.film.layers import PHOTOGRAPHS
from scene_description import SceneDescription, SceneSynthError, error_line, scene_from_json
from scene_synth_ros.render.camera_requests import CameraRequests
from scene_synth_ros.render.frame_report import CameraPlace, RateReport, Throughput
from scene_synth_ros.render.inbox import Inbox
from scene_synth_ros.render.next_room import NextRoom
from scene_synth_ros.render.renderer_config import catalog_folder
from scene_synth_ros.render.room import RenderedRoom, RoomMeter, RoomSettings, room_settings
from scene_synth_ros.render.room_loop import Life, RoomLoop
from scene_synth_ros.render.streams import StreamPublishers
from scene_synth_ros.suite.heap import trim_heap
from scene_synth_ros.suite.parameters import Parameters
from scene_synth_ros.suite.suite_node import SuiteNode


class Rendering:
    """Renders the rooms of an inbox, each in a :class:`RoomLoop`; decides which rooms are this renderer's, and makes one ahead.

    Threading: :meth:`run` is the rendering thread, and every other method is called in it.  The executor's thread makes this object and
    reads its attributes: ``warm``, ``scene`` and the counts are replaced as a whole.

    Attributes:
        warm: whether the kernels are loaded.
        scene: the room at work, None while there is none.
        refused: scenes and rooms that could not be rendered.
        made_ahead: rooms that were made while the one before was shown.
        life: what the rooms share.
    """

    def __init__(self, node: SuiteNode, settings: Parameters, inbox: Inbox, output: StreamPublishers, requests: CameraRequests) -> None:
        self._catalog_dir = catalog_folder(node.get_name(), settings)
        self.warm, self.refused, self.made_ahead = False, 0, 0
        self.scene: SceneDescription | None = None
        self.life = Life(
            node=node,
            settings=settings,
            inbox=inbox,
            output=output,
            requests=requests,
            meter=RoomMeter(settings),
            throughput=Throughput(),
            rate=RateReport(node, settings),
            place=CameraPlace(node.get_logger()),
        )
        self._next = NextRoom(node.faults)
        self._room: RenderedRoom | None = None
        self._newest_room = -1

    def run(self) -> None:
        """Load the kernels, then render what comes until the inbox is stopped.

        Raises:
            RenderError: Embree is missing.
        """
        began = time.perf_counter()
        self.life.node.get_logger().info("loading kernels (the first run compiles them)")
        render: RenderConfig = self.life.settings["render"]
        layers = set(self.life.output.messages.layers)
        if needs_meter(render) and any(layer in PHOTOGRAPHS for layer in layers):
            layers |= set(metered_layers(render))
        warm_up(
            layers,
            self.life.settings["depth_sensor"],
            render.integrator,
            guiding=render.guiding,
            final_gathering=render.final_gathering,
            scan=self.life.settings["scan"],
            lidar=self.life.settings["lidar"],
        )
        if self.life.settings["streams"].annotations:
            warm_up_annotations()
        self.life.node.get_logger().info(f"kernels are ready ({time.perf_counter() - began:.1f} s)")
        self.warm = True
        try:
            while (text := self.life.inbox.next_room()) is not None:
                self._take_room(text)
                trim_heap()
        finally:
            self._next.drop()

    def _take_room(self, text: str) -> None:
        """Render a room; what is wrong with it, or with the program, ends this room only."""
        try:
            self.scene = scene_from_json(text)
            if self._is_own(self.scene):
                self._render_room(self.scene)
        except RenderCancelled:
            pass
        except (SceneSynthError, OSError) as error:
            reason = f"refused {f'room {self.scene.index}' if self.scene else 'a scene'}: {error_line(error)}"
            self.life.node.refuse(reason)
            self._give_up(reason)
        except Exception as error:
            self._give_up(self.life.node.faults.tell(error, f"{self.life.node.get_name()} rendered {room_name(self.scene) or 'a scene'}"))
        finally:
            self.scene = None

    def _give_up(self, reason: str) -> None:
        """Tell the peers not to wait for the room at work."""
        self.refused += 1
        if self.scene is not None:
            self.life.output.tell(refused_scene=self.scene.index, reason=reason[:1000])

    def _is_own(self, scene: SceneDescription) -> bool:
        """Return whether this renderer renders a room; those of others, and rooms that were never sent, count as finished."""
        config, output = self.life.config, self.life.output
        status, newest, self._newest_room = output.status, self._newest_room, scene.index
        if config.share_count > 1:
            if scene.index % config.share_count != config.share_index or scene.index <= self.life.inbox.finished_scene:
                output.tell(done_scene=scene.index)
                return False
            if 0 <= newest < scene.index - 1:
                output.tell(done_scene=scene.index - 1)
        if max(status.done_scene, status.refused_scene) >= scene.index:  # the run begins again
            output.tell(done_scene=scene.index - 1, refused_scene=-1, begun_scene=-1)
        return True

    def _render_room(self, scene: SceneDescription) -> None:
        life, settings = self.life, self._room_settings()
        ahead = self._next.take(scene, settings, lambda: life.inbox.must_leave(on_path=True))
        self.made_ahead += ahead is not None
        self._room = ahead or RenderedRoom(scene, settings, self._room)
        with closing(self._room) as room:
            if not life.pace().realtime:  # else a room that nobody looks at is not even made
                room.make()
            RoomLoop(room, life, self._look_ahead).run()

    def _room_settings(self) -> RoomSettings:
        return room_settings(self.life.settings, self._catalog_dir)

    def _look_ahead(self) -> None:
        """Begin with the next room if it is known, in real time and while somebody looks; else nothing would wait for it."""
        life, layers = self.life, self.life.output.wanted_layers()
        if self._room is None or not layers or not life.pace().realtime or life.config.share_count > 1:
            return
        text = life.inbox.take_announced()
        if text is not None:
            self._next.begin(text, self._room, self._room_settings(), layers)


def room_name(scene: SceneDescription | None) -> str:
    """Return a room as a fault's report names it; empty if there is none."""
    return f"room {scene.index} of seed {scene.seed}" if scene is not None else ""
