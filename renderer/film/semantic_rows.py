"""The table of layers where class ids are those of another standard than NYU40: the rows of class, object, part and light ids differ."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import numpy as np

from renderer.film.false_color import CLASSES, Picture
from renderer.film.layer import Layer
from renderer.film.layers import LAYERS
from scene_description.label_standards import LabelStandard, StandardName, label_standard
from scene_description.labels import instance_labels, part_labels
from scene_description.light_labels import light_labels


@cache
def layers_in(standard: StandardName) -> Mapping[str, Layer]:
    """Return the table of layers with the names, ids and colours of a standard; ``nyu40`` is ``LAYERS`` itself."""
    return LAYERS if standard == "nyu40" else {name: _row_in(label_standard(standard), row) for name, row in LAYERS.items()}


def _row_in(standard: LabelStandard, row: Layer) -> Layer:
    if row.picture is CLASSES:
        palette = standard.palette()
        picture = Picture(CLASSES.words, lambda ids: np.take(palette, ids, axis=0))
        meaning = row.meaning.replace("NYU40", standard.name)
        return replace(row, meaning=meaning, picture=picture, labels=lambda _: standard.semantic_labels())
    tables = {instance_labels: standard.instance_labels, part_labels: standard.part_labels, light_labels: standard.light_labels}
    return replace(row, labels=tables[row.labels]) if row.labels in tables else row
