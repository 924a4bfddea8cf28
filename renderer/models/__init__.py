"""Procedural furniture: the table of generators and how to build one model.

Each family of furniture has a file; a new category is one function and one line of that file's ``MODELS``, or for small things a row of
``config/models.yaml`` (:mod:`renderer.models.shape_rows`).
"""

import numpy as np

from renderer.models import (
    appliances,
    bathroom,
    bathroom_things,
    beds,
    cabinets,
    cases,
    chairs,
    floor_things,
    gym,
    kitchen,
    lamps,
    office,
    plants,
    shape_rows,
    small_things,
    sofas,
    storage,
    tables,
    vehicles,
    wall_things,
    workshop,
)
from renderer.models.model import Model, Parts, Size, fitted

FAMILIES = (
    *(beds, cabinets, cases, tables, chairs, sofas, lamps, plants, wall_things, floor_things, small_things),
    *(bathroom, bathroom_things, office, gym, workshop, storage, vehicles),
    *(kitchen, appliances, shape_rows),
)
"""The modules of this folder that each have a table ``MODELS``."""

MODELS: dict[str, Model] = {name: model for family in FAMILIES for name, model in family.MODELS.items()}
"""Generator name -> model."""


def build_model(generator: str, style: str, seed: int, size_m: Size) -> Parts:
    """Return the named parts of a model in its own frame; the same arguments give the same bytes.

    ``style`` "default" is the generator's first style.

    Raises:
        KeyError: the generator or the style is unknown.
    """
    model = MODELS[generator]
    chosen = model.styles[0] if style == "default" else style
    if chosen not in model.styles:
        raise KeyError(style)
    return fitted(model.build(np.random.default_rng(seed), size_m, chosen), size_m)


__all__ = ["MODELS", "Model", "Parts", "Size", "build_model"]
