"""The room as unit rows see it: walls, what doors and windows keep free, and the places of units against these."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from grammar.derivation.drafts import Draft
from grammar.derivation.row_fit import bounds_along_m, least_along_m, reach_m, unit_rule
from grammar.derivation.slopes import top_m
from grammar.geometry.arrays import Bools, Boxes, Floats
from grammar.geometry.boxes import HALF_WIDTH, NO_BOXES, Z_HIGH, Z_LOW, box_rows, deepest_penetrations
from grammar.geometry.run_slots import MOST_LEGS, Frame, Slot, frames, slots
from grammar.geometry.slopes import above_slopes, low_ceiling, slope_rows
from grammar.geometry.wall_spans import Span, outlines, spans_of
from grammar.geometry.walls import ALONG_X, ALONG_Y, LENGTH, START_X, START_Y, WALL_YAW, wall_rows
from grammar.geometry.zones import FACE, SWING, VIEW, opening_frame, opening_front, opening_zones, placed_zones
from grammar.spec.rules import Grammar
from grammar.spec.run_rules import HANGING_LOW_M, SIDE_WINDOW, WINDOW, UnitRowRule
from scene_description import Opening, Room

OFF_WALL = -1
ASKEW = 0.5
"""Greatest cosine of the angle between walls that are not opposite each other or in line."""

Pose = tuple[float, float, float, int]
"""x, y, yaw, and the number of the wall at the back, ``OFF_WALL`` without one."""

_DEEPER_M = 0.03
"""By how much a unit beside a corner may reach further into the room than the one that fills it."""

_EVEN_M, _ROUNDING_M = 0.0005, 1e-9


class Aisle(NamedTuple):
    """What a unit that stands already takes, (1, 8) world boxes: for units opposite it, and for those at walls at an angle to its own."""

    yaw_rad: float
    ahead: Boxes
    aside: Boxes


class Shell(NamedTuple):
    """A room's walls, (n, 8) boxes that doors, windows, and windows' frames keep free, and windows by wall and stretch.

    slope: the planes of :func:`grammar.geometry.slopes.slope_rows`; line_m: how high what hangs in line above unit rows reaches, about.
    """

    room: Room
    wall: Floats
    swings: Boxes
    views: Boxes
    faces: Boxes
    windows: tuple[tuple[int, float, float], ...]
    slope: Floats
    line_m: float

    def along(self, pose: Pose) -> float:
        """Return how far along the wall at its back a unit's middle is."""
        row = self.wall[pose[3]]
        return float((pose[0] - row[START_X]) * row[ALONG_X] + (pose[1] - row[START_Y]) * row[ALONG_Y])

    def windows_met(self, poses: Sequence[Pose]) -> list[frozenset[str]]:
        """Return for each unit whether its middle is below a window of its wall, and whether a wall at an angle to its back has one."""
        found = []
        for pose in poses:
            below = any(w == pose[3] and low <= self.along(pose) <= high for w, low, high in self.windows)
            aside = any(abs(math.cos(pose[2] - self.wall[w, WALL_YAW])) < ASKEW for w, _, _ in self.windows)
            found.append(frozenset(name for name, met in ((WINDOW, below), (SIDE_WINDOW, aside)) if met))
        return found

    def bars(self, units: Sequence[Draft], boxes: Boxes) -> bool:
        """Return whether a unit stands before a window that must stay free, or it, or what may stand on it, goes through a slope."""
        if depths_in(boxes, self.views).any():
            return True
        loaded = boxes.copy()
        loaded[:, Z_HIGH] = [max(unit.loaded_m, unit.size_m[2]) for unit in units]
        return bool(self._pierced(loaded).any())

    def carries(self, boxes: Boxes, poses: Sequence[Pose]) -> list[bool]:
        """Return of units whether something may hang above each: there is a wall behind it, high enough, with no window."""
        above = boxes.copy()
        above[:, Z_LOW], above[:, Z_HIGH] = boxes[:, Z_HIGH], self.line_m
        low = self._pierced(above)
        above[:, Z_HIGH] = self.room.height_m
        barred = low | (depths_in(above, self.faces) > 0.0)
        return [pose[3] != OFF_WALL and not bar for pose, bar in zip(poses, barred.tolist(), strict=True)]

    def _pierced(self, boxes: Boxes) -> Bools:
        """Return (n,) whether boxes reach through a sloped ceiling."""
        return np.array([len(self.slope) > 0 and above_slopes(self.slope, boxes, k) > 0.0 for k in range(len(boxes))], bool)


