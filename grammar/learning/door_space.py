"""How much floor furniture leaves free before doors: which doors can open into their room, and how deep it stays free before the others."""

from collections.abc import Sequence

import numpy as np

from grammar.geometry.walls import ALONG_X, ALONG_Y, LENGTH, NORMAL_X, NORMAL_Y, START_X, START_Y, wall_rows
from grammar.learning.observed import ObservedObject, ObservedOpening, ObservedRoom, filled_outline, half_extents, wrapped
from grammar.spec.room_rules import OpeningRule
from scene_description.products import matmul

_START, _ALONG, _NORMAL = [START_X, START_Y], [ALONG_X, ALONG_Y], [NORMAL_X, NORMAL_Y]
_NICHE_M, _EDGE_M, _FURTHEST_M = 0.45, 0.02, 2.0
_LEAST_M, _LOW_SHARE = 0.4, 0.1
"""One door in ten has less free floor before it than the rule asks for; but a robot of the usual width gets through all of them."""


def learn_door_space(rule: OpeningRule, seen: Sequence[tuple[ObservedRoom, ObservedOpening]]) -> dict[str, float]:
    """Return the fields of the rule that say which doors open into the room and what stays free before those that do not.

    Sources do not tell which way a door opens: of those that can open into the room no more do than the base says, and those before which
    something stands open the other way.
    """
    free = np.array([free_depth_m(room, opening) for room, opening in seen])
    opens = free >= np.array([opening.width_m for _, opening in seen])
    clear = max(min(float(np.quantile(free, _LOW_SHARE)), rule.clear_depth_m), _LEAST_M)
    return {"swing_in": min(rule.swing_in, float(opens.mean())), "clear_depth_m": clear}


def free_depth_m(room: ObservedRoom, opening: ObservedOpening) -> float:
    """Return how deep the floor before a door is free of furniture, from the wall that its niche is in."""
    wall = wall_rows(room.polygon_m)[opening.wall]
    along, normal = wall[_ALONG], wall[_NORMAL]
    middle = wall[_START] + (opening.offset_m + 0.5 * opening.width_m) * along
    begins = 0.0
    for row in wall_rows(filled_outline(room.polygon_m)):
        off, place = float(matmul(row[_START] - middle, normal)), float(matmul(middle - row[_START], row[_ALONG]))
        if float(matmul(row[_NORMAL], normal)) > 0.99 and 0.0 <= place <= row[LENGTH] and 0.0 < off < _NICHE_M:
            begins = max(begins, off)
    depths = [_near_edge_m(item, middle, along, normal, 0.5 * opening.width_m) for item in room.objects if _in_the_way(item, opening)]
    return min([max(depth - begins, 0.0) for depth in depths] + [_FURTHEST_M])


def _in_the_way(item: ObservedObject, opening: ObservedOpening) -> bool:
    return item.position_m[2] < opening.sill_m + opening.height_m


def _near_edge_m(item: ObservedObject, middle: np.ndarray, along: np.ndarray, normal: np.ndarray, half_m: float) -> float:
    """Return how far into the room the nearer edge of an object is, infinite if it is not before the door."""
    delta = np.array(item.position_m[:2]) - middle
    deep, wide = half_extents(item.size_m, wrapped(item.yaw_rad - float(np.arctan2(normal[1], normal[0]))))
    into, aside = float(matmul(delta, normal)), abs(float(matmul(delta, along)))
    return into - deep if aside - wide < half_m - _EDGE_M and into + deep > 0.0 else np.inf
