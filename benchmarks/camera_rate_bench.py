"""Colour by the irradiance cache in sampled rooms of every type: rates, stages, a new room's first frame, memory, error.

python -m benchmarks.camera_rate_bench [--rooms N] [--types TYPE ...] [--references DIR] [--samples N] [--preset NAME] [--threads N]
    [--json FILE] [--write]

Rates are of colour, depth, normals, semantic and instance ids together, in one process, along the rooms' own camera paths, by the clock:
*known* where all light is known that the path sees, *on the way* as the camera comes by for the first time.  Errors are against the path
tracer with so many samples, denoised and as it is: FLIP of what is displayed, and mean luminance.  A new room begins with its description:
mesh, textures, the renderer, metering and light of the first view follow.
"""

import argparse
import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.sampled_rooms import (
    LARGE,
    SMALL,
    VIEW,
    References,
    SampledRoom,
    bare_s,
    camera_of,
    frame_times,
    mean_flip,
    mean_luminance,
    new_room_s,
    preset_config,
    sample_rooms,
    seconds,
    stage_times,
)
from benchmarks.table import DOCS, Row, at_least, at_most, markdown_table, render_table, write_section
from grammar import room_types
from renderer import RenderConfig, Renderer, warm_up

COMPARED = {
    "realtime": preset_config("realtime"),
    "stream": preset_config("stream"),
    "path traced, 1 sample": preset_config("stream", integrator="path", denoise="auto"),
    "balanced": preset_config("balanced"),
}
"""What is compared with the reference; ``stream`` once was the path tracer with one sample, denoised."""


class Error(NamedTuple):
    """Of one picture: FLIP against the denoised and the raw reference, mean luminance over its own, seconds by clock and processor."""

    flip: float
    raw_flip: float
    light: float
    clock_s: float
    processor_s: float


class Figures(NamedTuple):
    """Of one room: frames/s, milliseconds, seconds, MB; share of bare packets; milliseconds of processor by stage; errors by name."""

    name: str
    triangles: int
    known_rate: float
    way_rate: float
    processor_ms: float
    small_rate: float
    first_s: float
    filled_s: float
    memory_mb: float
    bare_share: float
    stages: dict[str, float]
    errors: dict[str, Error]


def measure(
    rooms: int = 1, types: Sequence[str] = (), preset: str = "stream", threads: int = 0, references: References | None = None
) -> list[Row]:
    """Return the table of ``rooms`` rooms of each type; without ``references`` no errors."""
    return tabulate(find_figures(rooms, types, preset, threads, references), references.samples if references else 0)


def find_figures(rooms: int, types: Sequence[str], preset: str, threads: int, references: References | None) -> list[Figures]:
    """Measure rooms one after the other, and print each."""
    warm_up(integrator="cached")
    next(sample_rooms(1, types))  # what only the first room loads
    config, found = preset_config(preset, threads=threads), []
    for room in sample_rooms(rooms, types):
        found.append(_measure_room(room, config, references))
        print(describe(found[-1]), flush=True)
    return found


def _measure_room(room: SampledRoom, config: RenderConfig, references: References | None) -> Figures:
    first_s, filled_s, memory_mb = new_room_s(room, LARGE, config)
    with Renderer(room.flat, camera_of(LARGE), config, room.key) as renderer:
        way, known = frame_times(renderer, room), frame_times(renderer, room)
        stages = stage_times(renderer, room)
    with Renderer(room.flat, camera_of(SMALL), config, room.key) as renderer:
        frame_times(renderer, room)
        small = frame_times(renderer, room)
    return Figures(
        name=room.name,
        triangles=len(room.flat.mesh.faces),
        known_rate=1.0 / known.clock_s,
        way_rate=1.0 / way.clock_s,
        processor_ms=1e3 * known.processor_s,
        small_rate=1.0 / small.clock_s,
        first_s=first_s,
        filled_s=filled_s,
        memory_mb=memory_mb,
        bare_share=bare_s(room, LARGE) / known.processor_s,
        stages=stages,
        errors=_errors(room, references) if references else {},
    )


def _errors(room: SampledRoom, references: References) -> dict[str, Error]:
    truth, pose, found = references.view(room, VIEW, LARGE), room.path[VIEW], {}
    for name, config in COMPARED.items():
        with Renderer(room.flat, camera_of(LARGE), config, room.key) as renderer:
            frames: list[Any] = []
            for _ in range(2 if config.integrator == "cached" else 1):
                spent = seconds(lambda frames=frames: frames.append(renderer.render(pose, VIEW, ("color",), exposure=room.exposure)))
            frame = frames[-1]
        picture, light = frame.layers["color"], mean_luminance(frame.radiance) / mean_luminance(truth.radiance)
        found[name] = Error(mean_flip(truth.color, picture), mean_flip(truth.color_noisy, picture), light, *spent)
    return found


