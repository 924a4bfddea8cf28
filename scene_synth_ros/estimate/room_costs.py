"""Measures rooms of a dataset as they will be made: in as many processes at once, each on its own processors."""

import resource
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

from mcap.reader import make_reader

from grammar.synthesize import SceneSynthesizer
from scene_description import SceneDescription, scene_to_json
from scene_synth_ros.mcap.file import COMPRESSORS
from scene_synth_ros.messages.canonical_cdr import canonical_cdr
from scene_synth_ros.offline.offline_bag import OfflineBag
from scene_synth_ros.offline.rules import rules_of, sample_room
from scene_synth_ros.offline.settings import OfflineSettings
from scene_synth_ros.synthesize.scene_messages import scene_to_msgs
from scene_synth_ros.workers.pool import WorkerPool
from scene_synth_ros.workers.temporary_folder import temporary_folder

_WARM_FRAMES = 2


class Measured(NamedTuple):
    """What a sample of rooms says.

    Attributes:
        rooms: what each costs, by index.
        start_s: what a process took before its first room, the longest: modules, compiled kernels, and a room that is not counted.
        memory_bytes: the most that a process had.
    """

    rooms: "tuple[RoomCost, ...]"
    start_s: float
    memory_bytes: int


class _Sample(NamedTuple):
    """A room's cost, and what the process that made it took to start and had of memory."""

    cost: "RoomCost"
    start_s: float
    memory_bytes: int


def measure_rooms(
    settings: OfflineSettings,
    indices: Sequence[int],
    most_frames: int,
    workers: int,
    threads: int = 1,
    tell: "Callable[[RoomCost], object]" = lambda _: None,
) -> Measured:
    """Make some rooms of a dataset and measure them.

    ``most_frames``: of a room that are rendered.

    Raises:
        WorkerError: a room cannot be made, or a worker was killed.
    """
    samples: list[_Sample] = []
    setup = settings, most_frames, time.time()
    with WorkerPool(prepare_measuring, setup, min(workers, len(indices)), threads) as pool:
        for sample in pool.results(indices):
            samples.append(sample)
            tell(sample.cost)
    return Measured(
        rooms=tuple(sorted((sample.cost for sample in samples), key=lambda cost: cost.index)),
        start_s=max(sample.start_s for sample in samples),
        memory_bytes=max(sample.memory_bytes for sample in samples),
    )


def prepare_measuring(setup: tuple[OfflineSettings, int, float]) -> Callable[[int, object], _Sample]:
    """Return what measures a room by its index, in a worker process.

    Args:
        setup: parameters of the dataset, frames of a room that are rendered, and when the process was asked for, by the time of day (s).
    """
    settings, most_frames, asked_s = setup
    rules = rules_of(settings)
    start_s: list[float] = []

    def measure(index: int, _: object) -> _Sample:
        if not start_s:  # kernels are loaded, or compiled, with the first room of a process
            cost_of_room(settings, rules, index, _WARM_FRAMES)
            start_s.append(time.time() - asked_s)
        cost = cost_of_room(settings, rules, index, most_frames)
        return _Sample(cost, start_s[0], resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024)

    return measure


class Clocks(NamedTuple):
    """Seconds since some moment: of the processor, all threads of the process together, and by the wall clock."""

    processor_s: float
    wall_s: float

    def since(self, before: "Clocks") -> "Clocks":
        """Return how much has passed since another reading."""
        return Clocks(self.processor_s - before.processor_s, self.wall_s - before.wall_s)


def read_clocks() -> Clocks:
    """Read both clocks."""
    return Clocks(time.process_time(), time.perf_counter())


