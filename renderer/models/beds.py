"""Beds: foot end at +x, headboard at -x."""

from __future__ import annotations

import numpy as np

from renderer.models.bedding import BedPlan, bedding, mattress, slats
from renderer.models.bedsteads import BEDSTEADS
from renderer.models.model import Model, Parts, Size, fitted


def build_bed(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return a bed made up with duvet, turned-down sheet, pillows, decorative cushion and throw."""
    depth, width, height = size_m
    kind = BEDSTEADS[style]
    top = min(0.53, 0.28 + 0.24 * height, 0.82 * height)
    thickness = min(0.22, 0.5 * top)
    plan = BedPlan(-0.5 * depth + kind.head, 0.5 * depth - kind.foot, 0.5 * width - kind.inset, top - thickness, top)
    parts = kind.build(rng, size_m, plan)
    parts["mattress"] = mattress(plan)
    parts["slats"] = slats(plan)
    parts.update(bedding(rng, plan, height, thickness * kind.fall * rng.uniform(0.9, 1.1), kind.over_foot))
    return fitted(parts, size_m)


MODELS = {"bed": Model(build_bed, tuple(BEDSTEADS))}
