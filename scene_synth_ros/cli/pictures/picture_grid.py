"""Labelled pictures in rows and columns, as one image file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from scene_synth_ros.cli.options import UsageError

INK, PAPER = (30, 30, 34), (250, 250, 248)
FORMATS = {".jpg": "JPEG", ".jpeg": "JPEG", ".png": "PNG"}
_GAP, _LABEL_HEIGHT = 3, 15


class Tile(NamedTuple):
    """A picture, (height, width, 3) uint8, and the line below it."""

    label: str
    picture: NDArray[np.uint8]


def write_grid(tiles: Sequence[Tile], columns: int, path: Path, quality: int = 85) -> None:
    """Write the tiles row by row as JPEG or PNG by the file's name; all have the size of the first.

    Raises:
        UsageError: there is no tile.
        OSError: the file cannot be written.
    """
    if not tiles:
        raise UsageError(f"{path}: expected at least one picture, got none")
    height, width = tiles[0].picture.shape[:2]
    rows = -(-len(tiles) // columns)
    step_x, step_y = width + _GAP, height + _LABEL_HEIGHT + _GAP
    sheet = Image.new("RGB", (_GAP + min(columns, len(tiles)) * step_x, _GAP + rows * step_y), PAPER)
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(10)
    for index, tile in enumerate(tiles):
        x, y = _GAP + index % columns * step_x, _GAP + index // columns * step_y
        sheet.paste(Image.fromarray(tile.picture), (x, y))
        draw.text((x + 2, y + height + 1), tile.label, INK, font)
    partial = path.with_name(f".{path.name}.partial")
    sheet.save(partial, format=FORMATS.get(path.suffix.lower(), "PNG"), quality=quality, optimize=True)
    partial.replace(path)
