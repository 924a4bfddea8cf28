"""Conversions of a bag: processor seconds a gigabyte of it, format by format.

python -m benchmarks.convert_bench [--bag BAG] [--only FORMAT ...] [--rooms N] [--frames N] [--json FILE]

The bag, unless one is given, has one 640x480 camera with the layers that the formats take, and no others, so that a gigabyte holds many
frames; 4 samples a pixel without a denoiser make pictures that compress badly.  Two cores work 120 s in a minute.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path

from benchmarks.table import Row, at_most, render_table
from grammar import SceneRequest
from grammar.synthesize import CameraTimes, SceneSynthesizer
from scene_description import SceneSynthError
from scene_synth_ros.cli.parameters.run_parameters import RunWords, run_parameters
from scene_synth_ros.convert.formats import FORMATS, writer_of
from scene_synth_ros.convert.pipeline import convert
from scene_synth_ros.convert.source import Choice, open_source
from scene_synth_ros.offline.offline_bag import OfflineBag
from scene_synth_ros.offline.settings import read_settings

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


def measure(names: list[str] | None = None, bag: Path | None = None, rooms: int = 2, frames: int = 12) -> list[Row]:
    """Return the rows of all formats, or of those named."""
    if bag is not None:
        return rows_of(bag, names or list(FORMATS))
    with tempfile.TemporaryDirectory() as folder:
        make_bag(Path(folder) / "bag", rooms, frames)
        return rows_of(Path(folder) / "bag", names or list(FORMATS))


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.convert_bench")
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
    rows = measure(arguments.only, arguments.bag, arguments.rooms, arguments.frames)
    print(render_table("Conversions", rows))
    if arguments.json:
        arguments.json.write_text(json.dumps([row._asdict() for row in rows], indent=1))


if __name__ == "__main__":
    main()
