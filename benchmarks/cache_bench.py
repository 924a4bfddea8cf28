"""What the irradiance cache trades: time of a frame and of a new room against the path tracer's light, in sampled rooms.

python -m benchmarks.cache_bench [settings] [--types TYPE ...] [--references DIR] [--samples N] [--write]
python -m benchmarks.cache_bench picture [--types TYPE ...] [--references DIR] [--samples N] [--preset NAME] [--out FILE]
python -m benchmarks.cache_bench all [--rooms N] [--references DIR] [--samples N] [--write]

*settings*: times are of one thread's processor at 640x480, of colour and the four basic layers: *first picture* is from a renderer that
knows nothing yet; *on the way* are the frames of a camera that walks on, which compute light for what comes into view; *known* are the
same frames once more; *everywhere* is light for the whole room.  Pictures are compared at 320x240 with denoised ones of exact transport.

*picture*: draws cached views beside path-traced ones, with FLIP of their pixels.

*all*: everything that is measured of the cache, one bench after the other, each in a process of its own, for a machine that does nothing
else: rates are by the clock.  A bench that fails does not keep the others from running.
"""

import argparse
import importlib.util
import shlex
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from PIL import Image

from benchmarks.sampled_rooms import (
    LARGE,
    LAYERS,
    SLOW,
    SMALL,
    VIEW,
    Reference,
    References,
    SampledRoom,
    camera_of,
    everywhere,
    flip_map,
    frame_times,
    mean_flip,
    mean_luminance,
    preset_config,
    sample_room,
    seconds,
)
from benchmarks.table import DOCS, Row, write_section
from grammar import room_types
from grammar.synthesize import SceneSynthesizer
from renderer import RenderConfig, Renderer, warm_up

ROOM_TYPES, DRAWN = ("bedroom", "kitchen", "living_room", "bathroom"), ("bedroom", "bathroom", "dining_room")
SAMPLES, FRAMES = 256, 15
MANY_SAMPLES = 1024
"""Of pictures that are drawn, and of the references of all rooms."""
SHOWN, QUALITY = (400, 300), 85
"""Size of each picture that is drawn, and the quality of the JPEG."""
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
        truth = references.view(room, 0, SMALL)
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
    with Renderer(room.flat, camera_of(SMALL), config, room.key) as renderer:
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


def draw_picture(out: Path, types: Sequence[str], references: References, preset: str) -> None:
    """Draw a row for each room: cached, path traced, FLIP from black (0) by violet and orange to pale yellow (1)."""
    synthesizer, rows = SceneSynthesizer.from_config(), []
    for room_type in types:
        room = sample_room(synthesizer, room_type, 0)
        truth = references.view(room, VIEW, LARGE).color
        with Renderer(room.flat, camera_of(LARGE), preset_config(preset), room.key) as renderer:
            picture = np.asarray(renderer.render(room.path[VIEW], VIEW, ("color",), exposure=room.exposure).layers["color"])
        print(f"{room.name}: FLIP {mean_flip(truth, picture):.3f}", flush=True)
        tiles = [np.asarray(Image.fromarray(image).resize(SHOWN)) for image in (picture, truth, flip_map(truth, picture))]
        rows.append(np.concatenate(tiles, axis=1))
    Image.fromarray(np.concatenate(rows)).save(out, quality=QUALITY, optimize=True)
    print(f"{out}: {out.stat().st_size // 1000} kB")


def measure_all(rooms: int, references: Path | None, samples: int, write: bool) -> None:
    """Run every bench of the cache, quick ones first; end with status 1 if one failed."""
    places = ["--references", str(references)] if references else []
    options = [*places, "--write"] if write else places
    commands = [
        ["rate_curves_bench", "--clock", *(["--write"] if write else [])],
        ["camera_rate_bench", "--rooms", str(rooms), "--samples", str(samples), *options],
        ["cache_bench", *options],
        ["walk_bench", "flicker", *options],
    ]
    if importlib.util.find_spec("open3d") and importlib.util.find_spec("cv2"):
        commands.append(["walk_bench", "perception", *options])
    if write:
        commands.append(["cache_bench", "picture", *places, "--samples", str(samples)])
    failed = []
    for name, *words in commands:
        command = [sys.executable, "-m", f"benchmarks.{name}", *words]
        print(shlex.join(command), flush=True)
        if subprocess.run(command).returncode:
            failed.append(name)
    if failed:
        raise SystemExit(f"failed: {', '.join(failed)}")


def main() -> None:
    """Print the table, draw the picture, or run all benches."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.cache_bench")
    parser.add_argument("what", nargs="?", choices=("settings", "picture", "all"), default="settings")
    parser.add_argument("--types", nargs="+", choices=room_types(), help="room types (default: four; of the picture three)")
    parser.add_argument("--rooms", type=int, default=2, help="of each type, with all (default: %(default)s)")
    parser.add_argument("--references", type=Path, metavar="DIR", help="pictures to compare with are kept here, rendered if missing")
    parser.add_argument("--samples", type=int, help=f"of the references (default: {SAMPLES}; of the picture and of all {MANY_SAMPLES})")
    parser.add_argument("--preset", choices=("realtime", "stream"), default="stream", help="of the picture (default: %(default)s)")
    parser.add_argument("--out", type=Path, default=DOCS / "cached.jpg", help="the picture (default: docs/cached.jpg)")
    parser.add_argument("--write", action="store_true", help="put tables and pictures into docs")
    arguments = parser.parse_args()
    samples = arguments.samples or (SAMPLES if arguments.what == "settings" else MANY_SAMPLES)
    if arguments.what == "all":
        measure_all(arguments.rooms, arguments.references, samples, arguments.write)
    elif arguments.what == "picture":
        draw_picture(arguments.out, arguments.types or DRAWN, References(arguments.references, samples), arguments.preset)
    else:
        types = arguments.types or ROOM_TYPES
        table = _markdown(find_figures(types, References(arguments.references, samples)), types, samples)
        print(table)
        if arguments.write:
            write_section(DOCS / "noise.md", "cache settings", table)


if __name__ == "__main__":
    main()
