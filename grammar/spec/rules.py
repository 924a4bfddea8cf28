"""The attributed spatial And-Or graph of one room type, with every number that shapes its rooms, as frozen data.

An And node is made of all its branches, an Or node of one of them, a Set node of k copies of each of them, k = 0, 1, 2, ... drawn per
branch.  A symbol that is no node is an object, a regular terminal of the graph
(:mod:`grammar.spec.object_rules`).  The formalism is that of Jiang et al., IJCV 2018, section 2.  Units are in the names.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Literal

from grammar.spec.energy_terms import Weights
from grammar.spec.object_rules import ObjectRule
from grammar.spec.room_rules import OpeningRule, RoomRule
from grammar.spec.run_rules import UnitRowRule
from grammar.spec.values import Count, Distance, Extent, Probability, Spread, SpreadAngle, Symbol, TruncatedNormal
from scene_description import Limits, SceneSynthError


@dataclass(frozen=True, slots=True, kw_only=True)
class Branch:
    """One branch of a node.

    Branches of an Or node have a ``probability``, those of a Set node the probabilities of 0, 1, ... copies (``multiplicity``), those of an
    And node neither.
    """

    symbol: Symbol
    probability: Probability | None = None
    multiplicity: Annotated[tuple[Probability, ...], Limits(min_length=1, max_length=64)] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Node:
    """An And, Or or Set node; with ``run`` the objects below it that stand on the floor make a run."""

    kind: Literal["and", "or", "set"]
    branches: Annotated[tuple[Branch, ...], Limits(min_length=1, max_length=256)]
    run: UnitRowRule | None = None


class GrammarError(SceneSynthError):
    """A grammar, or a table beside it, that cannot be used; one line with file, field, expected and got."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MoveRule:
    """Probabilities of the kinds of proposals that the chain makes, and their widths."""

    translate: Probability
    rotate: Probability
    slide: Probability
    swap: Probability
    repoint: Probability
    relocate: Probability
    carry: Probability
    """Probability that what is grouped around a core object moves along with it; what stands on an object always does."""
    translate_sd_m: Annotated[tuple[Spread, ...], Limits(min_length=1, max_length=8)]
    rotate_sd_rad: Annotated[tuple[SpreadAngle, ...], Limits(min_length=1, max_length=8)]
    quarter_turn: Probability
    relocate_uniform: Probability
    relocate_wall: Probability
    relocate_around: Probability
    """Shares of the relocation's mixture; those that an object has no relation for leave their share to the others."""
    relocate_beside: Probability = 0.0
    """Share of the poses around a core that are drawn at the wall nearest to them, for what stands at walls too."""
    wall_gap_sd_m: Spread
    wall_orientation_sd_rad: SpreadAngle
    around_sd_m: Spread
    around_orientation_sd_rad: SpreadAngle
    place_sd_m: Spread


