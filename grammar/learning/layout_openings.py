"""Doors and windows of layout files: boxes in walls."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from grammar.geometry.walls import ALONG_X, ALONG_Y, LENGTH, NORMAL_X, NORMAL_Y, START_X, START_Y, wall_rows
from grammar.learning.layout_fields import UnfitError, read_numbers
from grammar.learning.observed import ObservedOpening
from scene_description.types import Point2

_OFF_WALL_M = 0.5
_LEAST_SIDE_M = 0.3
_KINDS = {"door": ("doors", ("door",)), "window": ("windows", ("window",))}
"""Kind -> key of the list in a layout line, and the names that count as it; frames and jambs are listed beside their doors."""


def read_openings(data: Mapping[str, Any], polygon: Sequence[Point2], reasons: list[str]) -> dict[str, tuple[ObservedOpening, ...]]:
    """Return the openings of a room by kind; a kind that the line does not list is left out.

    Args:
        data: the line.
        polygon: outline of the room, counter-clockwise.
        reasons: gets the reasons why openings cannot be used.
    """
    return {kind: found for kind in _KINDS if (found := _read_kind(data, kind, polygon, reasons)) is not None}


def _read_kind(data: Mapping[str, Any], kind: str, polygon: Sequence[Point2], reasons: list[str]) -> tuple[ObservedOpening, ...] | None:
    """Return the openings of one kind, None where the room does not list them: [name, and the lower and upper corner of a box]."""
    key, names = _KINDS[kind]
    boxes = data.get(key)
    if not isinstance(boxes, list):
        return None
    found: list[ObservedOpening] = []
    for box in boxes:
        try:
            if not isinstance(box, list) or len(box) != 7 or not isinstance(box[0], str):
                raise UnfitError(f"{kind}: not a name and six numbers")
            if box[0] in names:
                low = read_numbers(box[1:4], f"{kind}: absurd or missing corner", -1e5, 1e5)
                high = read_numbers(box[4:7], f"{kind}: absurd or missing corner", -1e5, 1e5)
                found.append(_in_wall(kind, low, high, polygon))
        except UnfitError as unfit:
            reasons.append(str(unfit))
    return tuple(found)


def _in_wall(kind: str, low: Sequence[float], high: Sequence[float], polygon: Sequence[Point2]) -> ObservedOpening:
    """Return a box as an opening of the wall that its middle is nearest to and that it lies along."""
    x, y = 0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])
    best: tuple[float, ObservedOpening] | None = None
    for index, wall in enumerate(wall_rows(polygon).tolist()):
        width = abs(wall[ALONG_X]) * (high[0] - low[0]) + abs(wall[ALONG_Y]) * (high[1] - low[1])
        along = (x - wall[START_X]) * wall[ALONG_X] + (y - wall[START_Y]) * wall[ALONG_Y]
        across = abs((x - wall[START_X]) * wall[NORMAL_X] + (y - wall[START_Y]) * wall[NORMAL_Y])
        beyond = max(0.5 * width - along, along + 0.5 * width - wall[LENGTH], 0.0)
        if width >= _LEAST_SIDE_M and across <= _OFF_WALL_M and beyond <= _OFF_WALL_M:
            offset = min(max(along - 0.5 * width, 0.0), max(wall[LENGTH] - width, 0.0))
            opening = ObservedOpening(wall=index, offset_m=offset, width_m=width, height_m=high[2] - low[2], sill_m=max(low[2], 0.0))
            if best is None or across + beyond < best[0]:
                best = across + beyond, opening
    if best is None or best[1].height_m < _LEAST_SIDE_M:
        raise UnfitError(f"{kind}: at no wall, or of no size")
    return best[1]
