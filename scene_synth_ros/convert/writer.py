"""What the writer of a format does, what it is told of its source, and what runs it.

Frames come in *sequences*: those of one room by one camera, in the order of their stamps.  :func:`convert` calls

    begin(out, source)
    for each sequence: begin_sequence(sequence) -> state, then for each frame encode(frame, number, state) -> item and take(item, state),
                       end_sequence(state)
    finish() -> notes

``encode`` runs in several threads and in any order: it decodes pixels and writes the frame's own files.  Everything else runs in one
thread, ``take`` in the order of the frames.  What an encoder needs of its sequence is made by ``begin_sequence``, which may run while
frames of the sequence before are still encoded.
"""

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from scene_description import SceneSynthError
from scene_synth_ros.convert.files import beyond_note
from scene_synth_ros.dataset import Camera, Dataset, Frame


class ConvertError(SceneSynthError):
    """A source that lacks what a format needs, or has what a format cannot carry; one line: what, where, got, expected, what to do."""


class Role(NamedTuple):
    """What a layer is for in a format.

    Attributes:
        name: of the role, for the writer.
        layers: those that can play it, the usual one first.
        required: whether the format is nothing without it.
        first_only: whether it is taken of a room's first camera alone, so that the others need not have it.
    """

    name: str
    layers: tuple[str, ...]
    required: bool = True
    first_only: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Sequence:
    """The frames of a room by one camera that are converted.

    Attributes:
        folder: ``room_0003``, the same for all cameras of the room; ``room_0003_2`` where a second room has that index.
        name: the folder, with the camera where several are converted: ``room_0003_left``; unique.
        room: index of the room.
        camera: name of the camera, with its namespace.
        place: of the camera among those of the room, from 0.
        cameras: how many the room has.
        frames: indices in the camera's dataset, by stamp.
    """

    folder: str
    name: str
    room: int
    camera: str
    place: int
    cameras: int
    frames: tuple[int, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """What is converted.

    Attributes:
        data: camera -> its frames.
        name: of the source as the user gave it, for messages.
        sequences: by room, then camera.
        roles: role -> layer that plays it; roles that nothing plays are left out.
        layers: layers beside the roles that were asked for, for formats that carry any.
        split: that was asked for; None for none.
        catalog: folder of the user's models; None for none.
        notes: lines for people about what is not whole, or left out.
    """

    data: Mapping[str, Dataset]
    name: str
    sequences: tuple[Sequence, ...]
    roles: Mapping[str, str]
    layers: tuple[str, ...] = ()
    split: str | None = None
    catalog: Path | None = None
    notes: tuple[str, ...] = ()
    frames: int = field(init=False)

    def __post_init__(self) -> None:
        """Count the frames."""
        object.__setattr__(self, "frames", sum(len(sequence.frames) for sequence in self.sequences))

    def camera(self, sequence: Sequence) -> Camera:
        """Return the camera of a sequence, as its first frame has it."""
        return self.frame(sequence, 0).camera

    def frame(self, sequence: Sequence, number: int) -> Frame:
        """Return the frame in place ``number``, from 0, of a sequence."""
        return self.data[sequence.camera].frame(sequence.frames[number])


MAX_NOTES = 100


class Writer(ABC):
    """Writes one format; made anew for each conversion.

    Attributes:
        name: of the format, as of ``--to``.
        out: the folder, new and empty.
        source: what is converted.
        notes: lines for people, each once: what the format has no place for.
        steps_a_metre: of its depth, where it stores that in whole steps.
        beyond: pixels so far whose depth is larger than any that it stores.
    """

    out: Path
    source: Source
    steps_a_metre = 1.0

    def __init__(self, name: str = "") -> None:
        self.name = name
        self.notes: dict[str, None] = {}
        self.beyond = 0

    def tell(self, line: str) -> None:
        """Keep a line for people, once; of very many the first."""
        if len(self.notes) < MAX_NOTES:
            self.notes[line] = None

    def begin(self, out: Path, source: Source) -> None:
        """Take the folder and the source.

        Raises:
            ConvertError: the source has what the format cannot carry, or a library is missing.
        """
        self.out, self.source = out, source

    def begin_sequence(self, sequence: Sequence) -> Any:
        """Return the state of a sequence, by itself the sequence.

        Raises:
            ConvertError: it has what the format cannot carry.
        """
        return sequence

    @abstractmethod
    def encode(self, frame: Frame, number: int, state: Any) -> Any:
        """Return what ``take`` wants of a frame, the one in place ``number``, from 0, of its sequence; called in several threads."""

    @abstractmethod
    def take(self, item: Any, state: Any) -> None:
        """Take the next frame, as ``encode`` has it."""

    def end_sequence(self, state: Any) -> None:
        """Write what belongs to a whole sequence."""
        del state

    def finish(self) -> tuple[str, ...]:
        """Write what belongs to the whole; return lines for people, as what the format could not hold of single pixels."""
        return (*self.notes, *beyond_note(self.name, self.beyond, self.steps_a_metre))


_AHEAD = 2
"""Frames for each thread that are encoded, or wait to be, before the oldest is taken: bounds memory."""


class _Step(NamedTuple):
    """A frame on its way; ``last``: the sequence ends with it."""

    encoded: Future[Any]
    state: Any
    last: bool


def convert(
    out: Path, source: Source, writer: Writer, *, threads: int = 2, progress: Callable[[int], object] = lambda _: None
) -> tuple[str, ...]:
    """Write a source into a folder; return lines for people, the source's and the writer's.

    ``threads``: that decode and encode frames; the output is the same with any number.
    ``progress``: called after every frame with how many are done.

    Raises:
        SceneSynthError: the source has what the format cannot carry, or a frame cannot be read.
        OSError: a file cannot be written.
    """
    writer.begin(out, source)
    done = 0
    pool = ThreadPoolExecutor(threads, "encode")
    try:
        for step in _ahead(_steps(source, writer, pool), _AHEAD * threads):
            writer.take(step.encoded.result(), step.state)
            if step.last:
                writer.end_sequence(step.state)
            done += 1
            progress(done)
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
    late = [note for frames in source.data.values() for note in frames.notes if note not in source.notes]
    return (*source.notes, *dict.fromkeys(late), *writer.finish())


def _steps(source: Source, writer: Writer, pool: ThreadPoolExecutor) -> Iterator[_Step]:
    """Yield every frame, handed over to the pool."""

    def encode(sequence: Sequence, number: int, state: Any) -> Any:
        return writer.encode(source.frame(sequence, number), number, state)

    for sequence in source.sequences:
        state = writer.begin_sequence(sequence)
        for number in range(len(sequence.frames)):
            yield _Step(pool.submit(encode, sequence, number, state), state, number == len(sequence.frames) - 1)


def _ahead(steps: Iterator[_Step], count: int) -> Iterator[_Step]:
    """Yield steps in their order, with up to ``count`` of them begun."""
    begun: deque[_Step] = deque()
    for step in steps:
        begun.append(step)
        if len(begun) >= count:
            yield begun.popleft()
    while begun:
        yield begun.popleft()
