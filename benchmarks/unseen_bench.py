"""Cached colour in rooms that nobody has seen: how far it is from the path tracer's, by room and by material, and what is wrong in it.

python -m benchmarks.unseen_bench [--seed N] [--rooms N] [--types TYPE ...] [--presets NAME ...] [--size W H] [--samples N]
    [--references DIR] [--pictures DIR] [--json FILE] [--write]

The seed is drawn from the clock unless it is given.  A reference is the mean of two pictures of half the samples each, denoised each for
itself; how they differ tells the reference's own error.  Light is mean luminance over the reference's.  *Zero* pixels are black where the
path tracer sees light; *lone dark* ones have less than half the luminance of each of their eight neighbours, and not so in the reference.
"""

import argparse
import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from benchmarks.sampled_rooms import (
    SMALL,
    TIMES,
    VIEW,
    References,
    SampledRoom,
    camera_of,
    flip_map,
    flip_values,
    mean_luminance,
    preset_config,
    sample_room,
)
from benchmarks.seeds import add_seed
from benchmarks.table import DOCS, Row, at_most, markdown_table, render_table, write_section
from grammar import room_types
from grammar.synthesize import SceneSynthesizer
from renderer import Renderer, warm_up
from renderer.core.color import LUMINANCE
from renderer.film.tone import to_display

CLASSES = ("metal", "glass", "gloss", "matt")
"""What a surface is: let light through, is metal, is smooth or has a coat, or none of these."""
LEAST_SHARE = 0.01
"""Of a picture's pixels that a class has to have."""
ZOOM = 2


class Truth(NamedTuple):
    """A view by the path tracer: radiance, (h, w, 3) float32, what is displayed, (h, w, 3) uint8, and FLIP between its two halves."""

    radiance: NDArray[np.float32]
    color: NDArray[np.uint8]
    own_flip: float


class Figures(NamedTuple):
    """Of one room: FLIP in all and by class, light in all and by class, numbers of pixels; own_flip: of the reference's halves."""

    name: str
    preset: str
    flip: float
    own_flip: float
    light: float
    flip_of: dict[str, float]
    light_of: dict[str, float]
    zero: int
    lone_dark: int


def find_figures(
    seed: int,
    rooms: int,
    types: Sequence[str],
    presets: Sequence[str],
    size: tuple[int, int],
    references: References,
    pictures: Path | None,
) -> Iterator[Figures]:
    """Yield the figures of ``rooms`` rooms of each type by each preset, in views of (width, height) pixels.

    ``pictures``: a folder for cached, path traced, FLIP.
    """
    warm_up(integrator="cached")
    synthesizer = SceneSynthesizer.from_config()
    for index in range(rooms):
        for room_type in types:
            room = sample_room(synthesizer, room_type, index, TIMES, seed)
            truth = find_truth(room, size, references)
            for preset in presets:
                with Renderer(room.flat, camera_of(size), preset_config(preset), room.key) as renderer:
                    layers = ("color", "roughness", "metallic", "material", "depth")
                    frame = renderer.render(room.path[VIEW], VIEW, layers, exposure=room.exposure)
                assert frame.radiance is not None
                yield compare(room, preset, frame.layers, frame.radiance, truth)
                if pictures is not None:
                    pictures.mkdir(parents=True, exist_ok=True)
                    shown = np.asarray(frame.layers["color"], np.uint8)
                    _draw(pictures / f"{room.name.replace(' ', '_')}_{preset}.png", shown, truth.color)


def find_truth(room: SampledRoom, size: tuple[int, int], references: References) -> Truth:
    """Return the reference of a room's view, of twice the samples of ``references``."""
    halves = [references.view(half, VIEW, size) for half in (room, room._replace(key=room.key ^ 1))]
    radiance = np.asarray(0.5 * (halves[0].radiance + halves[1].radiance), np.float32)
    own = float(flip_values(halves[0].color, halves[1].color).mean())
    return Truth(radiance, np.asarray(to_display(radiance, room.exposure, preset_config("photo").tone_curve)), own)


def compare(room: SampledRoom, preset: str, layers: dict[str, Any], radiance: NDArray[np.float32], truth: Truth) -> Figures:
    """Return how far a frame is from the truth."""
    flip, here, there = flip_values(truth.color, layers["color"]), radiance @ LUMINANCE, truth.radiance @ LUMINANCE
    masks = {name: mask for name, mask in classes(room, layers).items() if mask.mean() >= LEAST_SHARE and there[mask].sum() > 0.0}
    return Figures(
        room.name,
        preset,
        float(flip.mean()),
        truth.own_flip,
        mean_luminance(radiance) / mean_luminance(truth.radiance),
        {name: float(flip[mask].mean()) for name, mask in masks.items()},
        {name: float(here[mask].sum() / there[mask].sum()) for name, mask in masks.items()},
        int(((here == 0.0) & (there > 0.0)).sum()),
        int((lone_dark(here) & ~lone_dark(there)).sum()),
    )


def classes(room: SampledRoom, layers: dict[str, Any]) -> dict[str, NDArray[np.bool_]]:
    """Return which pixels, (h, w), show which class."""
    materials, seen = room.flat.materials, np.isfinite(layers["depth"])
    glass = np.append(False, materials.transmission > 0.0)[layers["material"]]
    coat = np.append(False, materials.clearcoat > 0.0)[layers["material"]]
    metal = (layers["metallic"] > 0.5) & ~glass
    gloss = ((layers["roughness"] < 0.5) | coat) & ~glass & ~metal
    return {"metal": metal & seen, "glass": glass & seen, "gloss": gloss & seen, "matt": ~(metal | glass | gloss) & seen}


