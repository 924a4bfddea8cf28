"""``scene_synth gallery``: contact sheets of every model, every material and a room of each type."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from grammar import SceneRequest
from grammar.synthesize import CameraTimes, SceneSynthesizer
from renderer import CameraConfig, RenderConfig, Renderer
from renderer.exposure import exposed, meter
from renderer.flatten import flatten
from renderer.scene_key import scene_key
from scene_description import SceneDescription
from scene_synth_ros.gallery import HORIZONTAL_FOV_RAD, studio_scene, typical_examples
from scene_synth_ros.picture_grid import Tile, write_grid

MODEL_CAMERA = CameraConfig(width=128, height=128, horizontal_fov_rad=HORIZONTAL_FOV_RAD)
ROOM_CAMERA = CameraConfig(width=320, height=240)
MODEL_COLUMNS, MODEL_ROWS, ROOM_COLUMNS, VIEWS = 12, 10, 4, 2


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for models_<n>.jpg and rooms.jpg")
    parser.add_argument("--only", metavar="WORD", help="only models and room types whose name contains WORD")
    parser.add_argument("--kind", choices=("all", "models", "rooms"), default="all", help="what to draw (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="seed of models and rooms (default: %(default)s)")
    parser.add_argument("--spp", type=int, default=24, help="samples per pixel (default: %(default)s)")


def run(arguments: argparse.Namespace) -> int:
    """Draw; files that exist are replaced."""
    synthesizer = SceneSynthesizer.from_config()
    arguments.out.mkdir(parents=True, exist_ok=True)
    if arguments.kind != "rooms":
        tiles = list(_models(synthesizer, arguments.only or "", arguments.seed, arguments.spp))
        per_sheet = MODEL_COLUMNS * MODEL_ROWS
        for sheet in range(-(-len(tiles) // per_sheet)):
            write_grid(tiles[sheet * per_sheet : (sheet + 1) * per_sheet], MODEL_COLUMNS, arguments.out / f"models_{sheet + 1}.jpg")
    if arguments.kind != "models":
        rooms = list(_rooms(synthesizer, arguments.only or "", arguments.seed, arguments.spp))
        if rooms:
            write_grid(rooms, ROOM_COLUMNS, arguments.out / "rooms.jpg", quality=80)
    sys.stderr.write("\n")
    return 0


def _models(synthesizer: SceneSynthesizer, only: str, seed: int, spp: int) -> Iterator[Tile]:
    for category, example in typical_examples(synthesizer.grammars).items():
        if only not in category:
            continue
        for style in synthesizer.appearance.categories[category].styles:
            sys.stderr.write(f"\r{category} {style:32s}")
            scene = studio_scene(synthesizer, category, example, style, seed)
            yield Tile(f"{category} {style}", next(_views(scene, MODEL_CAMERA, spp, 1)))


def _rooms(synthesizer: SceneSynthesizer, only: str, seed: int, spp: int) -> Iterator[Tile]:
    times = CameraTimes(frames=24, start_ns=0, rate_hz=10.0)
    for room_type in synthesizer.grammars:
        if only not in room_type:
            continue
        sys.stderr.write(f"\r{room_type:40s}")
        scene = synthesizer.synthesize(SceneRequest(room_type=room_type), seed, 0, times)
        for view, picture in enumerate(_views(scene, ROOM_CAMERA, spp, VIEWS)):
            yield Tile(f"{room_type}, view {view + 1}", picture)


def _views(scene: SceneDescription, camera: CameraConfig, spp: int, count: int) -> Iterator[NDArray[np.uint8]]:
    """Render views spread over a scene's camera path, at one metered exposure."""
    flat, config, key = flatten(scene), RenderConfig(samples_per_pixel=spp, clamp=8.0, denoise="auto"), scene_key(scene)
    path = scene.camera_path
    exposure = exposed(replace(config, auto_exposure=True), meter(flat, camera, config, key, path))
    with Renderer(flat, camera, config, key) as renderer:
        for view in range(count):
            index = int((view + 0.5) * len(path) / count)
            yield renderer.render(path[index], index, ("color",), exposure=exposure).layers["color"].astype(np.uint8)
