"""All layers of the hit record: a row of ``renderer.film.layers.ROWS`` of the group "hit" has its function in one of these modules."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from numpy.typing import NDArray

from renderer.ground_truth import boundaries, coverage, lights_seen, materials, motion, normals, opaque, positions
from renderer.ground_truth.hit_view import HitLayers, HitView

_MODULES = (positions, normals, materials, lights_seen, motion, boundaries, coverage, opaque)
FUNCTIONS: HitLayers = {name: function for module in _MODULES for name, function in module.LAYERS.items()}
"""By the layer's name."""


def hit_layers(view: HitView, names: Collection[str]) -> dict[str, NDArray[Any]]:
    """Return the named layers that follow from the hit record, C-contiguous."""
    return {name: FUNCTIONS[name](view) for name in FUNCTIONS if name in names}
