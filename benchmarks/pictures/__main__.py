"""Pictures of unseen rooms beside photographs, and what views show.

python -m benchmarks.pictures [--seed N] [--rooms N] [--types TYPE ...] [--size WIDTHxHEIGHT] [--preset NAME] [--overlay NAME]
    [--pictures DIR] [--page] [--of DIR] [--views N] [--json FILE] [--write]

The seed is drawn from the clock unless it is given.  Preset and overlays are those of ``scene_synth render``; pictures are what the sensor
reads (``color_sensed``), the camera at rest.  ``--of`` measures PNG files of a folder instead; ``--views`` judges the views of so
many rooms of each type by primary rays, without light.  ``--page`` puts the pictures into docs/pictures and docs/gallery.md.
"""

import argparse
import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from benchmarks.pictures.statistics import FIGURES, figures
from benchmarks.pictures.views import View, judge_views
from benchmarks.sampled_rooms import STILL, TIMES
from benchmarks.seeds import add_seed
from benchmarks.table import DOCS, Row, at_most, markdown_table, render_table, write_section
from grammar import SceneRequest, room_types
from grammar.synthesize import SceneSynthesizer
from renderer import RenderConfig, Renderer, warm_up
from renderer.exposure import exposed, meter
from renderer.scene.flatten import flatten
from renderer.scene.scene_key import scene_key
from scene_synth_ros.cli.parameters.render_settings import Settings, add_arguments, read_settings

PAGE_QUALITY = 80
"""Of JPEG files for the documentation."""
PHOTOGRAPHS: dict[str, dict[str, Any]] = json.loads((Path(__file__).parent / "photographs.json").read_text())
"""Statistics of real frames: means, and the ranges of several sets."""


def render_pictures(seed: int, rooms: int, types: Sequence[str], settings: Settings) -> Iterator[tuple[str, NDArray[np.uint8]]]:
    """Yield the best view of ``rooms`` rooms of each type, with names."""
    warm_up()
    synthesizer, camera, config = SceneSynthesizer.from_config(), settings.camera, settings.render
    for index in range(rooms):
        for place, room_type in enumerate(types):  # rooms of one index share daylight and palette
            scene = synthesizer.synthesize(SceneRequest(room_type=room_type), seed, index * len(types) + place, STILL)
            flat, key = flatten(scene, Path.cwd()), scene_key(scene)
            exposure = exposed(config, meter(flat, camera, RenderConfig(), key, scene.camera_path))
            with Renderer(flat, camera, config, key, sensor=settings.sensor) as renderer:
                frame = renderer.render(scene.camera_path[0], 0, ("color_sensed",), exposure=exposure)
            yield f"{room_type}_{index}", np.asarray(frame.layers["color_sensed"], np.uint8)


def tabulate(found: Sequence[dict[str, float]]) -> list[Row]:
    """Return the means of figures beside those of photographs, and whether they lie in the range of these."""
    rows = []
    for name in FIGURES:
        value, real = float(np.mean([row[name] for row in found])), PHOTOGRAPHS["mean"][name]
        low, high = PHOTOGRAPHS["range"].get(name, (None, None))
        measure = f"{real:g}" if low is None else f"{real:g} ({low:g} to {high:g})"
        rows.append(Row(name, value, "", measure, None if low is None else low <= value <= high))
    return rows


def view_rows(views: dict[str, list[list[View]]]) -> list[Row]:
    """Return what views show: of all frames, and of the first of each path."""
    rows = []
    for name, chosen in (
        ("all frames", [view for rooms in views.values() for room in rooms for view in room]),
        ("first frames", [room[0] for rooms in views.values() for room in rooms]),
        ("hallways", [view for room in views.get("hallway", []) for view in room]),
    ):
        if chosen:
            rows += [
                at_most(f"{name} ({len(chosen)}): a plane > 60 %", 100.0 * float(np.mean([view.plane > 0.6 for view in chosen])), "%", 1.0),
                Row("  a plane > 40 %", 100.0 * float(np.mean([view.plane > 0.4 for view in chosen])), "%"),
                at_most("  fewer than 3 things", 100.0 * float(np.mean([view.things < 3 for view in chosen])), "%", 1.0),
                Row("  nearer than 0.8 m on > 5 %", 100.0 * float(np.mean([view.near > 0.05 for view in chosen])), "%"),
                Row("  median depth < 1.2 m", 100.0 * float(np.mean([view.depth_m < 1.2 for view in chosen])), "%"),
            ]
    return rows


