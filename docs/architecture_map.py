"""Draws docs/architecture.svg: the packages, the folders in them, and which imports which.  ``make docs`` runs it.

A folder stands above all that it imports.  An arrow that others already imply is left out.
"""

from __future__ import annotations

import ast
import sys
from pathlib import Path

from grammar.drawing.shapes import Drawing, Shape, area, line, to_svg, words

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = {"scene_description": "#f3e9d2", "grammar": "#dcebd9", "renderer": "#dbe6f4", "scene_synth_ros": "#f2dcdc"}
ENTRY = "entry points"
"""The modules beside a package's folders."""

_BOX_WIDTH, _BOX_HEIGHT, _GAP_X, _GAP_Y, _MARGIN, _HEAD, _LETTER = 168.0, 46.0, 16.0, 34.0, 18.0, 40.0, 13.0
_INK, _ARROW = "#222222", "#7a7a7a"


def folders(package: str) -> dict[str, set[str]]:
    """Return folder -> folders of the same package that it imports; modules beside the folders are one of them, ``ENTRY``."""
    found: dict[str, set[str]] = {}
    root = ROOT / package
    for path in sorted(root.rglob("*.py")):
        if path == root / "__init__.py":
            continue
        here = found.setdefault(_folder(root, path.relative_to(root).parts[0]), set())
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] == package:
                parts = node.module.split(".")[1:]
                here |= {_folder(root, parts[0] if parts else alias.name) for alias in node.names}
    return {name: below - {name} for name, below in found.items()}


def _folder(root: Path, name: str) -> str:
    return name if (root / name).is_dir() else ENTRY


def levels(graph: dict[str, set[str]]) -> dict[str, int]:
    """Return how many folders lie below each on the longest way down.

    Raises:
        RecursionError: the arrows go in a circle.
    """

    def level(name: str) -> int:
        return 1 + max((level(below) for below in graph[name]), default=-1)

    return {name: level(name) for name in graph}


def implied(graph: dict[str, set[str]], upper: str, lower: str) -> bool:
    """Return whether a way from one folder down to another leads through a third."""

    def leads(start: str) -> bool:
        return start == lower or any(leads(below) for below in graph[start])

    return any(leads(below) for below in graph[upper] - {lower})


def draw_package(package: str, left: float, bottom: float, at_least: float = 0.0) -> tuple[list[Shape], float, float]:
    """Return a package's shapes, its width (``at_least`` so much) and its height, for the lower left corner of its frame, in pixels."""
    graph = folders(package)
    level = levels(graph)
    rows = [sorted(name for name in graph if level[name] == depth) for depth in range(max(level.values()) + 1)]
    across = max(map(len, rows))
    width = max(2.0 * _MARGIN + across * _BOX_WIDTH + (across - 1) * _GAP_X, at_least)
    height = _HEAD + 2.0 * _MARGIN + len(rows) * _BOX_HEIGHT + (len(rows) - 1) * _GAP_Y
    middles: dict[str, tuple[float, float]] = {}
    for depth, row in enumerate(rows):
        start = left + 0.5 * (width - len(row) * _BOX_WIDTH - (len(row) - 1) * _GAP_X)
        for place, name in enumerate(row):
            x = start + place * (_BOX_WIDTH + _GAP_X) + 0.5 * _BOX_WIDTH
            middles[name] = (x, bottom - _MARGIN - depth * (_BOX_HEIGHT + _GAP_Y) - 0.5 * _BOX_HEIGHT)
    frame = [(left, bottom), (left + width, bottom), (left + width, bottom - height), (left, bottom - height)]
    shapes = [area(frame, PACKAGES[package], opacity=0.5, stroke=_ARROW)]
    shapes.append(words((left + _MARGIN, bottom - height + 0.5 * _HEAD), f"{package}/", 1.3 * _LETTER, anchor="start"))
    u, v = 0.5 * _BOX_WIDTH, 0.5 * _BOX_HEIGHT
    for x, y in middles.values():
        shapes.append(area([(x - u, y - v), (x + u, y - v), (x + u, y + v), (x - u, y + v)], PACKAGES[package], stroke=_INK))
    arrows = [(upper, lower) for upper in graph for lower in graph[upper] if not implied(graph, upper, lower)]
    for upper, lower in sorted(arrows):
        shapes += _arrow(middles[upper], middles[lower])
    for name, (x, y) in middles.items():
        place = ROOT / package / ("" if name == ENTRY else name)
        count = len([path for path in (place.glob("*.py") if name == ENTRY else place.rglob("*.py")) if path.name != "__init__.py"])
        shapes.append(words((x, y - 0.55 * _LETTER), name if name == ENTRY else f"{name}/", _LETTER, halo=True))
        shapes.append(words((x, y + 0.65 * _LETTER), f"{count} module{'s' if count > 1 else ''}", 0.8 * _LETTER, fill="#666666", halo=True))
    return shapes, width, height


def _arrow(upper: tuple[float, float], lower: tuple[float, float]) -> list[Shape]:
    (ax, ay), (bx, by) = (upper[0], upper[1] + 0.5 * _BOX_HEIGHT), (lower[0], lower[1] - 0.5 * _BOX_HEIGHT)
    length = max(((bx - ax) ** 2 + (by - ay) ** 2) ** 0.5, 1e-9)
    u, v = (bx - ax) / length, (by - ay) / length
    head = [(bx, by), (bx - 8.0 * u - 3.5 * v, by - 8.0 * v + 3.5 * u), (bx - 8.0 * u + 3.5 * v, by - 8.0 * v - 3.5 * u)]
    return [line([(ax, ay), (bx, by)], _ARROW), area(head, _ARROW)]


def architecture() -> str:
    """Return the map as SVG: ``scene_description`` at the foot, grammar and renderer on it, ``scene_synth_ros`` on top."""
    gap = 2.0 * _MARGIN
    _, grammar_width, grammar_height = draw_package("grammar", 0.0, 0.0)
    _, renderer_width, renderer_height = draw_package("renderer", 0.0, 0.0)
    _, _, ros_height = draw_package("scene_synth_ros", 0.0, 0.0)
    _, _, nouns_height = draw_package("scene_description", 0.0, 0.0)
    width = grammar_width + gap + renderer_width + 2.0 * _MARGIN
    middle_height = max(grammar_height, renderer_height)
    height = ros_height + middle_height + nouns_height + 2.0 * gap + 2.0 * _MARGIN
    foot = height - _MARGIN
    second = foot - nouns_height - gap
    third = second - middle_height - gap
    left = _MARGIN
    shapes: list[Shape] = []
    whole = grammar_width + gap + renderer_width
    for package, x, y, at_least in (
        ("scene_description", left, foot, whole),
        ("grammar", left, second, 0.0),
        ("renderer", left + grammar_width + gap, second, 0.0),
        ("scene_synth_ros", left, third, whole),
    ):
        shapes += draw_package(package, x, y, at_least)[0]
    centre = left + 0.5 * grammar_width, left + grammar_width + gap + 0.5 * renderer_width
    for x, heights in zip(centre, (grammar_height, renderer_height), strict=True):
        half = 0.5 * _BOX_HEIGHT
        shapes += _arrow((x, third - half), (x, second - heights + half))
        shapes += _arrow((x, second - half), (x, foot - nouns_height + half))
    return to_svg(Drawing(width=width, height=height, shapes=tuple(shapes)))


if __name__ == "__main__":
    target = ROOT / "docs" / "architecture.svg"
    target.write_text(architecture(), encoding="utf-8")
    sys.stdout.write(f"{target.relative_to(ROOT)} written\n")