@dataclass(frozen=True, slots=True, kw_only=True)
class RoomCost:
    """What one room costs; times in seconds, ``processor_s`` counts all threads.

    Attributes:
        index: of the room in its dataset.
        room_type: of the room.
        frames: that were rendered, at least 1.
        synthesis: what the description took.
        total: what all of it took, to the closed bag, description included.
        frame: what one more frame takes; nothing where one frame was rendered.
        bytes_frames: of the bag, its frames.
        bytes_room: what is written once a room.
        bytes_bag: what is written once a bag: definitions, indexes, records, metadata.
    """

    index: int
    room_type: str
    frames: int
    synthesis: Clocks
    total: Clocks
    frame: Clocks
    bytes_frames: int
    bytes_room: int
    bytes_bag: int

    def of_frames(self, frames: int) -> Clocks:
        """Return what the room takes with so many frames; exact for as many as were rendered."""
        more = frames - self.frames
        return Clocks(*(total + more * frame for total, frame in zip(self.total, self.frame, strict=True)))

    def bytes_of_frames(self, frames: int) -> float:
        """Return how many bytes the room has with so many frames, beside those of its bag."""
        return self.bytes_room + self.bytes_frames * frames / self.frames

    def to_mapping(self) -> dict[str, Any]:
        """Return the figures as JSON has them."""
        clocks: dict[str, Clocks] = {"synthesis": self.synthesis, "total": self.total, "frame": self.frame}
        return asdict(self) | {name: value._asdict() for name, value in clocks.items()}

    @classmethod
    def from_mapping(cls, values: Mapping[str, Any]) -> "RoomCost":
        """Return what :meth:`to_mapping` has written."""
        fields: dict[str, Any] = {name: Clocks(**value) if isinstance(value, Mapping) else value for name, value in values.items()}
        return cls(**fields)


def cost_of_room(settings: OfflineSettings, rules: SceneSynthesizer, index: int, most_frames: int) -> RoomCost:
    """Make a room of a dataset in a temporary folder, measure it, and remove it.

    Where it has more frames than are asked for, neighbours from the middle of its path are rendered: what one frame takes is the time
    between the first and the last of them, so at least 2 are.

    Raises:
        SceneSynthError: the room cannot be made, or there is no place for it.
    """
    began = read_clocks()
    scene = sample_room(rules, settings, index)
    synthesis = read_clocks().since(began)
    part = _middle(scene, max(2, most_frames))
    marks: list[Clocks] = []
    with temporary_folder() as folder:
        bag = folder / "room"
        with OfflineBag(bag, settings, rules.floor_map, machine=False) as writer:
            writer.add_room(part, rendered=lambda: marks.append(read_clocks()))
        total = read_clocks().since(began)
        size, chunks = _sizes(bag)
    once = min(chunks, _bytes_once(settings, rules, part))
    between = marks[-1].since(marks[0])
    steps = max(1, len(marks) - 1)
    return RoomCost(
        index=index,
        room_type=scene.category,
        frames=len(part.camera_path),
        synthesis=synthesis,
        total=total,
        frame=Clocks(between.processor_s / steps, between.wall_s / steps),
        bytes_frames=chunks - once,
        bytes_room=once,
        bytes_bag=size - chunks,
    )


def _middle(scene: SceneDescription, frames: int) -> SceneDescription:
    """Return a room with neighbouring frames from the middle of its path."""
    first = max(0, len(scene.camera_path) - frames) // 2
    return replace(scene, camera_path=scene.camera_path[first : first + frames], motion=None)


def _sizes(bag: Path) -> tuple[int, int]:
    """Return the bytes of a bag's files, and those of its chunks with their indexes among them."""
    size = chunks = 0
    for path in bag.iterdir():
        size += path.stat().st_size
        if path.suffix == ".mcap":
            with path.open("rb") as file:
                summary = make_reader(file).get_summary()
            chunks += sum(chunk.chunk_length + chunk.message_index_length for chunk in summary.chunk_indexes) if summary else 0
    return size, chunks


def _bytes_once(settings: OfflineSettings, rules: SceneSynthesizer, scene: SceneDescription) -> int:
    """Return about how many bytes of a room's bag are its messages without an image, compressed as the recorder does."""
    recorder = settings.recorder[""]
    messages = scene_to_msgs(scene, scene_to_json(scene), rules.floor_map(scene), settings.run.world_frame).values()
    data = b"".join(bytes(canonical_cdr(message)) for message in messages)
    return len(COMPRESSORS[recorder.compression](recorder.compression_level)(memoryview(data)))
