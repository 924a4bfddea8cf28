"""Models as data: the rows of ``config/models.yaml``, and what makes meshes of them.

A row names its styles, a style its parts, a part its pieces.  Places are shares of the object's box: x of half its depth (front +1), y of
half its width, z of its height; radii are shares of half the shorter side of its footprint.  A piece has one of the kinds of
:data:`SOLIDS` and any of the moves of :func:`_moved`; a name in place of an outline means one of the file's ``profiles``.
"""

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

import kernel_cache.elementary as el
from renderer.core.arrays import Array
from renderer.core.errors import FlattenError
from renderer.geometry.cloth import SHOULDERS, coat, folded, garment, heap, wrinkles
from renderer.geometry.lofts import bent, loft, lying, oval
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, lathe, merged, moved, rotated, rounded_box, sheet, slab, stretched, sweep
from renderer.geometry.upholstery import pillow
from renderer.models.model import Model, Pieces, Size
from scene_description.share import config_path
from scene_description.yaml_text import read_yaml

Row = Mapping[str, Any]
"""A piece as the file has it: its kind with the outline, options of the kind, and moves."""


class Frame(NamedTuple):
    """What shares are of, in metres: half the depth, half the width, the height, half the shorter side; the named outlines; randomness."""

    half_d: float
    half_w: float
    height: float
    radius: float
    profiles: Mapping[str, Any]
    rng: np.random.Generator

    def at(self, place: Sequence[float]) -> tuple[float, float, float]:
        """Return a place in metres."""
        return place[0] * self.half_d, place[1] * self.half_w, place[2] * self.height

    def outline(self, value: Any) -> Array:
        """Return an outline (n, k), or the one of that name."""
        return np.array(self.profiles[value] if isinstance(value, str) else value, np.float64)


def hollowed(outer: Array, wall: float, floor: float) -> Array:
    """Return the profile of a vessel: an outer wall (n, 2) from the axis to the rim, an inner one ``wall`` inward, and a ``floor``."""
    inner = [(r - wall, z) for r, z in outer[::-1] if z > floor]
    low = float(np.interp(floor, outer[1:, 1], outer[1:, 0])) - wall
    return np.array([*outer, *inner, (low, floor), (0.0, floor)])


def _lathe(frame: Frame, value: Any, row: Row) -> Mesh:
    """A turned body: radius and height of its profile; ``wall`` and ``floor`` hollow it, ``axis`` lays it down, ``closed``: a ring."""
    profile, axis = frame.outline(value), row.get("axis", "z")
    if "wall" in row:
        profile = hollowed(profile, row["wall"], row.get("floor", row["wall"]))
    low, high = row.get("span", (0.0, 1.0))
    profile[:, 1] = low + profile[:, 1] * (high - low)
    long = {"x": frame.half_d, "y": frame.half_w, "z": frame.height}[axis]
    across = {"x": min(frame.half_w, 0.5 * frame.height), "y": min(frame.half_d, 0.5 * frame.height), "z": frame.radius}[axis]
    mesh = lathe(profile * (across * row.get("r", 1.0), long), row.get("sides", 20), row.get("closed", False))
    return mesh if axis == "z" else lying(mesh, axis)


def _box(frame: Frame, value: Any, row: Row) -> Mesh:
    """A box between two corners; ``round``: radius of its edges as a share of half its thinnest side."""
    low, high = (frame.at(corner) for corner in value)
    thin = min(b - a for a, b in zip(low, high, strict=True))
    if "round" in row:
        return rounded_box(low, high, 0.5 * row["round"] * thin, row.get("steps", 1))
    return block(low, high, min(0.002, 0.2 * thin))


def _loft(frame: Frame, value: Any, row: Row) -> Mesh:
    """A body through superellipses, bottom up: half depth, half width, height, and where they lie along x; ``power`` 8 is nearly a box."""
    power, sides = row.get("power", 2.0), row.get("sides", 24)
    places = [(*frame.at(ring[:3]), ring[3] * frame.half_d if len(ring) > 3 else 0.0) for ring in value]
    return loft([oval(half_x, half_y, z, x, power, sides) for half_x, half_y, z, x in places])


