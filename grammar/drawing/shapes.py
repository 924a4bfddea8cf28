"""Flat drawings as data: shapes in pixels, y downwards, painted in their order.  As SVG text here, as a raster by who has a painter."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal
from xml.sax.saxutils import escape, quoteattr

Point = tuple[float, float]

TEXT_WIDTH = 0.56
"""Mean width of a letter of the sans-serif font, over the font's size; for the layout of labels."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Shape:
    """One shape.

    kind: "area" (closed polygon), "line" (open), "dot" (circle about ``points[0]``), "text" (its vertical middle at ``points[0]``);
    points: pixels; fill, stroke: "#rrggbb" or "" for none; opacity: of the fill; width: of the stroke, pixels; dash: lengths drawn and
    left out, pixels; size: radius of a dot, height of letters; anchor: which end of the text ``points[0]`` is; halo: whether letters have a
    white rim.
    """

    kind: Literal["area", "line", "dot", "text"]
    points: tuple[Point, ...]
    fill: str = ""
    opacity: float = 1.0
    stroke: str = ""
    width: float = 1.0
    dash: tuple[float, float] | None = None
    size: float = 0.0
    text: str = ""
    anchor: Literal["start", "middle", "end"] = "middle"
    halo: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Drawing:
    """Shapes on a white sheet of ``width`` x ``height`` pixels."""

    width: float
    height: float
    shapes: tuple[Shape, ...]


def area(points: Iterable[Point], fill: str, *, opacity: float = 1.0, stroke: str = "", width: float = 1.0) -> Shape:
    """Return a filled polygon."""
    return Shape(kind="area", points=tuple(points), fill=fill, opacity=opacity, stroke=stroke, width=width)


def line(points: Iterable[Point], stroke: str, width: float = 1.0, dash: tuple[float, float] | None = None) -> Shape:
    """Return an open line."""
    return Shape(kind="line", points=tuple(points), stroke=stroke, width=width, dash=dash)


def dot(point: Point, radius: float, fill: str, stroke: str = "", width: float = 1.0) -> Shape:
    """Return a circle."""
    return Shape(kind="dot", points=(point,), size=radius, fill=fill, stroke=stroke, width=width)


def words(
    point: Point, text: str, size: float, *, fill: str = "#222222", anchor: Literal["start", "middle", "end"] = "middle", halo: bool = False
) -> Shape:
    """Return a line of text."""
    return Shape(kind="text", points=(point,), text=text, size=size, fill=fill, anchor=anchor, halo=halo)


def dashes(points: Sequence[Point], dash: tuple[float, float]) -> list[tuple[Point, Point]]:
    """Return the drawn pieces of a dashed line, for painters that know no dashes."""
    pieces, left, drawn = [], dash[0], True
    for (ax, ay), (bx, by) in pairwise(points):
        length, done = ((bx - ax) ** 2 + (by - ay) ** 2) ** 0.5, 0.0
        while length > 0.0 and done < length:
            step = min(left, length - done)
            if drawn:
                f, g = done / length, (done + step) / length
                pieces.append(((ax + f * (bx - ax), ay + f * (by - ay)), (ax + g * (bx - ax), ay + g * (by - ay))))
            done, left = done + step, left - step
            if left <= 1e-9:
                drawn = not drawn
                left = dash[0] if drawn else dash[1]
    return pieces


def to_svg(drawing: Drawing) -> str:
    """Return the drawing as SVG text; the same drawing gives the same text."""
    width, height = drawing.width, drawing.height
    head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" viewBox="0 0 {width:.2f} {height:.2f}"'
    style = 'font-family="sans-serif" dominant-baseline="central" stroke-linejoin="round"'
    sheet = '<rect width="100%" height="100%" fill="#ffffff"/>'
    return "\n".join([f"{head} {style}>", sheet, *map(_element, drawing.shapes), "</svg>", ""])


def _element(shape: Shape) -> str:
    attributes: dict[str, object] = {}
    if shape.kind in ("area", "line"):
        name = "polygon" if shape.kind == "area" else "polyline"
        attributes["points"] = " ".join(f"{x:.2f},{y:.2f}" for x, y in shape.points)
    elif shape.kind == "dot":
        name, (x, y) = "circle", shape.points[0]
        attributes |= {"cx": f"{x:.2f}", "cy": f"{y:.2f}", "r": f"{shape.size:g}"}
    else:
        name, (x, y) = "text", shape.points[0]
        attributes |= {"x": f"{x:.2f}", "y": f"{y:.2f}", "font-size": f"{shape.size:.2f}", "text-anchor": shape.anchor}
    attributes["fill"] = shape.fill or "none"
    if shape.opacity < 1.0:
        attributes["fill-opacity"] = f"{shape.opacity:g}"
    if shape.stroke:
        attributes |= {"stroke": shape.stroke, "stroke-width": f"{shape.width:g}"}
    if shape.dash:
        attributes["stroke-dasharray"] = f"{shape.dash[0]:g} {shape.dash[1]:g}"
    if shape.halo:
        attributes |= {"stroke": "#ffffff", "stroke-width": f"{0.22 * shape.size:.2f}", "paint-order": "stroke"}
    listed = "".join(f" {key}={quoteattr(str(value))}" for key, value in attributes.items())
    return f"<{name}{listed}>{escape(shape.text)}</{name}>" if shape.kind == "text" else f"<{name}{listed}/>"
