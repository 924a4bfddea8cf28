"""Reading bags: as datasets, frames a second by layers, layout, order and loader; and conversions, processor seconds a gigabyte by format.

python -m benchmarks.reading_bench [--bag BAG] [--only FORMAT ...] [--rooms N] [--frames N] [--json FILE]

measures conversions of a bag that is given, or of one 640x480 camera with the layers that the formats take, and no others, so that a
gigabyte holds many frames; 4 samples a pixel without a denoiser make pictures that compress badly.  Two cores work 120 s in a minute.
"""

import argparse
import json
import multiprocessing
import os
import resource
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from multiprocessing.context import BaseContext
from multiprocessing.shared_memory import SharedMemory
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.table import Row, at_least, at_most, render_table
from grammar import SceneRequest
from grammar.synthesize import CameraTimes, SceneSynthesizer
from scene_description import SceneSynthError
from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.bags.bag_writer import DEFAULT_CHUNK_SIZE, BagWriter
from scene_synth_ros.cli.parameters.run_parameters import RunWords, run_parameters
from scene_synth_ros.convert.formats import FORMATS, writer_of
from scene_synth_ros.convert.source import Choice, open_source
from scene_synth_ros.convert.writer import convert
from scene_synth_ros.dataset import Dataset, Frame, open_dataset
from scene_synth_ros.offline.offline_bag import OfflineBag
from scene_synth_ros.offline.settings import read_settings

_AHEAD = 3
"""Batches that each worker may have ready."""


def batches(data: Dataset, order: Sequence[int], size: int, workers: int) -> Iterator[dict[str, NDArray[Any]]]:
    """Yield layer -> (size, height, width, ...) in any order; an array is good until the next batch is asked for.

    All frames have the shapes of the first; those that fill no whole batch are left out.
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


FRAMES, COPIES, ROUNDS, BATCH = 10, 12, 4, 8
"""Frames that are rendered, bags of them (links to one file), how often all are read, frames of a batch."""
ASKED = 200.0
"""Frames of colour, depth and classes that two workers shall give a second, at 640x480."""
THREE = ("color", "depth", "semantic")
FIVE = (*THREE, "instance", "normals")
SMALL = 2**18


class Layout(NamedTuple):
    """How the messages of a bag lie in its files."""

    compression: str
    chunk_size: int

    def __str__(self) -> str:
        return f"{self.compression}, chunks of {self.chunk_size / 2**20:g} MiB"


RECORDED = Layout("zstd", DEFAULT_CHUNK_SIZE)
LAYOUTS = (RECORDED, Layout("lz4", DEFAULT_CHUNK_SIZE), Layout("none", DEFAULT_CHUNK_SIZE), Layout("zstd", SMALL), Layout("none", SMALL))


def measure_datasets() -> list[Row]:
    """Render a room at 640x480, write its bag in several layouts, and read each."""
    rows: list[Row] = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        _render(folder / "rendered")
        for layout in LAYOUTS:
            bags = folder / f"{layout.compression}_{layout.chunk_size}"
            size = _copy(folder / "rendered", bags, layout)
            rows.append(Row(f"{layout}: a frame with all its topics", size / FRAMES / 1e6, "MB"))
            rows += _decoding(bags, layout)
            if layout in (RECORDED, Layout("zstd", SMALL)):
                rows += _loading(bags, layout)
    return rows


def _render(bag: Path) -> None:
    settings = read_settings(run_parameters(RunWords(params=Path("demo"), record=bag)))
    synthesizer = SceneSynthesizer.from_config()
    times = CameraTimes(frames=FRAMES, start_ns=1_000_000_000, rate_hz=10.0)
    scene = synthesizer.synthesize(SceneRequest(room_type="bedroom", max_objects=25), seed=7, index=0, times=times)
    with OfflineBag(bag, settings, synthesizer.floor_map) as writer:
        writer.add_room(scene)


def _copy(source: Path, folder: Path, layout: Layout) -> int:
    """Write the bag anew in a layout, ``COPIES`` times over as links; return the bytes of one."""
    first = folder / "bag_00"
    with BagReader(source) as reader, BagWriter(first, compression=layout.compression, chunk_size=layout.chunk_size) as writer:
        for name, record in reader.summary.records.items():
            if name != "rosbag2":
                writer.set_record(name, record)
        for message in reader.messages(file_order=True):
            writer.add_topic(message.topic, message.type_name)
            writer.write(message.topic, message.data, message.log_ns, message.publish_ns)
    (file,) = first.glob("*.mcap")
    for number in range(1, COPIES):
        copy = folder / f"bag_{number:02d}"
        copy.mkdir()
        os.link(file, copy / file.name)
    return file.stat().st_size


def _decoding(bags: Path, layout: Layout) -> list[Row]:
    """Return the processor time of a frame on one thread."""
    rows = []
    for layers in (THREE, FIVE):
        data = open_dataset(bags, layers=layers)
        for name, order in (("in order", np.arange(len(data))), ("at random", _random(data))):
            dict(data.frame(int(order[-1])))
            began = time.process_time()
            for index in order:
                dict(data.frame(int(index)))
            spent = 1000.0 * (time.process_time() - began) / len(order)
            rows.append(Row(f"  {len(layers)} layers {name}, processor time of a frame", spent, "ms"))
    return rows


def _loading(bags: Path, layout: Layout) -> list[Row]:
    """Return frames a second of colour, depth and classes at random, with two workers."""
    data = open_dataset(bags, layers=THREE)
    order = np.concatenate([_random(data, seed) for seed in range(ROUNDS)])
    loaders: dict[str, Callable[[], Iterable[int]]] = {
        "two threads": lambda: _threads(data, order),
        "two processes, shared memory": lambda: (len(batch["color"]) for batch in batches(data, order, BATCH, workers=2)),
    }
    if _has_torch():
        loaders["PyTorch DataLoader, two workers"] = lambda: _torch(bags, order)
    rows = []
    for name, load in loaders.items():
        spent, began = _spent(), time.perf_counter()
        count = sum(load())
        seconds, spent = time.perf_counter() - began, _spent() - spent
        asked = layout == RECORDED and name != "two threads"
        words = f"  3 layers at random, {name}"
        rows.append(at_least(words, count / seconds, "frames/s", ASKED) if asked else Row(words, count / seconds, "frames/s"))
        rows.append(Row("    processor time of a frame, all processes", 1000.0 * spent / count, "ms"))
    return rows


def _threads(data: Dataset, order: Sequence[int]) -> Iterable[int]:
    with ThreadPoolExecutor(2) as pool:
        for frame in pool.map(lambda index: dict(data.frame(int(index))), order):
            yield len(frame) // len(THREE)


def _has_torch() -> bool:
    try:
        import torch  # noqa: F401
    except ImportError:
        return False
    return True


def _tensors(frame: Frame) -> dict[str, Any]:
    import torch

    return {layer: torch.from_numpy(pixels) for layer, pixels in frame.items()}


def _torch(bags: Path, order: Sequence[int]) -> Iterable[int]:
    from torch.utils.data import DataLoader

    data = open_dataset(bags, layers=THREE, transform=_tensors).frames_at(order)
    for batch in DataLoader(data, batch_size=BATCH, num_workers=2, prefetch_factor=4):
        yield len(batch["color"])


def _random(data: Dataset, seed: int = 0) -> Any:
    return np.random.default_rng(seed).permutation(len(data))


def _spent() -> float:
    """Return the processor seconds of this process and of its children that have ended."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


