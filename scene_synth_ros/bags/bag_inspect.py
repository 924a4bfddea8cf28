"""Inspects a bag: what it holds, and everything that is wrong with it.

All images, camera infos, poses, annotations and detections of a camera must have exactly the same stamps.  A room begins with a message of
the topic ``scene``; within it frames must be evenly spaced, and every frame that its camera path announces must be there.  Only the last
room may be cut short, as happens when a run is stopped.  A scene that is logged later than its first frame was is repeated from before (in
a snapshot, in a later file of a split bag): of its frames those from then on must be there.  Where log times are not stamps, as in bags of
other recorders, those from the bag's first frame on must be there.  A bag that begins with the first room of its run lacks what the
run's parameters, which it holds, promise and it does not have.
"""

from array import array
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scene_synth_ros.bags.bag_metadata import METADATA_NAME, NO_TIME_NS, BagMetadata, TopicInfo
from scene_synth_ros.bags.bag_reader import BagReader, BagSummary
from scene_synth_ros.bags.run_info import PARAMETERS_NAME, Promise, read_promise
from scene_synth_ros.bags.whole_frames import FRAME_TYPES, cameras, label_topics
from scene_synth_ros.messages.stamps import NANOSECONDS, AnnouncedRoom, announced_room, stamp_ns
from scene_synth_ros.messages.streams import (
    IMU_DATA,
    IMU_IDEAL,
    JOINT_STATES,
    LIDAR_IDEAL,
    LIDAR_POINTS,
    ODOM,
    SCENE,
    find_streams,
    has_own_stamps,
    parse,
)

MAX_GAP_PERIODS = 1.5
EVEN = (IMU_DATA, IMU_IDEAL, ODOM, JOINT_STATES, LIDAR_POINTS, LIDAR_IDEAL)
"""Roles of streams between frames whose stamps are evenly spaced within a room."""

Stamps = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True)
class TopicReport:
    """What a bag holds of a topic.

    ``count`` is as found by reading; ``period_ns`` is the median distance of stamps, 0 with less than two; ``gaps`` counts distances of
    more than 1.5 periods within a room; ``size`` is the bytes of all messages.
    """

    name: str
    type_name: str
    count: int
    size: int
    period_ns: int
    gaps: int

    @property
    def rate_hz(self) -> float:
        """Messages per second of stamps; 0 if unknown."""
        return NANOSECONDS / self.period_ns if self.period_ns else 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class InspectReport:
    """What a bag holds.

    Lines for people: ``faults`` on what is wrong with it, ``lacking`` on what its run promised and it does not have, ``notes``.
    """

    path: Path
    files: int
    size: int
    start_ns: int | None
    end_ns: int | None
    rooms: int
    topics: tuple[TopicReport, ...]
    custom_data: Mapping[str, str]
    faults: tuple[str, ...]
    lacking: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def message_count(self) -> int:
        """How many messages were found."""
        return sum(topic.count for topic in self.topics)


class _Tally:
    """What is noted of a topic while the bag is read."""

    __slots__ = ("count", "size", "stamps")

    def __init__(self) -> None:
        self.count = 0
        self.size = 0
        self.stamps = array("q")


def inspect_bag(path: str | Path) -> InspectReport:
    """Read a bag from end to end and report on it.

    Raises:
        BagReadError: there is no bag at ``path``.
    """
    with BagReader(path) as reader:
        tallies, rooms, first, backwards = _read_all(reader)
        summary = reader.summary
        stamps = {name: np.frombuffer(tally.stamps, np.int64) for name, tally in tallies.items()}
        room_starts = np.array(sorted(rooms), np.int64)
        topics = tuple(_topic_report(topic, tallies[topic.name], stamps[topic.name], room_starts) for topic in summary.topics)
        faults = [*reader.faults, *_count_faults(summary, topics)]
        if backwards:
            faults.append(backwards)
        announced = [np.array(rooms[start], np.int64) for start in sorted(rooms)]
        promise = read_promise(summary.attachments.get(PARAMETERS_NAME, b""))
        own = _of_run(topics, promise)
        faults += _camera_faults(own, stamps, announced[:-1])
        faults += [f"{topic.name}: {topic.gaps} gaps of more than {MAX_GAP_PERIODS} periods" for topic in own if topic.gaps]
        faults += _meaning_faults(topics)
    return InspectReport(
        path=summary.path,
        files=len(summary.files),
        size=summary.size,
        start_ns=summary.start_ns,
        end_ns=summary.end_ns,
        rooms=len(room_starts),
        topics=topics,
        custom_data=dict(summary.custom_data),
        faults=tuple(faults),
        lacking=tuple(_lacking(promise, own, stamps, first)),
        notes=tuple(_last_room_notes(own, stamps, announced[-1:])),
    )


