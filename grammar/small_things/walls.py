"""Poses of small things on walls: anywhere at their height where the wall and the space before it are free, or below hooks."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from grammar.geometry.arrays import Floats
from grammar.geometry.walls import ALONG_X, ALONG_Y, LENGTH, NORMAL_X, NORMAL_Y, START_X, START_Y, WALL_YAW
from grammar.small_things.place import Fits, Newcomer, Obstacles, clear_of, in_frame
from scene_description import SceneObject
from scene_description import Support as Supported

TRIALS = 24
"""Poses that are drawn for a thing before it is given up."""

_BEFORE_M, _BESIDE_M = 0.3, 0.06
"""Free space before what hangs on a wall, from the wall, and beside it."""

_ABOVE_M = (0.12, 0.35)
"""How far above furniture hangs what belongs there."""

_BACK_M = 0.3
_LOWEST_M = 0.12


def backed(wall: Floats, item: SceneObject) -> tuple[int, float] | None:
    """Return the wall (row of ``wall_rows``) that furniture has its back to, and how far along it the middle is."""
    for k, row in enumerate(wall):
        dx, dy = item.position_m[0] - row[START_X], item.position_m[1] - row[START_Y]
        along, across = dx * row[ALONG_X] + dy * row[ALONG_Y], dx * row[NORMAL_X] + dy * row[NORMAL_Y]
        straight = abs(math.remainder(item.yaw_rad - row[WALL_YAW], 2.0 * math.pi)) < 0.1
        if straight and 0.0 < along < row[LENGTH] and 0.0 < across - 0.5 * item.size_m[0] < _BACK_M:
            return k, float(along)
    return None


def on_wall(
    rng: np.random.Generator, new: Newcomer, wall: Floats, below: Sequence[SceneObject], fits: Fits, obstacles: Obstacles
) -> SceneObject | None:
    """Return a thing flat on a wall at its height, or above furniture that it belongs over; None where no drawn pose is free."""
    depth, width, height = new.item.size_m
    lowest, highest = new.thing.hangs_m or (1.4, 1.6)
    shares = wall[:, LENGTH] / wall[:, LENGTH].sum()
    before = new.solids.copy()
    before[:, 4] += 0.5 * max(_BEFORE_M - depth, 0.0)
    before[:, 5] += _BESIDE_M
    before[:, 0] += 0.5 * max(_BEFORE_M - depth, 0.0)
    roomy = new._replace(solids=before)
    for _ in range(TRIALS):
        k, along = int(rng.choice(len(wall), p=shares)), float(rng.uniform())
        middle = float(rng.uniform(lowest, highest))
        over = below[int(rng.integers(len(below)))] if below else None
        place = None if over is None else backed(wall, over)
        row = wall[k]
        at = 0.5 * width + along * (row[LENGTH] - width)
        if over is not None and place is not None:
            k, at = place[0], place[1] + 0.4 * (along - 0.5)
            row = wall[k]
            middle = max(middle, over.position_m[2] + over.size_m[2] + float(rng.uniform(*_ABOVE_M)) + 0.5 * height)
        if not 0.5 * width + _BESIDE_M < at < row[LENGTH] - 0.5 * width - _BESIDE_M:
            continue
        off = 0.5 * depth
        x, y = row[START_X] + at * row[ALONG_X] + off * row[NORMAL_X], row[START_Y] + at * row[ALONG_Y] + off * row[NORMAL_Y]
        position = (float(x), float(y), middle - 0.5 * height)
        placed = replace(new.item, position_m=position, yaw_rad=float(row[WALL_YAW]), support=Supported(kind="wall", wall=k))
        if fits(placed) and clear_of(roomy, placed, obstacles):
            return placed
    return None


def below_hooks(rng: np.random.Generator, new: Newcomer, hooks: SceneObject, fits: Fits, obstacles: Obstacles) -> SceneObject | None:
    """Return a thing that hangs from hooks on a wall, its top at their lower edge; None where no drawn pose is free."""
    depth, width, height = new.item.size_m
    reach = max(0.5 * (hooks.size_m[1] - 0.5 * width), 0.0)
    for _ in range(TRIALS):
        y = float(rng.uniform(-reach, reach))
        x = 0.5 * (depth - hooks.size_m[0])
        placed = in_frame(new.item, hooks, x, y, -height - 0.001, 0.0, Supported(kind="wall", wall=hooks.support.wall))
        if placed.position_m[2] > _LOWEST_M and fits(placed) and clear_of(new, placed, obstacles):
            return placed
    return None
