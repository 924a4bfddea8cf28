"""Sloped ceilings as the layout sees them: planes that solids stay below, and boxes over the floor where the ceiling is low.

World frame, metres; boxes are rows as :mod:`grammar.geometry.boxes` defines them.
"""

import itertools
import math

import numpy as np

from grammar.geometry.arrays import Boxes, Floats
from grammar.geometry.boxes import COS_YAW, HALF_DEPTH, HALF_WIDTH, NO_BOXES, SIN_YAW, Z_HIGH, X, Y, box_rows
from grammar.geometry.kernels import entry
from grammar.geometry.walls import ALONG_X, ALONG_Y, NORMAL_X, NORMAL_Y, START_X, START_Y, WALL_YAW, wall_rows
from scene_description import Room
from scene_description.ceilings import ceiling_planes
from scene_description.products import matmul

GRADIENT_X, GRADIENT_Y, HEIGHT, COSINE = range(4)
"""Columns of :func:`slope_rows`."""

_STEP_M = 0.1


def slope_rows(room: Room) -> Floats:
    """Return the planes of a room's slopes, (s, 4): height = column 0 times x + column 1 times y + column 2, and cosine of the pitch."""
    planes = ceiling_planes(room)
    return np.column_stack([planes, 1.0 / np.sqrt(1.0 + planes[:, 0] ** 2 + planes[:, 1] ** 2)])


@entry
def above_slopes(slope: Floats, box: Boxes, k: int) -> float:
    """Return how deep box ``k`` reaches through the planes of :func:`slope_rows`, square to them, in metres; 0 below them."""
    deepest = 0.0
    c, s = box[k, COS_YAW], box[k, SIN_YAW]
    for w in range(len(slope)):
        gx, gy = slope[w, GRADIENT_X], slope[w, GRADIENT_Y]
        middle = gx * box[k, X] + gy * box[k, Y] + slope[w, HEIGHT]
        lowest = middle - box[k, HALF_DEPTH] * abs(gx * c + gy * s) - box[k, HALF_WIDTH] * abs(gy * c - gx * s)
        deepest = max(deepest, (box[k, Z_HIGH] - lowest) * slope[w, COSINE])
    return deepest


def low_ceiling(room: Room, below_m: float) -> Boxes:
    """Return upright boxes over exactly the floor where the ceiling's slopes are lower than a height, from their eaves to the ceiling."""
    return _strips(room, below_m, 0.0)


def roof_boxes(room: Room) -> Boxes:
    """Return upright boxes that fill what the slopes cut off below the flat ceiling, and at most a step of 0.1 m of height more."""
    rows = [NO_BOXES]
    if room.slopes is not None:
        for slope in room.slopes:
            levels = np.append(np.arange(slope.eaves_height_m, room.height_m, _STEP_M), room.height_m)
            only = Room(
                polygon_m=room.polygon_m, height_m=room.height_m, wall_thickness_m=room.wall_thickness_m, openings=(), surfaces=(),
                slopes=(slope,),
            )  # fmt: skip
            rows += [_strips(only, high, low) for low, high in itertools.pairwise(levels.tolist())]
    return np.concatenate(rows)


def _strips(room: Room, below_m: float, above_m: float) -> Boxes:
    """Return for each slope the box over the floor where its plane lies between two heights, which spans the whole floor along its wall."""
    rows = []
    wall, points = wall_rows(room.polygon_m), np.array(room.polygon_m)
    for slope in room.slopes or ():
        row, rise = wall[slope.wall], math.tan(slope.pitch_rad)
        offset = points - row[[START_X, START_Y]]
        along, across = matmul(offset, row[[ALONG_X, ALONG_Y]]), matmul(offset, row[[NORMAL_X, NORMAL_Y]])
        near = max((above_m - slope.eaves_height_m) / rise, 0.0)
        far = min((below_m - slope.eaves_height_m) / rise, float(across.max()))
        if far > near:
            u, v = 0.5 * float(along.min() + along.max()), 0.5 * (near + far)
            x, y = row[[START_X, START_Y]] + u * row[[ALONG_X, ALONG_Y]] + v * row[[NORMAL_X, NORMAL_Y]]
            c, s = math.cos(row[WALL_YAW]), math.sin(row[WALL_YAW])
            low = slope.eaves_height_m + near * rise
            rows.append((x, y, low, room.height_m, 0.5 * (far - near), 0.5 * float(along.max() - along.min()), c, s))
    return box_rows(rows)
