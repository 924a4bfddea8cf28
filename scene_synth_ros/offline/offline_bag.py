"""A bag that is written without DDS: the same bytes on every topic as the recorder of the live suite writes.

``/diagnostics`` is missing, which nobody publishes here; everything else is as in a recorded run, whatever the order in which that had
found its topics.
"""

import sys
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Any

from grammar.synthesize import FloorMap
from renderer.exposure import LightReading
from scene_description import SceneDescription, scene_to_json
from scene_description.whole import WholeFolder
from scene_synth_ros.bags.bag_writer import BagWriteError, BagWriter
from scene_synth_ros.messages.canonical_cdr import canonical_cdr
from scene_synth_ros.messages.message_definitions import type_name_of
from scene_synth_ros.offline.offline_renderer import OfflineRenderer
from scene_synth_ros.offline.settings import OfflineSettings
from scene_synth_ros.record.frame_topics import frame_topics
from scene_synth_ros.record.recording import Recording, describe_run, make_writer, recording_options
from scene_synth_ros.record.room_progress import expect_frames
from scene_synth_ros.record.senders import Origin
from scene_synth_ros.record.topic_inputs import complete_qos, is_chosen
from scene_synth_ros.render.room import RenderedRoom
from scene_synth_ros.suite.heap import trim_heap
from scene_synth_ros.suite.qos import latched_qos
from scene_synth_ros.synthesize.scene_messages import SCENE_TOPICS, scene_to_msgs

_JOBS_WAITING = 2
"""Batches of messages that may wait for the disk: about a frame, while the next is rendered."""


def _tell(line: str) -> None:
    sys.stderr.write(f"{line}\n")


