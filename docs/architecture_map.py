"""Draws docs/architecture.svg: the packages, the folders in them, and which imports which.  ``make docs`` runs it.

A folder stands above all that it imports.  An arrow that others already imply is left out.
"""

import ast
import sys
from pathlib import Path

from grammar.drawing.shapes import Drawing, Shape, area, line, to_svg, words

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = {
    "scene_description": "#f3e9d2",
    "grammar": "#dcebd9",
    "renderer": "#dbe6f4",
    "evaluation": "#eadcf0",
    "scene_synth_ros": "#f2dcdc",
}
FOOT, TOP = "scene_description", "scene_synth_ros"
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
    """Return the map as SVG: ``scene_description`` at the foot, the three packages that build on it, ``scene_synth_ros`` on top."""
    gap = 2.0 * _MARGIN
    sizes = {package: draw_package(package, 0.0, 0.0)[1:] for package in PACKAGES}
    middle = [package for package in PACKAGES if package not in (FOOT, TOP)]
    whole = sum(sizes[package][0] for package in middle) + (len(middle) - 1) * gap
    middle_height = max(sizes[package][1] for package in middle)
    height = sizes[TOP][1] + middle_height + sizes[FOOT][1] + 2.0 * gap + 2.0 * _MARGIN
    width = whole + 2.0 * _MARGIN
    foot = height - _MARGIN
    second = foot - sizes[FOOT][1] - gap
    third = second - middle_height - gap
    shapes = [*draw_package(FOOT, _MARGIN, foot, whole)[0], *draw_package(TOP, _MARGIN, third, whole)[0]]
    left, half = _MARGIN, 0.5 * _BOX_HEIGHT
    for package in middle:
        across, up = sizes[package]
        shapes += draw_package(package, left, second)[0]
        centre = left + 0.5 * across
        shapes += _arrow((centre, third - half), (centre, second - up + half))
        shapes += _arrow((centre, second - half), (centre, foot - sizes[FOOT][1] + half))
        left += across + gap
    return to_svg(Drawing(width=width, height=height, shapes=tuple(shapes)))


if __name__ == "__main__":
    target = ROOT / "docs" / "architecture.svg"
    target.write_text(architecture(), encoding="utf-8")
    sys.stdout.write(f"{target.relative_to(ROOT)} written\n")