def _side_at(draft: Draft, window: Opening, axis: str) -> float:
    """Return a side of what hangs at windows, or how high its middle is, at one of them: about as its ties will make it there."""
    rule, high = draft.rule, draft.rule.centre_height_m
    sides = {"width": (draft.size_m[1], rule.low_m[1], rule.high_m[1]), "height": (draft.size_m[2], rule.low_m[2], rule.high_m[2])}
    usual, low, most = sides.get(axis) or ((high.mean, high.low, high.high) if high is not None else (math.inf,) * 3)
    measures = {"width": window.width_m, "height": window.height_m, "bottom": window.sill_m, "top": window.sill_m + window.height_m}
    tied = [tie.factor * measures[tie.of] + tie.add_m for tie in rule.tied if tie.axis == axis and tie.to == WINDOW and tie.of in measures]
    return min(max(tied[0], low), most) if tied else usual


def shell_of(grammar: Grammar, room: Room, drafts: Sequence[Draft]) -> Shell:
    """Return a room as unit rows see it, in which these objects are to stand and hang.

    Windows keep free what a curtain, a sill or a radiator takes of their wall too.
    """
    found: dict[int, list[Boxes]] = {SWING: [], VIEW: [], FACE: []}
    for opening in room.openings:
        x, y, yaw = opening_frame(room, opening)
        for zone in opening_zones(opening, grammar.openings[opening.category]):
            found[zone.kind].append(placed_zones([zone], x, y, opening.sill_m, yaw))
    for row, window in zip(found[VIEW], (o for o in room.openings if o.category == "window"), strict=True):
        for draft in drafts:
            if draft.rule.mount == "wall" and set(draft.rule.cores or ()) == {WINDOW}:
                row[0, HALF_WIDTH] = max(row[0, HALF_WIDTH], 0.5 * _side_at(draft, window, "width"))
                row[0, Z_LOW] = min(row[0, Z_LOW], _side_at(draft, window, "middle") - 0.5 * _side_at(draft, window, "height"))
    boxes = {kind: np.concatenate([NO_BOXES, *rows]) for kind, rows in found.items()}
    windows = tuple((o.wall, o.offset_m, o.offset_m + o.width_m) for o in room.openings if o.category == "window")
    line_m = max((top_m(draft.rule, draft.size_m) for draft in drafts if draft.rule.in_line), default=0.0)
    return Shell(room, wall_rows(room.polygon_m), boxes[SWING], boxes[VIEW], boxes[FACE], windows, slope_rows(room), line_m)


def _spans_beside(shell: Shell, openings: Boxes, taken: Sequence[Aisle], depth_m: float) -> list[list[Span]]:
    """Return the stretches of each wall that openings and the unit rows that stand already leave free."""
    free, aisles = outlines(openings), [(one.yaw_rad, outlines(one.aside), outlines(one.ahead)) for one in taken]
    spans = []
    for w, wall_yaw in enumerate(shell.wall[:, WALL_YAW].tolist()):
        kept = [corners for yaw, aside, ahead in aisles for corners in (aside if abs(math.cos(yaw - wall_yaw)) < ASKEW else ahead)]
        spans.append(spans_of(shell.wall, w, [*free, *kept], depth_m))
    return spans


def box_of(unit: Draft, pose: Pose, before_m: float = 0.0) -> Boxes:
    """Return the (1, 8) world box of a unit, ``before_m`` deeper to its front."""
    x, y, yaw, _ = pose
    c, s = math.cos(yaw), math.sin(yaw)
    depth, width, height = unit.size_m
    middle = 0.5 * before_m
    return np.array([[x + middle * c, y + middle * s, 0.0, height, 0.5 * depth + middle, 0.5 * width, c, s]])


def boxes_as_wide(units: Sequence[Draft], widths: Sequence[float], poses: Sequence[Pose]) -> Boxes:
    """Return the (n, 8) world boxes of units that are as wide as their unit row asks for, if they stretch."""
    return box_rows(
        (x, y, 0.0, unit.size_m[2], 0.5 * unit.size_m[0], 0.5 * _width(unit, width), math.cos(yaw), math.sin(yaw))
        for unit, width, (x, y, yaw, _) in zip(units, widths, poses, strict=True)
    )


def fronts_of(units: Sequence[Draft], widths: Sequence[float], poses: Sequence[Pose]) -> Boxes:
    """Return the (n, 8) world boxes that the fronts of units open into."""
    sizes = [(unit.size_m[0], _width(unit, width), unit.size_m[2]) for unit, width in zip(units, widths, strict=True)]
    placed = (placed_zones([opening_front(size)], x, y, 0.0, yaw) for size, (x, y, yaw, _) in zip(sizes, poses, strict=True))
    return np.concatenate([NO_BOXES, *placed])


