"""What the writer of a format does, and what it is told of its source.

Frames come in *sequences*: those of one room by one camera, in the order of their stamps.  :mod:`scene_synth_ros.convert.pipeline` calls

    begin(out, source)
    for each sequence: begin_sequence(sequence) -> state, then for each frame encode(frame, number, state) -> item and take(item, state),
                       end_sequence(state)
    finish() -> notes

``encode`` runs in several threads and in any order: it decodes pixels and writes the frame's own files.  Everything else runs in one
thread, ``take`` in the order of the frames.  What an encoder needs of its sequence is made by ``begin_sequence``, which may run while
frames of the sequence before are still encoded.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from scene_synth_ros.dataset import Camera, Dataset, Frame


class Role(NamedTuple):
    """What a layer is for in a format.

    Attributes:
        name: of the role, for the writer.
        layers: those that can play it, the usual one first.
        required: whether the format is nothing without it.
    """

    name: str
    layers: tuple[str, ...]
    required: bool = True


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


class Writer(ABC):
    """Writes one format; made anew for each conversion."""

    @abstractmethod
    def begin(self, out: Path, source: Source) -> None:
        """Take the folder, which is new and empty, and the source.

        Raises:
            ConvertError: the source has what the format cannot carry.
        """

    def begin_sequence(self, sequence: Sequence) -> Any:
        """Return the state of a sequence; None where a format knows no sequences."""
        del sequence
        return None

    @abstractmethod
    def encode(self, frame: Frame, number: int, state: Any) -> Any:
        """Return what ``take`` wants of a frame, the one in place ``number``, from 0, of its sequence; called in several threads."""

    @abstractmethod
    def take(self, item: Any, state: Any) -> None:
        """Take the next frame, as ``encode`` has it."""

    def end_sequence(self, state: Any) -> None:
        """Write what belongs to a whole sequence."""
        del state

    @abstractmethod
    def finish(self) -> tuple[str, ...]:
        """Write what belongs to the whole; return lines for people, as what the format could not hold of single pixels."""