@dataclass(frozen=True, slots=True, kw_only=True)
class Convergence:
    """When the last stage may end before its proposals are spent (Jiang et al., IJCV 2018, section 3.2).

    The histogram of the energies of the last ``window`` sweeps (a sweep is one proposal for each object) differs from that of ``lag``
    sweeps before by less than ``epsilon`` in total variation, over ``bins`` equal bins.  ``window`` 0: the test is off.
    """

    window: Count = 0
    lag: Annotated[int, Limits(ge=1, le=1_000_000)] = 50
    epsilon: Probability = 0.1
    bins: Annotated[int, Limits(ge=2, le=1000)] = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class Schedule:
    """How long the chain runs, in proposals for each object that takes part, and at which tidiness.

    The stages bring in core objects, objects associated with cores, unpaired objects, objects on walls, and supported objects; then all
    move ``together`` (after Jiang et al., IJCV 2018, section 6).  All but what is supported begins in several layouts, the ``entrants``,
    which share the proposals of these stages; after each round the worse half drops out, and the others share half as many as ``unpaired``.
    """

    beta: Annotated[float, Limits(ge=1e-3, le=1e6)]
    walls: Count
    cores: Count
    associates: Count
    unpaired: Count
    supported: Count
    together: Count
    again: Count
    starts: Annotated[int, Limits(ge=1, le=1000)]
    """Poses drawn for an object that comes in; the best one begins."""
    hard_tolerance: Annotated[float, Limits(ge=0.0, le=1.0, unit="m")]
    """A state is feasible when each of its hard energy terms is at most this, and circulation and reach too if they have weights."""
    convergence: Convergence = Convergence()
    entrants: Annotated[int, Limits(ge=1, le=1000)] = 8
    hopeless: Annotated[float, Limits(ge=0.0, le=1000.0, unit="m")] = 0.05
    """A structure is given up when all of its entrants of a round have a hard energy term above this."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Budget:
    """Greatest numbers of derivations for one structure, of structures for one room, of layouts of a structure, of rounds of a chain.

    ``odd``: so many valid layouts with faults of use (:mod:`grammar.checks.faults`) are passed over; then the one with fewest is taken.
    ``mends``: so many further rounds of a chain follow its odd layouts.  ``gate``: what faults pass over, whole structures too or only
    layouts of a structure that has a valid one, which leaves the structures their probabilities.
    """

    derivations: Annotated[int, Limits(ge=1, le=1_000_000)]
    structures: Annotated[int, Limits(ge=1, le=10_000)]
    layouts: Annotated[int, Limits(ge=1, le=10_000)]
    rounds: Annotated[int, Limits(ge=1, le=10_000)]
    odd: Annotated[int, Limits(ge=0, le=10_000)] = 24
    mends: Annotated[int, Limits(ge=0, le=10_000)] = 3
    gate: Literal["structures", "layouts"] = "layouts"


@dataclass(frozen=True, slots=True, kw_only=True)
class Thresholds:
    """Thresholds of the exact checks of a finished room."""

    penetration_m: Distance
    outside_m: Distance
    gap_m: Distance
    walkable_share: Probability
    robot_radius_m: Extent
    robot_height_m: Extent
    reach_depth_m: Extent
    grid_resolution_m: Annotated[float, Limits(ge=0.005, le=0.5, unit="m")]
    side_gap_m: Distance = 0.05
    side_depth_m: Extent = 0.2
    side_share: Probability = 0.0
    """Least free share of the strip ``side_depth_m`` deep, ``side_gap_m`` off the freest of the sides by which an object is reached."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Grammar:
    """One room type: its graph and every number that shapes its rooms.

    ``like``: another room type, whose materials, spots in the ceiling and small things the rooms of a type have that has none of its own.
    """

    room_type: Symbol
    root: Symbol
    like: Symbol | None = None
    room: RoomRule
    openings: Mapping[str, OpeningRule]
    nodes: Mapping[str, Node]
    objects: Mapping[str, ObjectRule]
    weights: Weights
    moves: MoveRule
    schedule: Schedule
    budget: Budget
    validity: Thresholds

    @property
    def looks_like(self) -> str:
        """Room type by which the tables of materials, light and small things know these rooms."""
        return self.like or self.room_type


MOVES: tuple[str, ...] = ("translate", "rotate", "slide", "swap", "repoint", "relocate")
"""Names of the proposals, fields of :class:`MoveRule`, in the order in which they are counted."""


def truncated_normals(grammar: Grammar) -> Iterator[tuple[str, TruncatedNormal]]:
    """Yield the path and the value of every truncated normal distribution of a grammar."""
    for name in ("width_m", "depth_m", "height_m"):
        yield f"room.{name}", getattr(grammar.room, name)
    for name in ("height_m", "eaves_height_m", "pitch_rad"):
        yield f"room.slopes.{name}", getattr(grammar.room.slopes, name)
    for kind, opening in grammar.openings.items():
        for name in ("width_m", "height_m", "sill_m", "corner_gap_m"):
            yield f"openings.{kind}.{name}", getattr(opening, name)
    for symbol, rule in grammar.objects.items():
        if rule.centre_height_m is not None:
            yield f"objects.{symbol}.centre_height_m", rule.centre_height_m
