"""Labelled pictures in rows and columns as one image file, and drawings as PNG."""

import io
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from grammar.drawing.shapes import Drawing, Shape, dashes
from scene_description.whole import whole_file
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
    with whole_file(path) as partial:
        sheet.save(partial, format=FORMATS.get(path.suffix.lower(), "PNG"), quality=quality, optimize=True)


OVERSAMPLING = 2
"""Painted this many times as large and then averaged, against jagged edges."""

_ANCHOR = {"start": "lm", "middle": "mm", "end": "rm"}


def png_bytes(drawing: Drawing) -> bytes:
    """Return the drawing as a PNG file."""
    size = (round(drawing.width), round(drawing.height))
    sheet = Image.new("RGB", (size[0] * OVERSAMPLING, size[1] * OVERSAMPLING), (255, 255, 255))
    painter = ImageDraw.Draw(sheet, "RGBA")
    for shape in drawing.shapes:
        _PAINT[shape.kind](painter, shape)
    out = io.BytesIO()
    sheet.resize(size, Image.Resampling.BOX).save(out, format="PNG", optimize=True)
    return out.getvalue()


def _color(text: str, opacity: float = 1.0) -> tuple[int, int, int, int]:
    return int(text[1:3], 16), int(text[3:5], 16), int(text[5:7], 16), round(255 * opacity)


def _scaled(shape: Shape) -> list[tuple[float, float]]:
    return [(x * OVERSAMPLING, y * OVERSAMPLING) for x, y in shape.points]


def _paint_line(painter: ImageDraw.ImageDraw, shape: Shape) -> None:
    points, width = _scaled(shape), max(round(shape.width * OVERSAMPLING), 1)
    if shape.dash is None:
        painter.line(points, fill=_color(shape.stroke), width=width, joint="curve")
        return
    for piece in dashes(points, (shape.dash[0] * OVERSAMPLING, shape.dash[1] * OVERSAMPLING)):
        painter.line(piece, fill=_color(shape.stroke), width=width)


def _paint_area(painter: ImageDraw.ImageDraw, shape: Shape) -> None:
    points = _scaled(shape)
    if shape.fill:
        painter.polygon(points, fill=_color(shape.fill, shape.opacity))
    if shape.stroke:
        outline = Shape(kind="line", points=(*shape.points, shape.points[0]), stroke=shape.stroke, width=shape.width, dash=shape.dash)
        _paint_line(painter, outline)


def _paint_dot(painter: ImageDraw.ImageDraw, shape: Shape) -> None:
    x, y = _scaled(shape)[0]
    r = shape.size * OVERSAMPLING
    stroke = _color(shape.stroke) if shape.stroke else None
    fill = _color(shape.fill, shape.opacity) if shape.fill else None
    painter.ellipse((x - r, y - r, x + r, y + r), fill=fill, outline=stroke, width=round(shape.width * OVERSAMPLING))


def _paint_text(painter: ImageDraw.ImageDraw, shape: Shape) -> None:
    rim = round(0.11 * shape.size * OVERSAMPLING) if shape.halo else 0
    painter.text(
        _scaled(shape)[0],
        shape.text,
        fill=_color(shape.fill),
        font=_font(shape.size * OVERSAMPLING),
        anchor=_ANCHOR[shape.anchor],
        stroke_width=rim,
        stroke_fill=(255, 255, 255, 255) if rim else None,
    )


@cache
def _font(size: float) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size)


_PAINT = {"area": _paint_area, "line": _paint_line, "dot": _paint_dot, "text": _paint_text}
