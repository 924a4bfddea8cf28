"""``scene_synth gallery``: contact sheets of every model, every material and a room of each type."""

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from grammar import SceneRequest
from grammar.appearance.materials import Palette, draw_material
from grammar.synthesize import CameraTimes, SceneSynthesizer
from renderer import CameraConfig, RenderConfig, Renderer
from renderer.exposure import exposed, meter
from renderer.material_sheet import render_material
from renderer.scene.flatten import flatten
from renderer.scene.scene_key import scene_key
from scene_description import SceneDescription
from scene_synth_ros.cli.pictures.gallery import EXPOSURE_EV100, HORIZONTAL_FOV_RAD, studio_scene, typical_examples
from scene_synth_ros.cli.pictures.picture_grid import Tile, write_grid

MODEL_CAMERA = CameraConfig(width=144, height=144, horizontal_fov_rad=HORIZONTAL_FOV_RAD)
ROOM_CAMERA = CameraConfig(width=384, height=288)
VIEWS = 2
BALL_EDGE_PX, QUALITY = 120, 80
BALL_HUES_DEG = (235.0, 40.0)
"""Main and second hue of the palette that the materials are drawn with: blue and terracotta."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument(
        "--out", type=Path, required=True, metavar="DIR", help="folder for models_<n>.jpg, materials_<n>.jpg and rooms_<n>.jpg"
    )
    parser.add_argument("--only", metavar="WORD", help="only models, materials and room types whose name contains WORD")
    parser.add_argument(
        "--kind", choices=("all", *(kind for kind, *_ in SHEETS)), default="all", help="what to draw (default: %(default)s)"
    )
    parser.add_argument("--seed", type=int, default=1, help="seed of models, materials and rooms (default: %(default)s)")
    parser.add_argument("--spp", type=int, default=32, help="samples per pixel (default: %(default)s)")


def run(arguments: argparse.Namespace) -> int:
    """Draw; files that exist are replaced."""
    synthesizer, out = SceneSynthesizer.from_config(), arguments.out
    asked = (synthesizer, arguments.only or "", arguments.seed, arguments.spp)
    out.mkdir(parents=True, exist_ok=True)
    kinds = [kind for kind, *_ in SHEETS if arguments.kind in ("all", kind)]
    for kind, draw, columns, rows in SHEETS:
        tiles = list(draw(*asked)) if kind in kinds else []
        for sheet, first in enumerate(range(0, len(tiles), columns * rows), 1):
            write_grid(tiles[first : first + columns * rows], columns, out / f"{kind}_{sheet}.jpg", QUALITY)
    sys.stderr.write("\n")
    return 0


def _models(synthesizer: SceneSynthesizer, only: str, seed: int, spp: int) -> Iterator[Tile]:
    for category, example in typical_examples(synthesizer.grammars, synthesizer.small_things).items():
        if only not in category:
            continue
        for style in synthesizer.appearance.categories[category].styles:
            sys.stderr.write(f"\r{category} {style:32s}")
            scene = studio_scene(synthesizer, category, example, style, seed)
            yield Tile(f"{category} {style}".replace("_", " "), next(_views(scene, MODEL_CAMERA, spp, 1, EXPOSURE_EV100)))


def _materials(synthesizer: SceneSynthesizer, only: str, seed: int, spp: int) -> Iterator[Tile]:
    palette = Palette(main_deg=BALL_HUES_DEG[0], second_deg=BALL_HUES_DEG[1], accent_deg=BALL_HUES_DEG[1])
    for name, kind in sorted(synthesizer.appearance.materials.items(), key=lambda entry: (entry[1].family, entry[0])):
        if only not in name:
            continue
        sys.stderr.write(f"\r{name:40s}")
        rng = np.random.default_rng(np.random.SeedSequence([seed, *name.encode()]))
        yield Tile(name.replace("_", " "), render_material(draw_material(rng, kind, name, palette), BALL_EDGE_PX, spp))


def _rooms(synthesizer: SceneSynthesizer, only: str, seed: int, spp: int) -> Iterator[Tile]:
    times = CameraTimes(frames=24, start_ns=0, rate_hz=10.0)
    for index, room_type in enumerate(synthesizer.grammars):
        if only not in room_type:
            continue
        sys.stderr.write(f"\r{room_type:40s}")
        scene = synthesizer.synthesize(SceneRequest(room_type=room_type), seed, index, times)
        for view, picture in enumerate(_views(scene, ROOM_CAMERA, spp, VIEWS)):
            yield Tile(f"{room_type}, view {view + 1}".replace("_", " "), picture)


def _views(scene: SceneDescription, camera: CameraConfig, spp: int, count: int, ev100: float | None = None) -> Iterator[NDArray[np.uint8]]:
    """Render the views of a scene's camera path that show most, at one exposure: that given, or the metered one."""
    flat, config, key = flatten(scene), RenderConfig(samples_per_pixel=spp, clamp=8.0, denoise="auto"), scene_key(scene)
    path = scene.camera_path
    with Renderer(flat, camera, config, key) as renderer:
        if ev100 is None:
            exposure = exposed(replace(config, auto_exposure=True), meter(flat, camera, config, key, path, like=renderer))
        else:
            exposure = exposed(replace(config, exposure_ev100=ev100, white_balance="none"), None)
        shown = [_shown(renderer.render(pose, frame, ("instance",)).layers["instance"]) for frame, pose in enumerate(path)]
        for frame in sorted(_most_telling(shown, count)):
            yield renderer.render(path[frame], frame, ("color",), exposure=exposure).layers["color"].astype(np.uint8)


def _shown(instances: NDArray[np.generic]) -> frozenset[int]:
    """Return the objects that cover at least a hundredth of a frame."""
    found, pixels = np.unique(instances, return_counts=True)
    return frozenset(int(thing) for thing in found[(pixels >= 0.01 * instances.size) & (found > 0)])


def _most_telling(shown: Sequence[frozenset[int]], count: int) -> list[int]:
    """Return frames a third of the path apart or more, each the first that adds most to those before; what was seen counts a quarter."""
    chosen: list[int] = []
    apart = max(1, len(shown) // 3)
    for _ in range(count):
        seen = frozenset[int]().union(*(shown[frame] for frame in chosen))
        rest = [frame for frame in range(len(shown)) if all(abs(frame - other) >= apart for other in chosen)]
        if not rest:
            break
        chosen.append(max(rest, key=lambda frame: len(shown[frame] - seen) + 0.25 * len(shown[frame] & seen)))
    return chosen


SHEETS = (("models", _models, 11, 8), ("materials", _materials, 12, 8), ("rooms", _rooms, 4, 4))
"""Kind, how it is drawn, and the columns and rows of its sheets."""
