"""All layers of the hit record: a row of ``renderer.film.layers.ROWS`` of the group "hit" has its function in one of these modules."""

from typing import Any

from numpy.typing import NDArray

from renderer.ground_truth import boundaries, coverage, materials, motion, opaque, points, surface_images
from renderer.ground_truth.hit_view import HitLayers, HitView

_MODULES = (points, surface_images, materials, motion, boundaries, coverage, opaque)
FUNCTIONS: HitLayers = {name: function for module in _MODULES for name, function in module.LAYERS.items()}
"""By the layer's name."""


def hit_layers(view: HitView) -> dict[str, NDArray[Any]]:
    """Return the layers of a view that are asked for and follow from its hit record, C-contiguous."""
    return {name: FUNCTIONS[name](view) for name in FUNCTIONS if name in view.names}
