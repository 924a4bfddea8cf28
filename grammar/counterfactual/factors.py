"""The table of factors: every attribute of a scene that can be changed alone, by name."""

from __future__ import annotations

from grammar.counterfactual import addition, cameras, clutter, lamps, outdoors, rearrangement, removal, room_size, surfaces
from grammar.counterfactual.factor import Factor

_FAMILIES = (lamps, outdoors, surfaces, clutter, addition, removal, rearrangement, room_size, cameras)

FACTORS: dict[str, Factor] = {factor.name: factor for family in _FAMILIES for factor in family.FACTORS}
"""Name -> factor, in the order of the four attributes: illumination, material, objects, camera."""
