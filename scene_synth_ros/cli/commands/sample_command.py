"""``scene_synth sample``: rooms as JSON and labelled top views, a table of their metrics, records of their chains; without ROS."""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
import multiprocessing
import os
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml

from grammar import RequestError, SceneRequest
from grammar.checks.metrics import RoomMetrics, measure_room
from grammar.diagnostics import chain_plot, record_chain, to_csv
from grammar.drawing.shapes import to_svg
from grammar.drawing.top_view import top_view
from grammar.spec.grammar_file import read_grammar
from grammar.synthesize import PURPOSES, CameraTimes, SceneSynthesizer
from scene_description import SceneDescription, from_mapping, scene_to_json
from scene_description.strict import field_types, split_annotation
from scene_synth_ros.cli.files.sample_report import report_json, report_text
from scene_synth_ros.cli.pictures.drawing_png import png_bytes
from scene_synth_ros.synthesize.catalogs import with_catalog

ALL = "all"
WRITES = ("json", "svg", "png")
_PROGRESS_S = 10.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """What every room of a run of the command has in common."""

    grammar_files: tuple[Path, ...]
    catalog: str
    request: SceneRequest
    seed: int
    frames: int
    out: Path | None
    writes: tuple[str, ...]
    chain: bool


class Done(NamedTuple):
    """A room that is done: its name, what is said of it, its metrics, or why there is none."""

    name: str
    text: str
    metrics: RoomMetrics | None
    error: str


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.epilog = "constraints (-p NAME:=VALUE):\n" + "\n".join(_constraint_lines())
    parser.add_argument(
        "--room", metavar="TYPE", help="room type; several, with commas between, or 'all', in turn (default: bedroom, or the --grammar's)"
    )
    parser.add_argument("--seed", type=int, default=1, help="seed of the run (default: %(default)s)")
    parser.add_argument("--count", type=int, default=1, help="number of rooms (default: %(default)s)")
    parser.add_argument(
        "-p", dest="constraints", action="append", default=[], metavar="NAME:=VALUE", help="a constraint, see below; may be repeated"
    )
    parser.add_argument(
        "--grammar",
        type=Path,
        action="append",
        default=[],
        metavar="FILE",
        help="grammar file in place of its room type's; may be repeated",
    )
    parser.add_argument("--catalog", default="", metavar="DIR", help="folder of the user's models, with catalog.yaml")
    parser.add_argument("--look", action="append", default=[], metavar="TEXT", help="appearance of a target, see docs/looks.md; repeatable")
    parser.add_argument("--frames", type=int, default=30, help="poses of each camera path (default: %(default)s)")
    parser.add_argument("--workers", type=int, default=1, help="processes; they change nothing but the time (default: %(default)s)")
    parser.add_argument("--report", action="store_true", help="print a table of metrics over all rooms, and write report.json with --out")
    parser.add_argument(
        "--chain", action="store_true", help="write a record of each room's chain: energy terms and acceptance by proposals"
    )
    parser.add_argument(
        "--write", default=",".join(WRITES), metavar="KINDS", help="files of each room, a list of json, svg, png (default: %(default)s)"
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="new folder for the files; may be missing with --report")


def run(arguments: argparse.Namespace) -> int:
    """Sample; room i becomes ``room_<i>.json``, ``.svg`` and ``.png``.

    Returns:
        0; 1 if a room could not be sampled or the report found a metric out of its limit.
    """
    job, synthesizer = _job(arguments)
    if job.out is not None:
        _make_folder(job.out)
    _say(f"sampling {arguments.count} room{'s' if arguments.count > 1 else ''} (the first run compiles kernels)")
    began, rooms, errors = time.monotonic(), [], []
    said = began
    for done in _rooms(job, synthesizer, arguments.count, arguments.workers):
        if done.metrics is None:
            if not arguments.report:
                raise RequestError(f"{done.name}: {done.error}")
            errors.append(f"{done.name}: {done.error}")
            _say(errors[-1])
        else:
            rooms.append(done.metrics)
        finished, now = len(rooms) + len(errors), time.monotonic()
        if not arguments.report or arguments.count <= 20:
            _say(done.text)
        elif now - said > _PROGRESS_S or finished == arguments.count:
            said = now
            _say(f"{finished} of {arguments.count} rooms, {len(errors)} failures, {now - began:.0f} s")
    if not arguments.report:
        return 0
    return _report(job, arguments, rooms, errors, time.monotonic() - began)


