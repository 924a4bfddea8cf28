"""Paints a :class:`grammar.drawing.shapes.Drawing` as PNG."""

from __future__ import annotations

import io
from functools import cache

from PIL import Image, ImageDraw, ImageFont

from grammar.drawing.shapes import Drawing, Shape, dashes

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
