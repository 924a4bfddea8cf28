"""Datasets: workers, interruptions, the live suite, bytes, memory.  ``python -m benchmarks.generate_bench [--only NAME ...] [--write]``.

``make bench`` has all but the long rows, of interruptions and memory, which ``--only resume memory`` measures.
"""

import argparse
import json
import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from statistics import median

from benchmarks.generate_runs import (
    BALANCED,
    GROUND_TRUTH,
    SMALL,
    dataset_words,
    killed,
    manifest_sha256,
    memory_of_worker,
    time_of_shard,
    timed,
    write_costs,
)
from benchmarks.table import DOCS, Row, at_least, at_most, markdown_table, render_table, write_section

FRAMES = 8
TRUTH_ROOMS, BALANCED_ROOMS, BALANCED_FRAMES = 48, 8, 2
LIVE_ROOMS = 24
KILLS, KILLED_ROOMS = 20, 80
MEMORY_ROOMS = 500
_INSIDE = ("sampling rooms", "geometry of rooms", "casting rays", "compression")


def measure() -> list[Row]:
    """Return the rows of ``make bench``."""
    return [row for name in ("workers", "live", "time", "write", "bytes") for row in SECTIONS[name]()]


def workers() -> Iterator[Row]:
    """Yield what a second worker brings, at both profiles, and whether the manifests are the same."""
    for name, words, rooms, frames, asked in (
        ("ground truth", GROUND_TRUTH, TRUTH_ROOMS, FRAMES, 1.8),
        ("balanced", BALANCED, BALANCED_ROOMS, BALANCED_FRAMES, 1.9),
    ):
        with _folder() as folder:
            taken = {count: timed(dataset_words(folder / str(count), rooms, frames, *words, "--workers", str(count))) for count in (1, 2)}
            same = manifest_sha256(folder / "1") == manifest_sha256(folder / "2")
        count = rooms * frames
        yield Row(f"{name}, 640x480, {rooms} rooms of {frames} frames: 1 worker", count / taken[1].seconds, "frames/s")
        yield Row("  2 workers", count / taken[2].seconds, "frames/s")
        yield Row("  processor time of a frame, start of the program included", taken[1].processor_s / count, "s")
        yield Row("  processor hours of 1,000 frames", taken[1].processor_s / count / 3.6, "h")
        yield at_least("  1 worker over 2 workers, elapsed", taken[1].seconds / taken[2].seconds, "", asked)
        yield at_most("  manifests that differ", float(not same), "", 0.0)


def live() -> Iterator[Row]:
    """Yield the same rooms from the live suite, which records them, and from ``generate``, ground truth."""
    os.environ["ROS_DOMAIN_ID"] = str(1 + os.getpid() % 100)
    frames = LIVE_ROOMS * FRAMES
    with _folder() as folder:
        words = ["--rooms", str(LIVE_ROOMS), "--frames", str(FRAMES), "--seed", "11", *GROUND_TRUTH]
        suite = timed(["run", *words, "--record", str(folder / "bag"), "--no-progress"])
        offline = timed(dataset_words(folder / "dataset", LIVE_ROOMS, FRAMES, *GROUND_TRUTH))
    yield Row(f"live suite, ground truth, {LIVE_ROOMS} rooms of {FRAMES} frames", frames / suite.seconds, "frames/s")
    yield Row("  processor time of a frame", suite.processor_s / frames, "s")
    yield Row("generate, the same rooms, all processors", frames / offline.seconds, "frames/s")
    yield Row("  processor time of a frame", offline.processor_s / frames, "s")


def time_rows() -> Iterator[Row]:
    """Yield where the processor time of a shard goes, ground truth, one thread."""
    processors = sorted(os.sched_getaffinity(0))
    os.sched_setaffinity(0, processors[:1])
    with _folder() as folder:
        spent = time_of_shard(folder, 8, FRAMES, Path("ground_truth"))
    os.sched_setaffinity(0, processors)
    whole = spent.pop("everything")
    yield Row(f"ground truth, 8 rooms of {FRAMES} frames, one thread, a frame", 1000.0 * whole / (8 * FRAMES), "ms")
    for what in (*_INSIDE, "SHA-256 of messages"):
        yield Row(f"  {what}", 100.0 * spent[what] / whole, "%")
    outside = 100.0 * (1.0 - sum(spent[what] for what in _INSIDE) / whole)
    yield at_most("  outside sampling, geometry, rays and compression", outside, "%", 10.0)
    yield Row("  the same without SHA-256", outside - 100.0 * spent["SHA-256 of messages"] / whole, "%")


