"""The run that a simulator's services steer, and the words of their answers.  No ROS."""

from collections.abc import Callable, Mapping
from typing import Any, Literal, NamedTuple, Protocol
from urllib.parse import parse_qsl, urlsplit

from grammar.synthesize import SceneSynthesizer
from scene_description import SceneDescription
from scene_description.strict import whole_number
from scene_synth_ros.simulation.world import World

UNSUPPORTED, DONE, NOT_FOUND, INCORRECT_STATE, FAILED = range(5)
"""Result codes of any service; those above 100 are a service's own."""
STOPPED, PLAYING, PAUSED, QUITTING = range(4)
MODELS, ROOMS = "model", "room"
"""Schemes: ``model://CATEGORY/STYLE?seed=N`` and ``room://TYPE?seed=N``."""


Phase = Literal["stopped", "paused", "playing"]
Answer = Mapping[str, Any]


class Refusal(Exception):
    """What a service answers in place of success: a result code, and a line that says why."""

    def __init__(self, code: int, line: str) -> None:
        super().__init__(line)
        self.code, self.line = code, " ".join(line.split())[:2000]


class Later(NamedTuple):
    """An answer that is not there yet; called, it returns it, or None, or raises a Refusal."""

    ask: Callable[[], Answer | None]


class Run(Protocol):
    """The run that is steered."""

    @property
    def phase(self) -> Phase:
        """Where it stands."""

    @property
    def scene(self) -> SceneDescription | None:
        """The room at work; while stopped the one that will come first; None while there is none yet."""

    @property
    def rules(self) -> SceneSynthesizer:
        """What rooms are made by."""

    @property
    def shown_ns(self) -> int:
        """Stamp of the last frame that is known to be shown, 0 for none."""

    @property
    def world(self) -> World:
        """What its first room differs by."""

    @property
    def frame(self) -> str:
        """Frame of the world."""

    def put(self, world: World) -> None:
        """Let the first room differ by something else, at once while stopped, otherwise with the next reset.

        Raises:
            ChangeError: the room cannot be so; it stays as it is.
        """

    def can_hold(self) -> str:
        """Return why frames cannot be held, in a line; empty where they can."""

    def can_restart_time(self) -> str:
        """Return why time cannot begin again, in a line; empty where it can."""

    def play(self) -> None:
        """Let rooms and frames go on."""

    def hold(self) -> None:
        """Hold back frames."""

    def let_out(self, frames: int) -> Callable[[], bool]:
        """Let out frames; return what tells whether they are shown.

        What is returned raises a SceneSynthError where they never will be.
        """

    def begin_anew(self, *, time: bool, stopped: bool) -> None:
        """Let the run begin again."""

    def has_begun_anew(self) -> bool:
        """Return whether it has begun again, and its first room is there.

        Raises:
            SceneSynthError: its first room cannot be made.
        """

    def load(self, scene: SceneDescription | None, room_type: str, seed: int | None) -> None:
        """Take another room, or rooms of another type and seed, to begin with.

        Raises:
            SceneSynthError: it cannot be.
        """

    def quit(self) -> None:
        """End the run."""


def result(code: int = DONE, line: str = "") -> dict[str, Any]:
    """Return the field ``result`` of an answer."""
    return {"result": {"result": code, "error_message": line}}


def scene_of(run: Run) -> SceneDescription:
    """Return the room at work, or that comes first.

    Raises:
        Refusal: none is there.
    """
    scene = run.scene
    if scene is None:
        raise Refusal(INCORRECT_STATE, "no room is there yet; ask again")
    return scene


def refuse_if(code: int, reason: str) -> None:
    """Refuse for a reason, if there is one."""
    if reason:
        raise Refusal(code, reason)


def read_uri(uri: str, scheme: str, code: int) -> tuple[str, str, int | None]:
    """Return host, path and seed of a URI."""
    wanted = f"{scheme}://{'CATEGORY/STYLE' if scheme == MODELS else 'TYPE'}[?seed=N]"
    try:
        parts = urlsplit(uri)
        query = dict(parse_qsl(parts.query, strict_parsing=True)) if parts.query else {}
    except ValueError:
        raise Refusal(code, f"uri: expected {wanted}, got '{uri[:200]}'") from None
    seed = whole_number(query["seed"]) if "seed" in query else None
    if parts.scheme != scheme or set(query) - {"seed"} or ("seed" in query and (seed is None or not 0 <= seed < 2**63)):
        raise Refusal(code, f"uri: expected {wanted}, got '{uri[:200]}'")
    return parts.netloc, parts.path.strip("/"), seed
