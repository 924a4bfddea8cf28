"""Where a run can stand: frames, stretches of one or more walls round corners of the room, and slots, places of a run in these.

A run is walked from its first unit to its last one, along the walls as the outline numbers them or against that, so a run and its mirror
image have slots of their own.  A leg is the part of a run that stands at one line; all legs but the last end with a unit that turns.  A
line is a wall, or one on the floor: that of a last leg that juts out into the room behind a unit that turns (a peninsula), or that of a run
that stands free (an island).
"""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from grammar.geometry.arrays import Floats
from grammar.geometry.wall_spans import Span
from grammar.geometry.walls import ALONG_X, ALONG_Y, LENGTH, REFLEX, START_X, START_Y, WALL_YAW
from grammar.spec.run_rules import RowUnit, UnitRowRule

MOST_LEGS, LEG_COLUMNS = 3, 3
"""Of a slot: legs at most, and numbers for each, x, y and yaw of its line."""
_SQUARE = 0.02
"""Greatest cosine of the angle between two walls round which a run goes."""

_FIT_M = 1e-4
_TOUCH_M = 1e-6
_CLOSED_M = 0.01


class Leg(NamedTuple):
    """What a leg may take of a wall: metres ``low`` to ``high`` along it in the direction of the walk."""

    wall: int
    low: float
    high: float


class Frame(NamedTuple):
    """Where the legs of a run may stand.

    forward: the walk follows the numbers of the walls; closed_start, closed_end: whether a side wall ends the first and the last leg there.
    """

    forward: bool
    legs: tuple[Leg, ...]
    closed_start: bool
    closed_end: bool


class Line(NamedTuple):
    """Where the backs of a leg stand: the point at which the leg begins, and the direction to its front (metres, radians)."""

    x_m: float
    y_m: float
    yaw_rad: float

    def point(self, along_m: float, across_m: float) -> tuple[float, float]:
        """Return the point so far along the line, which is to the right of its front, and so far before it."""
        c, s = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        return self.x_m + along_m * s + across_m * c, self.y_m - along_m * c + across_m * s


class Slot(NamedTuple):
    """One place of a run whose legs have given lengths.

    direction: 1 if the walk goes along the lines, a wall on its right, else -1; x_a, y_a, yaw_a, ...: the line of each leg (zero where
    there is no such leg); slide: how far the run may be shifted along from there.
    """

    direction: float
    x_a: float
    y_a: float
    yaw_a: float
    x_b: float
    y_b: float
    yaw_b: float
    x_c: float
    y_c: float
    yaw_c: float
    slide: float

    def line(self, leg: int) -> Line:
        """Return the line of a leg."""
        return Line(*self[1 + LEG_COLUMNS * leg :][:LEG_COLUMNS])


def slot_at(direction: float, lines: Sequence[Line], slide: float) -> Slot:
    """Return the slot whose legs have these lines."""
    numbers = [number for line in lines for number in line]
    return Slot._make((direction, *numbers, *[0.0] * (LEG_COLUMNS * MOST_LEGS - len(numbers)), slide))


def frames(wall: Floats, spans: Sequence[Sequence[Span]], legs: int, corners_m: tuple[float, float], gap_m: float) -> list[Frame]:
    """Return all frames of a run.

    Args:
        wall: (w, 9) rows of :func:`grammar.geometry.walls.wall_rows`.
        spans: the free stretches of each wall.
        legs: their number.
        corners_m: how far from a corner the next leg begins where the walk follows the numbers of the walls, and where it does not.
        gap_m: between units and walls.
    """
    found: list[Frame] = []
    for forward in (True, False):
        lengths, ordered = [float(row[LENGTH]) for row in wall], [_walked(spans, w, wall, forward) for w in range(len(wall))]
        for w in range(len(wall)):
            found.extend(_frames_from(wall, lengths, ordered, w, forward, (legs, corners_m[not forward], gap_m)))
    return found


def _walked(spans: Sequence[Sequence[Span]], w: int, wall: Floats, forward: bool) -> list[Span]:
    """Return the free stretches of a wall in the direction of the walk."""
    if forward:
        return list(spans[w])
    length = float(wall[w, LENGTH])
    return [Span(length - s.high, length - s.low, s.closed_high, s.closed_low) for s in reversed(spans[w])]


def _turns(wall: Floats, w: int, forward: bool) -> bool:
    """Return whether a run can go on from wall ``w`` round the corner at its end."""
    following = (w + 1) % len(wall) if forward else w
    before = (following - 1) % len(wall)
    cosine = wall[before, ALONG_X] * wall[following, ALONG_X] + wall[before, ALONG_Y] * wall[following, ALONG_Y]
    return not wall[following, REFLEX] and abs(cosine) < _SQUARE


def _frames_from(
    wall: Floats, lengths: Sequence[float], spans: Sequence[list[Span]], w: int, forward: bool, measures: tuple[int, float, float]
) -> Iterator[Frame]:
    """Yield the frames whose first leg stands at wall ``w``."""
    legs, corner_m, gap_m = measures
    if legs == 1:
        for span in spans[w]:
            low, high = span.low + gap_m * span.closed_low, span.high - gap_m * span.closed_high
            yield Frame(forward, (Leg(w, low, high),), span.closed_low, span.closed_high)
        return
    path = [(w + (k if forward else -k)) % len(wall) for k in range(legs)]
    if any(not spans[v] for v in path) or len(set(path)) < legs or not all(_turns(wall, v, forward) for v in path[:-1]):
        return
    # each leg but the first begins behind a corner unit, each but the last reaches the end of its wall
    first, last = spans[path[0]][-1], spans[path[-1]][0]
    if first.high < lengths[path[0]] - _TOUCH_M or last.low > _TOUCH_M:
        return
    if any(len(spans[v]) != 1 or spans[v][0].low > _TOUCH_M or spans[v][0].high < lengths[v] - _TOUCH_M for v in path[1:-1]):
        return
    found = [Leg(path[0], first.low + gap_m * first.closed_low, lengths[path[0]] - gap_m)]
    found += [Leg(v, gap_m + corner_m, lengths[v] - gap_m) for v in path[1:-1]]
    found.append(Leg(path[-1], gap_m + corner_m, last.high - gap_m * last.closed_high))
    yield Frame(forward, tuple(found), first.closed_low, last.closed_high)


