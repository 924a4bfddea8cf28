"""The terms of the layout energy, one row each: name, default weight, kind, unit, what it measures, and what its weight is learned from.

A row is a field of :class:`Weights`.  The order of energy vectors, the configuration, what the chain holds to zero, what learning leaves
alone, reports and the table in ``docs/grammar.md`` all follow from these rows; kernels find a term by its name.  A new term needs its row
here and the kernel that adds its loss (:mod:`grammar.layout.losses` or :mod:`grammar.layout.circulation`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields
from typing import Annotated, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from scene_description import Limits
from scene_description.strict import field_types

Cliques = Literal["wall", "zone", "support", "group", "centre"]
"""What the cliques of a term are made of; :data:`grammar.layout.cliques.COUNTERS` counts them in a layout problem."""

_NEVER = "no valid room has it"
_PROBABILITY = "a probability, which is counted"
_BY_HAND = "a habit that is set by hand"
_NO_DOOR = "observed rooms are taken without doors"


@dataclass(frozen=True, slots=True, kw_only=True)
class EnergyTerm:
    """What one term measures, and how the chain and the learning treat it.

    ``kind``: "hard": zero in every feasible layout; "floor": read off the raster of the floor, which the chain keeps only if the weight of
    such a term is above zero, and zero in every feasible layout then; "soft": neither.  ``learned_from``: the cliques whose observed losses
    teach the weight; a term without them says in ``not_learned`` why its weight stays.

    Raises:
        ValueError: both or neither of ``learned_from`` and ``not_learned`` are given.
    """

    kind: Literal["hard", "floor", "soft"]
    unit: str
    measures: str
    learned_from: Cliques | None = None
    not_learned: str = ""

    def __post_init__(self) -> None:
        if (self.learned_from is None) != bool(self.not_learned):
            raise ValueError(f"energy term '{self.measures}': expected either learned_from or not_learned, got both or neither; give one")


def _hard(unit: str, measures: str) -> EnergyTerm:
    return EnergyTerm(kind="hard", unit=unit, measures=measures, not_learned=_NEVER)


def _floor(unit: str, measures: str) -> EnergyTerm:
    return EnergyTerm(kind="floor", unit=unit, measures=measures, not_learned=_NO_DOOR)


def _soft(unit: str, measures: str, learned_from: Cliques | None = None, not_learned: str = "") -> EnergyTerm:
    return EnergyTerm(kind="soft", unit=unit, measures=measures, learned_from=learned_from, not_learned=not_learned)


Weight = Annotated[float, Limits(ge=0.0, le=1e6)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Weights:
    """The lambda of every energy term; the order of the fields is that of every energy vector.

    A weight of 1 takes the probabilities behind ``relation_odds`` and ``support_address`` as they are.
    """

    overlap: Annotated[Weight, _hard("m", "depth to which solids of two objects overlap")]
    out_of_room: Annotated[Weight, _hard("m", "how far a footprint sticks out of the room, or solids through a sloped ceiling")]
    blocked: Annotated[Weight, _hard("m", "depth of solids in what doors, windows and pictures need free")]
    overhang: Annotated[Weight, _hard("m", "how far a footprint sticks out of its support surface")]
    off_wall: Annotated[
        Weight,
        _hard("m", "distance to the wall of the backs of shelves, beds and the like, and of a side of baths, beyond what they may have"),
    ] = 500.0
    wall_distance: Annotated[Weight, _soft("m", "distance to the wall, less the mean of the mode", "wall")]
    wall_orientation: Annotated[Weight, _soft("rad", "yaw against the wall, less the mean of the mode", "wall")]
    occlusion: Annotated[Weight, _soft("", "share of the depth of an access space that is taken", "zone")]
    support_position: Annotated[Weight, _soft("m", "distances to the four edges of the support surface, less their means", "support")]
    support_orientation: Annotated[Weight, _soft("rad", "yaw on the support surface, less the mean of the mode", "support")]
    support_address: Annotated[Weight, _soft("nat", "-log of the probability of the supporter", not_learned=_PROBABILITY)]
    group_distance: Annotated[Weight, _soft("m", "distance to the place around the core object that fits best", "group")]
    group_orientation: Annotated[Weight, _soft("rad", "yaw against the core object, less the mean of the mode", "group")]
    room_centre: Annotated[Weight, _soft("m", "distance to the centroid of the floor", "centre")]
    screen_aside: Annotated[
        Weight, _soft("rad", "how far a screen and the largest sofa or bed look past each other, beyond 25 degrees", not_learned=_BY_HAND)
    ] = 60.0
    run_order: Annotated[Weight, _soft("nat", "what the order of a run's units costs", not_learned=_PROBABILITY)] = 1.0
    relation_odds: Annotated[Weight, _soft("nat", "what the modes taken are less dense than the densest", not_learned=_PROBABILITY)] = 1.0
    circulation: Annotated[Weight, _floor("", "what the share of the floor that a robot reaches lacks of the wanted one")] = 0.0
    reach: Annotated[Weight, _floor("", "number of seats, beds and stores that a robot does not get to")] = 0.0


ENERGY_TERMS: Mapping[str, EnergyTerm] = {
    name: next(extra for extra in get_args(annotation) if isinstance(extra, EnergyTerm))
    for name, annotation in field_types(Weights).items()
}
"""Name -> row, in the order of every energy vector."""

TERMS: tuple[str, ...] = tuple(ENERGY_TERMS)
"""Names of the energy terms in the order of every energy vector."""

HARD_TERMS: tuple[str, ...] = tuple(name for name, term in ENERGY_TERMS.items() if term.kind == "hard")
"""Names of the terms that measure what no valid room has."""

FLOOR_TERMS: tuple[str, ...] = tuple(name for name, term in ENERGY_TERMS.items() if term.kind == "floor")
"""Names of the terms that are read off the raster of the floor."""


def weight_vector(weights: Weights) -> NDArray[np.float64]:
    """Return the (t,) weights in the order of :data:`TERMS`."""
    return np.array([getattr(weights, name) for name in TERMS])


def terms_table() -> str:
    """Return all rows as a Markdown table."""
    defaults = {field.name: "" if field.default is MISSING else f"{field.default:g}" for field in fields(Weights)}
    lines = ["| term | kind | unit | default weight | loss | weight learned from |", "|---|---|---|---|---|---|"]
    for name, term in ENERGY_TERMS.items():
        learned = f"{term.learned_from} cliques" if term.learned_from else f"not learned: {term.not_learned}"
        lines.append(f"| `{name}` | {term.kind} | {term.unit} | {defaults[name]} | {term.measures} | {learned} |")
    return "\n".join(lines) + "\n"
