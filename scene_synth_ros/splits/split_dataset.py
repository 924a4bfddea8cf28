"""Makes the splits of a dataset: rooms by their seeds, then frames by filters, then views that are not nearly equal to one before."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from scene_synth_ros.splits.assignment import Ranges, RoomKey, Shares, SplitError, assign
from scene_synth_ros.splits.filters import Asked, needs_of, refused_by
from scene_synth_ros.splits.frame_facts import FrameFacts, Wanted, facts_of
from scene_synth_ros.splits.near_views import KeptViews, Nearness
from scene_synth_ros.splits.split_file import LeftOut, RoomFrames

if TYPE_CHECKING:
    from scene_synth_ros.dataset import Dataset, RoomInfo

_AHEAD = 8
"""Frames that are read, or wait to be, before the oldest is judged."""


@dataclass(frozen=True, slots=True)
class Splits:
    """What was chosen.

    Attributes:
        rooms: split -> its rooms, in the order of the dataset.
        left_out: filter -> what it left out.
        types: split -> room type -> rooms with a frame left.
        frames: split -> how many.
        seen: category -> frames that see it, where filters asked for objects.
        classes: split -> class -> pixels of each of its frames, where a balance was asked for.
    """

    rooms: dict[str, list[RoomFrames]]
    left_out: dict[str, LeftOut]
    types: dict[str, Counter[str]]
    frames: dict[str, int]
    seen: Counter[str]
    classes: dict[str, list[Mapping[str, int]]]


@dataclass(slots=True)
class _Refused:
    """Counts of one filter."""

    rooms: int = 0
    frames: int = 0
    alone: int = 0

    def whole_room(self, frames: int) -> None:
        """Count a room of which no frame stays."""
        self.rooms += 1
        self.frames += frames
        self.alone += frames


@dataclass(slots=True)
class _Room:
    """A room on its way: where its frames are in the dataset, and the numbers of those that stay."""

    info: RoomInfo
    frames: range
    split: str
    copy: int
    views: KeptViews | None
    kept: list[int] = field(default_factory=list)
    classes: list[Mapping[str, int]] = field(default_factory=list)


def layers_of(
    asked: Asked, near: Nearness | None, recorded: tuple[str, ...], *, classes: bool = False
) -> tuple[tuple[str, ...], set[Wanted]]:
    """Return the layers that must be opened, and what is read of each frame; near views are told by the pictures that there are.

    ``classes``: whether the classes of its pixels are.
    """
    wanted: set[Wanted] = {*needs_of(asked)}
    if near is not None:
        wanted.add("pose")
        wanted |= {what for what, layer in (("thumbnail", "color"), ("ids", "instance")) if layer in recorded}  # type: ignore[misc]
    layers = []
    if wanted & {"color", "thumbnail"}:
        layers.append("color")
    if wanted & {"instance", "ids"}:
        layers.append("instance")
    if classes:
        layers.append("semantic")
        wanted.add("classes")
    return tuple(layers), wanted


def split_dataset(
    data: Dataset,
    rule: Shares | Ranges,
    asked: Asked,
    near: Nearness | None,
    wanted: set[Wanted],
    *,
    threads: int = 2,
    progress: Callable[[], object] = lambda: None,
) -> Splits:
    """Return the splits of a dataset.

    Pixels are read only where ``wanted`` asks for something, and then once.

    ``near``: which views are nearly equal; None: none is left out.
    ``wanted``: of a frame, as :func:`layers_of` has it.
    ``threads``: that read frames; the splits are the same with any number.

    Raises:
        SplitError: what a filter needs was not recorded, or no room has a type that is asked for.
        DatasetError: a frame cannot be read.
    """
    refused: dict[str, _Refused] = {}
    rooms = _placed_rooms(data, rule, asked, near, refused)
    categories_seen: Counter[str] = Counter()
    if wanted:
        for room, facts in _read(data, rooms, wanted, threads):
            categories_seen.update({item.category for item in facts.objects or ()})
            _judge(room, facts, asked, refused)
            progress()
    else:
        for room in rooms:
            room.kept.extend(range(len(room.frames)))
    left_out = {name: LeftOut(rooms=it.rooms, frames=it.frames, alone=it.alone) for name, it in refused.items()}
    return _chosen(rooms, list(rule.of), left_out, categories_seen)


def _placed_rooms(data: Dataset, rule: Shares | Ranges, asked: Asked, near: Nearness | None, refused: dict[str, _Refused]) -> list[_Room]:
    """Return the rooms that go into a split, in their order; the others are counted in ``refused``.

    Raises:
        SplitError: no room has a type that is asked for.
    """
    types = {info.room_type for info in data.rooms}
    if unknown := [name for name in asked.room_types if name not in types]:
        raise SplitError(f"--room-types {','.join(unknown)}: expected types that the source has: {', '.join(sorted(types))}")
    keys = [RoomKey(info.room_type, info.seed, info.index) for info in data.rooms]
    split_of = assign(keys, rule)
    rooms, copies, first = [], Counter[tuple[int, str]](), 0
    for info, key in zip(data.rooms, keys, strict=True):
        copy, split = copies[info.index, info.scene_id], split_of[key]
        copies[info.index, info.scene_id] += 1
        frames = range(first, first + info.frames)
        first = frames.stop
        if split is None:
            refused.setdefault("ranges", _Refused()).whole_room(info.frames)
        elif asked.room_types and info.room_type not in asked.room_types:
            refused.setdefault("room_types", _Refused()).whole_room(info.frames)
        else:
            rooms.append(_Room(info, frames, split, copy, KeptViews(near) if near is not None else None))
    return rooms


def _judge(room: _Room, facts: FrameFacts, asked: Asked, refused: dict[str, _Refused]) -> None:
    names = refused_by(facts, asked)
    if not names and room.views is not None and room.views.equal_to(facts) is not None:
        names = ["near"]
    for name in names:
        count = refused.setdefault(name, _Refused())
        count.frames += 1
        count.alone += len(names) == 1
    if not names:
        room.kept.append(facts.number)
        room.classes += [facts.classes] if facts.classes is not None else []


def _read(data: Dataset, rooms: list[_Room], wanted: set[Wanted], threads: int) -> Iterator[tuple[_Room, FrameFacts]]:
    """Yield what is wanted of each frame, in order; frames are read in threads, some ahead."""
    begun: deque[tuple[_Room, Future[FrameFacts]]] = deque()
    with ThreadPoolExecutor(threads, "facts") as pool:
        for room in rooms:
            for index in room.frames:
                begun.append((room, pool.submit(lambda at: facts_of(data.frame(at), wanted), index)))
                if len(begun) >= _AHEAD:
                    room_of, facts = begun.popleft()
                    yield room_of, facts.result()
        for room_of, facts in begun:
            yield room_of, facts.result()


def _chosen(rooms: list[_Room], names: list[str], left_out: dict[str, LeftOut], seen: Counter[str]) -> Splits:
    splits = Splits({name: [] for name in names}, left_out, {name: Counter() for name in names}, dict.fromkeys(names, 0), seen, {})
    for room in rooms:
        if room.kept:
            whole = len(room.kept) == room.info.frames
            kept = None if whole else tuple(room.kept)
            row = RoomFrames(room=room.info.index, scene=room.info.scene_id, copy=room.copy, frames=kept, count=len(room.kept))
            splits.rooms[room.split].append(row)
            splits.types[room.split][room.info.room_type] += 1
            splits.frames[room.split] += len(room.kept)
            splits.classes.setdefault(room.split, []).extend(room.classes)
    return splits
