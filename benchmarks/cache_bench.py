"""What the settings of the irradiance cache trade: time of a frame and of a new room against the path tracer's light, in sampled rooms.

python -m benchmarks.cache_bench [--types TYPE ...] [--references DIR] [--samples N] [--write]

Times are of one thread's processor at 640x480, of colour and the four basic layers: *first picture* is from a renderer that knows nothing
yet; *on the way* are the frames of a camera that walks on, which compute light for what comes into view; *known* are the same frames once
more; *everywhere* is light for the whole room.  Pictures are compared at 320x240 with denoised ones of exact transport.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.frame_times import everywhere, frame_times, seconds
from benchmarks.sampled_rooms import (
    LAYERS,
    SLOW,
    Reference,
    References,
    SampledRoom,
    camera_of,
    mean_flip,
    mean_luminance,
    preset_config,
    sample_room,
)
from benchmarks.table import DOCS, Row, write_section
from grammar import room_types
from grammar.synthesize import SceneSynthesizer
from renderer import RenderConfig, Renderer, warm_up

ROOM_TYPES = ("bedroom", "kitchen", "living_room", "bathroom")
LARGE, COMPARED = (640, 480), (320, 240)
SAMPLES, FRAMES = 256, 15
CHANGES: dict[str, tuple[str, dict[str, float | int]]] = {
    "`realtime`": ("realtime", {}),
    "`stream`": ("stream", {}),
    "`stream`, `cache_spacing_m` 0.02": ("stream", {"cache_spacing_m": 0.02}),
    "`stream`, `cache_spacing_m` 0.08": ("stream", {"cache_spacing_m": 0.08}),
    "`stream`, `cache_rays` 16": ("stream", {"cache_rays": 16}),
    "`stream`, `cache_rays` 256": ("stream", {"cache_rays": 256}),
    "`stream`, `cache_light_samples` 8": ("stream", {"cache_light_samples": 8}),
    "`stream`, `cache_light_samples` 32": ("stream", {"cache_light_samples": 32}),
}
"""Name -> preset, and what is changed of it."""


class Figures(NamedTuple):
    """One room with one setting: milliseconds, seconds, megabytes, and shares; or what all rooms together give."""

    known_ms: float
    on_the_way_ms: float
    first_s: float
    everywhere_s: float
    memory_mb: float
    mean: float
    flip: float


TITLES = ("frame, known, ms", "on the way, ms", "first picture, s", "everywhere, s", "MB", "mean", "FLIP")
"""Of the fields of ``Figures``."""


def measure(types: Sequence[str] = ROOM_TYPES, references: References | None = None) -> list[Row]:
    """Return the rows of every setting."""
    rows = []
    for name, figures in find_figures(types, references or References(None, SAMPLES)).items():
        rows += [Row(f"{name}: {title}", value, "") for title, value in zip(TITLES, figures, strict=True)]
    return rows


def find_figures(types: Sequence[str], references: References) -> dict[str, Figures]:
    """Return, for every setting, medians of the rooms, and the mean luminance over the exact one of the room farthest from 1."""
    warm_up(integrator="cached")
    synthesizer = SceneSynthesizer.from_config()
    found: dict[str, list[Figures]] = {name: [] for name in CHANGES}
    for room_type in types:
        room = sample_room(synthesizer, room_type, 0, SLOW)
        room = room._replace(path=room.path[:FRAMES])
        truth = references.view(room, 0, COMPARED)
        for name, (preset, changes) in CHANGES.items():
            found[name].append(_compare(room, preset_config(preset, threads=1, **changes), truth))
            print(room.name, name, *(f"{value:.3g}" for value in found[name][-1]), flush=True)
    settings = {}
    for name, figures in found.items():
        columns = Figures(*np.array(figures).T)
        farthest = float(columns.mean[np.argmax(np.abs(np.asarray(columns.mean) - 1.0))])
        settings[name] = Figures(*(float(np.median(column)) for column in columns))._replace(mean=farthest)
    return settings


def _compare(room: SampledRoom, config: RenderConfig, truth: Reference) -> Figures:
    with Renderer(room.flat, camera_of(LARGE), config, room.key) as renderer:
        _, first_s = seconds(lambda: renderer.render(room.path[0], 0, LAYERS, exposure=room.exposure, path=room.path))
        way, known = frame_times(renderer, room), frame_times(renderer, room)
    with Renderer(room.flat, camera_of(COMPARED), config, room.key) as renderer:
        frame = renderer.render(room.path[0], 0, ("color",), exposure=room.exposure)
    with Renderer(room.flat, camera_of(LARGE), config, room.key) as renderer:
        _, everywhere_s = seconds(lambda: renderer.cached().prepare(everywhere(room.flat, config.cache_spacing_m)))
        memory_mb = renderer.cached().size_bytes / 1e6
    mean, flip = mean_luminance(frame.radiance) / mean_luminance(truth.radiance), mean_flip(truth.color, frame.layers["color"])
    return Figures(1e3 * known.processor_s, 1e3 * way.processor_s, first_s, everywhere_s, memory_mb, mean, flip)


def _markdown(settings: dict[str, Figures], types: Sequence[str], samples: int) -> str:
    names = ", ".join(name.replace("_", " ") for name in types)
    lines = [
        f"Medians of {len(types)} rooms ({names}; the mean is that of the room farthest from 1), {samples} denoised samples:\n",
        "| | " + " | ".join(TITLES) + " |",
        "|" + " --- |" * (1 + len(TITLES)),
    ]
    for name, figures in settings.items():
        known, way, *others, memory, mean, flip = figures
        cells = [f"{known:.0f}", f"{way:.0f}", *(f"{value:.2f}" for value in others), f"{memory:.0f}", f"{mean:.3f}", f"{flip:.3f}"]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.cache_bench")
    parser.add_argument("--types", nargs="+", choices=room_types(), default=list(ROOM_TYPES), help="room types (default: four)")
    parser.add_argument("--references", type=Path, metavar="DIR", help="pictures to compare with are kept here, rendered if missing")
    parser.add_argument("--samples", type=int, default=SAMPLES, help="of the references (default: %(default)s)")
    parser.add_argument("--write", action="store_true", help="put the table into docs/noise.md")
    arguments = parser.parse_args()
    settings = find_figures(arguments.types, References(arguments.references, arguments.samples))
    table = _markdown(settings, arguments.types, arguments.samples)
    print(table)
    if arguments.write:
        write_section(DOCS / "noise.md", "cache settings", table)


if __name__ == "__main__":
    main()
