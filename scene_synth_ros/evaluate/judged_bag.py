"""Measures the estimates of one bag against its truth, a frame at a time."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import nullcontext
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

from evaluation.core.errors import EvaluationError
from evaluation.core.task import Measurement
from evaluation.evaluation_file import FrameKey
from evaluation.summary import MeasuredFrame
from evaluation.tasks import TASKS
from scene_synth_ros.bags.indexed_bag import IndexedBag, open_bag
from scene_synth_ros.evaluate.algorithm import NEXT, POSE_INPUT, PREVIOUS, THIS, Algorithm, frame_of
from scene_synth_ros.evaluate.bag_index import index_bag, refuse_empty
from scene_synth_ros.evaluate.errors import EstimateError, EvaluateError, Notes
from scene_synth_ros.evaluate.estimate_sources import OWN_CAMERA, AlgorithmEstimates, BagEstimates, EstimateSource, Frames
from scene_synth_ros.evaluate.estimates_bag import EstimatesBag
from scene_synth_ros.evaluate.flow_direction import FlowDirections
from scene_synth_ros.evaluate.measuring import Estimates, TruthFrame, layers_beside, measure_frame, measure_room, needed_layers
from scene_synth_ros.evaluate.readings import Reading
from scene_synth_ros.evaluate.task_streams import POSES, TASK_STREAMS
from scene_synth_ros.evaluate.topics import TypedTopic, camera_of, estimate_topic, image_topics, info_topics, layers_present, truth_topics
from scene_synth_ros.evaluate.truth_bags import TruthBag
from scene_synth_ros.messages.stamps import CdrBytes
from scene_synth_ros.messages.streams import LABELS, Stream


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """What is judged, the same for every bag.

    Attributes:
        tasks: keys of ``evaluation.TASKS``.
        camera: whose truth counts; empty for the only one.
        topics: task -> topic of its estimates, as the user has chosen them.
        estimates: bag of the estimates, or the folder with one for each variant; None for topics of the truth's bag.
        algorithm: gives the estimates in place of a bag.
        estimates_out: folder of the bag, or of one for each variant, that gets the algorithm's estimates; None for none.
    """

    tasks: tuple[str, ...]
    camera: str = ""
    topics: Mapping[str, str] = field(default_factory=dict)
    estimates: Path | None = None
    algorithm: Algorithm | None = None
    estimates_out: Path | None = None


class JudgedBag:
    """A bag of truth with what is to be judged by it.

    Raises:
        BagReadError: a bag cannot be read at all.
        EvaluateError: a topic is missing, or has no message.
    """

    def __init__(self, bag: TruthBag, plan: Plan, notes: Notes) -> None:
        self._bag, self._plan, self._notes = bag, plan, notes
        self._opened = open_bag(bag.path, lambda line: notes.add(f"{bag.path}: {line}"))
        types = self._opened.types
        self._estimates_bag = self._open_estimates()
        self._truth = truth_topics(types, needed_layers(plan.tasks), plan.camera, str(bag.path))
        self._camera = camera_of(self._truth)
        self._directions = FlowDirections(plan.tasks)
        beside = (*layers_beside(plan.tasks), *self._directions.layers)
        self._layers = {**layers_present(types, self._camera, beside), **self._truth}
        algorithm = plan.algorithm
        self._images = image_topics(types, self._camera, algorithm.layers, str(bag.path)) if algorithm else {}
        self._infos = info_topics(types, {OWN_CAMERA: next(iter(self._truth.values())), **self._images}) if algorithm else {}
        self._estimates = {} if algorithm else self._estimate_topics()
        read = {*self._layers.values(), *self._images.values(), *self._infos.values()}
        if algorithm and POSE_INPUT in algorithm.inputs:
            self._poses = truth_topics(types, ["poses"], self._camera, str(bag.path))["poses"]
            read.add(self._poses)
        own = set(self._estimates.values()) if plan.estimates is None else set()
        self._read = tuple(topic for topic in read if topic.type_name not in POSES)
        info = next((topic.name for topic in info_topics(types, self._layers).values()), "")
        self.index = index_bag(self._opened, bag.path, read | own, Stream(self._camera, LABELS, "semantic").topic, info)
        judged = self._estimates_bag, self._estimates_path, set(self._estimates.values())
        self._estimate_index = self.index if plan.estimates is None else index_bag(*judged)
        self._class_ids = {name: number for number, name in self.index.class_names.items()}
        for layer, topic in self._truth.items():
            refuse_empty(self.index, topic, f"truth of {layer}")

    @property
    def topics(self) -> dict[str, str]:
        """Task -> topic of its estimates; empty where an algorithm gives them."""
        return {task: topic.name for task, topic in self._estimates.items()}

    @property
    def frames(self) -> int:
        """How many stamps there are to judge."""
        return len(self._stamps())

    def measure(self, progress: Callable[[], None]) -> Iterator[MeasuredFrame]:
        """Yield the measurements of all frames, in the order of their stamps, those of whole rooms at the end of each room.

        ``progress`` is called after each frame.

        Raises:
            EvaluateError: the truth cannot be read, or the algorithm raised something.
            BagWriteError: estimates cannot be written.
        """
        stamps, out, source = self._stamps(), self._plan.estimates_out, self._source()
        with EstimatesBag(self._bag.beside(out)) if out is not None else nullcontext() as written:
            for room, of_room in self._by_room(stamps):
                source.begin_room(room)
                yield from self._measure_room(room, of_room, source, written, progress)
        for line in self._directions.lines():
            self._notes.add(line)

    def _measure_room(
        self,
        room: int,
        stamps: list[int],
        source: EstimateSource,
        written: EstimatesBag | None,
        progress: Callable[[], None],
    ) -> Iterator[MeasuredFrame]:
        whole: dict[str, list[Reading]] = {task: [] for task in self._plan.tasks if TASKS[task].whole_rooms}
        for frame, stamp in enumerate(stamps):
            messages = self._opened.read_all([topic.name for topic in self._read], stamp)
            found = source.of_frame(stamp, {THIS: messages, **self._neighbours(stamps, frame)})
            truth = TruthFrame(self._layers, messages, f"{self._bag.path}, stamp {stamp} ns", self._class_ids)
            place, names = self._place(room, frame, stamp), set()
            for task in [task for task in self._plan.tasks if self._has_truth(task, stamp, messages) and not truth.says_nothing(task)]:
                estimate = self._usable(task, found.get(task), place)
                if task not in whole:
                    measurement = self._measured(task, truth, found, place) if estimate is not None else None
                    yield MeasuredFrame(key=self._key(room, frame, stamp), task=task, measurement=measurement)
                elif estimate is not None:
                    whole[task].append(estimate)
                name = TASK_STREAMS[task].name
                if written is not None and estimate is not None and name not in names:
                    names.add(name)
                    self._write(written, task, estimate, truth, stamp)
            progress()
        for task, readings in whole.items():
            poses = self.index.poses[self._topic(task).name]
            true = [poses[stamp] for stamp in stamps if stamp in poses]
            try:
                measurement = measure_room(task, true, [reading.value[0] for reading in readings])
            except EvaluationError as error:
                self._notes.add(f"{task}: {self._origin(task)}: {error}", self._place(room, 0, stamps[0]))
                measurement = None
            yield MeasuredFrame(key=self._key(room, 0, stamps[0]), task=task, measurement=measurement)

    def _neighbours(self, stamps: list[int], frame: int) -> Frames:
        """Return the images that the algorithm asks for of the frames beside one, of those that are as near as frames of the room are."""
        asked: dict[str, set[str]] = {}
        for name, topic in self._images.items():
            asked.setdefault(frame_of(name), set()).add(topic.name)
        nearest_ns = min((later - stamp for stamp, later in pairwise(stamps)), default=0)
        places = {which: frame + step for which, step in ((PREVIOUS, -1), (NEXT, 1)) if which in asked and 0 <= frame + step < len(stamps)}
        return {
            which: self._opened.read_all(asked[which], stamps[place])
            for which, place in places.items()
            if 2 * abs(stamps[place] - stamps[frame]) < 3 * nearest_ns
        }

    def _has_truth(self, task: str, stamp: int, messages: Mapping[str, CdrBytes]) -> bool:
        """Return whether a task has a truth at a stamp that could be read; what is damaged was told when it was read."""
        topic = self._topic(task)
        return stamp in self.index.stamps[topic.name] if topic.type_name in POSES else topic.name in messages

    def _usable(self, task: str, estimate: Reading | EstimateError | None, place: str) -> Reading | None:
        """Return the estimate; None, told of, where there is none that can be measured."""
        if isinstance(estimate, EstimateError):
            self._notes.add(f"{task}: {self._origin(task)}: {estimate}", place)
        if isinstance(estimate, Reading):
            return estimate
        self._notes.add_missing(task, place)
        return None

    def _measured(self, task: str, truth: TruthFrame, estimates: Estimates, place: str) -> Measurement | None:
        try:
            measurement = measure_frame(task, truth, estimates)
            self._directions.add(task, truth, estimates)
            return measurement
        except (EstimateError, EvaluationError) as error:
            self._notes.add(f"{task}: {self._origin(task)}: {error}", place)
            self._notes.add_missing(task, place)
            return None

    def _key(self, room: int, frame: int, stamp: int) -> FrameKey:
        found = self._bag.base or self.index.rooms[room]
        return FrameKey(
            bag=str(self._bag.path),
            variant=self._bag.variant,
            room=found.index,
            room_type=found.room_type,
            seed=found.seed,
            frame=frame,
            stamp_ns=stamp,
            factors=self._bag.factors,
        )

    def _topic(self, task: str) -> TypedTopic:
        return self._truth[TASK_STREAMS[task].name]

    def _write(self, written: EstimatesBag, task: str, estimate: Reading, truth: TruthFrame, stamp: int) -> None:
        reading = truth.layer(TASK_STREAMS[task].name)
        value = estimate.value[0] if TASKS[task].whole_rooms else estimate.value
        written.add(task, value, stamp, (reading.frame_id if reading else None) or "")

    def _stamps(self) -> list[int]:
        return sorted({stamp for task in self._plan.tasks for stamp in self.index.stamps[self._topic(task).name]})

    def _by_room(self, stamps: list[int]) -> Iterator[tuple[int, list[int]]]:
        rooms: dict[int, list[int]] = {}
        for stamp in stamps:
            rooms.setdefault(self.index.rooms.position(stamp), []).append(stamp)
        yield from sorted(rooms.items())

    @property
    def _estimates_path(self) -> Path:
        return self._bag.path if self._plan.estimates is None else self._bag.beside(self._plan.estimates)

    def _open_estimates(self) -> IndexedBag:
        return self._opened if self._plan.estimates is None else open_bag(self._estimates_path)

    def _estimate_topics(self) -> dict[str, TypedTopic]:
        same, where = self._plan.estimates is None, str(self._estimates_path)
        return {
            task: estimate_topic(
                self._estimates_bag.types, task, self._plan.topics.get(task, ""), self._topic(task), self._camera, where, same_bag=same
            )
            for task in self._plan.tasks
        }

    def _source(self) -> EstimateSource:
        if self._plan.algorithm is not None:
            poses = self.index.poses[self._poses.name] if POSE_INPUT in self._plan.algorithm.inputs else {}
            return AlgorithmEstimates(self._plan.algorithm, self._plan.tasks, self._images, self._infos, poses)
        for task, topic in self._estimates.items():
            self._check_stamps(task, topic)
        return BagEstimates(self._estimates_bag, self._estimates, self._estimate_index)

    def _check_stamps(self, task: str, topic: TypedTopic) -> None:
        refuse_empty(self._estimate_index, topic, f"estimates of {task}")
        match = match_stamps(self.index.stamps[self._topic(task).name], self._estimate_index.stamps[topic.name])
        for line in stamp_notes(task, topic.name, match):
            self._notes.add(line)
        unread = self._estimate_index.unstamped[topic.name]
        if unread:
            self._notes.add(f"{task}: {topic.name}: {unread} messages have no stamp that can be read")
        if not match.paired:
            advice = "copy the stamp of each image into its estimate"
            count = len(self._estimate_index.stamps[topic.name])
            raise EvaluateError(
                f"{self._estimates_path}: topic {topic.name}: expected stamps of the truth, got none among {count}; {advice}"
            )

    def _origin(self, task: str) -> str:
        return self._plan.algorithm.words if self._plan.algorithm else self._estimates[task].name

    def _place(self, room: int, frame: int, stamp: int) -> str:
        kind = "shard" if self._bag.variant is None else "variant"
        of_several = f"{kind} {self._bag.path.name}, " if self._bag.of_several else ""
        return f"{of_several}room {room}, frame {frame}, stamp {stamp} ns"


@dataclass(frozen=True, slots=True, kw_only=True)
class StampMatch:
    """The stamps of one task.

    Attributes:
        paired: in both, ascending.
        missing: of truth without an estimate, ascending.
        foreign: of estimates whose stamp no truth has, ascending.
        repeated: messages beyond the first of a stamp of the estimates.
    """

    paired: tuple[int, ...]
    missing: tuple[int, ...]
    foreign: tuple[int, ...]
    repeated: int


def match_stamps(truth: Mapping[int, int], estimates: Mapping[int, int]) -> StampMatch:
    """Compare two topics.

    Both are stamp -> how many messages have it.
    """
    return StampMatch(
        paired=tuple(sorted(truth.keys() & estimates.keys())),
        missing=tuple(sorted(truth.keys() - estimates.keys())),
        foreign=tuple(sorted(estimates.keys() - truth.keys())),
        repeated=sum(count - 1 for count in estimates.values()),
    )


def stamp_notes(task: str, topic: str, match: StampMatch) -> list[str]:
    """Return a line for each way in which the stamps do not fit."""
    lines = []
    if match.foreign:
        shown = (
            f"{len(match.foreign)} of {len(match.foreign) + len(match.paired)} stamps that no truth has, the first {match.foreign[0]} ns"
        )
        lines.append(f"{task}: {topic}: expected estimates at the stamps of the truth, got {shown}; copy the stamp of the image")
    if match.repeated:
        lines.append(f"{task}: {topic}: {match.repeated} messages repeat a stamp; the first of each stamp counts")
    return lines
