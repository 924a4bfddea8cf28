"""What a bag says, room by room: tables of its streams, its rooms' meshes, and where the body is at any time."""

import json
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import replace
from functools import cached_property, lru_cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation, RotationSpline

from renderer.camera.config import CameraConfig
from renderer.export.scene_glb import scene_to_glb
from renderer.scene.flatten import flatten
from scene_description import SceneDescription, scene_from_json
from scene_synth_ros.dataset.part import find_cameras
from scene_synth_ros.messages import streams as roles
from scene_synth_ros.messages.cdr import CdrReader, read_text
from scene_synth_ros.messages.streams import Role, Stream, find_streams
from scene_synth_ros.prove.decode import (
    Heads,
    OdometryRows,
    PoseRows,
    cut,
    heads,
    heads_of_images,
    odometry_rows,
    pose_rows,
    transform_rows,
)
from scene_synth_ros.prove.room_mesh import RoomMesh
from scene_synth_ros.prove.stack import Columns, Stack, read_table

Floats = NDArray[np.float64]
NS = 1e-9
_END_NS = 2**62


class Messages(Protocol):
    """Messages of a bag by topic, in the order of their log times."""

    @property
    def types(self) -> Mapping[str, str]:
        """Topic -> type."""

    def messages(self, topic: str, wanted: Collection[int] | None = None) -> Iterator[tuple[int, memoryview]]:
        """Yield log time and bytes of each message of a topic, or of those log times that are wanted."""

    def all(self) -> Iterator[tuple[str, int, memoryview]]:
        """Yield topic, log time and bytes of every message."""


class Reel:
    """The messages of a topic, by ascending stamps."""

    def __init__(self, messages: Iterator[tuple[int, memoryview]]) -> None:
        self._messages = ((CdrReader(data).header().stamp_ns, data) for _, data in messages)
        self._next = next(self._messages, None)

    def at(self, stamp_ns: int) -> memoryview | None:
        """Return the message of a stamp, not before any that was asked for; None if there is none."""
        while self._next is not None and self._next[0] < stamp_ns:
            self._next = next(self._messages, None)
        return self._next[1] if self._next is not None and self._next[0] == stamp_ns else None


