"""The run of a grammar node as what others steer by the services of a simulator."""

import time
from collections.abc import Callable
from typing import Any, Protocol

from rclpy.parameter import Parameter

from grammar.synthesize import SceneSynthesizer
from scene_description import SceneDescription, SceneSynthError
from scene_synth_ros.simulation.run import Phase
from scene_synth_ros.simulation.world import UNCHANGED, World, checked_world
from scene_synth_ros.synthesize.room_ahead import Prepared, RoomAhead
from scene_synth_ros.synthesize.room_schedule import RoomSchedule
from scene_synth_ros.synthesize.run_config import RunConfig


class RunOwner(Protocol):
    """The node whose run it is."""

    active: bool
    exit_code: int | None

    @property
    def config(self) -> RunConfig:
        """Its parameters."""

    @property
    def run(self) -> RoomSchedule:
        """The schedule of rooms."""

    @property
    def newest_room(self) -> Prepared | None:
        """The room that was sent last."""

    @property
    def obstacle(self) -> str:
        """Why the next room cannot be made, empty if it can."""

    def tell_change(self) -> None:
        """Tell the peers, and do what is due."""

    def end_soon(self) -> None:
        """End the run in a moment."""

    def set_parameters(self, parameters: list[Parameter]) -> list[Any]:
        """Set parameters of the node."""


class SimulatedRun:
    """Steers a run; see :class:`scene_synth_ros.simulation.run.Run`, which says what each member does.

    Threading: the executor's thread.
    """

    def __init__(self, owner: RunOwner, ahead: RoomAhead, rules: SceneSynthesizer) -> None:
        self._owner, self._ahead, self.rules = owner, ahead, rules
        self.world = UNCHANGED

    @property
    def frame(self) -> str:
        """Frame of the world."""
        return self._owner.config.world_frame

    @property
    def phase(self) -> Phase:
        """Where the run stands."""
        run = self._owner.run
        if run.stopped:
            return "stopped"
        return "paused" if run.held or run.paused or not self._owner.active else "playing"

    @property
    def shown_ns(self) -> int:
        """Stamp of the last frame that is known to be shown."""
        return max(self._owner.run.shown_ns, 0)

    @property
    def scene(self) -> SceneDescription | None:
        """The room at work, or that will come first."""
        sent, ahead = self._owner.newest_room, self._ready
        prepared = sent if self._owner.run.last_sent >= 0 else ahead
        return prepared.scene if prepared is not None else None

    @property
    def _ready(self) -> Prepared | None:
        """The room that is prepared for the settings of now."""
        ready = self._ahead.ready
        return ready if ready is not None and ready.generation == self._owner.run.generation else None

    def put(self, world: World) -> None:
        """Let the first room differ by something else."""
        run = self._owner.run
        if run.last_sent < 0 and run.is_reset:
            if self._ready is not None:
                self._ahead.change(world, self.rules)
            else:
                run.generation += 1
        self.world = world

    def can_hold(self) -> str:
        """Return why frames cannot be held."""
        return "" if self._owner.config.lock_step else "frames of a free-running run are not held; set grammar_node lock_step:=true"

    def can_restart_time(self) -> str:
        """Return why time cannot begin again."""
        if self._owner.config.clock == "wall":
            return "stamps are the time of day, which does not begin again; reset without time"
        if self._owner.config.expected_recorders:
            return "a recorder is at work, in whose bag time does not go back; reset without time"
        return ""

    def play(self) -> None:
        """Let rooms and frames go on."""
        self._owner.run.play(time.monotonic())
        self._owner.tell_change()

    def hold(self) -> None:
        """Hold back frames."""
        self._owner.run.hold()
        self._owner.tell_change()

    def let_out(self, frames: int) -> Callable[[], bool]:
        """Let out frames; return what tells whether they are shown."""
        run, room = self._owner.run, self._owner.newest_room
        path = room.scene.camera_path if room is not None and run.last_sent >= 0 else ()
        until_ns, name = run.let_out(frames, [pose.stamp_ns for pose in path]), run.name
        self._owner.tell_change()

        def is_shown() -> bool:
            if run.has_shown(until_ns):
                return True
            if run.name != name or run.is_over:
                raise SceneSynthError(f"the run {'is over' if run.is_over else 'has begun again'} before the last of {frames} frames")
            return False

        return is_shown

    def begin_anew(self, *, time: bool, stopped: bool) -> None:
        """Let the run begin again."""
        self._owner.run.begin_anew(time=time, stopped=stopped)
        self._owner.tell_change()

    def has_begun_anew(self) -> bool:
        """Return whether it has begun again, and its first room is there."""
        run = self._owner.run
        if self._owner.obstacle:
            raise SceneSynthError(self._owner.obstacle)
        return run.is_reset and (not run.stopped or self._ready is not None)

    def load(self, scene: SceneDescription | None, room_type: str, seed: int | None) -> None:
        """Take another room, or rooms of another type and seed, to begin with."""
        world = UNCHANGED if scene is None else checked_world(scene, self.rules)
        values = {"scene.room_type": room_type, "seed": seed} if scene is None else {}
        wanted = [Parameter(name, value=value) for name, value in values.items() if value is not None]
        for done in self._owner.set_parameters(wanted):
            if not done.successful:
                raise SceneSynthError(f"world: {done.reason}")
        self.put(world)

    def quit(self) -> None:
        """End the run soon: when who asked for it has the answer."""
        self._owner.end_soon()