LIMIT_S = 120.0
THREADS = 2
_SETTINGS = (
    "renderer_node.render.samples_per_pixel:=4",
    "renderer_node.streams.normals:=false",
    "renderer_node.streams.color_companions:=false",
)


def make_bag(bag: Path, rooms: int, frames: int) -> None:
    """Record bedrooms, without DDS."""
    settings = read_settings(run_parameters(RunWords(rooms=rooms, frames=frames, record=bag, overrides=_SETTINGS)))
    synthesizer = SceneSynthesizer.from_config()
    with OfflineBag(bag, settings, synthesizer.floor_map) as writer:
        for index in range(rooms):
            times = CameraTimes(frames=frames, start_ns=1_000_000_000 * (1 + 1000 * index), rate_hz=10.0)
            writer.add_room(synthesizer.synthesize(SceneRequest(room_type="bedroom"), 1, index, times))


def convert_timed(bag: Path, name: str) -> tuple[float, float, int]:
    """Return processor seconds, elapsed seconds and frames of a conversion, opening the bag included."""
    with tempfile.TemporaryDirectory() as folder:
        cpu, began = time.process_time(), time.perf_counter()
        source = open_source(str(bag), name, FORMATS[name], Choice())
        convert(Path(folder), source, writer_of(name), threads=THREADS)
        return time.process_time() - cpu, time.perf_counter() - began, source.frames


def rows_of(bag: Path, names: list[str]) -> list[Row]:
    """Convert a bag into each format, twice, as the first time loads kernels and libraries; the second counts."""
    size_gb = sum(path.stat().st_size for path in bag.rglob("*.mcap")) / 1e9
    rows = []
    for name in names:
        try:
            convert_timed(bag, name)
        except SceneSynthError as error:
            print(f"  {name} is left out: {error}")
            continue
        cpu, elapsed, frames = convert_timed(bag, name)
        rows += [
            at_most(f"{name}, processor time a GB of the bag", cpu / size_gb, "s", LIMIT_S),
            Row("  processor time a frame", 1000.0 * cpu / frames, "ms"),
            Row(f"  processors busy of {THREADS} threads", cpu / elapsed, ""),
        ]
    return [Row("the bag, a frame", 1e3 * size_gb / frames, "MB"), *rows] if rows else []


def measure_conversions(names: list[str] | None = None, bag: Path | None = None, rooms: int = 2, frames: int = 12) -> list[Row]:
    """Return the rows of all formats, or of those named."""
    if bag is not None:
        return rows_of(bag, names or list(FORMATS))
    with tempfile.TemporaryDirectory() as folder:
        make_bag(Path(folder) / "bag", rooms, frames)
        return rows_of(Path(folder) / "bag", names or list(FORMATS))


def main() -> None:
    """Measure conversions and print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.reading_bench")
    parser.add_argument("--bag", type=Path, metavar="BAG", help="convert this bag")
    parser.add_argument("--make", type=Path, metavar="BAG", help="only record the bag, to be kept")
    parser.add_argument("--only", nargs="+", choices=FORMATS, metavar="FORMAT")
    parser.add_argument("--rooms", type=int, default=2)
    parser.add_argument("--frames", type=int, default=12, help="of each room")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    arguments = parser.parse_args()
    if arguments.make:
        make_bag(arguments.make, arguments.rooms, arguments.frames)
        return
    rows = measure_conversions(arguments.only, arguments.bag, arguments.rooms, arguments.frames)
    print(render_table("Conversions", rows))
    if arguments.json:
        arguments.json.write_text(json.dumps([row._asdict() for row in rows], indent=1))


if __name__ == "__main__":
    main()
