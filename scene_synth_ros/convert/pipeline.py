"""Runs a writer over its source: frames are decoded and encoded in several threads, a few ahead, and taken in their order."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

from scene_synth_ros.convert.writer import Sequence, Source, Writer

_AHEAD = 2
"""Frames for each thread that are encoded, or wait to be, before the oldest is taken: bounds memory."""


class _Step(NamedTuple):
    """A frame on its way; ``last``: the sequence ends with it."""

    encoded: Future[Any]
    state: Any
    last: bool


def convert(
    out: Path, source: Source, writer: Writer, *, threads: int = 2, progress: Callable[[int], None] = lambda _: None
) -> tuple[str, ...]:
    """Write a source into a folder; return lines for people, the source's and the writer's.

    Args:
        out: the folder, empty.
        source: what is converted.
        writer: of the format.
        threads: that decode and encode frames; the output is the same with any number.
        progress: called after every frame with how many are done.

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
    return source.notes + writer.finish()


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
