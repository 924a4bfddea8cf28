"""Renders the frames of a bag again, from the bag alone, and compares every message with what was recorded.

A frame is made again from its settings (``<renderer>/settings``), the scene that they name and the pose of its stamp.  Messages are
compared as their bytes, with zeros where CDR has gaps.
"""

import zlib
from collections import OrderedDict, deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import CompressedImage, Image

from renderer import RenderError
from renderer.core.errors import FlattenError
from scene_description import CameraPose, FieldError, SceneDescription, SceneSynthError, scene_from_json
from scene_description.strict import whole_number
from scene_synth_ros.bags.bag_manifest import ManifestBuilder, ManifestError, read_manifest
from scene_synth_ros.bags.bag_reader import BagMessage, BagReader
from scene_synth_ros.bags.run_info import JPEG_QUALITY, RECORD_NAME
from scene_synth_ros.messages.canonical_cdr import canonical_cdr
from scene_synth_ros.messages.cdr import read_text
from scene_synth_ros.messages.conversions import msg_to_image
from scene_synth_ros.messages.detections import ANNOTATIONS
from scene_synth_ros.messages.driven_base import DrivenRooms, frame_path
from scene_synth_ros.messages.frame_messages import FrameMessages
from scene_synth_ros.messages.frame_settings import FrameSettings, settings_from_json
from scene_synth_ros.messages.image_codec import compress_image
from scene_synth_ros.messages.poses import read_pose
from scene_synth_ros.messages.stamps import stamp_ns
from scene_synth_ros.messages.streams import POSE, SCENE, SETTINGS, Role, Stream, find_streams, parse, untransported
from scene_synth_ros.render.room import RenderedRoom, room_settings
from scene_synth_ros.verify.bodies_again import BodiesAgain
from scene_synth_ros.verify.scans_again import ScansAgain

_CACHED_STAMPS, _ROOMS_HELD = 4, 2


class VerifyError(SceneSynthError):
    """A bag that cannot be rendered again; one line."""


class Difference(NamedTuple):
    """A message that is not what rendering gives: where, and what is different."""

    topic: str
    stamp_ns: int
    room: str
    frame: int
    detail: str


@dataclass(slots=True, kw_only=True)
class VerifyReport:
    """What a comparison has found; ``damaged`` are lines on files that are not what their manifests say."""

    frames: int = 0
    compared: int = 0
    different: int = 0
    first: Difference | None = None
    damaged: list[str] = field(default_factory=list)
    manifests: int = 0

    @property
    def good(self) -> bool:
        """Whether everything is as it was recorded and as it is rendered."""
        return self.compared > 0 and not self.different and not self.damaged


class _Expected(NamedTuple):
    """What rendering gives for one stamp: topic -> message, and whose frame it is."""

    messages: dict[str, object]
    room: str
    frame: int


