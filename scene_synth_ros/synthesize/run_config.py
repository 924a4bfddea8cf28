"""The grammar node's own parameters."""

from dataclasses import dataclass
from typing import Annotated, Literal

from grammar import SceneRequest
from grammar.camera.motion_config import MotionConfig
from scene_description import Limits, SceneSynthError

_PEERS_FIXED = "the run's peers are counted once"


@dataclass(frozen=True, slots=True, kw_only=True)
class RunConfig:
    """How many rooms and frames a run has, and how it keeps step."""

    seed: Annotated[int, Limits(ge=0, le=2**63 - 1, description="Seed of the run; room i depends on it, on i and on the settings")] = 1
    rooms: Annotated[int, Limits(ge=0, le=10**9, description="Rooms of the run; 0 goes on for ever")] = 0
    grammar_file: Annotated[
        str,
        Limits(
            max_length=4096,
            description="Grammar file in place of its room type's; empty: those that come with the program",
            fixed="grammars are read once",
        ),
    ] = ""
    first_index: Annotated[int, Limits(ge=0, le=2**40, description="Index of the first room", fixed="rooms are counted from it")] = 0
    frames_per_room: Annotated[int, Limits(ge=1, le=100_000, description="Frames of each room's camera path")] = 30
    rate_hz: Annotated[float, Limits(ge=0.1, le=1000.0, unit="Hz", description="Simulated frame rate")] = 10.0
    start_time_s: Annotated[
        float, Limits(ge=0.0, le=4e9, unit="s", description="Simulated time of the first frame of room 0", fixed="time cannot jump")
    ] = 1.0
    clock: Annotated[
        Literal["simulated", "wall"],
        Limits(
            description="What stamps follow: simulated counts frames from start_time_s; wall is the time of day, free-running only",
            fixed="time cannot jump",
        ),
    ] = "simulated"
    lock_step: Annotated[bool, Limits(description="Send a room only when all peers have finished the one before")] = True
    expected_renderers: Annotated[int, Limits(ge=0, le=100, description="Renderers that a lock-step run waits for", fixed=_PEERS_FIXED)] = 1
    expected_recorders: Annotated[int, Limits(ge=0, le=100, description="Recorders that a lock-step run waits for", fixed=_PEERS_FIXED)] = 0
    rooms_ahead: Annotated[
        int,
        Limits(
            ge=1,
            le=16,
            description="Rooms of a lock-step run that may be unfinished at once; renderers that share need as many",
            fixed="queues of scenes are as deep",
        ),
    ] = 1
    peer_timeout_s: Annotated[float, Limits(ge=1.0, le=1e6, unit="s", description="Wait for peers before a warning")] = 30.0
    world_frame: Annotated[str, Limits(min_length=1, max_length=100, description="Frame of the scene", fixed="frames of a run stay")] = (
        "map"
    )
    catalog_dir: Annotated[
        str, Limits(max_length=1000, description="Folder of the user's models, with catalog.yaml; empty: none", fixed="it is read once")
    ] = ""
    start_stopped: Annotated[
        bool, Limits(description="Begin as a stopped simulation: the first room waits for ~/play, or for SetSimulationState")
    ] = False
    autostart: Annotated[bool, Limits(description="Configure and activate at the start", fixed="it is used at the start only")] = True
    exit_when_done: Annotated[bool, Limits(description="End the process after the last room")] = False

    def check(self) -> None:
        """Refuse settings that contradict each other.

        Raises:
            SceneSynthError: frames that wait for each other are stamped by a clock that waits for nobody.
        """
        if self.clock == "wall" and self.lock_step:
            raise SceneSynthError("grammar_node: parameter clock: 'wall' goes with lock_step false, got true; set lock_step:=false")


GRAMMAR_GROUPS: dict[str, type] = {"": RunConfig, "scene": SceneRequest, "motion": MotionConfig}
"""Prefix of a grammar node's parameters -> dataclass that defines them."""