def _width(unit: Draft, width: float) -> float:
    return width if unit_rule(unit).stretches else unit.size_m[1]


def depths_in(boxes: Boxes, others: Boxes) -> Floats:
    """Return (n,) how deep each of some boxes is in others, metres."""
    return deepest_penetrations(boxes, np.zeros(len(boxes), np.int64), others, np.ones(len(others), np.int64))


class UnitRow(NamedTuple):
    """A unit row that is to be placed: its units at walls, those of them that turn, and those that jut out.

    taken: what other unit rows keep free; hanging: all that hangs in line above some row.
    """

    rule: UnitRowRule
    shell: Shell
    units: list[Draft]
    turning: list[Draft]
    juts: list[Draft]
    taken: tuple[Aisle, ...]
    hanging: list[Draft]

    @property
    def corner_m(self) -> float:
        """Return how far a leg keeps off a corner on that side where the units of the other leg pass: the reach of the deepest of them."""
        side = self.side_m
        deeper = (reach_m(unit) for unit in self.units if unit.size_m[2] < HANGING_LOW_M)
        return max((reach for reach in deeper if side + _EVEN_M < reach < side + _DEEPER_M), default=side) if self.turning else 0.0

    @property
    def side_m(self) -> float:
        """Return the depth of the units that turn."""
        return max((unit.size_m[0] for unit in self.turning), default=0.0)

    @property
    def corners_m(self) -> tuple[float, float]:
        """Return how far from a corner the leg after it begins where the walk follows the numbers of the walls, and where it does not."""
        return self.corner_m, self.corner_m if self.is_square else max(unit.size_m[1] for unit in self.turning)

    @property
    def is_square(self) -> bool:
        """Return whether both sides of all units that turn take as much of the walls, so that the unit row can be walked either way."""
        return all(abs(unit.size_m[1] - self.corner_m) < _ROUNDING_M for unit in self.turning)

    @property
    def jut_m(self) -> float:
        """Return the depth of the units that jut out."""
        return max((unit.size_m[0] for unit in self.juts), default=0.0)

    def frames(self, taken: Sequence[Aisle]) -> list[Frame]:
        """Return where the legs at walls may stand, with aisles kept free; room is left behind a leg that juts out."""
        rule, shell = self.rule, self.shell
        depth = rule.wall_gap_m + max(map(reach_m, self.units))
        low_roof = low_ceiling(shell.room, min(unit.size_m[2] for unit in self.units))
        spans = _spans_beside(shell, np.concatenate([self._openings(), low_roof]), taken, depth)
        legs, least_m = len(self.turning) + (not self.juts), sum(map(least_along_m, self.units)) - _ROUNDING_M
        found = [
            frame
            for frame in frames(shell.wall, spans, legs, self.corners_m, rule.wall_gap_m)
            if sum(leg.high - leg.low for leg in frame.legs) >= least_m
            and (legs < MOST_LEGS or shell.wall[frame.legs[1].wall, LENGTH] >= 2.0 * depth + rule.aisle_m)
        ]
        if not self.juts:
            return found
        behind = max(self.jut_m - self.side_m, 0.0) + rule.around_m
        shorter = [(frame, frame.legs[-1]._replace(high=frame.legs[-1].high - behind)) for frame in found]
        return [frame._replace(legs=(*frame.legs[:-1], leg), closed_end=False) for frame, leg in shorter if leg.high > leg.low]

    def fills(self, frame: Frame) -> bool:
        """Return whether the units, as wide as they may be, leave no more of a frame bare than the row may."""
        length = sum(leg.high - leg.low for leg in frame.legs) - self.rule.joint_m * (len(self.units) - len(frame.legs))
        widest = sum(max(unit.size_m[:2]) if unit in self.turning else bounds_along_m(unit)[1] for unit in self.units)
        return length - widest <= self.rule.most_bare_m + _ROUNDING_M

    def _openings(self) -> Boxes:
        """Return the boxes (n, 8) of doors and windows whose walls the unit row keeps free."""
        windows = self.shell.views
        if self.rule.window_gap_m is None:
            windows = windows[windows[:, Z_LOW] < min(unit.size_m[2] for unit in self.units)]
        else:
            windows = windows.copy()
            windows[:, HALF_WIDTH] += self.rule.window_gap_m
        return np.concatenate([self.shell.swings, windows])

    def slots(self, frame: Frame, lengths: Sequence[float]) -> list[Slot]:
        """Return where legs of these lengths may lie in a frame."""
        return slots(self.shell.wall, frame, lengths, self.rule.end_gap_m, self.rule.flush, self.rule.ends_free)
