"""Batches of a dataset that processes decode into shared memory, as the workers of PyTorch's DataLoader do, for machines without it."""

from __future__ import annotations

import multiprocessing
from collections.abc import Iterator, Sequence
from multiprocessing.context import BaseContext
from multiprocessing.shared_memory import SharedMemory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_synth_ros.dataset import Dataset

_AHEAD = 3
"""Batches that each worker may have ready."""


def batches(data: Dataset, order: Sequence[int], size: int, workers: int) -> Iterator[dict[str, NDArray[Any]]]:
    """Yield layer -> (size, height, width, ...) in any order; an array is good until the next batch is asked for.

    Args:
        data: all its frames have the shapes of the first.
        order: indices of frames; those that fill no whole batch are left out.
        size: frames of a batch.
        workers: processes.
    """
    context: BaseContext = multiprocessing.get_context("fork")
    shapes = {layer: ((size, *pixels.shape), pixels.dtype) for layer, pixels in data.frame(0).items()}
    places = np.cumsum([0, *(int(np.prod(shape)) * dtype.itemsize for shape, dtype in shapes.values())])
    slots = [SharedMemory(create=True, size=int(places[-1])) for _ in range(_AHEAD * workers)]
    views = [
        {layer: np.ndarray(*form, slot.buf, int(place)) for (layer, form), place in zip(shapes.items(), places, strict=False)}
        for slot in slots
    ]
    free, jobs, done = context.Queue(), context.Queue(), context.Queue()
    chosen = [[int(index) for index in order[start : start + size]] for start in range(0, len(order) - size + 1, size)]
    for number in range(len(slots)):
        free.put(number)
    for job in [*chosen, *[None] * workers]:
        jobs.put(job)
    processes = [context.Process(target=_work, args=(data, views, free, jobs, done), daemon=True) for _ in range(workers)]
    for process in processes:
        process.start()
    try:
        for _ in chosen:
            number = done.get()
            yield views[number]
            free.put(number)
    finally:
        for process in processes:
            process.join(timeout=10)
        views.clear()
        for slot in slots:
            slot.close()
            slot.unlink()


def _work(data: Dataset, views: list[dict[str, NDArray[Any]]], free: Any, jobs: Any, done: Any) -> None:
    while (indices := jobs.get()) is not None:
        number = free.get()
        for place, index in enumerate(indices):
            frame = data.frame(index)
            for layer, batch in views[number].items():
                batch[place] = frame[layer]
        done.put(number)
