"""The world before a simulation plays: the first room of the run, another one in its place, and what was changed in it.  No ROS."""

import math
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

from grammar.counterfactual import Change, apply_change, as_base
from grammar.counterfactual.gate import report_of
from grammar.synthesize import CameraTimes, SceneSynthesizer
from scene_description import SceneDescription, SceneSynthError
from scene_synth_ros.messages.stamps import NANOSECONDS

MOVED = "object_moved"
"""Factor of what a reset of the state undoes; the others are of what a reset of what was spawned undoes."""


@dataclass(frozen=True, slots=True)
class World:
    """What the first room of a run differs by from the one that the run would have.

    Attributes:
        loaded: a room in its place.
        changes: made to it, in their order.
        names: name that an object was given -> its id.
    """

    loaded: SceneDescription | None = None
    changes: tuple[Change, ...] = ()
    names: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))

    def scene(self, sampled: SceneDescription, times: CameraTimes, rules: SceneSynthesizer) -> SceneDescription:
        """Return the first room: the one that was sampled, or the one that was loaded, at ``times`` of frames; changed.

        A changed room has an id of its own, by its changes: a bag may have it beside the one that it was.

        Raises:
            ChangeError: a change does not fit the room any more.
        """
        scene = sampled if self.loaded is None else _in_place(self.loaded, sampled.index, times)
        for change in self.changes:
            scene = apply_change(as_base(scene), change, rules)
        if not self.changes:
            return scene
        return replace(scene, id=f"{scene.id[:100]}-{zlib.crc32(repr(self.changes).encode()):08x}")

    def after(self, change: Change) -> "World":
        """Return the world with one more change."""
        return replace(self, changes=(*self.changes, change))

    def named(self, name: str, identifier: int) -> "World":
        """Return the world with a name for an object."""
        return replace(self, names={**self.names, name: identifier})

    def reset(self, *, moved: bool, spawned: bool) -> "World":
        """Return the world with objects where they were, or without what was spawned and deleted, which takes moves along."""
        changes = () if spawned else tuple(change for change in self.changes if not moved or change.factor != MOVED)
        return replace(self, changes=changes, names={} if spawned else self.names)


UNCHANGED = World()
"""The first room as the run has it."""


def checked_world(scene: SceneDescription, rules: SceneSynthesizer) -> World:
    """Return the world of a room that is loaded.

    Raises:
        SceneSynthError: it is no valid room; the line says which checks it fails.
    """
    failed = [check.name for check in report_of(rules, scene).checks if not check.passed]
    if failed:
        raise SceneSynthError(f"world: expected a valid room, got one that fails {', '.join(failed)}; change what is at fault")
    return World(loaded=scene)


def _in_place(scene: SceneDescription, index: int, times: CameraTimes) -> SceneDescription:
    """Return a room as that of an index, its camera's path at the run's times.

    Its body's motion is left away, whose times are its own: the camera goes from pose to pose.
    """
    path = tuple(
        replace(pose, stamp_ns=times.start_ns + round((times.first_index + k) * NANOSECONDS / times.rate_hz))
        for k, pose in enumerate(scene.camera_path)
    )
    return replace(scene, index=index, camera_path=path, motion=None)


def upright_yaw(x: float, y: float, z: float, w: float) -> float | None:
    """Return the yaw (rad) of a rotation about the vertical; None for any other, and for what is no unit quaternion."""
    length = math.sqrt(x * x + y * y + z * z + w * w)
    if abs(length - 1.0) > 0.01 or math.hypot(x, y) > 1e-3:
        return None
    return 2.0 * math.atan2(z, w) if w >= 0.0 else 2.0 * math.atan2(-z, -w)
