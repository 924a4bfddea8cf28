"""Samples the rooms of ``scene_synth sample``, in one process or several, and writes the files of each."""

import contextlib
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from grammar import RequestError, SceneRequest
from grammar.checks.metrics import RoomMetrics, measure_room
from grammar.diagnostics import chain_plot, record_chain, to_csv
from grammar.drawing.shapes import to_svg
from grammar.drawing.top_view import top_view
from grammar.synthesize import PURPOSES, CameraTimes, SceneSynthesizer
from scene_description import SceneDescription, scene_to_json
from scene_description.whole import write_whole
from scene_synth_ros.cli.pictures.picture_grid import png_bytes
from scene_synth_ros.synthesize.catalogs import with_catalog
from scene_synth_ros.workers.pool import Do, in_order

WRITES = ("json", "svg", "png")
"""Files that a room may have."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SampleJob:
    """What every room of a run of the command has in common."""

    grammar_files: tuple[Path, ...]
    catalog: str
    request: SceneRequest
    seed: int
    frames: int
    out: Path | None
    writes: tuple[str, ...]
    chain: bool


class RoomOutcome(NamedTuple):
    """A room that is done: its name, what is said of it, its metrics, or why there is none."""

    name: str
    text: str
    metrics: RoomMetrics | None
    error: str


def sampled_rooms(job: SampleJob, synthesizer: SceneSynthesizer, count: int, workers: int) -> Iterator[RoomOutcome]:
    """Yield all rooms in the order of their indices."""
    if count > 1:
        _warm(job, synthesizer)  # times are taken of compiled kernels, and workers find them compiled
    if workers == 1:
        yield from (_make(job, synthesizer, index) for index in range(count))
    else:
        yield from in_order(prepare_sampling, job, range(count), workers)


def prepare_sampling(job: SampleJob) -> Do:
    """Return what makes a room by its index in a worker process."""
    synthesizer = with_catalog(SceneSynthesizer.from_config(job.grammar_files), job.catalog)
    _warm(job, synthesizer)
    return lambda index, _: _make(job, synthesizer, index)


def _warm(job: SampleJob, synthesizer: SceneSynthesizer) -> None:
    """Compile or load the kernels before times are taken."""
    with contextlib.suppress(RequestError):
        synthesizer.synthesize(job.request, job.seed, 0, CameraTimes(frames=1, start_ns=0, rate_hz=10.0))


def _make(job: SampleJob, synthesizer: SceneSynthesizer, index: int) -> RoomOutcome:
    """Sample room ``index`` and write its files."""
    request = job.request.of_room(index)
    times = CameraTimes(frames=job.frames, start_ns=1_000_000_000, rate_hz=10.0, first_index=index * job.frames)
    name, began = f"room_{index:04d}", time.thread_time()
    try:
        scene, cost = synthesizer.synthesize_with_cost(request, job.seed, index, times)
    except RequestError as error:
        return RoomOutcome(name, "", None, str(error))
    seconds = time.thread_time() - began
    metrics = measure_room(synthesizer.grammar_of(request), synthesizer.categories, scene, cost, seconds)
    if job.out is not None:
        _write_room(job, scene, job.out / name)
        if job.chain:
            _write_chain(job, synthesizer, request, index, job.out / f"chain_{index:04d}")
    layouts = f"{cost.attempts} layout{'s' if cost.attempts > 1 else ''} tried"
    return RoomOutcome(name, f"{name}: {scene.category}, {len(scene.objects)} objects, {layouts}, {seconds:.2f} s", metrics, "")


def _write_room(job: SampleJob, scene: SceneDescription, base: Path) -> None:
    drawing = top_view(scene) if {"svg", "png"} & set(job.writes) else None
    if "json" in job.writes:
        write_whole(base.with_suffix(".json"), scene_to_json(scene).encode())
    if drawing is not None and "svg" in job.writes:
        write_whole(base.with_suffix(".svg"), to_svg(drawing).encode())
    if drawing is not None and "png" in job.writes:
        write_whole(base.with_suffix(".png"), png_bytes(drawing))


def _write_chain(job: SampleJob, synthesizer: SceneSynthesizer, request: SceneRequest, index: int, base: Path) -> None:
    """Record the first chain of a room, by the random numbers that the room was made with."""
    rng = np.random.default_rng(np.random.SeedSequence([job.seed, index, PURPOSES.index("layout")]))
    record = record_chain(synthesizer.grammar_of(request), synthesizer.categories, request, rng)
    plot = chain_plot(record, f"{request.room_type.replace('_', ' ')} {index}, seed {job.seed}")
    write_whole(base.with_suffix(".csv"), to_csv(record).encode())
    write_whole(base.with_suffix(".svg"), to_svg(plot).encode())
    write_whole(base.with_suffix(".png"), png_bytes(plot))
