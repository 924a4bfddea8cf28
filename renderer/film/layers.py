"""The table of layers: what a layer is, is one row of it.

Frames, messages, topics, parameters, files, pictures, contact sheets, options of commands and ``docs/layers.md`` are made from the rows.
A new layer is its computation, a row, a test, and the page made again: ``scene_synth layers --markdown > docs/layers.md``.

Where class ids are those of another standard than NYU40, the rows of class, object, part and light ids differ (:func:`layers_in`).
"""

from collections.abc import Collection, Mapping
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.core.errors import RenderError
from renderer.film.false_color import CLASSES, Picture
from renderer.film.layer import Layer
from renderer.film.layer_rows import BASIC_ROWS, HIT_ROWS
from scene_description.label_standards import LabelStandard, StandardName, label_standard
from scene_description.labels import instance_labels, part_labels
from scene_description.light_labels import light_labels

ROWS = (*BASIC_ROWS, *HIT_ROWS)
"""In the order of the parameters, and so of the keys in ``<renderer>/settings``."""

LAYERS: dict[str, Layer] = {row.name: row for row in sorted(ROWS, key=lambda row: row.option != "")}
"""By name, in the order of frames and files: first what is always written, then what options ask for.

Where the lens sees nothing, distances are NaN and all else is 0.
"""

GEOMETRIC_LAYERS = tuple(name for name, row in LAYERS.items() if row.group == "geometric")
"""Layers that are filled while the rays through the pixel centres are traced."""

HIT_LAYERS = tuple(name for name, row in LAYERS.items() if row.group == "hit")
"""Layers that are computed from the hit record of these rays, each when it is asked for."""

COLOR_LAYERS = tuple(name for name, row in LAYERS.items() if row.group == "color")
"""Layers for which light is traced."""

SENSED_LAYERS = tuple(name for name, row in LAYERS.items() if row.group == "sensed")

PHOTOGRAPHS = tuple(name for name in COLOR_LAYERS if LAYERS[name].dtype == "uint8" and LAYERS[name].channels == 3)
"""Layers that show light at an exposure."""

PICTURES = (*PHOTOGRAPHS, "radiance")
"""Layers of the light itself: every integrator gives them, only the path tracer the rest of ``COLOR_LAYERS``."""

SAMPLED_LAYERS = tuple(name for name, row in LAYERS.items() if row.group in ("sampled", "color"))
"""Layers that are means of samples: they carry noise, and the blur of whatever the lens or the shutter blurs."""


def check_names(names: Collection[str]) -> None:
    """Refuse names that no row has.

    Raises:
        RenderError: there is one; the line lists the known ones.
    """
    unknown = sorted(set(names) - set(LAYERS))
    if unknown:
        raise RenderError(f"layers: expected some of {', '.join(LAYERS)}, got {', '.join(unknown)}")


def check_layers(images: Mapping[str, NDArray[Any]]) -> None:
    """Refuse images, by layer, that do not fit the table or each other.

    Raises:
        RenderError: an unknown layer, another dtype or shape than its row says, or images of several sizes.
    """
    check_names(images)
    for name, image in images.items():
        LAYERS[name].check(image)
    sizes = sorted({image.shape[:2] for image in images.values()})
    if len(sizes) > 1:
        raise RenderError(f"layers: expected one size, got {' and '.join(map(str, sizes))}")


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
