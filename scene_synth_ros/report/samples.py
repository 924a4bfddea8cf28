"""Frames of an evaluation as arrays: the room, the column of each factor and the metrics of each frame."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from evaluation.evaluation_file import FactorValue, FrameKey, FrameRow
from scene_synth_ros.report.design import Design

RoomKey = tuple[str, int, int]
"""Type, seed and index of a room: the same room in every variant of a sweep has the same key."""
Integers = NDArray[np.int64]
Array = NDArray[np.float64]


class Samples(NamedTuple):
    """The frames of one task of one evaluation.

    Attributes:
        rooms: (frames,), place of the room among all rooms of the report.
        columns: (frames, factors), column of each factor, -1 for none.
        variants: (frames,), number of the combination of factors and room.
        values: (frames, metrics), NaN where a frame has none.
        factors: of each frame, as the file has them.
    """

    rooms: Integers
    columns: Integers
    variants: Integers
    values: Array
    factors: Sequence[Mapping[str, FactorValue]]


def take_samples(
    frames: Sequence[FrameRow], metrics: Sequence[str], design: Design, rooms: dict[RoomKey, int], room_of: Callable[[FrameKey], RoomKey]
) -> Samples:
    """Return the frames of one task; rooms that are new get the next places in ``rooms``."""
    places = [rooms.setdefault(room_of(frame.key), len(rooms)) for frame in frames]
    columns = [[factor.column_of.get(frame.key.factors.get(factor.name), -1) for factor in design.factors] for frame in frames]
    variants: dict[tuple[Any, ...], int] = {}
    numbers = [
        variants.setdefault((place, *(frame.key.factors.get(factor.name) for factor in design.factors)), len(variants))
        for place, frame in zip(places, frames, strict=True)
    ]
    values = [[np.nan if (value := frame.metrics.get(name)) is None else value for name in metrics] for frame in frames]
    return Samples(
        rooms=np.array(places, np.int64),
        columns=np.array(columns, np.int64).reshape(len(frames), len(design.factors)),
        variants=np.array(numbers, np.int64),
        values=np.array(values, np.float64).reshape(len(frames), len(metrics)),
        factors=[frame.key.factors for frame in frames],
    )


def shown_frames(samples: Samples, design: Design, factor: int) -> NDArray[np.bool_]:
    """Return which frames the curve of a factor is made of, (frames,): in a one-at-a-time design, those with all others at their base."""
    shown = samples.columns[:, factor] >= 0
    if design.name == "one_at_a_time":
        for other, row in enumerate(design.factors):
            if other != factor and row.base is not None:
                shown &= samples.columns[:, other] == row.base
    return shown


def room_matrix(rooms: Integers, columns: Integers, values: Array, shape: tuple[int, int]) -> tuple[Array, Integers]:
    """Return the mean of the frames of each room and column, (rooms, columns), NaN for none, and how many frames each has."""
    known = np.isfinite(values)
    sums, counts = np.zeros(shape), np.zeros(shape, np.int64)
    np.add.at(sums, (rooms[known], columns[known]), values[known])
    np.add.at(counts, (rooms[known], columns[known]), 1)
    return np.divide(sums, counts, out=np.full(shape, np.nan), where=counts > 0), counts
