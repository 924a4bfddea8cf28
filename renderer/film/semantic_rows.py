"""The table of layers where class ids are those of another standard than NYU40: two rows differ."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import numpy as np

from renderer.film.false_color import CLASSES, Picture
from renderer.film.layers import LAYERS, Layer
from scene_description.label_standards import StandardName, label_standard


@cache
def layers_in(standard: StandardName) -> Mapping[str, Layer]:
    """Return the table of layers with the names, ids and colours of a standard; ``nyu40`` is ``LAYERS`` itself."""
    if standard == "nyu40":
        return LAYERS
    classes = label_standard(standard)
    palette = classes.palette()
    semantic = replace(
        LAYERS["semantic"],
        meaning=f"{standard} class id, 0 for void",
        picture=Picture(CLASSES.words, lambda ids: np.take(palette, ids, axis=0)),
        labels=lambda _: classes.semantic_labels(),
    )
    return LAYERS | {"semantic": semantic, "instance": replace(LAYERS["instance"], labels=classes.instance_labels)}