def _report(job: Job, arguments: argparse.Namespace, rooms: list[RoomMetrics], errors: list[str], seconds: float) -> int:
    if not rooms:
        raise RequestError(f"none of {arguments.count} rooms could be sampled; the first: {errors[0]}")
    text, passed = report_text(rooms, len(errors))
    _say(text)
    _say(f"{len(rooms)} rooms in {seconds:.1f} s with {arguments.workers} processes")
    if job.out is not None:
        command = {
            "room": job.request.room_type.replace(",", ", "),
            "seed": job.seed,
            "count": arguments.count,
            "workers": arguments.workers,
        }
        _write(job.out / "report.json", report_json(rooms, errors, command).encode())
        _say(f"wrote {job.out / 'report.json'}")
    return 0 if passed else 1


def parse_constraints(texts: list[str], room_type: str) -> SceneRequest:
    """Return the request that ``NAME:=VALUE`` texts make, values in YAML.

    Raises:
        RequestError: a text has another form.
        FieldError: a constraint is unknown or out of range.
    """
    values: dict[str, Any] = {"room_type": room_type}
    for text in texts:
        name, assigned, value = text.partition(":=")
        if not assigned or not name:
            raise RequestError(f"-p {text}: expected NAME:=VALUE, for example max_objects:=12")
        try:
            values[name] = yaml.safe_load(value)
        except yaml.YAMLError:
            raise RequestError(f"-p {text}: expected a YAML value, got {value!r}") from None
    return from_mapping(SceneRequest, values, "")


def _constraint_lines() -> Iterator[str]:
    defaults = SceneRequest()
    for name, annotation in field_types(SceneRequest).items():
        limits = split_annotation(annotation)[1]
        unit = f" [{limits.unit}]" if limits.unit else ""
        default = getattr(defaults, name)
        shown = "" if dataclasses.is_dataclass(default) or default in ((), {}, None) else f" (default: {default})"
        if name != "room_type":
            yield f"  {name:18s} {limits.description}{unit}{shown}"


def _job(arguments: argparse.Namespace) -> tuple[Job, SceneSynthesizer]:
    """Check the options and read the configuration."""
    for name, low, high in (("count", 1, 10**7), ("frames", 1, 100_000), ("workers", 1, 1024), ("seed", 0, 2**63 - 1)):
        if not low <= getattr(arguments, name) <= high:
            raise RequestError(f"--{name}: expected an integer in [{low}, {high}], got {getattr(arguments, name)}")
    writes = tuple(filter(None, arguments.write.split(",")))
    for kind in writes:
        if kind not in WRITES:
            raise RequestError(f"--write: expected a list of {', '.join(WRITES)}, got '{kind}'")
    if arguments.out is None and (not arguments.report or arguments.chain):
        raise RequestError("--out: expected a new folder for the files; only --report without --chain can do without")
    if arguments.out is not None and arguments.out.exists():
        raise RequestError(f"--out {arguments.out}: exists already; choose another folder or remove it")
    synthesizer = with_catalog(SceneSynthesizer.from_config(arguments.grammar), arguments.catalog)
    own = [read_grammar(path, synthesizer.categories).room_type for path in arguments.grammar]
    room = arguments.room or (own[-1] if own else SceneRequest().room_type)
    types = ",".join(sorted(synthesizer.grammars)) if room == ALL else room
    request = parse_constraints(arguments.constraints, types)
    request = dataclasses.replace(request, looks=(*request.looks, *arguments.look))
    if request.room_type != types:
        raise RequestError(f"-p room_type: expected no value, got '{request.room_type}'; use --room")
    synthesizer.check(request)
    job = Job(
        grammar_files=tuple(arguments.grammar),
        catalog=arguments.catalog,
        request=request,
        seed=arguments.seed,
        frames=arguments.frames,
        out=arguments.out,
        writes=writes,
        chain=arguments.chain,
    )
    return job, synthesizer


