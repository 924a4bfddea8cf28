"""What a test asks of rooms: ``@room(seed=7, path="loop", rig="lidar_robot", ate_m=0.05)`` above a test that takes ``judge``."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal, TypeVar

from scene_description.strict import FieldError, Limits, from_mapping

MARK = "scene_synth_room"
Test = TypeVar("Test", bound=Callable[..., object])
_Most = Annotated[float, Limits(ge=0.0, le=1e6)]

PATHS: Mapping[str, Mapping[str, object]] = {
    "rig": {},
    "loop": {"grammar_node.motion.kind": "base", "grammar_node.motion.loop": True},
    "base": {"grammar_node.motion.kind": "base", "grammar_node.motion.loop": False},
    "handheld": {"grammar_node.motion.kind": "handheld"},
    "flight": {"grammar_node.motion.kind": "flight"},
    "still": {"grammar_node.motion.kind": "still"},
    "walk": {"grammar_node.motion.kind": "walk"},
}
"""Name of a path -> parameters that give it; ``rig``: the one that the rig has."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RoomTest:
    """Rooms, what is recorded in them, and what an estimate must reach.

    Attributes:
        seed, rooms: the rooms are those with the indices 0, 1, ... of a seed.
        room_type: of them all.
        rig: shipped overlays by their names, or parameter files, later ones over earlier, with commas between; empty: a camera.
        path: a name of ``PATHS``.
        frames, rate_hz: of a room.
        parameters: further ones, NODE.NAME -> value, or NAME of every renderer.
        truth: what the estimate is of: the camera's optical frame, or the body.
        camera: whose; empty for the only one.
        repeats: how often the estimator runs on each room: its own randomness.
        ate_m, rpe_m, rpe_deg, coverage: the most errors may be over all rooms, and the least share of poses; None is not judged.
        blamed: how many recordings may be made to find what broke a failure; 0: none.
    """

    seed: Annotated[int, Limits(ge=0, le=2**63 - 1)]
    rooms: Annotated[int, Limits(ge=1, le=1000)] = 1
    room_type: Annotated[str, Limits(min_length=1, max_length=100)] = "living_room"
    rig: Annotated[str, Limits(max_length=1000)] = ""
    path: Literal["rig", "loop", "base", "handheld", "flight", "still", "walk"] = "rig"
    frames: Annotated[int, Limits(ge=3, le=100_000)] = 150
    rate_hz: Annotated[float, Limits(ge=0.1, le=1000.0, unit="Hz")] | None = None
    parameters: Mapping[str, Any] = field(default_factory=dict)
    truth: Literal["camera", "body"] = "camera"
    camera: Annotated[str, Limits(max_length=100)] = ""
    repeats: Annotated[int, Limits(ge=1, le=100)] = 1
    ate_m: _Most | None = None
    rpe_m: _Most | None = None
    rpe_deg: _Most | None = None
    coverage: Annotated[float, Limits(ge=0.0, le=1.0)] | None = None
    blamed: Annotated[int, Limits(ge=0, le=100)] = 8

    def __post_init__(self) -> None:
        """Check what single ranges cannot say."""
        if all(bar is None for bar in (self.ate_m, self.rpe_m, self.rpe_deg, self.coverage)):
            raise FieldError("@room", "at least one of ate_m, rpe_m, rpe_deg and coverage", "none")


def room(**words: Any) -> Callable[[Test], Test]:
    """Return a decorator that gives a test its rooms; the words are the fields of :class:`RoomTest`.

    Raises:
        FieldError: a word is unknown or its value does not fit.
    """
    import pytest

    test = from_mapping(RoomTest, words, "@room")
    return getattr(pytest.mark, MARK)(test)  # type: ignore[no-any-return]