def _read_all(reader: BagReader) -> tuple[dict[str, _Tally], dict[int, list[int]], AnnouncedRoom | None, str]:
    """Read every message.

    Returns:
        The tallies by topic; start of every room -> stamps of the frames that must come; the first room with these stamps, None without
        rooms; a line on log times that decrease, or none.
    """
    scenes: dict[int, tuple[int, AnnouncedRoom]] = {}
    first_frame: tuple[int, int] | None = None
    tallies = {topic.name: _Tally() for topic in reader.summary.topics}
    scene_topics = find_streams(reader.types, SCENE)
    last_ns, first_fault, faults = 0, "", 0
    for message in reader.messages(file_order=True):
        tally = tallies[message.topic]
        tally.count += 1
        tally.size += len(message.data)
        stamp = stamp_ns(message.type_name, message.data)
        if stamp is not None:
            tally.stamps.append(stamp)
        if message.topic in scene_topics:
            start_ns = min(message.log_ns, NO_TIME_NS) if stamp is None else stamp
            scenes.setdefault(start_ns, (message.log_ns, announced_room(message.data)))
        if first_frame is None and stamp is not None and message.type_name in FRAME_TYPES:
            first_frame = message.log_ns, stamp
        if message.log_ns < last_ns:
            faults += 1
            first_fault = first_fault or f"{message.topic} at {message.log_ns} ns after {last_ns} ns"
        last_ns = message.log_ns
    logged_by_stamp = first_frame is None or first_frame[0] == first_frame[1]
    rooms = {}
    for start_ns, (log_ns, room) in scenes.items():
        due_ns = log_ns if logged_by_stamp or first_frame is None else first_frame[1]
        rooms[start_ns] = [announced for announced in room.stamps_ns if announced >= due_ns]
    first = AnnouncedRoom(scenes[min(scenes)][1].index, rooms[min(scenes)]) if scenes else None
    return tallies, rooms, first, f"log time decreases {faults} times, first {first_fault}" if faults else ""


def _topic_report(topic: TopicInfo, tally: _Tally, stamps: Stamps, room_starts: Stamps) -> TopicReport:
    spacing = np.diff(stamps)
    period_ns = int(np.median(spacing)) if spacing.size else 0
    gaps = 0
    stream = parse(topic.name, topic.type_name)
    even = stream is not None and stream.role in EVEN
    if (even or (topic.type_name in FRAME_TYPES and not has_own_stamps(topic.name))) and period_ns > 0:
        rooms = np.searchsorted(room_starts, stamps, side="right")
        gaps = int(np.count_nonzero((spacing > MAX_GAP_PERIODS * period_ns) & (np.diff(rooms) == 0)))
    return TopicReport(
        name=topic.name, type_name=topic.type_name, count=tally.count, size=tally.size, period_ns=max(period_ns, 0), gaps=gaps
    )


def _count_faults(summary: BagSummary, topics: Sequence[TopicReport]) -> list[str]:
    """Compare what was found with the statistics of the files and with metadata.yaml."""
    faults = []
    if not any(topic.count for topic in topics):
        faults.append("the bag holds no messages")
    for said, found in zip(summary.topics, topics, strict=True):
        if said.message_count != found.count:
            faults.append(f"{said.name}: the index says {said.message_count} messages, {found.count} were found")
    if summary.metadata is not None:
        faults += _metadata_faults(summary.metadata, summary, topics)
    return faults


def _metadata_faults(metadata: BagMetadata, summary: BagSummary, topics: Sequence[TopicReport]) -> list[str]:
    faults = []
    said = {topic.name: topic for topic in metadata.topics}
    found = {topic.name: topic for topic in topics}
    for name in said.keys() - found.keys():
        faults.append(f"{METADATA_NAME}: topic {name} with {said[name].message_count} messages is not in the bag")
    for name in found.keys() - said.keys():
        faults.append(f"{METADATA_NAME}: topic {name} with {found[name].count} messages is not mentioned")
    for name in said.keys() & found.keys():
        if said[name].message_count != found[name].count:
            faults.append(f"{METADATA_NAME}: {name}: {said[name].message_count} messages, {found[name].count} were found")
        if said[name].type_name != found[name].type_name:
            faults.append(f"{METADATA_NAME}: {name}: type {said[name].type_name}, {found[name].type_name} was found")
    if summary.start_ns is not None and summary.end_ns is not None and not faults:
        times = (metadata.start_ns, metadata.start_ns + metadata.duration_ns)
        if times != (summary.start_ns, summary.end_ns):
            faults.append(f"{METADATA_NAME}: times {times[0]} to {times[1]} ns, {summary.start_ns} to {summary.end_ns} ns were found")
    return sorted(faults)


