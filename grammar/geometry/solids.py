"""From objects to the boxes that they occupy, by the compounds of the category table."""

import math
from collections.abc import Sequence

import numpy as np

from grammar.geometry.arrays import Boxes, Ints
from grammar.geometry.boxes import BOX_WIDTH, LOCAL_BOX_WIDTH, NO_BOXES, place_boxes
from grammar.spec.categories import Categories, Category, Rest, Solid, SupportSurface
from scene_description import SceneObject

Size = tuple[float, float, float]

SHEET_M = 0.01
"""To the layout, rugs and mats lie this deep below the floor."""

_WHOLE = (Solid(),)


def local_solids(category: Category, size_m: Size) -> Boxes:
    """Return the (n, 6) boxes of an object in its own frame: x, y, z_low, z_high, half_depth, half_width, metres.

    A box that the object's size leaves without extent is dropped.
    """
    rows = []
    for solid in _WHOLE if category.solids is None else category.solids:
        given = zip(size_m, solid.low_fraction, solid.low_m, solid.high_fraction, solid.high_m, strict=True)
        spans = [(min(max(f * side + m, 0.0), side), min(max(g * side + n, 0.0), side)) for side, f, m, g, n in given]
        if all(high > low for low, high in spans):
            (x0, x1), (y0, y1), (z0, z1) = spans
            x, y = 0.5 * (x0 + x1) - 0.5 * size_m[0], 0.5 * (y0 + y1) - 0.5 * size_m[1]
            rows.append((x, y, z0, z1, 0.5 * (x1 - x0), 0.5 * (y1 - y0)))
    return np.array(rows, np.float64).reshape(-1, LOCAL_BOX_WIDTH)


def layout_solids(category: Category, size_m: Size) -> Boxes:
    """Return :func:`local_solids`, of open shelves their box, of a rug its sheet below the floor, where it meets doors but no furniture."""
    if category.open:
        return np.array([[0.0, 0.0, 0.0, size_m[2], 0.5 * size_m[0], 0.5 * size_m[1]]])
    if not category.underlay:
        return local_solids(category, size_m)
    return np.array([[0.0, 0.0, -SHEET_M, 0.0, 0.5 * size_m[0], 0.5 * size_m[1]]])


def surface_top(surface: SupportSurface, size_m: Size) -> tuple[float, float, float]:
    """Return height, half depth and half width (metres) of a carrying top of an object of this size."""
    depth, width, height = size_m
    return (
        surface.height_fraction * height + surface.height_m,
        max(0.5 * depth - surface.inset_m, 0.0),
        max(0.5 * width - surface.inset_m, 0.0),
    )


def rest_top(rest: Rest, size_m: Size) -> tuple[float, float, float, float, float]:
    """Return height, x and y of the middle, half depth and half width (metres) of a rest of an object of this size, in its frame."""
    depth, width, height = size_m
    (back, front), (right, left) = rest.depth, rest.width
    return (
        rest.height * height + rest.height_m,
        (0.5 * (back + front) - 0.5) * depth,
        (0.5 * (right + left) - 0.5) * width,
        0.5 * (front - back) * depth,
        0.5 * (left - right) * width,
    )


def object_solids(categories: Categories, objects: Sequence[SceneObject]) -> tuple[Boxes, Ints]:
    """Return the (n, 8) boxes of all objects, whose categories the table must hold, and whose they are, (n,) ids."""
    return _placed([(item, local_solids(categories[item.category], item.size_m)) for item in objects])


def object_sheets(categories: Categories, objects: Sequence[SceneObject]) -> tuple[Boxes, Ints]:
    """Return the sheets of all rugs and mats on the floor and whose they are, in the form of :func:`object_solids`."""
    flat = [item for item in objects if categories[item.category].underlay and item.support.kind == "floor"]
    return _placed([(item, layout_solids(categories[item.category], item.size_m)) for item in flat])


def _placed(parts: Sequence[tuple[SceneObject, Boxes]]) -> tuple[Boxes, Ints]:
    """Return the boxes of objects in the world, and whose they are."""
    boxes, owners = [], []
    for item, local in parts:
        placed = np.empty((len(local), BOX_WIDTH))
        place_boxes(local, 0, len(local), *item.position_m, item.yaw_rad, placed)
        boxes.append(placed)
        owners.append(np.full(len(local), item.id, np.int64))
    if not boxes:
        return NO_BOXES, np.zeros(0, np.int64)
    return np.concatenate(boxes), np.concatenate(owners)


def whole_box(item: SceneObject) -> Boxes:
    """Return an object's own box, (8,), whatever its solids are."""
    x, y, z = item.position_m
    depth, width, height = item.size_m
    return np.array([x, y, z, z + height, 0.5 * depth, 0.5 * width, math.cos(item.yaw_rad), math.sin(item.yaw_rad)])