def write() -> Iterator[Row]:
    """Yield what writing the messages of a shard costs beside the bare writer."""
    with _folder() as folder:
        timed(dataset_words(folder / "dataset", 4, FRAMES, *GROUND_TRUTH, "--shard-rooms", "4"))
        costs = write_costs(folder / "dataset" / "shards" / "00000", 5)
    per_frame = 1000.0 / (4 * FRAMES)
    yield Row("writing a shard's messages, processor time a frame", per_frame * costs.ours, "ms")
    yield Row("  SHA-256 of them, which the bare writer does not make", per_frame * costs.hashes, "ms")
    yield Row("bare mcap writer, the same messages and compression", per_frame * costs.bare, "ms")
    yield at_least("bare mcap writer over ours, processor time", costs.bare / costs.ours, "", 0.8)
    yield Row("  the same without SHA-256", costs.bare / (costs.ours - costs.hashes), "")


def bytes_rows() -> Iterator[Row]:
    """Yield the bytes of a frame: raw, as bags have it, and with PNG where a recorder can have it."""
    png = [word for kind in ("color", "ids", "depth") for word in ("-p", f"recorder_node.images.{kind}:=png")]
    plain = ["-p", "recorder_node.compression:=none"]
    colored = ("-p", "renderer_node.render.samples_per_pixel:=1", "-p", "renderer_node.streams.color_companions:=false")
    for name, words in (("ground truth", GROUND_TRUTH), ("with colour", colored)):
        with _folder() as folder:
            for form, more in (("uncompressed", plain), ("zstd, as it comes", []), ("PNG (depth in 16 bits), then zstd", png)):
                out = folder / form.partition(" ")[0]
                timed(dataset_words(out, 4, FRAMES, *words, *more))
                manifest = json.loads((out / "manifest.json").read_text())
                size = sum(file["bytes"] for shard in manifest["shards"] for file in shard["files"])
                yield Row(f"{name}, 640x480, {form}: a frame", size / manifest["frames"] / 1e6, "MB")


def resume(kills: int = KILLS) -> Iterator[Row]:
    """Yield what runs that are killed at random moments come to."""
    with _folder() as folder:
        timed(dataset_words(folder / "whole", KILLED_ROOMS, 4, *GROUND_TRUTH, *SMALL, "--shard-rooms", "1"))
        there = list(killed(folder / "killed", kills, KILLED_ROOMS, 4, seed=17))
        same = manifest_sha256(folder / "whole") == manifest_sha256(folder / "killed")
        left = [path.name for path in (folder / "killed" / "shards").glob(".*")]
    yield Row(f"runs ended by SIGKILL at random moments, {KILLED_ROOMS} shards", float(len(there)), "")
    yield Row("  shards that were there, median", median(there), "")
    yield at_most("  manifests that differ from an undisturbed run's", float(not same), "", 0.0)
    yield at_most("  temporary folders left in the end", float(len(left)), "", 0.0)


def memory() -> Iterator[Row]:
    """Yield the memory of a worker over many rooms."""
    with _folder() as folder:
        series = memory_of_worker(folder / "dataset", MEMORY_ROOMS, 2, *GROUND_TRUTH, *SMALL)
    for part in range(5):
        low, high = part * MEMORY_ROOMS // 5, (part + 1) * MEMORY_ROOMS // 5
        yield Row(f"worker's memory, rooms {low} to {high}, median", median(mb for done, mb in series if low <= done <= high), "MB")
    second, last = (median(mb for done, mb in series if a <= done / MEMORY_ROOMS <= b) for a, b in ((0.2, 0.4), (0.8, 1.0)))
    yield at_most("  last fifth over second fifth", last / second, "", 1.05)


SECTIONS: dict[str, Callable[[], Iterator[Row]]] = {
    "workers": workers,
    "live": live,
    "time": time_rows,
    "write": write,
    "bytes": bytes_rows,
    "resume": resume,
    "memory": memory,
}
"""Name -> what yields its rows."""


@contextmanager
def _folder() -> Iterator[Path]:
    with tempfile.TemporaryDirectory(prefix="generate_bench_") as folder:
        yield Path(folder)


def main() -> None:
    """Print the tables that are asked for."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.generate_bench")
    parser.add_argument("--only", nargs="+", choices=SECTIONS, default=list(SECTIONS))
    parser.add_argument("--kills", type=int, default=KILLS)
    parser.add_argument("--write", action="store_true", help="write the table into docs/generate.md")
    arguments = parser.parse_args()
    found = []
    for name in arguments.only:
        rows = list(resume(arguments.kills) if name == "resume" else SECTIONS[name]())
        print(render_table(name, rows), flush=True)
        found += rows
    if arguments.write:
        write_section(DOCS / "generate.md", "generate bench", markdown_table(found))


if __name__ == "__main__":
    main()
