"""Procedural furniture: the table of generators and how to build one model.

Each family of furniture has a file; a new category is one function and one line of that file's ``MODELS``.
"""

from __future__ import annotations

import numpy as np

from renderer.models import (
    appliances,
    bathroom,
    bathroom_things,
    beds,
    cabinets,
    cars,
    cases,
    chairs,
    curtains,
    desks,
    dining_chairs,
    dining_things,
    electronics,
    exercise_bikes,
    fitted_kitchen,
    gym,
    hallway,
    islands,
    kitchen,
    kitchen_things,
    lamps,
    left_about,
    living_things,
    office,
    plants,
    rugs,
    seats,
    shelves,
    small,
    sofas,
    storage,
    tables,
    wall_things,
    workshop,
)
from renderer.models.model import Model, Parts, Size

MODELS: dict[str, Model] = {
    name: model
    for family in (
        *(beds, cabinets, desks, chairs, seats, rugs, shelves, lamps, plants, small, electronics, wall_things),
        *(bathroom, bathroom_things, office, gym, exercise_bikes, workshop, storage, cars),
        *(sofas, tables, cases, living_things, curtains, dining_chairs, dining_things, hallway),
        *(kitchen, fitted_kitchen, islands, appliances, kitchen_things),
        *(kitchen, fitted_kitchen, appliances, kitchen_things, left_about),
    )
    for name, model in family.MODELS.items()
}
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
    return model.build(np.random.default_rng(seed), size_m, chosen)


__all__ = ["MODELS", "Model", "Parts", "Size", "build_model"]