class _FramesAgain:
    """Settings, poses and scenes of a bag, and the frames made of them; at most a few are held."""

    def __init__(self, reader: BagReader, catalog_dir: Path | None) -> None:
        self._catalog_dir = catalog_dir
        self._settings: dict[int, list[FrameSettings]] = {}
        self._poses: dict[tuple[str, int], CameraPose] = {}
        self._scenes: dict[str, bytes] = {}
        self._parsed: SceneDescription | None = None
        self._drives = DrivenRooms()
        self.scans = ScansAgain(self._scene, self._room, self._drives)
        self.bodies = BodiesAgain(self._scene, self._room, self._drives)
        quality = whole_number(reader.summary.records.get(RECORD_NAME, {}).get(JPEG_QUALITY, ""))
        self.jpeg_quality = quality if quality is not None and 1 <= quality <= 100 else 90
        self._rooms: deque[RenderedRoom] = deque()
        self._frames: OrderedDict[int, _Expected] = OrderedDict()
        streams = find_streams(reader.types, SCENE, SETTINGS, POSE)
        self.namespace = next((stream.base for stream in streams.values() if stream.role is SCENE), "").rstrip("/")
        for message in reader.messages(streams, file_order=True):
            self._take(message, streams[message.topic].role)

    def _take(self, message: BagMessage, role: Role) -> None:
        if role is POSE:
            pose = read_pose(message.data).camera_pose
            self._poses[message.topic, pose.stamp_ns] = pose
            return
        text = read_text(message.data)
        if role is SCENE:
            scene = scene_from_json(text)
            self._scenes[scene.id] = zlib.compress(text.encode(), 1)
        else:
            settings = settings_from_json(text)
            self.scans.take(settings)
            self.bodies.take(settings)
            self._drives.take(settings)
            known = self._settings.setdefault(settings.stamp_ns, [])
            if settings not in known:
                known.append(settings)

    @property
    def count(self) -> int:
        """How many frames have settings."""
        return len(self._settings)

    def expected(self, stamp: int) -> _Expected | None:
        """Return what a frame is when it is rendered again; None for stamps of no frame."""
        if stamp not in self._settings:
            return None
        if stamp not in self._frames:
            self._frames[stamp] = self._render(stamp)
            while len(self._frames) > _CACHED_STAMPS:
                self._frames.popitem(last=False)
        return self._frames[stamp]

    def _render(self, stamp: int) -> _Expected:
        messages: dict[str, object] = {}
        for settings in self._settings[stamp]:
            scene = self._scene(settings.scene)
            pose = self._poses.get((Stream(f"{self.namespace}/{settings.streams.camera}", POSE).topic, stamp))
            if pose is None:
                raise VerifyError(f"frame at {stamp} ns: its pose is not in the bag")
            maker = FrameMessages(settings.streams, settings.camera)
            maker.begin_room(scene)
            path = maker.path
            if settings.scene in self._drives:
                path = maker.path = frame_path(scene, settings.camera, settings.streams, self._drives.motion(scene), stamp)
            layers = [*maker.rendered, *([ANNOTATIONS] if settings.streams.annotations else [])]
            frame = self._room(settings).render(pose, settings.frame, layers, exposure=settings.exposure, path=path)
            for topic, message in maker.of_frame(frame, pose, lambda _: True):
                messages[f"{self.namespace}/{topic}"] = message
        first = self._settings[stamp][0]
        return _Expected(messages, first.scene, first.frame)

    def _scene(self, scene_id: str) -> SceneDescription:
        if self._parsed is None or self._parsed.id != scene_id:
            if scene_id not in self._scenes:
                raise VerifyError(f"scene {scene_id}: it is not in the bag")
            self._parsed = scene_from_json(zlib.decompress(self._scenes[scene_id]).decode())
        return self._parsed

    def _room(self, settings: FrameSettings) -> RenderedRoom:
        """Return the room of a frame as it is rendered; the last two are kept."""
        groups = {group: getattr(settings, group) for group in ("camera", "render", "sensor", "depth_sensor", "streams")}
        made_with = room_settings(groups, self._catalog_dir)
        for room in self._rooms:
            if room.scene.id == settings.scene and room.settings == made_with:
                return room
        if len(self._rooms) == _ROOMS_HELD:
            self._rooms.popleft().close()
        self._rooms.append(RenderedRoom(self._scene(settings.scene), made_with))
        return self._rooms[-1]

    def close(self) -> None:
        """Release the rooms."""
        for room in self._rooms:
            room.close()


def verify_bag(bag: Path, catalog_dir: Path | None = None, progress: Callable[[int, int], None] = lambda *_: None) -> VerifyReport:
    """Compare a bag with its manifests and with what its frames are when they are rendered again.

    ``catalog_dir``: folder of the user's models, where the run had one; ``progress`` is told frames done and frames in all.

    Raises:
        BagReadError: the bag cannot be read.
        VerifyError: it lacks what rendering needs, or its scenes cannot be rendered.
    """
    report = VerifyReport()
    with BagReader(bag) as reader:
        report.damaged += _manifest_faults(reader, report)
        try:
            frames = _FramesAgain(reader, catalog_dir)
            if not frames.count:
                raise VerifyError(f"{bag}: no frame has settings beside it; expected a topic <renderer>/settings, as recorders write it")
            try:
                for message in reader.messages(file_order=True):
                    _compare(message, frames, report, progress)
            finally:
                frames.close()
        except (FieldError, FlattenError, RenderError) as error:
            raise VerifyError(f"{bag}: {error}") from None
        report.damaged += [fault for fault in reader.faults if fault not in report.damaged]
    return report


