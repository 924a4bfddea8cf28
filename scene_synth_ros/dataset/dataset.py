"""A dataset: the frames of a bag, of many bags, or of shards, each found and decoded when it is asked for."""

import warnings
from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from threading import RLock
from typing import Any, Literal, overload

import numpy as np
from numpy.typing import NDArray

from scene_description import error_line
from scene_synth_ros.bags.indexed_bag import CACHE_SIZE
from scene_synth_ros.dataset.errors import DatasetError
from scene_synth_ros.dataset.folders import Folder, open_folder
from scene_synth_ros.dataset.frame import Frame
from scene_synth_ros.dataset.part import Layers, Part
from scene_synth_ros.dataset.places import BagPlace, find_bags, read_split
from scene_synth_ros.dataset.rooms import RoomInfo
from scene_synth_ros.mcap.message_places import BlockCache

OPEN_BAGS = 512
"""Bags whose index a process keeps."""


def open_dataset(
    place: str | Path,
    layers: Layers = "usual",
    split: str | None = None,
    camera: str | None = None,
    transform: Callable[[Frame], Any] | None = None,
    damaged: Literal["refuse", "skip"] = "refuse",
) -> "Dataset":
    """Open the frames of a bag, a dataset, a folder of bags or one MCAP file.

    >>> data = open_dataset("rooms", layers=("color", "depth"))  # doctest: +SKIP
    >>> data[17]["depth"].shape  # doctest: +SKIP
    (480, 640)

    Args:
        place: path or URL.
        layers: a frame counts where it has all of these; None for all layers of the camera in the first bag, ``usual`` for those of
            colour, depth and classes that it has, or all where it has none of them.
        split: name of a split in ``splits.json`` of the dataset; None for all frames.
        camera: its name, alone or with its namespace; None for the first that has all layers.
        transform: what an item of the dataset is made with of its frame; ``dict`` decodes its layers.  None: items are frames.
        damaged: ``skip`` makes None of a frame that cannot be read, warns, and counts it; iterating leaves it out, and so does a
            DataLoader with ``collate_fn=without_damaged(...)``.

    Raises:
        DatasetError: there is nothing to read, no such layer, camera or split.
    """
    folder = open_folder(place)
    if isinstance(layers, str) and layers != "usual":
        raise DatasetError(f"{folder}: layers: expected names of layers, got the single text {layers!r}; write it as ({layers!r},)")
    if damaged not in ("refuse", "skip"):
        raise DatasetError(f"{folder}: damaged: expected refuse or skip, got {damaged!r:.100}")
    if layers is not None and not layers:
        raise DatasetError(f"{folder}: layers: expected a layer at least, got none")
    notes: list[str] = []
    try:
        bags = find_bags(folder, notes.append)
        data = Dataset(folder, bags, layers, camera, transform, notes, skip_damaged=damaged == "skip")
        return data if split is None else data.frames_at(read_split(folder, split, data.rooms))
    except OSError as error:
        raise DatasetError(error_line(error)) from None