def _make_folder(path: Path) -> None:
    try:
        path.mkdir(parents=True)
    except OSError as error:
        raise RequestError(f"--out {path}: cannot be made ({error.strerror})") from None


def _rooms(job: Job, synthesizer: SceneSynthesizer, count: int, workers: int) -> Iterator[Done]:
    """Yield all rooms in the order of their indices."""
    if count > 1:
        _warm(job, synthesizer)  # times are taken of compiled kernels, and workers find them compiled
    if workers == 1:
        yield from (_make(job, synthesizer, index) for index in range(count))
        return
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(min(workers, count), context, _start_worker, (job,)) as pool:
        waiting: list[Future[Done]] = []
        index = 0
        try:
            while waiting or index < count:
                while index < count and len(waiting) < 4 * workers:
                    waiting.append(pool.submit(_make_in_worker, index))
                    index += 1
                yield waiting.pop(0).result()
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


_in_worker: Callable[[int], Done] | None = None


def _start_worker(job: Job) -> None:
    global _in_worker
    synthesizer = with_catalog(SceneSynthesizer.from_config(job.grammar_files), job.catalog)
    _warm(job, synthesizer)
    _in_worker = partial(_make, job, synthesizer)


def _warm(job: Job, synthesizer: SceneSynthesizer) -> None:
    """Compile or load the kernels before times are taken."""
    with contextlib.suppress(RequestError):
        synthesizer.synthesize(job.request, job.seed, 0, CameraTimes(frames=1, start_ns=0, rate_hz=10.0))


def _make_in_worker(index: int) -> Done:
    assert _in_worker is not None
    return _in_worker(index)


def _make(job: Job, synthesizer: SceneSynthesizer, index: int) -> Done:
    """Sample room ``index`` and write its files."""
    request = job.request.of_room(index)
    times = CameraTimes(frames=job.frames, start_ns=1_000_000_000, rate_hz=10.0, first_index=index * job.frames)
    name, began = f"room_{index:04d}", time.thread_time()
    try:
        scene, cost = synthesizer.synthesize_with_cost(request, job.seed, index, times)
    except RequestError as error:
        return Done(name, "", None, str(error))
    seconds = time.thread_time() - began
    metrics = measure_room(synthesizer.grammar_of(request), synthesizer.categories, scene, cost, seconds)
    if job.out is not None:
        _write_room(job, scene, job.out / name)
        if job.chain:
            _write_chain(job, synthesizer, request, index, job.out / f"chain_{index:04d}")
    layouts = f"{cost.attempts} layout{'s' if cost.attempts > 1 else ''} tried"
    return Done(name, f"{name}: {scene.category}, {len(scene.objects)} objects, {layouts}, {seconds:.2f} s", metrics, "")


def _write_room(job: Job, scene: SceneDescription, base: Path) -> None:
    drawing = top_view(scene) if {"svg", "png"} & set(job.writes) else None
    if "json" in job.writes:
        _write(base.with_suffix(".json"), scene_to_json(scene).encode())
    if drawing is not None and "svg" in job.writes:
        _write(base.with_suffix(".svg"), to_svg(drawing).encode())
    if drawing is not None and "png" in job.writes:
        _write(base.with_suffix(".png"), png_bytes(drawing))


def _write_chain(job: Job, synthesizer: SceneSynthesizer, request: SceneRequest, index: int, base: Path) -> None:
    """Record the first chain of a room, by the random numbers that the room was made with."""
    rng = np.random.default_rng(np.random.SeedSequence([job.seed, index, PURPOSES.index("layout")]))
    record = record_chain(synthesizer.grammar_of(request), synthesizer.categories, request, rng)
    plot = chain_plot(record, f"{request.room_type.replace('_', ' ')} {index}, seed {job.seed}")
    _write(base.with_suffix(".csv"), to_csv(record).encode())
    _write(base.with_suffix(".svg"), to_svg(plot).encode())
    _write(base.with_suffix(".png"), png_bytes(plot))


def _write(path: Path, content: bytes) -> None:
    """Write a file that has its name only once it is whole."""
    partial = path.with_name(f".{path.name}.partial")
    partial.write_bytes(content)
    os.replace(partial, path)


def _say(text: str) -> None:
    if text:
        sys.stdout.write(text + "\n")
        sys.stdout.flush()
