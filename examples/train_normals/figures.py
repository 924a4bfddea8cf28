"""The pictures of docs/training.md: curves with their intervals, and what networks see in rooms of unseen types."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from evaluation.confidence import Interval
from examples.train_normals.pictures import Views
from examples.train_normals.study import CONSTANT, TESTED_ON, Judged, Predict
from grammar.drawing.shapes import Drawing, Shape, dot, line, to_svg, words
from renderer.film.false_color import normals_to_color
from scene_synth_ros.cli.pictures.picture_grid import Tile, write_grid

COLORS = {"one look": "#b5442c", "random looks": "#2c6cb5", "random looks, noise": "#2c8f4e", CONSTANT: "#777777"}
TITLES = {"color": "tested on clean pictures", "noisy": "tested on noisy pictures"}
LEFT, TOP, WIDE, HIGH, STEP = 60.0, 40.0, 300.0, 240.0, 360.0
ENLARGED = 2


def write_curves(judged: Sequence[Judged], path: Path) -> None:
    """Write the mean angle against the number of rooms as SVG, one panel for each kind of test picture."""
    ends = [bound for one in judged for bound in _bounds(one.metrics["mean"])]
    low, high = 5.0 * np.floor(min(ends) / 5.0), 5.0 * np.ceil(max(ends) / 5.0)
    counts = sorted({one.rooms for one in judged if one.rooms})
    shapes: list[Shape] = []
    for panel, tested_on in enumerate(TESTED_ON):
        left = LEFT + STEP * panel
        x = {count: left + WIDE * (0.1 + 0.8 * number / max(1, len(counts) - 1)) for number, count in enumerate(counts)}

        def y(value: float) -> float:
            return TOP + HIGH * (high - value) / (high - low)

        shapes.append(words((left + 0.5 * WIDE, TOP - 18.0), f"mean angle in degrees, {TITLES[tested_on]}", 12.0))
        for value in np.arange(low, high + 1.0, 5.0):
            shapes += [line([(left, y(value)), (left + WIDE, y(value))], "#dddddd"), words((left - 16.0, y(value)), f"{value:g}", 11.0)]
        shapes += [words((x[count], TOP + HIGH + 14.0), str(count), 11.0) for count in counts]
        shapes.append(words((left + 0.5 * WIDE, TOP + HIGH + 32.0), "rooms trained on", 11.0))
        for number, name in enumerate(COLORS):
            found = [one for one in judged if one.training == name and one.tested_on == tested_on]
            if name == CONSTANT:
                level = y(_bounds(found[0].metrics["mean"])[0])
                shapes.append(line([(left, level), (left + WIDE, level)], COLORS[name], 1.5, (6.0, 4.0)))
                continue
            shift = 5.0 * (number - 1)
            points = [(x[one.rooms] + shift, y(_bounds(one.metrics["mean"])[0])) for one in found]
            shapes.append(line(points, COLORS[name], 2.0))
            for point, one in zip(points, found, strict=True):
                _, bottom, top = _bounds(one.metrics["mean"])
                shapes += [line([(point[0], y(bottom)), (point[0], y(top))], COLORS[name], 1.2), dot(point, 3.5, COLORS[name])]
    for number, (name, color) in enumerate(COLORS.items()):
        at = LEFT + 175.0 * number
        shapes += [line([(at, TOP + HIGH + 58.0), (at + 24.0, TOP + HIGH + 58.0)], color, 2.0)]
        shapes.append(words((at + 30.0, TOP + HIGH + 58.0), f"{name} normal" if name == CONSTANT else name, 12.0, anchor="start"))
    path.write_text(to_svg(Drawing(width=LEFT + STEP + WIDE + 20.0, height=TOP + HIGH + 76.0, shapes=tuple(shapes))), encoding="utf-8")


def _bounds(interval: Interval) -> tuple[float, float, float]:
    """Return value, low and high; the value thrice where nothing is known of its spread."""
    value = float("nan") if interval.value is None else interval.value
    return value, value if interval.low is None else interval.low, value if interval.high is None else interval.high


def write_predictions(test: Sequence[Views], names: Sequence[str], networks: Mapping[str, Predict], path: Path) -> None:
    """Write a row for each test room: its first view clean and noisy, the truth, and what each network sees in the noisy one."""
    tiles = []
    for room, name in zip(test, names, strict=True):
        truth = room.normals[0].astype(np.float32)
        tiles += [Tile(name, room.color[0]), Tile("noisy", room.noisy[0]), Tile("true normals", normals_to_color(truth))]
        tiles += [Tile(label, normals_to_color(_unit(network(room.noisy[:1])[0]))) for label, network in networks.items()]
    enlarged = [Tile(tile.label, np.kron(tile.picture, np.ones((ENLARGED, ENLARGED, 1), np.uint8))) for tile in tiles]
    write_grid(enlarged, 3 + len(networks), path, quality=85)


def _unit(normals: NDArray[np.float32]) -> NDArray[np.float32]:
    return normals / np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-6)


def network_label(training: str, rooms: int) -> str:
    """Return the line under a network's picture."""
    return f"{training}, {rooms} rooms"