class Dataset(Sequence[Any]):
    """Frames in the order of bags and stamps.  What :func:`open_dataset` returns; slices are datasets too.

    It pickles, as do its frames; processes share nothing.  Threads: any may read.  Memory: ``CACHE_SIZE`` bytes of decompressed chunks,
    the index of ``OPEN_BAGS`` bags, some 200 bytes a room, 8 bytes a frame of a slice or split.

    Attributes:
        source: where it is.
        layers: that every frame has.
        camera: whose frames they are, with its namespace.
        cameras: all cameras of the first bag.
        rooms: in the order of their frames.
        notes: what is not whole, lines for people.
        damaged: indices of the frames that this process has skipped, in the dataset of all frames.
    """

    def __init__(
        self,
        folder: Folder,
        bags: Sequence[BagPlace],
        layers: Layers,
        camera: str | None,
        transform: Callable[[Frame], Any] | None,
        notes: list[str],
        *,
        skip_damaged: bool = False,
    ) -> None:
        self._skip, self.damaged = skip_damaged, set[int]()
        self._bags, self._transform, self.notes = tuple(bags), transform, notes
        self._cache, self._open, self._lock = BlockCache(CACHE_SIZE), OrderedDict[int, Part](), RLock()
        self.source = str(folder)
        self._asked: tuple[Layers, str | None] = layers if layers is None or isinstance(layers, str) else tuple(layers), camera
        first = self.part(0)
        self.layers, self.camera, self.cameras = first.layers, first.camera, tuple(first.cameras)
        self._asked = first.layers, camera
        of_bags = [bag.rooms if bag.rooms is not None else self.part(number).read_rooms() for number, bag in enumerate(self._bags)]
        self.rooms: tuple[RoomInfo, ...] = tuple(room for rooms in of_bags for room in rooms)
        self._room_starts = _starts([room.frames for room in self.rooms])
        self._bag_starts = _starts([sum(room.frames for room in rooms) for rooms in of_bags])
        self._chosen: NDArray[np.int64] | None = None

    def __len__(self) -> int:
        return int(self._room_starts[-1]) if self._chosen is None else len(self._chosen)

    @overload
    def __getitem__(self, index: int) -> Any: ...
    @overload
    def __getitem__(self, index: slice) -> "Dataset": ...
    def __getitem__(self, index: int | slice) -> Any:
        """Return a frame, or what ``transform`` makes of it; None of a damaged one that is skipped; of a slice the dataset of its frames.

        Raises:
            IndexError: there are fewer frames.
            DatasetError: the bag of the frame cannot be read, or of a dataset that skips no damaged frames, what ``transform`` reads.
        """
        if isinstance(index, slice):
            return self.frames_at(np.arange(len(self))[index])
        try:
            frame = self.frame(int(index))
            if self._skip:
                dict(frame)  # which keeps what it decodes
            return frame if self._transform is None else self._transform(frame)
        except DatasetError as error:
            if not self._skip:
                raise
            self.damaged.add(self._whole_index(int(index)))
            warnings.warn(f"skipped a damaged frame: {error}", stacklevel=2)
            return None

    def __iter__(self) -> Iterator[Any]:
        items = (self[index] for index in range(len(self)))
        return (item for item in items if item is not None) if self._skip else items

    def _whole_index(self, index: int) -> int:
        """Return the index of a frame in the dataset of all frames."""
        return index % len(self) if self._chosen is None else int(self._chosen[index])

    def frame(self, index: int) -> Frame:
        """Return a frame as it is, whatever ``transform``.

        Raises:
            IndexError: there are fewer frames.
            DatasetError: its bag cannot be read.
        """
        if not -len(self) <= index < len(self):
            raise IndexError(f"{self.source}: expected the index of one of {len(self)} frames, got {index}")
        index %= len(self)
        whole = self._whole_index(index)
        room = int(np.searchsorted(self._room_starts, whole, side="right")) - 1
        bag = int(np.searchsorted(self._bag_starts, whole, side="right")) - 1
        stamp = int(self.part(bag).stamps[whole - self._bag_starts[bag]])
        return Frame(self, bag, stamp, index, whole - int(self._room_starts[room]), self.rooms[room])

    def frames_at(self, indices: Sequence[int] | NDArray[np.int64]) -> "Dataset":
        """Return the dataset of some frames, in their order; it reads through this one's bags."""
        chosen = np.asarray(indices, np.int64)
        view = object.__new__(type(self))
        view.__dict__.update(self.__dict__)
        view._chosen = chosen if self._chosen is None else self._chosen[chosen]
        return view

    def shuffled(self, seed: int, bags: int = 64) -> "Dataset":
        """Return the dataset with its frames in a random order that goes from bag to bag, so that few are open at a time.

        Args:
            seed: the same seed gives the same order.
            bags: so many, drawn at random, are mixed with each other, then the next.
        """
        random = np.random.default_rng(seed)
        whole = np.arange(len(self)) if self._chosen is None else self._chosen
        places = np.searchsorted(self._bag_starts, whole, side="right") - 1
        groups = random.permutation(len(self._bags)) // bags
        order = np.lexsort((random.random(len(whole)), groups[places]))
        return self.frames_at(order)

    def frames_of(self, room: int) -> Sequence[int]:
        """Return the indices of the frames of a room, by its number in the run.

        Raises:
            DatasetError: there is no such room.
        """
        places = [place for place, known in enumerate(self.rooms) if known.index == room]
        if not places:
            raise DatasetError(f"{self.source}: expected one of {len(self.rooms)} rooms, got room {room}")
        spans = [(int(self._room_starts[place]), int(self._room_starts[place + 1])) for place in places]
        if self._chosen is None:
            return range(*spans[0]) if len(spans) == 1 else [index for span in spans for index in range(*span)]
        inside = [(self._chosen >= start) & (self._chosen < end) for start, end in spans]
        return [int(index) for index in np.flatnonzero(np.any(inside, axis=0))]

    def part(self, number: int) -> Part:
        """Return one of its bags, opened when it is asked for.

        Raises:
            DatasetError: it cannot be read, or has other frames than its shard says.
        """
        with self._lock:
            if number not in self._open:
                self._open[number] = self._opened(self._bags[number])
                while len(self._open) > OPEN_BAGS:
                    self._open.popitem(last=False)
            self._open.move_to_end(number)
            return self._open[number]

    def _opened(self, bag: BagPlace) -> Part:
        layers, camera = self._asked
        try:
            part = Part(bag.name, bag.files, layers, camera, self._cache, self._note)
        except OSError as error:
            raise DatasetError(error_line(error)) from None
        told = sum(room.frames for room in bag.rooms) if bag.rooms is not None else len(part.stamps)
        if told != len(part.stamps):
            raise DatasetError(f"{bag.name}: expected {told} frames with {', '.join(part.layers)}, got {len(part.stamps)}; make it again")
        return part

    def _note(self, line: str) -> None:
        if line not in self.notes and len(self.notes) < 100:
            self.notes.append(line)

    def __getstate__(self) -> dict[str, Any]:
        """Return what is pickled: no open bag, nothing that is cached."""
        return {key: value for key, value in self.__dict__.items() if key not in ("_lock", "_open")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Take what was pickled."""
        self.__dict__.update(state, _lock=RLock(), _open=OrderedDict())

    def __repr__(self) -> str:
        return f"<{len(self)} frames of {len(self.rooms)} rooms, {', '.join(self.layers)} of {self.camera}, in {self.source}>"


def without_damaged(collate: Callable[[list[Any]], Any]) -> Callable[[list[Any]], Any]:
    """Return a ``collate_fn`` of PyTorch's DataLoader that leaves out damaged frames, None, of ``open_dataset(..., damaged="skip")``.

    A batch of nothing else is None.  ``collate`` is ``torch.utils.data.default_collate``, say.
    """
    return partial(_collate_whole, collate)


def _collate_whole(collate: Callable[[list[Any]], Any], items: list[Any]) -> Any:
    whole = [item for item in items if item is not None]
    return collate(whole) if whole else None


def _starts(counts: Sequence[int]) -> NDArray[np.int64]:
    """Return the sums of all counts before each, and of all."""
    return np.concatenate([[0], np.cumsum(np.array(counts, np.int64))]).astype(np.int64)
