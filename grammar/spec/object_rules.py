"""Regular terminals of the And-Or graph: an object's sizes, where it is mounted, and its contextual relations.

Objects look along their own +x, so sizes are (depth, width, height).  A relation is a list of modes: poses relative to a wall, to the core
object of the functional group, or to the supporter.  Address terminals (``cores``, ``supporters``) point to the object that the relation
refers to (Jiang et al., IJCV 2018, section 2).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Literal

from grammar.spec.run_rules import RowUnit
from grammar.spec.values import Distance, Extent, Looseness, Metres, Probability, Radians, Side, Spread, Symbol, TruncatedNormal
from scene_description import Limits

Mount = Literal["floor", "object", "wall", "ceiling"]

NONE = "none"
"""Target of an address that points to nothing: the object stands for itself."""

CORE = "core"
"""What a tie follows: the core, whatever its symbol."""

CORNER = "corner"
"""Target of an address that points to a free corner of the room."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SizeMode:
    """A component of the mixture that an object's size follows: a product of truncated normal distributions, one for each side.

    Many narrow components make a kernel density estimate.
    """

    probability: Probability = 1.0
    mean_m: tuple[Extent, Extent, Extent]
    sd_m: tuple[Spread, Spread, Spread]


@dataclass(frozen=True, slots=True, kw_only=True)
class HeightMode:
    """A component of the mixture that the height of the middle of what hangs follows: a normal distribution."""

    probability: Probability = 1.0
    mean_m: Distance
    sd_m: Spread


@dataclass(frozen=True, slots=True, kw_only=True)
class Mode:
    """One preferred pose of an object in a relation, a component of a mixture.

    ``probability`` is the component's share; where all modes of the relation leave it out, they are equally likely.  ``spread`` and
    ``orientation_spread`` scale the mean deviation, in position and in yaw, that the weight of the energy term alone would give.
    """

    probability: Probability | None = None
    spread: Looseness = 1.0
    orientation_spread: Looseness = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class WallMode(Mode):
    """A preferred gap to a wall, and a yaw relative to the direction into the room (0: back to the wall; null: any)."""

    distance_m: Distance
    orientation_rad: Radians | None = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class AroundMode(Mode):
    """A preferred pose in the frame of the core object.

    ``gap_m`` separates the two boxes at ``side`` ("centre": on the core's centre line; of a door also "latch" and "hinge").  Along that
    side ``align`` -1 makes the backs (or right ends) flush, 1 the fronts (or left ends), 0 the middles; ``along_m`` is added.
    ``orientation_rad`` is relative to the core's yaw (null: any).
    """

    side: Literal["front", "back", "left", "right", "centre", "latch", "hinge"]
    gap_m: Metres = 0.0
    align: Annotated[float, Limits(ge=-1.0, le=1.0)] = 0.0
    along_m: Metres = 0.0
    orientation_rad: Radians | None = 0.0
    of: Annotated[tuple[Symbol, ...], Limits(max_length=16)] = ()
    """Cores that the place is meant for; empty: all."""

    def at_door(self, hinge: Literal["start", "end"]) -> "AroundMode":
        """Return the mode with "latch" or "hinge" told as the side of a door with that hinge; the start is at the left, seen from it."""
        if self.side not in ("latch", "hinge"):
            return self
        return replace(self, side="left" if (self.side == "hinge") == (hinge == "start") else "right")


@dataclass(frozen=True, slots=True, kw_only=True)
class PlaceMode(Mode):
    """A preferred pose on a support surface: -1 flush with its back or right edge, 1 with its front or left edge, null: anywhere."""

    depth_fraction: Annotated[float, Limits(ge=-1.0, le=1.0)] | None = None
    width_fraction: Annotated[float, Limits(ge=-1.0, le=1.0)] | None = None
    orientation_rad: Radians | None = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Access:
    """Space that a person needs at one side of an object, ``depth_m`` deep.

    "under" is the object's own footprint (knees at a desk); "over" too, of a mat, and nothing that stands on the floor may take any of it.
    """

    side: Literal["front", "back", "left", "right", "under", "over"]
    depth_m: Extent


