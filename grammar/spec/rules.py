"""The attributed spatial And-Or graph of one kind of room, as frozen data, and the checks that make it a grammar.

An And node is made of all its branches, an Or node of one of them, a Set node of k copies of each of them, k = 0, 1, 2, ... drawn per
branch.
Symbols that are no nodes are objects (regular terminals): their sizes, and their address terminals, which point to the core object of a
functional group or to what they stand on (Jiang et al., IJCV 2018, section 2).  Units are in the names; objects look along their own +x, so
sizes are (depth, width, height).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Literal

from grammar.spec.energy_terms import Weights
from scene_description import FieldError, Limits

NONE = "none"
"""Target of an address that points to nothing: the object stands for itself."""

CORNER = "corner"
"""Target of an address that points to a free corner of the room."""

Symbol = Annotated[str, Limits(min_length=1, max_length=60, pattern=r"[a-z][a-z0-9_]*")]
Probability = Annotated[float, Limits(ge=0.0, le=1.0)]
Metres = Annotated[float, Limits(ge=-50.0, le=50.0, unit="m")]
Extent = Annotated[float, Limits(ge=0.001, le=50.0, unit="m")]
Spread = Annotated[float, Limits(ge=1e-6, le=50.0, unit="m")]
Distance = Annotated[float, Limits(ge=0.0, le=50.0, unit="m")]
Radians = Annotated[float, Limits(ge=-math.pi, le=math.pi, unit="rad")]
SpreadAngle = Annotated[float, Limits(ge=1e-4, le=0.6, unit="rad")]
Count = Annotated[int, Limits(ge=0, le=10_000_000)]
Side = Literal["front", "back", "left", "right"]
Looseness = Annotated[float, Limits(ge=0.01, le=1000.0)]


class GrammarError(ValueError):
    """A grammar, or a table beside it, that cannot be used; one line with file, field, expected and got."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Normal:
    """A normal distribution cut to [low, high]; lengths in metres."""

    mean: Metres
    sd: Spread
    low: Distance
    high: Distance


@dataclass(frozen=True, slots=True, kw_only=True)
class SizeMode:
    """One component of the mixture of cut normal distributions that an object's size follows; many narrow ones make a kernel estimate."""

    probability: Probability = 1.0
    mean_m: tuple[Extent, Extent, Extent]
    sd_m: tuple[Spread, Spread, Spread]


@dataclass(frozen=True, slots=True, kw_only=True)
class Mode:
    """One of the ways in which an object stands in a relation.

    ``probability``: of this way among the object's ways in the relation; left out in all of them they are equally likely.  ``spread`` and
    ``orientation_spread``: how many times as far from its place, and as much turned, an object stands as the weight alone would have it.
    """

    probability: Probability | None = None
    spread: Looseness = 1.0
    orientation_spread: Looseness = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class WallMode(Mode):
    """How an object likes to stand at a wall: gap, and yaw against the direction into the room (0: back to the wall; null: any)."""

    distance_m: Distance
    orientation_rad: Radians | None = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class AroundMode(Mode):
    """Where an object likes to be in the frame of its core object.

    ``gap_m`` separates the two boxes at ``side`` ("centre": on the core's centre line).  Along that side ``align`` -1 makes the backs (or
    right ends) flush, 1 the fronts (or left ends), 0 the middles; ``along_m`` is added.  ``orientation_rad`` is relative to the core's
    yaw, null: any.
    """

    side: Literal["front", "back", "left", "right", "centre"]
    gap_m: Metres = 0.0
    align: Annotated[float, Limits(ge=-1.0, le=1.0)] = 0.0
    along_m: Metres = 0.0
    orientation_rad: Radians | None = 0.0
    of: Annotated[tuple[Symbol, ...], Limits(max_length=16)] = ()
    """Cores that the place is meant for; empty: all."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlaceMode(Mode):
    """Where an object likes to stand on a top: -1 flush with its back or right edge, 1 with its front or left edge, null: anywhere."""

    depth_fraction: Annotated[float, Limits(ge=-1.0, le=1.0)] | None = None
    width_fraction: Annotated[float, Limits(ge=-1.0, le=1.0)] | None = None
    orientation_rad: Radians | None = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Access:
    """Space that a person needs at one side of an object, ``depth_m`` deep; "under" is the object's own footprint (knees at a desk)."""

    side: Literal["front", "back", "left", "right", "under"]
    depth_m: Extent


