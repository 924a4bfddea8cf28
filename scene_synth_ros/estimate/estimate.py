"""The estimate of a dataset: figures with their intervals, as JSON and as text."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.special import stdtrit

from scene_synth_ros.estimate.room_costs import Measured

SCHEMA = "scene_synth_estimate/1"
_UNITS = ((1e12, "TB"), (1e9, "GB"), (1e6, "MB"), (1e3, "kB"))
_SPANS = ((172_800.0, 86_400.0, "days"), (3600.0, 3600.0, "h"), (60.0, 60.0, "min"))


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """What a dataset of ``rooms`` rooms with ``frames`` frames costs.

    Attributes:
        rooms: of the dataset.
        frames: of each room.
        rooms_per_shard: of the dataset.
        workers: of each machine.
        machines: further machines like this one that shall be told of; 1: none.
        measured: the rooms of the sample.
    """

    rooms: int
    frames: int
    rooms_per_shard: int
    workers: int
    machines: int
    measured: Measured

    @property
    def shards(self) -> int:
        """How many shards the dataset has."""
        return math.ceil(self.rooms / self.rooms_per_shard)

    @property
    def processor_s(self) -> "Interval":
        """Processor time of all rooms, s."""
        return total_of([cost.of_frames(self.frames).processor_s for cost in self.measured.rooms], self.rooms)

    @property
    def bytes(self) -> "Interval":
        """Bytes of all shards."""
        rooms = total_of([cost.bytes_of_frames(self.frames) for cost in self.measured.rooms], self.rooms)
        bags = self.shards * max(cost.bytes_bag for cost in self.measured.rooms)
        return Interval(*(value + bags for value in rooms))

    def seconds(self, machines: int) -> "Interval":
        """Return the time by the wall clock on so many machines like this one, s."""
        work = total_of([cost.of_frames(self.frames).wall_s for cost in self.measured.rooms], self.rooms)
        return seconds_on(work, self.shards, machines, self.workers, self.measured.start_s)

    def document(self) -> dict[str, Any]:
        """Return the estimate as JSON has it; an interval without an upper end has null there."""
        return {
            "schema": SCHEMA,
            "rooms": self.rooms,
            "frames": self.frames,
            "shards": self.shards,
            "workers": self.workers,
            "confidence": CONFIDENCE,
            "processor_s": _values(self.processor_s),
            "bytes": _values(self.bytes),
            "machines": [{"machines": count, "seconds": _values(self.seconds(count))} for count in sorted({1, self.machines})],
            "start_s": self.measured.start_s,
            "memory_bytes_per_worker": self.measured.memory_bytes,
            "sample": [cost.to_mapping() for cost in self.measured.rooms],
        }

    def text(self) -> str:
        """Return the estimate as a table for people."""
        rooms = self.measured.rooms
        types = sorted({cost.room_type for cost in rooms})
        per_frame = self.bytes.mean / (self.rooms * self.frames)
        lines = [
            f"measured: {len(rooms)} of {self.rooms:,} rooms ({', '.join(types)}), {rooms[0].frames} of {self.frames} frames each, "
            f"{min(self.workers, len(rooms))} at once",
            f"{'':<34}{'mean':>12}   {100.0 * CONFIDENCE:.0f} % interval",
            *self._rows(),
            f"a room: {_means(self, 'synthesis')} to sample, {_mean_room(self)} to prepare, {_means(self, 'frame')} a frame "
            "(processor time)",
            f"a frame: {size(per_frame)}; a worker: {size(self.measured.memory_bytes)} of memory, {span(self.measured.start_s)} to start",
        ]
        return "\n".join(lines) + "\n"

    def _rows(self) -> Iterator[str]:
        processor_h = self.processor_s.times(1.0 / 3600.0)
        yield _row("processor hours", *(f"{value:,.3g}" if value < 100.0 else f"{value:,.0f}" for value in processor_h))
        thousand = processor_h.times(1000.0 / (self.rooms * self.frames))
        yield _row("processor hours per 1,000 frames", *(f"{value:.3g}" for value in thousand))
        for count in sorted({1, self.machines}):
            workers = f"{self.workers} worker{'s' if self.workers > 1 else ''}"
            where = f"time here, {workers}" if count == 1 else f"time on {count:,} such machines"
            yield _row(where, *(span(value) for value in self.seconds(count)))
        yield _row("bytes", *(size(value) for value in self.bytes))


def size(count: float) -> str:
    """Return a number of bytes in words, decimal units."""
    if math.isinf(count):
        return "?"
    factor, unit = next(((factor, unit) for factor, unit in _UNITS if count >= factor), (1.0, "B"))
    return f"{count / factor:.3g} {unit}"


def span(seconds: float) -> str:
    """Return a time in words."""
    if math.isinf(seconds):
        return "?"
    factor, unit = next(((factor, unit) for least, factor, unit in _SPANS if seconds >= least), (1.0, "s"))
    return f"{seconds / factor:,.3g} {unit}" if seconds / factor < 1000.0 else f"{seconds / factor:,.0f} {unit}"


def _row(name: str, mean: str, low: str, high: str) -> str:
    return f"{name:<34}{mean:>12}   {low} to {high}"


def _values(interval: "Interval") -> dict[str, float | None]:
    return {name: value if math.isfinite(value) else None for name, value in interval._asdict().items()}


def _mean_room(estimate: Estimate) -> str:
    """Return the mean processor time of a room beside its description and its frames."""
    rooms = estimate.measured.rooms
    alone = [cost.total.processor_s - cost.synthesis.processor_s - cost.frames * cost.frame.processor_s for cost in rooms]
    return span(max(0.0, sum(alone)) / len(rooms))


def _means(estimate: Estimate, name: str) -> str:
    rooms = estimate.measured.rooms
    return span(sum(getattr(cost, name).processor_s for cost in rooms) / len(rooms))


CONFIDENCE = 0.95


class Interval(NamedTuple):
    """An estimate and its interval of confidence."""

    mean: float
    low: float
    high: float

    def times(self, factor: float) -> "Interval":
        """Return the interval of a multiple."""
        return Interval(self.mean * factor, self.low * factor, self.high * factor)


def total_of(sample: Sequence[float], count: int) -> Interval:
    """Return the total over ``count`` rooms, from the values of a simple random sample of them.

    The total is N times the sample's mean, its standard error is N s sqrt(1/n - 1/N), and the interval is Student's t with n - 1 degrees of
    freedom (Cochran, Sampling Techniques, 3rd ed. 1977, equations 2.21 to 2.24).  The lower end is at least what was measured.

    Args:
        sample: values of the n rooms measured, not negative, at least one; with one there is no upper end.
        count: N, at least n.
    """
    values = np.asarray(sample, np.float64)
    n = len(values)
    mean = count * float(values.mean())
    if n >= count:
        return Interval(mean, mean, mean)
    if n == 1:
        return Interval(mean, float(values.sum()), math.inf)
    error = count * float(values.std(ddof=1)) * math.sqrt(1.0 / n - 1.0 / count)
    half = float(stdtrit(n - 1, 0.5 + CONFIDENCE / 2.0)) * error
    return Interval(mean, max(float(values.sum()), mean - half), mean + half)


def seconds_on(work: Interval, shards: int, machines: int, workers: int, start_s: float) -> Interval:
    """Return how long so many machines work, by the wall clock, when each worker takes the next shard as soon as it has made one.

    The last shards leave workers idle: with S equal shards and M workers there are ceil(S / M) rounds.

    Args:
        work: seconds that one worker would take for all shards, while the others of its machine work too.
        shards: of the dataset.
        machines: at work.
        workers: of each machine.
        start_s: what a worker takes before its first room.
    """
    rounds = math.ceil(shards / (machines * workers))
    share = rounds / shards
    return Interval(*(start_s + share * seconds for seconds in work))


def sample_indices(rooms: int, count: int, types: int) -> tuple[int, ...]:
    """Return indices of rooms spread evenly over a dataset, as many of each room type; all where there are no more.

    ``rooms``: of the dataset; room ``i`` is of type ``i % types``.
    ``count``: how many to choose; rounded up to whole rounds of types.
    """
    rounds = math.ceil(rooms / types)
    wanted = min(rounds, math.ceil(count / types))
    firsts = [(2 * k + 1) * rounds // (2 * wanted) * types for k in range(wanted)]
    return tuple(index for first in firsts for index in range(first, first + types) if index < rooms)