class Curve:
    """Where the body is, by ``odom/ideal``: its places with their velocities, its orientations by a smooth spline."""

    def __init__(self, rows: OdometryRows) -> None:
        self.start_ns = int(rows.stamps[0])
        self._times = (rows.stamps - self.start_ns) * NS
        self._turn = RotationSpline(self._times, Rotation.from_quat(rows.quaternion))
        velocity = Rotation.from_quat(rows.quaternion).apply(rows.velocity)
        self._place = CubicHermiteSpline(self._times, rows.place, velocity)

    def covers(self, stamps: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Return which times (n,) lie within what was recorded."""
        times = (stamps - self.start_ns) * NS
        return np.asarray((times >= -1e-9) & (times <= self._times[-1] + 1e-9))

    def at(self, stamp_ns: int, after_s: Floats | float = 0.0) -> tuple[Floats, Rotation]:
        """Return places (n, 3) and rotations to the frame of odometry at a stamp and ``after_s`` (n,) later."""
        times = np.atleast_1d((stamp_ns - self.start_ns) * NS + np.asarray(after_s))
        return np.asarray(self._place(times)), self._turn(times)


class Mount(NamedTuple):
    """A frame that is fixed to the body: its place there and its rotation to it."""

    place: Floats
    turn: Rotation

    def on(self, place: Floats, turn: Rotation) -> tuple[Floats, Rotation]:
        """Return where it is when the body is at ``place`` (n, 3) and ``turn``."""
        return place + turn.apply(self.place), turn * self.turn


@lru_cache(maxsize=2)
def _mesh_of(text: str, catalog_dir: Path | None) -> RoomMesh:
    scene = _bare(scene_from_json(text))
    flat = flatten(scene, catalog_dir)
    plain = flat._replace(part_texture=np.full_like(flat.part_texture, -1))  # those of model files are left
    return RoomMesh(scene_to_glb(scene, plain, CameraConfig()))


def _bare(scene: SceneDescription) -> SceneDescription:
    """Return a room without what says nothing of where its surfaces are: patterns, traces of use, and the view from its windows."""
    materials = tuple(replace(material, texture=None) for material in scene.materials)
    return replace(scene, materials=materials, wear=(), environment=replace(scene.environment, surroundings=None, daylight=None, map=None))


_MOST_OF_IMAGES = 256 * 2**20
"""Bytes of images that are held; where there are more, all are read again when they are looked at."""
_BEGINNING = 512
"""Bytes of a message in which its header is, and an image's height and width."""


_KEPT = (
    roles.INFO, roles.POSE, roles.SCENE, roles.SETTINGS, roles.SCAN, roles.SCAN_IDEAL, roles.IMU_DATA, roles.IMU_IDEAL, roles.ODOM,
    roles.ODOM_IDEAL, roles.JOINT_STATES, roles.ROBOT_DESCRIPTION, roles.CLOCK, roles.TF, roles.TF_STATIC,
)  # fmt: skip
"""Roles whose messages are small, and are held."""
HEADED = (
    *roles.IMAGE_FORMS, roles.INFO, roles.POSE, roles.SCAN, roles.SCAN_IDEAL, roles.LIDAR_POINTS, roles.LIDAR_IDEAL, roles.IMU_DATA,
    roles.IMU_IDEAL, roles.ODOM, roles.ODOM_IDEAL, roles.JOINT_STATES,
)  # fmt: skip
"""Roles whose messages begin with a header, and are logged at its stamp."""


class Evidence:
    """The streams of a bag: its small messages, and of large ones how they begin; these are read again where they are looked at.

    Args:
        messages: of the bag.
        catalog_dir: folder of the user's models.
        digest: role -> what is kept of each of its messages, which are large and looked at once: all are decompressed only once for that.
    """

    def __init__(
        self, messages: Messages, catalog_dir: Path | None = None, digest: Mapping[Role, Callable[[memoryview], Any]] = MappingProxyType({})
    ) -> None:
        self.types, self.catalog_dir = messages.types, catalog_dir
        self._messages = messages
        self._tables: dict[str, Any] = {}
        self._heads: dict[str, tuple[NDArray[np.int64], Heads]] = {}
        self._mounts: dict[str, Mount | None] = {}
        self._kept: dict[str, list[tuple[int, memoryview]]] = {topic: [] for topic in find_streams(self.types, *_KEPT)}
        self._begins: dict[str, list[tuple[int, memoryview]]] = {topic: [] for topic in find_streams(self.types, *HEADED)}
        digests = {topic: keep for role, keep in digest.items() for topic in find_streams(self.types, role)}
        self._digested: dict[str, list[tuple[int, Any]]] = {topic: [] for topic in digests}
        self._images: dict[str, list[tuple[int, memoryview]]] = {
            topic: [] for topics in find_cameras(self.types).values() for topic in topics.images.values()
        }
        room = _MOST_OF_IMAGES
        for topic, log_ns, data in messages.all():
            if topic in self._images:
                self._images[topic].append((log_ns, data))
                room -= len(data)
                if room < 0:
                    self._images.clear()
            if topic in digests:
                self._digested[topic].append((log_ns, digests[topic](data)))
            if topic in self._kept:
                self._kept[topic].append((log_ns, data))
            if topic in self._begins:
                self._begins[topic].append((log_ns, memoryview(bytes(data[:_BEGINNING]))))
        for rows in (*self._kept.values(), *self._digested.values(), *self._begins.values(), *self._images.values()):
            rows.sort(key=lambda row: row[0])

    def each(self, topic: str, wanted: Collection[int] | None = None) -> Iterator[tuple[int, memoryview]]:
        """Yield log time and bytes of each message of a topic; of one whose messages are large those log times that are wanted."""
        if topic in self._images:
            return (row for row in self._images[topic] if wanted is None or row[0] in wanted)
        return iter(self._kept[topic]) if topic in self._kept else self._messages.messages(topic, wanted)

    def digested(self, topic: str) -> list[tuple[int, Any]]:
        """Return log time and what was kept of each message of a topic."""
        return self._digested[topic]

    def streams(self, *wanted: Role) -> dict[str, Stream]:
        """Return topic -> stream of some roles."""
        return find_streams(self.types, *wanted)

    def first(self, role: Role) -> str:
        """Return the first topic of a role; empty if there is none."""
        return next(iter(self.streams(role)), "")

    def table(self, topic: str, read: Callable[[Stack], list[Columns]], kind: Callable[..., Any]) -> Any:
        """Return what the messages of a topic say as rows; None where there are none."""
        if topic not in self._tables:
            messages = [data for _, data in self.each(topic)] if topic else []
            self._tables[topic] = read_table(messages, read, kind) if messages else None
        return self._tables[topic]

    def heads(self, topic: str) -> tuple[NDArray[np.int64], Heads] | None:
        """Return log times, and how the messages of a topic begin; None where there are none."""
        rows = self._begins.pop(topic, None)
        if rows:
            read = heads_of_images if self.types[topic] == roles.IMAGE_TYPE else heads
            table = read_table([data for _, data in rows], read, Heads)
            self._heads[topic] = np.array([log_ns for log_ns, _ in rows], np.int64), table
        return self._heads.get(topic)

    def transforms(self, role: Role) -> PoseRows | None:
        """Return the transforms of ``/tf`` or ``/tf_static``."""
        table: PoseRows | None = self.table(self.first(role), transform_rows, PoseRows)
        return table

    @cached_property
    def fixed(self) -> dict[str, tuple[str, Mount]]:
        """Child -> parent and place there, of the frames that are fixed to each other."""
        table = self.transforms(roles.TF_STATIC)
        if table is None:
            return {}
        rows = zip(table.frames.tolist(), table.children.tolist(), table.place, table.quaternion, strict=True)
        return {child: (parent, Mount(place, Rotation.from_quat(turn))) for parent, child, place, turn in rows}

    @cached_property
    def base(self) -> str:
        """The frame that odometry is of; empty without a body."""
        table = self.table(self.first(roles.ODOM_IDEAL), odometry_rows, OdometryRows)
        return "" if table is None else str(table.children[0])

    def mount(self, frame: str) -> Mount | None:
        """Return where a frame is fixed to the body; None if it is not."""
        if frame not in self._mounts:
            self._mounts[frame] = self._find_mount(frame)
        return self._mounts[frame]

    def _find_mount(self, frame: str) -> Mount | None:
        found, seen = Mount(np.zeros(3), Rotation.identity()), set()
        while frame != self.base:
            if frame in seen or frame not in self.fixed:
                return None
            seen.add(frame)
            frame, above = self.fixed[frame]
            found = Mount(above.place + above.turn.apply(found.place), above.turn * found.turn)
        return found

    @cached_property
    def rooms(self) -> "tuple[Room, ...]":
        """The rooms of the bag by time; one without a description where there are none."""
        told: dict[str, tuple[int, str]] = {}
        for topic in self.streams(roles.SCENE):
            for log_ns, data in self.each(topic):
                text = read_text(data)
                path = json.loads(text).get("camera_path") or [{"stamp_ns": log_ns}]
                told.setdefault(json.loads(text)["id"], (int(path[0]["stamp_ns"]), text))
        starts = sorted(told.values())
        ends = [start for start, _ in starts[1:]] + [_END_NS]
        if not starts:
            return (Room(self, 0, _END_NS, ""),)
        return tuple(Room(self, start, end, text) for (start, text), end in zip(starts, ends, strict=True))


class Room:
    """The part of a bag from one room's first stamp to the next room's."""

    def __init__(self, evidence: Evidence, start_ns: int, end_ns: int, text: str) -> None:
        self.evidence, self.start_ns, self.end_ns, self._text = evidence, start_ns, end_ns, text

    def table(self, role_or_topic: Role | str, read: Callable[[Stack], list[Columns]], kind: Callable[..., Any]) -> Any:
        """Return the rows of a topic, or of the first of a role, that lie in the room; None where there are none."""
        topic = role_or_topic if isinstance(role_or_topic, str) else self.evidence.first(role_or_topic)
        table = self.evidence.table(topic, read, kind)
        if table is None:
            return None
        inside = (table.stamps >= self.start_ns) & (table.stamps < self.end_ns)
        return cut(table, inside) if inside.any() else None

    def heads(self, topic: str) -> tuple[NDArray[np.int64], Heads]:
        """Return log times, and how the messages of a topic in the room begin."""
        found = self.evidence.heads(topic)
        if found is None:
            none = np.zeros(0, np.int64)
            return none, Heads(none, none.astype(str), none, none)
        logged, table = found
        inside = (logged >= self.start_ns) & (logged < self.end_ns)
        return logged[inside], cut(table, inside)

    def digested(self, topic: str) -> list[Any]:
        """Return what was kept of the messages of a topic in the room."""
        return [kept for log_ns, kept in self.evidence.digested(topic) if self.start_ns <= log_ns < self.end_ns]

    def each(self, topic: str, wanted: Collection[int] | None = None) -> Iterator[tuple[int, memoryview]]:
        """Yield log time and bytes of the messages of a topic in the room, as :meth:`Evidence.each` does."""
        for log_ns, data in self.evidence.each(topic, wanted):
            if self.start_ns <= log_ns < self.end_ns:
                yield log_ns, data

    @property
    def mesh(self) -> RoomMesh | None:
        """The room as it is exported; None where its description is not in the bag."""
        if not self._text:
            return None
        return _mesh_of(self._text, self.evidence.catalog_dir)

    @cached_property
    def settings(self) -> Mapping[str, Any]:
        """What the first frame of the first renderer was made with; empty where that is not told."""
        for topic in self.evidence.streams(roles.SETTINGS):
            for _, data in self.each(topic):
                found = json.loads(read_text(data))
                if self.start_ns <= found.get("stamp_ns", -1) < self.end_ns:
                    return dict(found)
        return {}

    def group(self, name: str) -> Mapping[str, Any]:
        """Return a group of settings; empty where that is not told."""
        found = self.settings.get(name)
        return found if isinstance(found, Mapping) else {}

    @cached_property
    def body(self) -> OdometryRows | None:
        """The rows of ``odom/ideal``; None where there are fewer than four."""
        rows: OdometryRows | None = self.table(roles.ODOM_IDEAL, odometry_rows, OdometryRows)
        return rows if rows is not None and len(rows.stamps) >= 4 and (np.diff(rows.stamps) > 0).all() else None

    @cached_property
    def curve(self) -> Curve | None:
        """Where the body is; None without one."""
        return None if self.body is None else Curve(self.body)

    def poses(self, topic: str) -> PoseRows | None:
        """Return the rows of a topic of poses."""
        rows: PoseRows | None = self.table(topic, pose_rows, PoseRows)
        return rows