def describe(room: Figures) -> str:
    """Return a line on a room."""
    parts = [
        f"{room.name}, {room.triangles} triangles: {room.known_rate:.1f} frames/s, {room.way_rate:.1f} on the way",
        f"{room.small_rate:.1f} at 320x240, {room.processor_ms:.0f} ms of processor",
        f"first {room.first_s:.2f} s, filled {room.filled_s:.2f} s, {room.memory_mb:.0f} MB",
        *(f"{name}: FLIP {item.flip:.3f}, raw {item.raw_flip:.3f}, mean {item.light:.3f}" for name, item in room.errors.items()),
    ]
    return "; ".join(parts)


def tabulate(found: Sequence[Figures], samples: int) -> list[Row]:
    """Return the measures over rooms; ``samples``: those of the references."""

    def column(name: str) -> NDArray[np.float64]:
        return np.array([getattr(room, name) for room in found])

    def middle(name: str) -> float:
        return float(np.median(column(name)))

    rate, first, filled, size = column("known_rate"), column("first_s"), column("filled_s"), f"{LARGE[0]}x{LARGE[1]}"
    rows = [
        at_least(f"{len(found)} rooms, {size}, median", middle("known_rate"), "frames/s", 15.0),
        at_least(f"  slowest, {found[int(rate.argmin())].name}", float(rate.min()), "frames/s", 10.0),
        Row("  on the way, median", middle("way_rate"), "frames/s"),
        at_least(f"{SMALL[0]}x{SMALL[1]}, median", middle("small_rate"), "frames/s", 30.0),
        at_most("a new room to its first frame, median", float(np.median(first)), "s", 2.5),
        at_most(f"  slowest, {found[int(first.argmax())].name}", float(first.max()), "s", 4.0),
        at_most(f"  to light everywhere in it, slowest, {found[int(filled.argmax())].name}", float(filled.max()), "s", 6.0),
        at_most("memory of a room's cache, most", float(column("memory_mb").max()), "MB", 100.0),
        Row("a frame's time of processor, median", middle("processor_ms"), "ms"),
        Row("  share of bare Embree packets for its pixels", 100.0 * middle("bare_share"), "%"),
    ]
    for stage in found[0].stages:
        rows.append(Row(f"  {stage}", float(np.median([room.stages[stage] for room in found])), "ms"))
    return rows + _error_rows(found, samples)


def _error_rows(found: Sequence[Figures], samples: int) -> list[Row]:
    rows = []
    for name in found[0].errors:
        error = Error(*(np.array(values) for values in zip(*(room.errors[name] for room in found), strict=True)))  # type: ignore[arg-type]
        flip, tail = float(np.median(error.flip)), float(np.quantile(error.flip, 0.9))
        farthest = int(np.abs(np.asarray(error.light) - 1.0).argmax())
        off = abs(found[farthest].errors[name].light - 1.0)
        looked_up = COMPARED[name].integrator == "cached"

        def held(row: Row, limit: float, looked_up: bool = looked_up) -> Row:
            return at_most(row.name, row.value, row.unit, limit) if looked_up else row

        rows += [
            held(Row(f"{name}, FLIP, {samples} samples denoised, median", flip, ""), 0.08),
            held(Row("  90th percentile", tail, ""), 0.11),
            Row("  against the raw samples, median", float(np.median(error.raw_flip)), ""),
            held(Row(f"  mean luminance off by, most, {found[farthest].name}", 100.0 * off, "%"), 3.0),
            Row("  colour by the clock, median", 1e3 * float(np.median(error.clock_s)), "ms"),
            Row("  colour, time of processor, median", 1e3 * float(np.median(error.processor_s)), "ms"),
        ]
    return rows


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.camera_rate_bench")
    parser.add_argument("--rooms", type=int, default=1, help="of each type (default: %(default)s)")
    parser.add_argument("--types", nargs="+", choices=room_types(), default=[], help="room types (default: all)")
    parser.add_argument(
        "--preset", choices=("realtime", "stream"), default="stream", help="whose rates are measured (default: %(default)s)"
    )
    parser.add_argument("--threads", type=int, default=0, help="of the rates; 0 takes all (default: %(default)s)")
    parser.add_argument(
        "--references", type=Path, metavar="DIR", help="measure errors too, against pictures kept here, rendered if missing"
    )
    parser.add_argument("--samples", type=int, default=1024, help="of the references (default: %(default)s)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures of every room to this file")
    parser.add_argument("--write", action="store_true", help="put the table into docs/cache.md")
    arguments = parser.parse_args()
    references = References(arguments.references, arguments.samples) if arguments.references else None
    found = find_figures(arguments.rooms, arguments.types, arguments.preset, arguments.threads, references)
    rows = tabulate(found, arguments.samples)
    print(render_table("Colour by the cache", rows))
    if arguments.json:
        plain = [room._asdict() | {"errors": {name: error._asdict() for name, error in room.errors.items()}} for room in found]
        arguments.json.write_text(json.dumps(plain, indent=1))
    if arguments.write:
        asked = arguments.threads or len(os.sched_getaffinity(0))
        caption = f"{len(found)} rooms, rates of `{arguments.preset}` by the clock on {asked} threads:\n\n"
        write_section(DOCS / "cache.md", "camera_rate", caption + markdown_table(rows))


if __name__ == "__main__":
    main()