_FACING: Mapping[str, tuple[int, int, int]] = {"z": (0, 1, 2), "x": (1, 2, 0), "y": (2, 0, 1)}


def _prism(frame: Frame, value: Any, row: Row) -> Mesh:
    """A prism over an outline across ``axis``, between the two shares of ``span``; the outline is that of the two other axes, in turn.

    ``cut``: how often the outline's corners are cut at a quarter of its edges, which makes it a smooth curve (G. Chaikin, 1974).
    """
    first, second, along = _FACING[row.get("axis", "z")]
    scale = np.array([frame.half_d, frame.half_w, frame.height])
    outline = frame.outline(value) * scale[[first, second]]
    for _ in range(row.get("cut", 0)):
        ahead = np.roll(outline, -1, axis=0)
        outline = np.stack([0.75 * outline + 0.25 * ahead, 0.25 * outline + 0.75 * ahead], axis=1).reshape(-1, 2)
    ahead = np.roll(outline, -1, axis=0)
    if float((outline[:, 0] * ahead[:, 1] - outline[:, 1] * ahead[:, 0]).sum()) < 0.0:
        outline = outline[::-1]
    low, high = (share * scale[along] for share in row["span"])
    mesh = slab(outline, low, high)
    order = np.argsort([first, second, along], kind="stable")
    return mesh._replace(vertices=mesh.vertices[:, order], normals=mesh.normals[:, order])


def _tube(frame: Frame, value: Any, row: Row) -> Mesh:
    """A tube along places; ``r``: one radius or one for each place, ``bend``: radius of its corners."""
    path = np.array([frame.at(place) for place in value])
    radius = np.asarray(row.get("r", 0.05), np.float64) * frame.radius
    if "bend" in row:
        return bent(path, float(radius), row["bend"] * frame.radius, row.get("sides", 6), 3)
    return sweep(path, radius, row.get("sides", 8), row.get("squash", 1.0))


def _arc(frame: Frame, value: Any, row: Row) -> Mesh:
    """A bowed tube from one place to another over a third: handles, straps, stems."""
    first, over, last = (np.array(frame.at(place)) for place in value)
    turn = np.linspace(0.0, math.pi, row.get("steps", 9))[:, None]
    middle = 0.5 * (first + last)
    path = middle + 0.5 * (first - last) * el.cos(turn) + (over - middle) * el.sin(turn)
    return sweep(path, row.get("r", 0.05) * frame.radius, row.get("sides", 6), row.get("squash", 1.0))