@dataclass(frozen=True, slots=True, kw_only=True)
class Tie:
    """A dependency of one attribute on another object or an opening: a side of the object, or the height of its middle.

    The attribute is normal about ``factor`` times the other's measure plus ``add_m``, with standard deviation ``sd_m`` (0: exactly that
    value), truncated to the object's own bounds.  ``to`` is "core", the symbol of the core, or that of an object of the same unit.
    """

    axis: Literal["depth", "width", "height", "middle"]
    to: Symbol
    of: Literal["depth", "width", "height", "bottom", "top"]
    factor: Annotated[float, Limits(ge=-10.0, le=10.0)] = 1.0
    add_m: Metres = 0.0
    sd_m: Distance = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectRule:
    """A regular terminal with its attributes, its address terminals and its contextual relations.

    ``sizes`` is a mixture truncated to ``low_m`` and ``high_m``.  ``wall``, ``around`` and ``placements`` are the modes of the relations to
    walls, to the core and to the supporter; ``cores`` and ``supporters`` the probabilities of what the address terminals point to.
    ``room_centre``: the object is drawn to the middle of the room.  A robot must reach one of the sides ``reach_any``.  What hangs keeps
    ``view_depth_m`` before it free of what stands on the floor.
    """

    category: Symbol
    mount: Mount = "floor"
    sizes: Annotated[tuple[SizeMode, ...], Limits(min_length=1, max_length=10_000)]
    low_m: tuple[Extent, Extent, Extent]
    high_m: tuple[Extent, Extent, Extent]
    centre_height_m: TruncatedNormal | None = None
    heights: Annotated[tuple[HeightMode, ...], Limits(max_length=64)] = ()
    """A mixture in place of that one normal distribution, truncated to the same bounds."""
    wall: Annotated[tuple[WallMode, ...], Limits(max_length=16)] = ()
    cores: Mapping[str, Probability] | None = None
    around: Annotated[tuple[AroundMode, ...], Limits(max_length=64)] = ()
    supporters: Mapping[str, Probability] | None = None
    placements: Annotated[tuple[PlaceMode, ...], Limits(max_length=64)] = ()
    within: Symbol | None = None
    """Symbol of a node above the object.  The nearest such node is the object's unit, and addresses point to objects of the unit.

    Where the unit holds no object of the symbol that an address names, the address points to those of the whole room.
    """
    one_each: Literal["place", "side"] | None = None
    """Objects that share a core and a list of modes exclude each other: from a mode ("place"), or from all modes at a side ("side").

    A place is drawn in any case, a side only where several objects share the core.
    """
    same_place_as: Symbol | None = None
    """Symbol of an object of the same unit.  If that one takes mode k of its ``around``, this one takes mode k of its ``placements``."""
    tied: Annotated[tuple[Tie, ...], Limits(max_length=8)] = ()
    room_centre: bool = False
    access: Annotated[tuple[Access, ...], Limits(max_length=8)] = ()
    reach_any: Annotated[tuple[Side, ...], Limits(max_length=4)] = ()
    view_depth_m: Distance = 0.0
    in_run: RowUnit | None = None
    """How the object stands in the run of a node above it."""
    in_line: bool = False
    """What hangs keeps to the middle of its core, a unit of a run, which carries one such object, and moves only with it.

    Without a tie of its width it hangs in a row instead, edge to edge with its like above the units of the runs, which then stay where
    they are.
    """
    beside_tall: Probability | None = None
    """How likely such a row begins beside a tall unit; without it, at either end of what is free, as likely."""
    below_row_m: Distance | None = None
    """Height of what hangs in line where a row goes past its core: it is built in below the row.  Without it, rows leave its place free."""


def plain_rule(category: str, mount: Mount, size_m: tuple[float, float, float]) -> ObjectRule:
    """Return the rule of an object that no grammar knows: it keeps its size, and nothing about it needs to be free."""
    sizes = (SizeMode(mean_m=size_m, sd_m=(0.01, 0.01, 0.01)),)
    return ObjectRule(category=category, mount=mount, sizes=sizes, low_m=size_m, high_m=size_m)