def leaves_gap(closed: bool, rest_m: float, end_gap_m: float) -> bool:
    """Return whether what is left between the end of a run and a side wall is too much for a joint and too little to be of use."""
    return closed and _CLOSED_M < rest_m < end_gap_m


def slots(wall: Floats, frame: Frame, lengths: Sequence[float], end_gap_m: float, flush: bool, ends_free: bool = False) -> list[Slot]:
    """Return the places in a frame of a run whose legs are ``lengths`` long; none where it does not fit or would leave a narrow gap.

    ``flush``: a run with one leg touches a side wall where the frame has one.  ``ends_free``: it keeps ``end_gap_m`` off side walls.
    """
    rests = [leg.high - leg.low - length for leg, length in zip(frame.legs, lengths, strict=True)]
    if min(rests) < -_FIT_M or any(rest > _FIT_M for rest in rests[1:-1]):
        return []
    if len(lengths) == 1:
        return [_slot(wall, frame, [at], slide) for at, slide in _straight(frame, rests[0], end_gap_m, flush, ends_free)]
    if leaves_gap(frame.closed_start, rests[0], end_gap_m) or leaves_gap(frame.closed_end, rests[-1], end_gap_m):
        return []
    return [_slot(wall, frame, [frame.legs[0].low + rests[0], *(leg.low for leg in frame.legs[1:])], 0.0)]


def _straight(frame: Frame, rest: float, end_gap_m: float, flush: bool, ends_free: bool) -> Iterator[tuple[float, float]]:
    """Yield where a run with one leg begins and how far it can be shifted: at either end of the frame, and between these."""
    low = frame.legs[0].low
    closed = frame.closed_start or frame.closed_end
    if rest <= _CLOSED_M and not (ends_free and closed):
        yield low + 0.5 * max(rest, 0.0), 0.0
        return
    if frame.closed_start and not ends_free and not leaves_gap(frame.closed_end, rest, end_gap_m):
        yield low, 0.0
    if frame.closed_end and not ends_free and not leaves_gap(frame.closed_start, rest, end_gap_m):
        yield low + rest, 0.0
    if flush and closed and not ends_free:
        return
    first, last = end_gap_m * frame.closed_start, rest - end_gap_m * frame.closed_end
    if last > first:
        yield low + first, last - first


def _slot(wall: Floats, frame: Frame, starts: Sequence[float], slide: float) -> Slot:
    """Return a slot; ``starts`` are measured in the direction of the walk."""
    lines = []
    for leg, at in zip(frame.legs, starts, strict=True):
        row = wall[leg.wall]
        along = at if frame.forward else float(row[LENGTH]) - at
        x, y = row[START_X] + row[ALONG_X] * along, row[START_Y] + row[ALONG_Y] * along
        lines.append(Line(float(x), float(y), float(row[WALL_YAW])))
    return slot_at(1.0 if frame.forward else -1.0, lines, slide)


def jutting(slot: Slot, leg: int, length_m: float, corner_m: float, depth_m: float, gap_m: float) -> Slot:
    """Return a slot with one leg more, which leaves the line of leg ``leg`` at a right angle.

    Args:
        slot: without room to shift.
        leg: number of the leg that ends with the unit that turns.
        length_m: of that leg.
        corner_m: side of the unit that turns.
        depth_m: of the units of the new leg; their fronts are even with the side of the unit that turns, their backs stand further out.
        gap_m: between units and lines.
    """
    base, direction = slot.line(leg), slot.direction
    x, y = base.point(direction * (length_m - corner_m + depth_m + gap_m), gap_m + corner_m)
    lines = [slot.line(k) for k in range(leg + 1)]
    return slot_at(direction, [*lines, Line(x, y, math.remainder(base.yaw_rad + 0.5 * math.pi * direction, 2.0 * math.pi))], 0.0)


def unit_poses(
    slot: Slot, slide_m: float, legs: Sequence[Sequence[tuple[float, float]]], units: Sequence[RowUnit], run: UnitRowRule
) -> list[tuple[float, float, float]]:
    """Return x, y and yaw (world) of each unit of a run; ``legs`` has what the units of each leg take across and along their line.

    The compiled twin is :func:`grammar.layout.unit_rows.arrange`.
    """
    poses: list[tuple[float, float, float]] = []
    for k, leg in enumerate(legs):
        line, walked = slot.line(k), slide_m if k == 0 else 0.0
        for across, along in leg:
            x, y = line.point(slot.direction * (walked + 0.5 * along), run.wall_gap_m + 0.5 * across)
            walked += along + run.joint_m
            yaw, place = line.yaw_rad, len(poses)
            if units[place].turns and slot.direction < 0.0:
                yaw -= 0.5 * math.pi
            elif units[place].end_on:
                yaw += 0.5 * math.pi * slot.direction * (1.0 if 2 * place + 2 <= len(units) else -1.0)
            poses.append((x, y, yaw))
    return poses