def _strip(frame: Frame, value: Any, row: Row) -> Mesh:
    """A sheet along places (x, z), from one y to the other of ``span``; ``thick`` is a share of the radius, ``wave`` how far it swings."""
    path = np.array([frame.at((x, 0.0, z)) for x, z in value])
    share = np.linspace(0.0, 1.0, row.get("steps", max(2, 4 * len(path))))
    places = np.column_stack([np.interp(share, np.linspace(0.0, 1.0, len(path)), path[:, k]) for k in (0, 2)])
    along = np.gradient(places, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
    low, high = (y * frame.half_w for y in row.get("span", (-1.0, 1.0)))
    y = np.linspace(low, high, row.get("columns", 9 if "wave" in row else 2))
    folds = row.get("wave", 0.0) * frame.radius * wrinkles(frame.rng, *np.meshgrid(share, y / frame.radius, indexing="ij"), 5, 0.4, 1.4)
    thick = row.get("thick", 0.02) * frame.radius
    top, bottom = (
        np.dstack(
            [places[:, :1] + along[:, 1:] * (folds + off), np.broadcast_to(y, folds.shape), places[:, 1:] - along[:, :1] * (folds + off)]
        )
        for off in (0.5 * thick, -0.5 * thick)
    )
    return sheet(bottom, top)


def _stuffed(frame: Frame, value: Any, row: Row) -> Mesh:
    """A pillow between two corners, its seam ``piped`` or not."""
    low, high = (frame.at(corner) for corner in value)
    depth, width, height = (b - a for a, b in zip(low, high, strict=True))
    mesh = pillow(frame.rng, depth, width, height, row.get("steps", 12), row.get("piped", False))
    return moved(mesh, *(0.5 * (a + b) for a, b in zip(low, high, strict=True)))


def _hanging(make: Callable[..., Mesh], frame: Frame, value: Any, row: Row) -> Mesh:
    """A garment or a coat that hangs between two corners; ``shape``: its widths from collar to hem."""
    shape = row.get("shape")
    low, high = (frame.at(corner) for corner in value)
    return make(frame.rng, low, high, SHOULDERS if shape is None else np.column_stack([np.linspace(0.0, 1.0, len(shape)), shape]))


SOLIDS: Mapping[str, Callable[[Frame, Any, Row], Mesh]] = {
    "lathe": _lathe, "box": _box, "loft": _loft, "prism": _prism, "tube": _tube, "arc": _arc, "strip": _strip,
    "heap": lambda frame, value, row: heap(frame.rng, frame.at(value[0]), frame.at(value[1]), row.get("steps", 27)),
    "folded": lambda frame, value, row: folded(frame.rng, frame.at(value[0]), frame.at(value[1])),
    "stuffed": _stuffed, "garment": partial(_hanging, garment), "coat": partial(_hanging, coat),
}  # fmt: skip
"""The kinds of pieces."""


def _moved(frame: Frame, mesh: Mesh, row: Row) -> list[Mesh]:
    """Return a piece where its moves put it, in this order.

    ``grow``: stretched upward by a factor between two numbers; ``turn``: degrees about axes through the origin; ``spin``: about z by up
    to so many degrees either way; ``at``: shifted; ``around``: so many copies about z; ``copies``: one at each of these places besides.
    """
    if "grow" in row:
        mesh = stretched(mesh, (1.0, 1.0, float(frame.rng.uniform(*row["grow"]))), (0.0, 0.0, 0.0))
    for axis, degrees in row.get("turn", {}).items():
        mesh = rotated(mesh, axis, math.radians(degrees))
    if "spin" in row:
        mesh = rotated(mesh, "z", math.radians(float(frame.rng.uniform(-row["spin"], row["spin"]))))
    if "at" in row:
        mesh = moved(mesh, *frame.at(row["at"]))
    count = row.get("around", 1)
    ring = [mesh if k == 0 else rotated(mesh, "z", 2.0 * math.pi * k / count) for k in range(count)]
    shifts = [(0.0, 0.0, 0.0), *(frame.at(place) for place in row.get("copies", ()))]
    return [moved(one, *shift) for one, shift in itertools.product(ring, shifts)]


def build_row(row: Row, profiles: Mapping[str, Any], rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return the pieces of a model by part.

    ``row``: of the file; ``profiles``: its named outlines.  A row with ``long: y`` is drawn along y, and turned where the box is longer
    along x.
    """
    turned = row.get("long") == "y" and size_m[0] > size_m[1]
    depth, width, height = (size_m[1], size_m[0], size_m[2]) if turned else size_m
    frame = Frame(0.5 * depth, 0.5 * width, height, 0.5 * min(depth, width), profiles, rng)
    parts: dict[str, list[Mesh]] = {}
    for name, pieces in row["styles"][style].items():
        made = parts.setdefault(name, [])
        for piece in pieces:
            kind = next(kind for kind in piece if kind in SOLIDS)
            made += _moved(frame, SOLIDS[kind](frame, piece[kind], piece), piece)
    return {name: rotated(merged(*made), "z", -0.5 * math.pi) if turned else merged(*made) for name, made in parts.items()}


def _read_models() -> dict[str, Model]:
    """Return the models of the file by name."""
    data = read_yaml(config_path("models.yaml"), FlattenError)
    return {name: Model(partial(build_row, row, data["profiles"]), tuple(row["styles"])) for name, row in data["models"].items()}


MODELS = _read_models()