@dataclass(frozen=True, slots=True, kw_only=True)
class Tie:
    """A side of an object, or the height of its middle, that follows another object or an opening.

    It is drawn about ``factor`` times the other's measure plus ``add_m`` with standard deviation ``sd_m`` (0: it is exactly that), cut to
    the object's own bounds.  ``to`` is the symbol of its core, or of an object of the same unit.
    """

    axis: Literal["depth", "width", "height", "middle"]
    to: Symbol
    of: Literal["depth", "width", "height", "bottom", "top"]
    factor: Annotated[float, Limits(ge=-10.0, le=10.0)] = 1.0
    add_m: Metres = 0.0
    sd_m: Distance = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectRule:
    """A regular terminal with its attributes and its contextual relations."""

    category: Symbol
    mount: Literal["floor", "object", "wall", "ceiling"] = "floor"
    sizes: Annotated[tuple[SizeMode, ...], Limits(min_length=1, max_length=10_000)]
    low_m: tuple[Extent, Extent, Extent]
    high_m: tuple[Extent, Extent, Extent]
    centre_height_m: Normal | None = None
    wall: Annotated[tuple[WallMode, ...], Limits(max_length=16)] = ()
    cores: Mapping[str, Probability] | None = None
    around: Annotated[tuple[AroundMode, ...], Limits(max_length=64)] = ()
    supporters: Mapping[str, Probability] | None = None
    placements: Annotated[tuple[PlaceMode, ...], Limits(max_length=64)] = ()
    within: Symbol | None = None
    """The nearest node of this name above the object is its own unit: addresses point there, where it has what they name."""
    one_each: Literal["place", "side"] | None = None
    """Of the objects around one core with the same list of places each takes another place, or another side with all places at it.

    A place is drawn in any case, a side only where several objects share the core.
    """
    same_place_as: Symbol | None = None
    """The object takes the placement with the number of the place that this one, of the same unit, has around its core."""
    tied: Annotated[tuple[Tie, ...], Limits(max_length=8)] = ()
    room_centre: bool = False
    access: Annotated[tuple[Access, ...], Limits(max_length=8)] = ()
    reach_any: Annotated[tuple[Side, ...], Limits(max_length=4)] = ()
    view_depth_m: Distance = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Branch:
    """One branch of a node: ``probability`` in an Or node, ``multiplicity`` (of 0, 1, ... copies) in a Set node, nothing in And nodes."""

    symbol: Symbol
    probability: Probability | None = None
    multiplicity: Annotated[tuple[Probability, ...], Limits(min_length=1, max_length=64)] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Node:
    """An And, Or or Set node."""

    kind: Literal["and", "or", "set"]
    branches: Annotated[tuple[Branch, ...], Limits(min_length=1, max_length=256)]


@dataclass(frozen=True, slots=True, kw_only=True)
class RoomShapes:
    """Odds of the shapes that a floor may have, and the proportions of those that are no rectangles.

    A notch takes a share between ``notch_low`` and ``notch_high`` of the sides; no arm that is left is narrower than ``narrowest_m``.
    """

    rectangle: Probability = 1.0
    l_shape: Probability = 0.0
    t_shape: Probability = 0.0
    u_shape: Probability = 0.0
    notch_low: Annotated[float, Limits(ge=0.05, le=0.9)] = 0.25
    notch_high: Annotated[float, Limits(ge=0.05, le=0.9)] = 0.45
    narrowest_m: Annotated[float, Limits(ge=0.3, le=20.0, unit="m")] = 1.6


