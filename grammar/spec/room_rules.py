"""The shell of a room: its size, the shape of its floor, its doors and windows."""

from dataclasses import dataclass
from typing import Annotated, get_args

from grammar.spec.values import Distance, Extent, Probability, Spread, TruncatedNormal
from scene_description import Limits
from scene_description.types import OpeningKind

OPENINGS: tuple[OpeningKind, ...] = get_args(OpeningKind)
"""Kinds of openings, in the order in which they are drawn; every grammar has doors and windows."""

MOST_NOTCHES = 64


@dataclass(frozen=True, slots=True, kw_only=True)
class RoomShapes:
    """Probabilities of the shapes of a floor, and the proportions of those that are not rectangles.

    A notch takes a share between ``notch_low`` and ``notch_high`` of a side.  With ``notches`` that of an L takes about these shares of its
    long and of its short side, one pair as likely as the others, with the deviation ``notch_sd``.  A chimney breast juts out from the
    middle of a side, an alcove is let into one, and a bay is an alcove whose walls carry the room's windows, with side walls at 45 degrees
    by the odds of ``bay_canted``; these are as wide and as deep as their ranges say.  No arm of the floor is narrower than ``narrowest_m``.
    """

    rectangle: Probability = 1.0
    l_shape: Probability = 0.0
    t_shape: Probability = 0.0
    u_shape: Probability = 0.0
    chimney_breast: Probability = 0.0
    alcove: Probability = 0.0
    bay: Probability = 0.0
    notch_low: Annotated[float, Limits(ge=0.05, le=0.9)] = 0.25
    notch_high: Annotated[float, Limits(ge=0.05, le=0.9)] = 0.45
    notches: Annotated[tuple[tuple[Probability, Probability], ...], Limits(max_length=MOST_NOTCHES)] = ()
    notch_sd: Annotated[float, Limits(ge=0.001, le=1.0)] = 0.05
    narrowest_m: Annotated[float, Limits(ge=0.3, le=20.0, unit="m")] = 1.6
    breast_width_m: tuple[Extent, Extent] = (1.0, 1.6)
    breast_depth_m: tuple[Extent, Extent] = (0.3, 0.45)
    alcove_width_m: tuple[Extent, Extent] = (1.1, 2.6)
    alcove_depth_m: tuple[Extent, Extent] = (0.4, 0.65)
    bay_width_m: tuple[Extent, Extent] = (1.8, 2.8)
    bay_depth_m: tuple[Extent, Extent] = (0.5, 0.75)
    bay_canted: Probability = 0.6


_ATTIC_HEIGHT = TruncatedNormal(mean=2.42, sd=0.08, low=2.3, high=2.6)
_EAVES_HEIGHT = TruncatedNormal(mean=1.1, sd=0.2, low=0.8, high=1.5)
_PITCH = TruncatedNormal(mean=0.72, sd=0.1, low=0.52, high=0.87)


@dataclass(frozen=True, slots=True, kw_only=True)
class SlopeRule:
    """How often a room lies under a roof, and how its ceiling slopes then: towards one wall, or alike towards two opposite ones.

    The ceiling falls at ``pitch_rad`` from ``height_m``, which takes the place of the room's own, to ``eaves_height_m`` at these walls.
    It is ``high_m`` high or more over a floor of at least ``high_share`` of what was drawn before it grew by what is too low to count
    (International Residential Code, R305.1: 7 feet over half of the floor that is asked for).
    """

    probability: Probability = 0.0
    two_sides: Probability = 0.35
    height_m: TruncatedNormal = _ATTIC_HEIGHT
    eaves_height_m: TruncatedNormal = _EAVES_HEIGHT
    pitch_rad: TruncatedNormal = _PITCH
    high_m: Distance = 2.13
    high_share: Probability = 0.5


