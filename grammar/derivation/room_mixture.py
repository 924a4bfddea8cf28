"""Sizes of rooms from a mixture, such that furniture covers as much of the floor as in the rooms behind the component.

A component is drawn by its probability and the room is rejected, with its furniture, unless that covers about the share of the floor that
the component says: rejection sampling from the product of both densities, so the ratio of two components' probabilities is that of their
odds whatever the furniture (which learning relies on).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from grammar.derivation.densities import draw_index, draw_truncated_normal, truncated_normal_log_density
from grammar.derivation.openings import Attribute
from grammar.derivation.rejection import RejectedError
from grammar.spec.room_rules import RoomSize

ROOM_SIZE = "room_size"
"""Name of the attribute node whose choice begins with the number of the component."""

_SHORTEST_M, _LONGEST_M = 0.7, 50.0
_EITHER_WAY = 0.5
_BARE = 1.0
"""A room is bare if furniture covers less of the floor than so many standard deviations of that share."""


def may_be_bare(size: RoomSize) -> bool:
    """Return whether rooms of a component may have no furniture."""
    return size.floor_share is None or size.floor_share <= _BARE * size.share_sd


class DrawnSize(NamedTuple):
    """The size of a room as it was drawn.

    ``area_m2`` of the floor; ``sides_m`` along x and y of a rectangle of that area or, with ``arm_m``, of the one that bounds a room with
    arms of that width.
    """

    area_m2: float
    sides_m: list[float]
    attributes: Sequence[Attribute]
    arm_m: float | None = None


def draw_room_size(sizes: Sequence[RoomSize], covered_m2: float, rng: np.random.Generator) -> DrawnSize:
    """Return a size drawn from a mixture.

    Args:
        sizes: the mixture.
        covered_m2: area that the furniture covers.
        rng: source of randomness.

    Raises:
        RejectedError: the furniture covers another share of the floor than in rooms of the component that was drawn.
    """
    chosen = draw_index(rng, [size.probability for size in sizes])
    size = sizes[chosen]
    drawn = [draw_truncated_normal(rng, mean, sd, _SHORTEST_M, _LONGEST_M) for mean, sd in zip(size.mean_m, size.sd_m, strict=True)]
    log = math.log(size.probability * _EITHER_WAY) + sum(
        truncated_normal_log_density(side, mean, sd, _SHORTEST_M, _LONGEST_M)
        for side, mean, sd in zip(drawn, size.mean_m, size.sd_m, strict=True)
    )
    area, arm = drawn[0] * drawn[1], None
    if size.arm_m is not None:
        arm = draw_truncated_normal(rng, size.arm_m, size.arm_sd_m, _SHORTEST_M, _LONGEST_M)
        log += truncated_normal_log_density(arm, size.arm_m, size.arm_sd_m, _SHORTEST_M, _LONGEST_M)
        area = arm * (sum(drawn) - arm)
    if size.floor_share is not None:
        off = (covered_m2 / area - size.floor_share) / size.share_sd
        if rng.random() > math.exp(-0.5 * off * off):
            raise RejectedError("furniture on as much of the floor as in rooms of that size")
    turned = bool(rng.random() < _EITHER_WAY)
    sides = drawn[::-1] if turned else drawn
    text = f"{chosen}, {sides[0]:.3f} x {sides[1]:.3f} m" + ("" if arm is None else f", arms {arm:.3f} m")
    return DrawnSize(area, sides, [Attribute(ROOM_SIZE, text, log)], arm)