def _manifest_faults(reader: BagReader, report: VerifyReport) -> Iterator[str]:
    """Yield a line for every topic of every file that is not what the file's manifest says."""
    manifests = dict(reader.manifests())
    for path, messages in reader.messages_by_file():
        if path not in manifests:
            continue
        found = ManifestBuilder()
        for message in messages:
            found.add(message.topic, message.log_ns, message.data)
        try:
            said = read_manifest(manifests[path])
        except ManifestError as error:
            yield f"{path.name}: {error}"
            continue
        report.manifests += 1
        digests = found.digests()
        for topic in sorted({*said, *digests}):
            if said.get(topic) != digests.get(topic):
                yield f"{path.name}: {topic[:200]} is not what was recorded"


def _compare(message: BagMessage, frames: _FramesAgain, report: VerifyReport, progress: Callable[[int, int], None]) -> None:
    stamp = stamp_ns(message.type_name, message.data)
    base = untransported(message.topic) or message.topic
    stream = parse(base)
    if stamp is None or stream is None or stream.role is SETTINGS:
        return
    if stream.has_own_stamps:
        name = message.topic.removeprefix(f"{frames.namespace}/")
        scan = frames.scans.message(name, stamp)
        again = frames.bodies.message(name, stamp) if scan is None else (scan[0], scan[1].settings)
        if again is not None:
            _judge(message, again[0], stamp, again[1].scene, again[1].frame, report)
        return
    expected = frames.expected(stamp)
    if expected is None or base not in expected.messages:
        return
    if stream.role is POSE:
        report.frames += 1
        progress(report.frames, frames.count)
    made = expected.messages[base]
    if base != message.topic:
        made = _compressed_like(message, made, frames.jpeg_quality)
    _judge(message, made, stamp, expected.room, expected.frame, report)


def _judge(message: BagMessage, made: object, stamp: int, room: str, frame: int, report: VerifyReport) -> None:
    """Count a message that has been made again, and whether it is the same."""
    report.compared += 1
    recorded = deserialize_message(message.data, type(made))
    if canonical_cdr(recorded) != canonical_cdr(made):
        report.different += 1
        if report.first is None:
            report.first = Difference(message.topic, stamp, room, frame, _detail(recorded, made))


def _compressed_like(message: BagMessage, image: object, jpeg_quality: int) -> CompressedImage:
    """Return an image compressed in the form of a recorded one."""
    assert isinstance(image, Image)
    recorded = deserialize_message(message.data, CompressedImage)
    form = "jpeg" if " jpeg " in recorded.format else "png"
    return compress_image(image, msg_to_image(image), message.topic, form, jpeg_quality)


def _detail(recorded: Any, made: Any) -> str:
    """Say in words what is different."""
    if (
        isinstance(made, Image)
        and all(getattr(recorded, name) == getattr(made, name) for name in ("width", "height", "encoding", "step", "is_bigendian"))
        and len(recorded.data) == len(made.data)
    ):
        a, b = msg_to_image(recorded), msg_to_image(made)
        pixels = (a != b) & ~((a != a) & (b != b))
        differing = np.count_nonzero(pixels.any(-1) if pixels.ndim == 3 else pixels)
        return f"{differing} of {made.width * made.height} pixels"
    names = [name for name in made.get_fields_and_field_types() if getattr(recorded, name) != getattr(made, name)]
    return f"field {', '.join(names)}"
