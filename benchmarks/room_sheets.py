"""Views from above of sampled rooms on sheets, four to each, with seed, index and the faults that were found, so that a person can look."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from grammar import SceneRequest
from grammar.checks.faults import scene_faults
from grammar.drawing.top_view import top_view
from grammar.synthesize import CameraTimes, SceneSynthesizer
from scene_synth_ros.cli.pictures.drawing_png import png_bytes
from scene_synth_ros.cli.pictures.picture_grid import Tile, write_grid

COLUMNS, TILE = 2, (1000, 760)
TIMES = CameraTimes(frames=1, start_ns=0, rate_hz=1.0)


def write_sheets(folder: Path, types: Sequence[str], seed: int, views: int) -> Iterator[Path]:
    """Write ``<type>.png`` for each type with its rooms 0 to ``views`` - 1, and yield the paths."""
    folder.mkdir(parents=True, exist_ok=True)
    synthesizer = SceneSynthesizer.from_config()
    for name in types:
        tiles = [_tile(synthesizer, name, seed, index) for index in range(views)]
        path = folder / f"{name}.png"
        write_grid(tiles, COLUMNS, path)
        yield path


def _tile(synthesizer: SceneSynthesizer, room_type: str, seed: int, index: int) -> Tile:
    scene = synthesizer.synthesize(SceneRequest(room_type=room_type), seed, index, TIMES)
    found = scene_faults(scene, synthesizer.categories)
    told = "; ".join(f"{name} {','.join(map(str, ids))}" for name, ids in found.items()) or "no fault found"
    view = top_view(replace(scene, camera_path=scene.camera_path[:1]))
    return Tile(f"{room_type} {index}, seed {seed}: {told}", _fitted(png_bytes(view)))


def _fitted(png: bytes) -> NDArray[np.uint8]:
    """Return a picture on a white sheet of the size ``TILE``, shrunk where it is larger."""
    picture = Image.open(io.BytesIO(png)).convert("RGB")
    picture.thumbnail(TILE)
    sheet = Image.new("RGB", TILE, (255, 255, 255))
    sheet.paste(picture, (0, 0))
    return np.asarray(sheet)
