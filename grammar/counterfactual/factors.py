"""The table of factors: every attribute of a scene that can be changed alone, by name."""

from __future__ import annotations

from grammar.counterfactual import cameras, lamps, outdoors, surfaces
from grammar.counterfactual.factor import Factor

FACTORS: dict[str, Factor] = {factor.name: factor for family in (lamps, outdoors, surfaces, cameras) for factor in family.FACTORS}
"""Name -> factor, in the order of the four attributes: illumination, material, objects, camera."""
