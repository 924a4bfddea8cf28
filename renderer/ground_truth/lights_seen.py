"""Which light a pixel sees itself, not by what it lights."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.ground_truth.hit_view import HitLayers, HitView
from scene_description.light_labels import SKY_ID


def light_seen(view: HitView) -> NDArray[np.uint16]:
    """Return ids of lights, (height, width), as ``scene_description.light_labels.light_ids`` has them; 0 for what sends no light itself.

    That are the backs of lamps and panes, and the black of glowing screens, too.
    """
    flat = view.scene.flat
    ids = flat.light_id if len(flat.light_id) else np.zeros(len(flat.part_names), np.uint16)
    seen = np.where(view.surface.emission.any(axis=2), view.of_part(ids), 0).astype(np.uint16)
    seen[np.isposinf(view.images.range)] = SKY_ID
    return seen


LAYERS: HitLayers = {
    "light_seen": light_seen,
}
