"""Sizes of rooms from a mixture, such that furniture covers as much of the floor as in the rooms behind the component.

A component is drawn by its probability and the room is rejected, with its furniture, unless that covers about the share of the floor that
the component says: rejection sampling from the product of both densities, so the ratio of two components' probabilities is that of their
odds whatever the furniture (which learning relies on).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from grammar.derivation.densities import draw_index, draw_truncated_normal, truncated_normal_log_density
from grammar.derivation.openings import Attribute
from grammar.derivation.rejection import RejectedError
from grammar.spec.room_rules import RoomSize

ROOM_SIZE = "room_size"
"""Name of the attribute node whose choice begins with the number of the component."""

_SHORTEST_M, _LONGEST_M = 0.7, 50.0
_EITHER_WAY = 0.5


def draw_room_size(sizes: Sequence[RoomSize], covered_m2: float, rng: np.random.Generator) -> tuple[float, list[float], list[Attribute]]:
    """Return the area in square metres, the sides along x and y in metres of a rectangle of that area, and how they were drawn.

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
    area = drawn[0] * drawn[1]
    if size.floor_share is not None:
        off = (covered_m2 / area - size.floor_share) / size.share_sd
        if rng.random() > math.exp(-0.5 * off * off):
            raise RejectedError("furniture on as much of the floor as in rooms of that size")
    turned = bool(rng.random() < _EITHER_WAY)
    sides = drawn[::-1] if turned else drawn
    return area, sides, [Attribute(ROOM_SIZE, f"{chosen}, {sides[0]:.3f} x {sides[1]:.3f} m", log)]
