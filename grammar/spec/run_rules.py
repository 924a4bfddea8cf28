"""Runs: rows of units that stand side by side along walls, round corners of the room, out into it or free in it, and move as one."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

from grammar.spec.values import Distance
from scene_description import Limits

END, CORNER_UNIT, WINDOW, SIDE_WINDOW = "end", "corner", "window", "side_window"
"""What a unit may be near to or apart from beside symbols of objects: an end of its run, a unit that turns, the wall below a window, a wall
at right angles to one with a window, so that the light comes from the side."""

HANGING_LOW_M = 1.3
"""Units that are higher close the line of what hangs above the others."""

Cost = Annotated[float, Limits(ge=0.0, le=100.0, unit="nat")]


@dataclass(frozen=True, slots=True, kw_only=True)
class UnitRowRule:
    """What makes the objects below a node that stand on the floor one run.

    They stand with their backs, and at side walls with their sides, ``wall_gap_m`` off the wall, or one of ``wall_gaps_m``, equally likely,
    and ``joint_m`` apart, or one of ``joints_m``.  A run that does not touch a side wall leaves ``end_gap_m`` at least;
    with ``flush`` it touches one where its stretch of wall ends at one, with ``ends_free`` a run without corner touches none.  Before units
    that face each other ``aisle_m`` stays free, and ``corner_aisle_m`` (if not given: ``aisle_m``) between units' fronts and a later run
    at a wall at an angle to theirs.  With ``window_gap_m`` the run keeps that far off the sides of windows (room for curtains), else low
    units stand below them.  A metre of wall that a run could take and leaves bare makes an arrangement less likely by ``bare_cost`` nat; it
    leaves at most ``most_bare_m``.  A unit that carries something in line costs ``line_cost`` nat if neither unit beside it does, nor
    stands as high.

    With ``free`` the run stands in the room as an island, its front to the units of a run drawn before it, ``aisle_m`` to 0.3 m more away
    from these.  ``around_m`` stays free behind it and at its ends, and behind and beyond what juts out of a run at a wall.  Where a room is
    as large as its furniture asks for, the run asks for as much as if it covered ``floor_m2`` more than its units do.
    """

    wall_gap_m: Distance = 0.005
    wall_gaps_m: Annotated[tuple[Distance, ...], Limits(max_length=64)] = ()
    joint_m: Distance = 0.0
    joints_m: Annotated[tuple[Distance, ...], Limits(max_length=64)] = ()
    end_gap_m: Distance = 0.4
    aisle_m: Distance = 0.8
    corner_aisle_m: Distance | None = None
    window_gap_m: Distance | None = None
    bare_cost: Cost = 4.0
    most_bare_m: Distance = 50.0
    flush: bool = True
    ends_free: bool = False
    line_cost: Cost = 0.0
    free: bool = False
    around_m: Distance = 0.9
    floor_m2: Annotated[float, Limits(ge=0.0, le=100.0, unit="m2")] = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class RowUnit:
    """How a unit stands in its run.

    ``turns``: it fills a corner of the room, with its back and its right side at walls, and the run goes on along the next wall.
    ``stretches``: its width is what the run lacks to the end of the wall, within the bounds of the size.
    ``juts``: it stands behind the last unit that turns, in a leg that leaves the wall at a right angle there; its front is even with the
    side of that unit.
    ``end_on``: it stands with a side to the wall and looks along that, away from the middle of its run, so that two of them stand back to
    back.

    ``near`` and ``apart`` are what it costs (nat) if the unit is not beside one of these, or is beside one: symbols of units, "end",
    "corner", "window", "side_window".  At an end is also what has only units between itself and the end that like to be near it too, so
    several tall units stand together there.
    """

    gaps_m: Annotated[tuple[Distance, ...], Limits(max_length=64)] = ()
    """How far its back stands off the line of its run: one of these, equally likely; empty: not at all."""
    turns: bool = False
    stretches: bool = False
    juts: bool = False
    end_on: bool = False
    near: Mapping[str, Cost] | None = None
    apart: Mapping[str, Cost] | None = None