def find_views(seed: int, rooms: int, types: Sequence[str]) -> dict[str, list[list[View]]]:
    """Return what the views of ``rooms`` rooms of each type show."""
    synthesizer = SceneSynthesizer.from_config()
    return {
        room_type: [
            judge_views(flatten(scene, Path.cwd()), scene.camera_path)
            for scene in (synthesizer.synthesize(SceneRequest(room_type=room_type), seed, index, TIMES) for index in range(rooms))
        ]
        for room_type in types
    }


def _measured(arguments: argparse.Namespace, seed: int) -> Iterator[tuple[str, dict[str, float]]]:
    """Yield names and figures of the pictures that are rendered, or read, as they come."""
    if arguments.of:
        files = sorted(arguments.of.rglob("*.png"))
        pictures: Iterator[tuple[str, NDArray[np.uint8]]] = ((path.stem, np.asarray(Image.open(path).convert("RGB"))) for path in files)
    else:
        pictures = render_pictures(seed, arguments.rooms, arguments.types, read_settings(arguments))
    for name, picture in pictures:
        print(name, flush=True)
        if arguments.pictures:
            arguments.pictures.mkdir(parents=True, exist_ok=True)
            Image.fromarray(picture).save(arguments.pictures / f"{name}.{'jpg' if arguments.page else 'png'}", quality=PAGE_QUALITY)
        yield name, figures(picture)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.pictures")
    add_seed(parser)
    parser.add_argument("--rooms", type=int, default=3, help="of each type (default: %(default)s)")
    parser.add_argument("--types", nargs="+", choices=room_types(), default=list(room_types()), help="room types (default: all)")
    add_arguments(parser)
    parser.set_defaults(size="512x384")
    parser.add_argument("--pictures", type=Path, metavar="DIR", help="write every picture there")
    parser.add_argument("--page", action="store_true", help="put the pictures, as JPEG, into docs/pictures and docs/gallery.md")
    parser.add_argument("--of", type=Path, metavar="DIR", help="measure the PNG files of a folder instead of rendering")
    parser.add_argument("--views", type=int, metavar="N", help="judge the views of N rooms of each type instead of rendering")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures of every picture or view to this file")
    parser.add_argument("--write", action="store_true", help="put the table into docs/cameras.md")
    arguments = parser.parse_args()
    if arguments.page:
        arguments.pictures = DOCS / "pictures"
    seed = arguments.seed
    told: dict[str, Any] = {"seed": seed}
    if arguments.views:
        section, told["views"] = "views", find_views(seed, arguments.views, arguments.types)
        title, rows = f"Views of unseen rooms, seed {seed}", view_rows(told["views"])
    else:
        section, told["pictures"] = "pictures", dict(_measured(arguments, seed))
        rows = tabulate(list(told["pictures"].values()))
        title = f"{len(told['pictures'])} pictures beside photographs: means, those of photographs, ranges of their sets; seed {seed}"
    print(render_table(title, rows))
    if arguments.page:
        links = "\n".join(f"![{name.replace('_', ' ')}](pictures/{name}.jpg)" for name in told["pictures"])
        write_section(DOCS / "gallery.md", "photographs", f"Seed {seed}:\n\n{links}")
    if arguments.write:
        write_section(DOCS / "cameras.md", section, f"{title}:\n\n{markdown_table(rows)}")
    if arguments.json:
        arguments.json.write_text(json.dumps(told, indent=1))


if __name__ == "__main__":
    main()