def lone_dark(luminance: NDArray[np.floating[Any]]) -> NDArray[np.bool_]:
    """Return the pixels, (h, w), with less than half the luminance of each of their eight neighbours; none of the rim."""
    height, width = luminance.shape
    around = [luminance[1 + i : height - 1 + i, 1 + j : width - 1 + j] for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0)]
    found = np.zeros(luminance.shape, np.bool_)
    found[1:-1, 1:-1] = luminance[1:-1, 1:-1] < 0.5 * np.min(around, axis=0)
    return found


def _draw(path: Path, picture: NDArray[np.uint8], truth: NDArray[np.uint8]) -> None:
    tiles = np.concatenate([picture, truth, flip_map(truth, picture)], axis=1)
    Image.fromarray(tiles).resize((ZOOM * tiles.shape[1], ZOOM * tiles.shape[0]), Image.Resampling.NEAREST).save(path)


def tabulate(found: Sequence[Figures], samples: int) -> list[Row]:
    """Return the measures of each preset over all rooms."""
    rows = []
    for preset in dict.fromkeys(room.preset for room in found):
        rooms = [room for room in found if room.preset == preset]
        flip, light = np.array([room.flip for room in rooms]), np.array([room.light for room in rooms])
        farthest = rooms[int(np.abs(light - 1.0).argmax())]
        rows += [
            at_most(f"{preset}, {len(rooms)} rooms, FLIP, median", float(np.median(flip)), "", 0.08),
            at_most("  90th percentile", float(np.quantile(flip, 0.9)), "", 0.10),
            at_most(f"  worst, {rooms[int(flip.argmax())].name}", float(flip.max()), "", 0.12),
            Row(
                f"  between halves of the references, {samples // 2} samples each", float(np.median([room.own_flip for room in rooms])), ""
            ),
            at_most(f"  mean luminance off by, most, {farthest.name}", 100.0 * abs(farthest.light - 1.0), "%", 3.0),
            Row("  rooms within 3 %", float((np.abs(light - 1.0) <= 0.03).sum()), ""),
        ]
        for name in CLASSES:
            having = [room for room in rooms if name in room.light_of]
            if having:
                light_of = np.array([room.light_of[name] for room in having])
                rows += [
                    Row(f"  {name}: FLIP, median of {len(having)} rooms", float(np.median([room.flip_of[name] for room in having])), ""),
                    at_most(f"  {name}: mean luminance off by, median", 100.0 * float(np.median(np.abs(light_of - 1.0))), "%", 10.0),
                ]
        rows += [
            at_most("  zero pixels, all rooms", float(sum(room.zero for room in rooms)), "", 0.0),
            Row("  lone dark pixels, median", float(np.median([room.lone_dark for room in rooms])), ""),
            at_most("  most", float(max(room.lone_dark for room in rooms)), "", 2.0),
        ]
    return rows


def describe(room: Figures) -> str:
    """Return a line on a room."""
    by_class = ", ".join(f"{name} {room.flip_of[name]:.3f} {room.light_of[name]:.3f}" for name in room.light_of)
    return (
        f"{room.name}, {room.preset}: FLIP {room.flip:.3f} (reference {room.own_flip:.3f}), light {room.light:.3f}; "
        f"FLIP and light of {by_class}; {room.zero} zero, {room.lone_dark} lone dark"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.unseen_bench")
    add_seed(parser)
    parser.add_argument("--rooms", type=int, default=2, help="of each type (default: %(default)s)")
    parser.add_argument("--types", nargs="+", choices=room_types(), default=list(room_types()), help="room types (default: all)")
    parser.add_argument("--presets", nargs="+", choices=("realtime", "stream"), default=["stream"], help="(default: stream)")
    parser.add_argument("--size", nargs=2, type=int, default=SMALL, metavar=("WIDTH", "HEIGHT"), help="pixels (default: %(default)s)")
    parser.add_argument("--samples", type=int, default=1024, help="of the references, both halves together (default: %(default)s)")
    parser.add_argument("--references", type=Path, metavar="DIR", help="halves of references are kept here, rendered if missing")
    parser.add_argument("--pictures", type=Path, metavar="DIR", help="write cached, path traced and FLIP of every room there")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures of every room to this file")
    parser.add_argument("--write", action="store_true", help="put the table into docs/cache.md")
    arguments = parser.parse_args()
    seed = arguments.seed
    references, found = References(arguments.references, arguments.samples // 2), []
    width, height = arguments.size
    print(f"seed {seed}", flush=True)
    for room in find_figures(seed, arguments.rooms, arguments.types, arguments.presets, (width, height), references, arguments.pictures):
        found.append(room)
        print(describe(room), flush=True)
    rows = tabulate(found, arguments.samples)
    print(render_table(f"Cached colour in unseen rooms, seed {seed}", rows))
    if arguments.json:
        arguments.json.write_text(json.dumps({"seed": seed, "rooms": [room._asdict() for room in found]}, indent=1))
    if arguments.write:
        caption = f"Seed {seed}, {width}x{height}, references of {arguments.samples} samples:\n\n"
        write_section(DOCS / "cache.md", "unseen", caption + markdown_table(rows))


if __name__ == "__main__":
    main()
