"""Models as people leave them: a drawer or door ajar, curtains half drawn, pictures a little askew.

An open front is within the object's box: the body takes the rest of its depth.  How the parts of a model move is found from their meshes:
fronts are blocks that share a rectangle of the front plane, and the handles in that rectangle go with them.
"""

import math
from collections.abc import Callable, Mapping

import numpy as np

from renderer.core.arrays import Array
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import blocks, merged, moved, rotated, stretched
from renderer.models import build_model
from renderer.models.model import Parts, Size, fitted
from scene_description import ModelReference

_BLOCK = 24
"""Vertices of one bevelled block."""

_DOOR_M = 0.38
"""Fronts that are higher and not much wider than that are doors, hung at the side that the handle is not at."""

_ASKEW_RAD = 0.06
_DRAWN_SHARE = 0.9
_INSIDE_M = 0.012


def moved_model(model: ModelReference, size_m: Size) -> Parts:
    """Return the parts of a generator's model with its movable parts as far open as ``model.ajar`` says, fitted to the object's box."""
    generator = model.generator or ""
    if generator in _WITHIN:
        shut = build_model(generator, model.style, model.seed, size_m)
        return _WITHIN[generator](shut, size_m, model.ajar)
    reach = model.ajar * size_m[0]
    shut = build_model(generator, model.style, model.seed, (size_m[0] - reach, size_m[1], size_m[2]))
    opened = _opened(shut, reach, model.seed)
    return fitted(opened, size_m)


def fronts_of(mesh: Mesh) -> Array:
    """Return the rectangles (n, 4) of a front plane, y and z low and high, that the blocks of a mesh fill; none if it has other pieces."""
    if len(mesh.vertices) % _BLOCK:
        return np.zeros((0, 4))
    corners = mesh.vertices.reshape(-1, _BLOCK, 3)[:, :, 1:].astype(np.float64)
    low, high = corners.min(axis=1), corners.max(axis=1)
    boxes = np.column_stack([low[:, 0], high[:, 0], low[:, 1], high[:, 1]])
    merged_boxes: list[Array] = []
    for box in boxes:
        apart = []
        for other in merged_boxes:
            if min(box[1], other[1]) - max(box[0], other[0]) > 1e-4 and min(box[3], other[3]) - max(box[2], other[2]) > 1e-4:
                box = np.array([min(box[0], other[0]), max(box[1], other[1]), min(box[2], other[2]), max(box[3], other[3])])
            else:
                apart.append(other)
        merged_boxes = [*apart, box]
    return np.array(merged_boxes)


def _opened(parts: Parts, reach: float, seed: int) -> Parts:
    """Return a closed case with one of its fronts open by ``reach``: a drawer pulled out, or a door turned about its edge."""
    name = "drawers" if "drawers" in parts else "doors"
    areas = fronts_of(parts[name]) if name in parts else np.zeros((0, 4))
    if not len(areas):
        return parts
    order = np.lexsort((areas[:, 0], -areas[:, 2]))
    left, right, low, high = areas[order[seed % len(areas)]]
    is_door = high - low > _DOOR_M and right - left < 1.6 * (high - low)
    front = float(parts[name].vertices[:, 0].max())
    handle_y = 0.5 * (left + right)
    masks = {key: _within(parts[key], (left, right, low, high), front) for key in (name, "handles") if key in parts}
    if "handles" in masks and masks["handles"].any():
        handle_y = float(parts["handles"].vertices[masks["handles"], 1].mean())
    hinge = left if handle_y > 0.5 * (left + right) else right
    angle = math.asin(min(0.95, reach / max(right - left, 1e-6))) * (1.0 if hinge == left else -1.0)
    result = dict(parts)
    for key, mask in masks.items():
        mesh = parts[key]
        whole = rotated(mesh, "z", -angle, (front - 0.018, float(hinge), 0.0)) if is_door else moved(mesh, reach)
        result[key] = mesh._replace(
            vertices=np.where(mask[:, None], whole.vertices, mesh.vertices), normals=np.where(mask[:, None], whole.normals, mesh.normals)
        )
    if not is_door:
        result[name] = merged(result[name], _tray(front, reach, left + _INSIDE_M, right - _INSIDE_M, low + _INSIDE_M, high - 0.03))
    return result


def _within(mesh: Mesh, area: tuple[float, float, float, float], front: float) -> Array:
    """Return (n,) whether vertices lie in a rectangle of the front plane, and not deep behind it."""
    left, right, low, high = area
    x, y, z = mesh.vertices.astype(np.float64).T
    return np.asarray((y > left - 1e-4) & (y < right + 1e-4) & (z > low - 1e-4) & (z < high + 1e-4) & (x > front - 0.05))


def _tray(front: float, reach: float, left: float, right: float, low: float, high: float) -> Mesh:
    """Return the sides and bottom of a drawer that is pulled out, behind its front and a little into the case."""
    x0, x1, board = front - 0.03, front + reach - 0.012, 0.01
    high = max(high, low + 2.0 * board)
    return blocks(
        [(x0, left, low), (x0, right - board, low), (x0, left, low)],
        [(x1, left + board, high), (x1, right, high), (x1, right, low + board)],
        0.001,
    )


def _askew(parts: Parts, size_m: Size, ajar: float) -> Parts:
    """Return what hangs turned on its nail, as large as its box then allows."""
    height = size_m[2]
    turned = {name: rotated(mesh, "x", _ASKEW_RAD * ajar, (0.0, 0.0, 0.9 * height)) for name, mesh in parts.items()}
    points = np.concatenate([mesh.vertices for mesh in turned.values()]).astype(np.float64)
    low, high = points.min(axis=0), points.max(axis=0)
    share = min(size_m[1] / (high[1] - low[1]), height / (high[2] - low[2]))
    shift = np.array([0.0, -0.5 * share * (low[1] + high[1]), 0.5 * height - 0.5 * share * (low[2] + high[2])])
    return {name: stretched(mesh, (1.0, share, share), shift) for name, mesh in turned.items()}


def _drawn(parts: Parts, size_m: Size, ajar: float) -> Parts:
    """Return a curtain whose cloth at one side is drawn towards the middle of the window."""
    del size_m
    cloth = parts["cloth"]
    y = cloth.vertices[:, 1].astype(np.float64)
    side = y > 0.0
    inner, half = float(y[side].min()), float(y[side].max())
    wide = half - inner
    further = half - (half - y) * (1.0 + _DRAWN_SHARE * ajar * inner / max(wide, 1e-6))
    points = cloth.vertices.copy()
    points[:, 1] = np.where(side, further, y)
    return parts | {"cloth": cloth._replace(vertices=points)}


_WITHIN: Mapping[str, Callable[[Parts, Size, float], Parts]] = {
    **dict.fromkeys(("picture", "poster", "photo_wall", "calendar", "cork_board"), _askew),
    "curtain": _drawn,
}
"""What moves within the box that it has anyway."""
