"""The terms of the layout energy, one row each: name, default weight, kind, unit, formula, and what its weight is learned from.

A row is a field of :class:`Weights`.  The order of energy vectors, the configuration, what the chain holds to zero, what learning leaves
alone, reports and the table in ``docs/grammar.md`` all follow from these rows; kernels write to ``out[TERM.name]``.  A new term needs its
row here and a kernel that says which terms it adds to (:mod:`grammar.layout.losses`).
"""

from collections import namedtuple
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from scene_description import Limits
from scene_description.strict import field_types

Cliques = Literal["wall", "zone", "support", "group", "centre"]
"""What the cliques of a term are made of; :data:`grammar.layout.problem.COUNTERS` counts them in a layout problem."""

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
    formula: str
    learned_from: Cliques | None = None
    not_learned: str = ""

    def __post_init__(self) -> None:
        if (self.learned_from is None) != bool(self.not_learned):
            raise ValueError(f"energy term '{self.measures}': expected either learned_from or not_learned, got both or neither; give one")


def _hard(unit: str, measures: str, formula: str) -> EnergyTerm:
    return EnergyTerm(kind="hard", unit=unit, measures=measures, formula=formula, not_learned=_NEVER)


def _floor(unit: str, measures: str, formula: str) -> EnergyTerm:
    return EnergyTerm(kind="floor", unit=unit, measures=measures, formula=formula, not_learned=_NO_DOOR)


def _soft(unit: str, measures: str, formula: str, learned_from: Cliques | None = None, not_learned: str = "") -> EnergyTerm:
    return EnergyTerm(kind="soft", unit=unit, measures=measures, formula=formula, learned_from=learned_from, not_learned=not_learned)


Weight = Annotated[float, Limits(ge=0.0, le=1e6)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Weights:
    """The lambda of every energy term; the order of the fields is that of every energy vector.

    A weight of 1 takes the probabilities behind ``relation_odds`` and ``support_address`` as they are.
    """

    overlap: Annotated[Weight, _hard("m", "depth to which solids of two objects overlap", "Σ depth")]
    out_of_room: Annotated[
        Weight,
        _hard("m", "how far a footprint sticks out of the room, or solids through a sloped ceiling", "outside + depth above slopes"),
    ]
    blocked: Annotated[Weight, _hard("m", "depth of solids in what doors, windows and pictures need free", "Σ max depth")]
    overhang: Annotated[Weight, _hard("m", "how far a footprint sticks out of its support surface", "Σ max(0, |u| + a - half extent)")]
    off_wall: Annotated[
        Weight,
        _hard(
            "m",
            "distance to the wall of the backs of shelves, beds and the like, and of a side of baths, beyond what they may have",
            "max(0, back - gap) + max(0, min(left, right) - gap)",
        ),
    ] = 500.0
    wall_distance: Annotated[Weight, _soft("m", "distance to the wall, less the mean of the mode", "|gap - mean| / spread", "wall")]
    wall_orientation: Annotated[Weight, _soft("rad", "yaw against the wall, less the mean of the mode", "|yaw - mean| / spread", "wall")]
    occlusion: Annotated[Weight, _soft("", "share of the depth of an access space that is taken", "Σ min(taken / depth, 1)", "zone")]
    support_position: Annotated[
        Weight,
        _soft(
            "m", "distances to the four edges of the support surface, less their means", "2 (|u - mean| + |v - mean|) / spread", "support"
        ),
    ]
    support_orientation: Annotated[
        Weight, _soft("rad", "yaw on the support surface, less the mean of the mode", "|yaw - mean| / spread", "support")
    ]
    support_address: Annotated[Weight, _soft("nat", "-log of the probability of the supporter", "-ln p / β", not_learned=_PROBABILITY)]
    group_distance: Annotated[
        Weight, _soft("m", "distance to the place around the core object that fits best", "√(Δx² + Δy²) / spread", "group")
    ]
    group_orientation: Annotated[
        Weight, _soft("rad", "yaw against the core object, less the mean of the mode", "|yaw - mean| / spread", "group")
    ]
    room_centre: Annotated[Weight, _soft("m", "distance to the centroid of the floor", "√(Δx² + Δy²)", "centre")]
    screen_aside: Annotated[
        Weight,
        _soft(
            "rad",
            "how far a screen and the largest sofa or bed look past each other, beyond 25 degrees",
            "max(0, max(off screen, off seat) - 25°)",
            not_learned=_BY_HAND,
        ),
    ] = 240.0
    run_order: Annotated[
        Weight, _soft("nat", "what the order of a run's units costs", "Σ cost of wishes not met / β", not_learned=_PROBABILITY)
    ] = 1.0
    relation_odds: Annotated[
        Weight,
        _soft("nat", "what the modes taken are less dense than the densest", "(max ln density - ln density) / β", not_learned=_PROBABILITY),
    ] = 1.0
    circulation: Annotated[
        Weight,
        _floor("", "what the share of the floor that a robot reaches lacks of the wanted one", "max(0, wanted - reached / standable)"),
    ] = 0.0
    reach: Annotated[Weight, _floor("", "number of seats, beds and stores that a robot does not get to", "Σ 1")] = 0.0


ENERGY_TERMS: Mapping[str, EnergyTerm] = {
    name: next(extra for extra in get_args(annotation) if isinstance(extra, EnergyTerm))
    for name, annotation in field_types(Weights).items()
}
"""Name -> row, in the order of every energy vector."""

TERMS: tuple[str, ...] = tuple(ENERGY_TERMS)
"""Names of the energy terms in the order of every energy vector."""

TERM: Any = namedtuple("TERM", TERMS)(*range(len(TERMS)))  # type: ignore[misc]
"""Places of the terms in every energy vector, as constants of kernels."""

HARD_TERMS: tuple[str, ...] = tuple(name for name, term in ENERGY_TERMS.items() if term.kind == "hard")
"""Names of the terms that measure what no valid room has."""

FLOOR_TERMS: tuple[str, ...] = tuple(name for name, term in ENERGY_TERMS.items() if term.kind == "floor")
"""Names of the terms that are read off the raster of the floor."""


def weight_vector(weights: Weights) -> NDArray[np.float64]:
    """Return the (t,) weights in the order of :data:`TERMS`."""
    return np.array([getattr(weights, name) for name in TERMS])