ARMED = ("l_shape", "t_shape", "u_shape")
"""Shapes that are made of arms."""
SHAPES = ("rectangle", "l_shape", "t_shape", "u_shape", "chimney_breast", "alcove", "bay")
"""Fields of :class:`RoomShapes` that are probabilities."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RoomSize:
    """A component of the mixture that the size of a room follows: both sides, and the share of the floor that furniture covers.

    The sides are those of a rectangle of the room's area, the first as likely along x as along y.  With ``arm_m`` the room is L-, T- or
    U-shaped, the sides are those of its bounding rectangle and all its arms are as wide as that, as in halls.  A mixture that has such
    components has these shapes by them only.  Without ``floor_share`` such a room holds any furniture.
    """

    probability: Probability = 1.0
    mean_m: tuple[Extent, Extent]
    sd_m: tuple[Spread, Spread]
    floor_share: Probability | None = None
    share_sd: Annotated[float, Limits(ge=0.001, le=1.0)] = 0.05
    arm_m: Extent | None = None
    arm_sd_m: Spread = 0.02


@dataclass(frozen=True, slots=True, kw_only=True)
class RoomRule:
    """Size of the bounding rectangle of a room, and the shape of the floor within it.

    ``floor_share_max`` bounds the share of the floor that furniture may cover.  In rooms whose size no request gives ``used_share_max``
    bounds that which it takes with the space to use it and doors, ``wall_share_max`` that of the walls behind it: beyond hardly any layout
    is valid.  With ``floor_share`` a room is as large as its furniture
    asks for: the area is what that covers over the share drawn, and ``proportion`` (long side over short one) takes the place of the sides.
    With ``sizes`` sides and share are drawn together, from a mixture.  With ``area_m2`` the area itself is drawn, as for halls, which are
    not made for furniture.  Sides and outlines that a request gives stay.
    """

    width_m: TruncatedNormal
    depth_m: TruncatedNormal
    height_m: TruncatedNormal
    wall_thickness_m: Annotated[float, Limits(ge=0.02, le=1.0, unit="m")]
    area_low_m2: Annotated[float, Limits(ge=1.0, le=10_000.0, unit="m2")]
    area_high_m2: Annotated[float, Limits(ge=1.0, le=10_000.0, unit="m2")]
    floor_share_max: Annotated[float, Limits(ge=0.01, le=1.0)]
    used_share_max: Annotated[float, Limits(ge=0.05, le=10.0)] = 10.0
    wall_share_max: Annotated[float, Limits(ge=0.05, le=10.0)] = 10.0
    shapes: RoomShapes = RoomShapes()
    slopes: SlopeRule = SlopeRule()
    floor_share: TruncatedNormal | None = None
    area_m2: TruncatedNormal | None = None
    proportion: TruncatedNormal | None = None
    sizes: Annotated[tuple[RoomSize, ...], Limits(max_length=256)] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class RoomNeeds:
    """What people expect of every room of a type, however it is furnished: the checks of use find what lacks.

    ``roles``: of each of these at least one object.  ``door_m``: a door that is as wide.  ``company``: each sofa and armchair looks at
    something.
    """

    roles: Annotated[tuple[str, ...], Limits(max_length=16)] = ()
    door_m: Distance = 0.0
    company: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class OpeningRule:
    """Doors, overhead doors or windows: how many, how large, where in a wall, and what must stay free before them.

    A wall is drawn by its length to the ``length_power``: 1 makes every place alike, 0 every wall, as at the ends of halls.
    ``near_corner`` is the probability that the opening lies ``corner_gap_m`` from one end of its wall; else its offset is uniform.
    Furniture keeps out of ``clear_depth_m`` before the opening above ``sill + clear_above_sill_m``.  Nothing hangs within ``casing_m``
    of its sides and top.  The floor is at least ``floor_depth_m`` deep before its wall.  A room has no more openings than leave each of
    them ``wall_m`` of the walls' length, unless it must have more.
    """

    multiplicity: Annotated[tuple[Probability, ...], Limits(min_length=1, max_length=16)]
    width_m: TruncatedNormal
    height_m: TruncatedNormal
    sill_m: TruncatedNormal
    near_corner: Probability
    corner_gap_m: TruncatedNormal
    end_gap_m: Distance
    clear_depth_m: Extent
    clear_above_sill_m: Distance
    casing_m: Distance
    swing_in: Probability = 0.0
    wall_without_door: bool = False
    floor_depth_m: Distance = 0.0
    wall_m: Distance = 0.0
    length_power: Annotated[float, Limits(ge=0.0, le=3.0)] = 1.0