def _of_run(topics: Sequence[TopicReport], promise: Promise | None) -> list[TopicReport]:
    """Return the topics of the run that a bag is of: those of its namespace, without what cameras of others publish in it."""
    if promise is None:
        return list(topics)
    own = [topic for topic in topics if topic.name.startswith(f"{promise.namespace}/")]
    seen = cameras(_types(own))
    if promise.cameras.isdisjoint(seen):
        return own
    of_run = tuple(f"{camera}/" for camera in promise.cameras)
    others = {name for camera, streams in seen.items() if not f"{camera}/".startswith(of_run) for name in streams}
    return [topic for topic in own if topic.name not in others]


def _camera_faults(topics: Iterable[TopicReport], stamps: Mapping[str, Stamps], announced: Sequence[Stamps]) -> list[str]:
    """Return what is wrong with the stamps of each camera's streams, given the stamps that rooms announce."""
    faults = []
    for streams in cameras(_types(topics)).values():
        united = np.unique(np.concatenate([*(stamps[name] for name in streams), *announced]))
        for name in streams:
            own, repeats = np.unique(stamps[name], return_counts=True)
            lost = np.setdiff1d(united, own)
            if lost.size:
                faults.append(f"{name}: {lost.size} of {united.size} frames of its camera are missing, first at {_seconds(int(lost[0]))}")
            if (repeats > 1).any():
                faults.append(f"{name}: {int((repeats > 1).sum())} stamps come more than once, first {_seconds(int(own[repeats > 1][0]))}")
            elif stamps[name].size and (np.diff(stamps[name]) < 0).any():
                faults.append(f"{name}: stamps decrease")
    return faults


def _lacking(
    promise: Promise | None, topics: Iterable[TopicReport], stamps: Mapping[str, Stamps], first: AnnouncedRoom | None
) -> list[str]:
    """Return what the parameters in a bag promise of each camera and is not there; nothing of a bag that begins later than its run."""
    if (
        promise is None
        or not promise.rooms
        or (first is not None and (first.index != promise.first_index or len(first.stamps_ns) < promise.frames_per_room))
    ):
        return []
    promised = promise.rooms * promise.frames_per_room
    found = {
        camera: np.unique(np.concatenate([stamps[name] for name in streams])).size for camera, streams in cameras(_types(topics)).items()
    }
    of_run = {camera: count for camera, count in found.items() if camera in promise.cameras} if found else {"the run": 0}
    told = f"of the {promised} frames that its parameters promise, {promise.rooms} rooms x {promise.frames_per_room}"
    return [f"{camera}: {count} {told}; the run or the recording ended early" for camera, count in of_run.items() if count < promised]


def _last_room_notes(topics: Iterable[TopicReport], stamps: Mapping[str, Stamps], announced: Sequence[Stamps]) -> list[str]:
    """Return a line for every camera whose last room was cut short."""
    notes = []
    for camera, streams in cameras(_types(topics)).items():
        for path in announced:
            found = np.isin(path, np.concatenate([stamps[name] for name in streams])).sum()
            if found < path.size:
                notes.append(f"{camera}: the last room has {found} of its {path.size} frames")
    return notes


def _meaning_faults(topics: Iterable[TopicReport]) -> list[str]:
    """Return what ids lack to be understood: a scene, and the labels of every labelled layer."""
    found = _types(topic for topic in topics if topic.count)
    labels = label_topics(found)
    faults = [f"{name}: the layer has no labels" for name in labels if name not in found]
    if labels and not find_streams(found, SCENE):
        faults.append("scene: the bag holds no scene description")
    return faults


def _types(topics: Iterable[TopicReport]) -> dict[str, str]:
    return {topic.name: topic.type_name for topic in topics}


def _seconds(time_ns: int) -> str:
    return f"{time_ns // NANOSECONDS}.{time_ns % NANOSECONDS:09d} s"
