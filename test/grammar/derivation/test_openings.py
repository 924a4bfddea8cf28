"""Openings keep clear of each other, and of where the leaves of doors get to."""

import numpy as np
import pytest
from small_grammar import CATEGORIES

from grammar import read_room_type
from grammar.derivation.openings import draw_opening
from scene_description import ModelReference, Opening

SQUARE = ((0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0))
RULES = read_room_type("bedroom", CATEGORIES).openings


def door(swing: str) -> Opening:
    """Return a door of 0.9 m in the wall y = 0, its hinge 0.1 m from the corner (0, 0)."""
    model = ModelReference(generator="door")
    return Opening(
        id=1, category="door", label=0, wall=0, offset_m=0.1, sill_m=0.0, width_m=0.9, height_m=2.0, swing=swing, model=model, parts=()
    )


@pytest.mark.parametrize(("kind", "beside"), [("window", 0.3), ("door", 0.0)])
def test_nothing_opens_where_the_leaf_of_a_door_gets_to(kind: str, beside: float) -> None:
    def nearest(swing: str) -> float:
        """Return the least distance from the corner (0, 0) of many openings in the wall x = 0, which ends there."""
        rng, gaps = np.random.default_rng(3), []
        for _ in range(1500):
            drawn = draw_opening(kind, RULES[kind], 2, CATEGORIES[kind].label_id, SQUARE, 2.6, [door(swing)], rng)
            if drawn is not None and drawn.opening.wall == 3:
                gaps.append(4.0 - drawn.opening.offset_m - drawn.opening.width_m)
        return min(gaps)

    assert nearest("out") < 0.5
    assert nearest("in") >= 0.9 + beside - 1e-6