@dataclass(frozen=True, slots=True, kw_only=True)
class RoomRule:
    """Size of the rectangle that a room fills, and its shape in it.

    ``floor_share_max`` bounds the share of the floor that furniture may cover.
    """

    width_m: Normal
    depth_m: Normal
    height_m: Normal
    wall_thickness_m: Annotated[float, Limits(ge=0.02, le=1.0, unit="m")]
    area_low_m2: Annotated[float, Limits(ge=1.0, le=10_000.0, unit="m2")]
    area_high_m2: Annotated[float, Limits(ge=1.0, le=10_000.0, unit="m2")]
    floor_share_max: Annotated[float, Limits(ge=0.01, le=1.0)]
    shapes: RoomShapes = RoomShapes()


@dataclass(frozen=True, slots=True, kw_only=True)
class OpeningRule:
    """Doors or windows: how many, how large, where in a wall, and what must stay free before them.

    ``near_corner`` is the probability of lying ``corner_gap_m`` from one end of the wall, else the place along the wall is uniform.
    Furniture
    keeps out of ``clear_depth_m`` before the opening above ``sill + clear_above_sill_m``; nothing hangs within ``casing_m`` of its sides
    and top.
    """

    multiplicity: Annotated[tuple[Probability, ...], Limits(min_length=1, max_length=16)]
    width_m: Normal
    height_m: Normal
    sill_m: Normal
    near_corner: Probability
    corner_gap_m: Normal
    end_gap_m: Distance
    clear_depth_m: Extent
    clear_above_sill_m: Distance
    casing_m: Distance
    swing_in: Probability = 0.0
    wall_without_door: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class MoveRule:
    """Which proposals the chain makes how often, and their widths."""

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

    The five stages bring in what hangs, what groups gather around, what gathers, what stands alone and what stands on things; then all move
    ``together``.  ``anneal_from_beta`` below ``beta`` raises the tidiness geometrically over the last stage; equal to it, beta is constant.
    ``keep``: the last feasible state of the chain, or the best.
    """

    beta: Annotated[float, Limits(ge=1e-3, le=1e6)]
    anneal_from_beta: Annotated[float, Limits(ge=1e-3, le=1e6)]
    keep: Literal["last", "best"]
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Budget:
    """How often to try: derivations for one room, structures, layouts of one structure, rounds of one layout's chain."""

    derivations: Annotated[int, Limits(ge=1, le=1_000_000)]
    structures: Annotated[int, Limits(ge=1, le=10_000)]
    layouts: Annotated[int, Limits(ge=1, le=10_000)]
    rounds: Annotated[int, Limits(ge=1, le=10_000)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Thresholds:
    """What the exact checks hold a finished room to."""

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
    """One room type: its graph and every number that shapes its rooms."""

    room_type: Symbol
    root: Symbol
    room: RoomRule
    openings: Mapping[str, OpeningRule]
    nodes: Mapping[str, Node]
    objects: Mapping[str, ObjectRule]
    weights: Weights
    moves: MoveRule
    schedule: Schedule
    budget: Budget
    validity: Thresholds


MOVES: tuple[str, ...] = ("translate", "rotate", "slide", "swap", "repoint", "relocate")
"""Names of the proposals, fields of :class:`MoveRule`, in the order in which they are counted."""


def normals(grammar: Grammar) -> Iterator[tuple[str, Normal]]:
    """Yield the path and value of every cut normal distribution of a grammar."""
    for name in ("width_m", "depth_m", "height_m"):
        yield f"room.{name}", getattr(grammar.room, name)
    for kind, opening in grammar.openings.items():
        for name in ("width_m", "height_m", "sill_m", "corner_gap_m"):
            yield f"openings.{kind}.{name}", getattr(opening, name)
    for symbol, thing in grammar.objects.items():
        if thing.centre_height_m is not None:
            yield f"objects.{symbol}.centre_height_m", thing.centre_height_m


def range_error(path: str, low: float, high: float) -> FieldError:
    """Return the error for bounds that are the wrong way round."""
    return FieldError(path, f"a lower bound below the upper bound {high:g}", f"{low:g}")