class OfflineBag:
    """A bag in the making; its folder has its name only once it is whole.  A context manager: after an exception nothing is left.

    Rendering and writing overlap: a thread of :class:`Recording` compresses and writes a frame while the next is rendered.  Memory is
    bounded by one room and about two frames.

    Threads: one calls every method.

    Args:
        records: further metadata records of the bag, by name.
        machine: whether the bag tells the machine that made it; without, equal machines and others make the same file.

    Attributes:
        rooms: how many rooms have messages in the bag, one that failed half-way included.

    Raises:
        BagWriteError: the folder exists or cannot be made.
        ParameterError: a parameter does not fit.
    """

    def __init__(
        self,
        directory: Path,
        settings: OfflineSettings,
        floor_of: Callable[[SceneDescription], FloorMap],
        records: Mapping[str, Mapping[str, str]] | None = None,
        warn: Callable[[str], None] = _tell,
        *,
        machine: bool = True,
    ) -> None:
        if directory.exists():
            raise BagWriteError(f"{directory} exists; choose another name or remove it")
        self._directory = directory
        self._settings, self._floor_of, self._records = settings, floor_of, dict(records or {})
        self._namespace = f"{settings.namespace}/"
        self._renderers = {
            name: OfflineRenderer(groups, lambda topic, name=name: self._is_recorded(self._full_name(name, topic)))  # type: ignore[misc]
            for name, groups in settings.renderers.items()
        }
        self._recording = Recording(self._make_writer, recording_options(settings.recorder), warn, repr, jobs_waiting=_JOBS_WAITING)
        self._takers: dict[str, Callable[[bytes], None]] = {}
        self._add_topics()
        describe_run(self._recording, settings.recorder, settings.nodes, machine=machine)
        self.rooms = 0
        try:
            self._folder = WholeFolder(directory)
        except OSError as error:
            self._recording.close()
            raise BagWriteError(f"cannot make bag folder {directory}: {error.strerror or error}") from None
        try:
            self._recording.begin(self._folder.partial).result()
        except BaseException:
            self.discard()
            raise

    def add_room(
        self,
        scene: SceneDescription,
        metered: Callable[[str], LightReading] | None = None,
        rendered: Callable[[], None] = lambda: None,
        former: RenderedRoom | None = None,
    ) -> str:
        """Render a room along its path and write it; return its description as it was written, JSON.

        Args:
            scene: the room; its frames come after those of the rooms before.
            metered: returns what the meter tells for a renderer, by its name, where that is needed; None meters the room.
            rendered: called after every frame.
            former: as of :class:`RenderedRoom`, for the first renderer; the others have the one's before them.

        Raises:
            SceneSynthError: the room cannot be made or rendered; a BagWriteError where it cannot be written.
        """
        renderers = {name: renderer for name, renderer in self._renderers.items() if renderer.renders(scene)}
        try:
            for name, renderer in renderers.items():
                former = renderer.begin_room(scene, partial(metered, name) if metered else None, former)
            text = scene_to_json(scene)
            room = scene_to_msgs(scene, text, self._floor_of(scene), self._settings.run.world_frame)
            self.rooms += 1
            self._write((self._namespace + name, message) for name, message in room.items())
            for index in range(len(scene.camera_path)):
                for name, renderer in renderers.items():
                    self._write((self._full_name(name, topic), message) for topic, message in renderer.frame(index))
                rendered()
        finally:
            for renderer in renderers.values():
                renderer.end_room()
            trim_heap()
        return text

    def close(self) -> None:
        """Write what waits and give the folder its name.

        Raises:
            BagWriteError: something was not written; nothing is left.
        """
        try:
            self._recording.close()
            self._folder.finish()
        except BaseException:
            self.discard()
            raise

    def discard(self) -> None:
        """Remove what there is of the bag."""
        with suppress(BagWriteError):
            self._recording.close()
        self._folder.discard()

    def __enter__(self) -> "OfflineBag":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if kind is None:
            self.close()
        else:
            self.discard()

    def _make_writer(self, folder: Path) -> BagWriter:
        writer = make_writer(self._settings.recorder, folder)
        for name, record in self._records.items():
            writer.set_record(name, record)
        return writer

    def _full_name(self, renderer: str, topic: str) -> str:
        """Return the full name of a topic of a renderer: absolute, private or below the namespace."""
        if topic.startswith("/"):
            return topic
        return f"{self._namespace}{renderer}/{topic[2:]}" if topic.startswith("~/") else self._namespace + topic

    def _is_recorded(self, topic: str) -> bool:
        return is_chosen(topic, self._settings.recorder[""], self._namespace, lambda source: True)

    def _add_topics(self) -> None:
        """Open the channels of all topics that are recorded, in the order of their names, as the recorder does; say what frames have."""
        offered: dict[str, tuple[type, list[Any]]] = {}
        for name, message_type in SCENE_TOPICS.items():
            offered[self._namespace + name] = message_type, [latched_qos(self._settings.run.rooms_ahead)]
        published: dict[str, list[str]] = {}
        for renderer, of_renderer in self._renderers.items():
            for topic in of_renderer.topics.values():
                full = self._full_name(renderer, topic.name)
                offered.setdefault(full, (topic.message_type, []))[1].append(topic.qos)
                published.setdefault(f"{self._namespace}{renderer}", []).append(full)
        for full, (message_type, profiles) in sorted(offered.items()):
            if self._is_recorded(full):
                type_name = type_name_of(message_type)
                self._recording.add_topic(full, type_name, [complete_qos(profile) for profile in profiles], Origin.SUITE)
                self._takers[full] = self._recording.taker(full, type_name, self._namespace)
        expect_frames(self._recording, {node: frame_topics(topics) for node, topics in published.items()}, self._takers.__contains__)

    def _write(self, messages: Iterable[tuple[str, object]]) -> None:
        """Hand messages over to the thread that writes.

        Raises:
            BagWriteError: writing has ended.
        """
        for topic, message in messages:
            if topic in self._takers:
                self._takers[topic](canonical_cdr(message))
        if self._recording.fault:
            raise BagWriteError(self._recording.fault)
