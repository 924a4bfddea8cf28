"""The windows of a bay: one in its front wall, and where its sides are long enough one in each of them, all at one height."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from grammar.derivation.densities import draw_with_log_density
from grammar.derivation.openings import Attribute, DrawnOpening
from grammar.geometry.walls import wall_lengths
from grammar.spec.room_rules import OpeningRule
from scene_description import ModelReference, Opening
from scene_description.types import Point2

_MAX_SEED = 2**63 - 1
_PIER_M, _CURTAIN_PIER_M = 0.12, 0.37
"""Wall beside a window of a bay; beside the front one with room for curtains, where it has that."""
_LEAST_WIDTH_M, _LEAST_FRONT_M = 0.4, 0.8


def draw_bay_windows(
    rule: OpeningRule,
    first: int,
    label: int,
    polygon_m: Sequence[Point2],
    height_m: float,
    bay: Sequence[int],
    most: int,
    rng: np.random.Generator,
) -> list[DrawnOpening] | None:
    """Draw the windows of a bay, or None where they do not fit below the ceiling.

    Args:
        rule: distributions of heights and sills; the widths are what the walls leave.
        first: object id of the first window.
        label: class id of windows.
        polygon_m: floor outline, counter-clockwise, world.
        height_m: height of the ceiling.
        bay: walls of the bay, the front one in the middle.
        most: number of windows that there may be; the front has the first.
        rng: source of randomness.
    """
    (tall, tall_log), (sill, sill_log) = (draw_with_log_density(rng, normal) for normal in (rule.height_m, rule.sill_m))
    if sill + tall > height_m - rule.casing_m:
        return None
    lengths = wall_lengths(polygon_m)
    before, front, after = bay
    drawn: list[DrawnOpening] = []
    for wall in (front, before, after):
        length = lengths[wall]
        wide = wall == front and length - 2.0 * _CURTAIN_PIER_M >= _LEAST_FRONT_M
        width = length - 2.0 * (_CURTAIN_PIER_M if wide else _PIER_M)
        if width < _LEAST_WIDTH_M or len(drawn) == most:
            continue
        opening = Opening(
            id=first + len(drawn),
            category="window",
            label=label,
            wall=wall,
            offset_m=0.5 * (length - width),
            sill_m=sill,
            width_m=width,
            height_m=tall,
            hinge="end",
            swing="out",
            model=ModelReference(generator="window", seed=int(rng.integers(_MAX_SEED))),
            parts=(),
        )
        text = f"{width:.3f} x {tall:.3f} m, sill {sill:.3f} m"
        drawn.append(
            DrawnOpening(opening, (Attribute("size", text, 0.0 if drawn else tall_log + sill_log), Attribute("wall", str(wall), 0.0)))
        )
    return drawn
