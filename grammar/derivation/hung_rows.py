"""Rows of what hangs above a unit row with widths of its own: edge to edge along the walls, with what is built in below.

A row begins at an end of a free stretch of wall above low units, beside a tall one as likely as its rule says; what is wider
than the rest of it goes on to the next stretch, or is cut to the rest where its bounds allow that.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from grammar.derivation.densities import draw_height
from grammar.derivation.drafts import Draft
from grammar.derivation.parse_tree import Pinned, RejectedError
from grammar.derivation.row_fit import unit_rule
from grammar.derivation.row_walls import OFF_WALL, Pose, Shell, box_of
from grammar.geometry.boxes import HALF_WIDTH
from grammar.geometry.wall_spans import outlines, spans_of
from grammar.geometry.walls import ALONG_X, ALONG_Y, NORMAL_X, NORMAL_Y, START_X, START_Y, WALL_YAW
from grammar.spec.object_rules import ObjectRule
from grammar.spec.run_rules import HANGING_LOW_M
from grammar.spec.values import TruncatedNormal

_TOUCH_M, _JOIN_M = 1e-6, 0.05
_BUILT_IN_SD_M = 0.001


class Stretch(NamedTuple):
    """A stretch of wall above low units, metres from the wall's start; ``from_high``: a row begins at its upper end."""

    wall: int
    low: float
    high: float
    from_high: bool


def hangs_in_row(rule: ObjectRule) -> bool:
    """Return whether something hangs in line with widths of its own, not with those of the units below."""
    return rule.in_line and rule.mount == "wall" and not any(tie.axis == "width" for tie in rule.tied)


def hang_rows(shell: Shell, standing: Sequence[tuple[Draft, Pose]], drafts: Sequence[Draft], rng: np.random.Generator) -> None:
    """Pin what hangs in rows to its places above the units that stand at walls, and build in below it what hangs above single units.

    Raises:
        RejectedError: there is no wall for it.
    """
    row = [draft for draft in drafts if hangs_in_row(draft.rule) and draft.pinned is None]
    if not row:
        return
    bottom = draw_height(rng, row[0].rule)[0] - 0.5 * row[0].size_m[2]
    others = [draft for draft in drafts if draft.rule.in_line and draft.rule.cores and draft not in row]
    depth = max(draft.size_m[0] for draft in row)
    free = list(_stretches(shell, standing, _crossed(standing, others), depth, rng))
    if row[0].rule.beside_tall is not None:
        free = _turned(free, _tall_ends(shell, standing), bool(rng.random() < row[0].rule.beside_tall))
    order = [row[int(k)] for k in rng.permutation(len(row))]
    # what does not fit as wide as it was drawn hangs in equal shares of the wall
    share = sum(one.high - one.low for one in free) / len(row)
    if not any(_hung(shell, free, order, most, bottom) for most in (math.inf, share, 0.75 * share)):
        raise RejectedError("free wall above the units for all that hangs there")
    for draft in others:
        _build_in(draft, standing, row, bottom)


def _hung(shell: Shell, free: Sequence[Stretch], order: Sequence[Draft], most_m: float, bottom: float) -> bool:
    """Return whether all fits, each ``most_m`` wide at most, and pin it; else nothing is changed."""
    left, before = list(free), [(draft.size_m, draft.drawn_axes, list(draft.below)) for draft in order]
    for draft in order:
        place = _place(left, draft, most_m)
        if place is None:
            for other, (size_m, drawn_axes, below) in zip(order, before, strict=True):
                other.size_m, other.drawn_axes, other.below, other.pinned = size_m, drawn_axes, below, None
            return False
        wall, low, width = place
        if width < draft.size_m[1]:
            draft.size_m, draft.drawn_axes = (draft.size_m[0], width, draft.size_m[2]), (0, 2)
        draft.pinned = _pinned(shell, wall, low + 0.5 * width, draft.size_m[0], bottom)
        draft.note("place_in_row", f"wall {wall}, {low:.3f} m", 0.0)
        left = _less(left, shell, draft)
    return True


def _crossed(standing: Sequence[tuple[Draft, Pose]], others: Sequence[Draft]) -> list[tuple[Draft, Pose]]:
    """Return the units above which something hangs that no row goes past."""
    symbols = {core for draft in others if draft.rule.below_row_m is None for core in draft.rule.cores or ()}
    return [(unit, pose) for unit, pose in standing if unit.symbol in symbols]


def _stretches(
    shell: Shell, standing: Sequence[tuple[Draft, Pose]], crossed: Sequence[tuple[Draft, Pose]], depth_m: float, rng: np.random.Generator
) -> Iterator[Stretch]:
    """Yield the free stretches of wall above low units in a random order, each with a random end to begin at."""
    high = [box_of(unit, pose) for unit, pose in (*((u, p) for u, p in standing if u.size_m[2] > HANGING_LOW_M), *crossed)]
    obstacles = outlines(np.concatenate([shell.swings, shell.faces, shell.views, *high]))
    found = []
    for wall in sorted({pose[3] for _, pose in standing} - {OFF_WALL}):
        at = sorted(_beside(shell, unit, pose) for unit, pose in standing if pose[3] == wall and unit.size_m[2] <= HANGING_LOW_M)
        for low, top in _joined([*at, *_corners(shell, standing, wall)]):
            for span in spans_of(shell.wall, wall, obstacles, depth_m):
                begin, end = max(low, span.low), min(top, span.high)
                if end > begin + _TOUCH_M:
                    found.append(Stretch(wall, begin, end, bool(rng.random() < 0.5)))
    yield from (found[int(k)] for k in rng.permutation(len(found)))


def _tall_ends(shell: Shell, standing: Sequence[tuple[Draft, Pose]]) -> list[tuple[int, float]]:
    """Return the sides of tall units: numbers of walls, metres along these."""
    tall = [(unit, pose) for unit, pose in standing if unit.size_m[2] > HANGING_LOW_M and pose[3] != OFF_WALL]
    return [(pose[3], end) for unit, pose in tall for end in _beside(shell, unit, pose)]


def _turned(free: Sequence[Stretch], tall: Sequence[tuple[int, float]], beside: bool) -> list[Stretch]:
    """Return stretches that begin beside tall units where these end them, and are first, or begin at their other ends."""

    def meets(one: Stretch, end: float) -> bool:
        return any(wall == one.wall and abs(at - end) < _JOIN_M for wall, at in tall)

    met = [(meets(one, one.low), meets(one, one.high)) for one in free]
    turned = [one._replace(from_high=high == beside) if low != high else one for one, (low, high) in zip(free, met, strict=True)]
    order = sorted(range(len(free)), key=lambda k: any(met[k]) != beside)
    return [turned[k] for k in order]


def _beside(shell: Shell, unit: Draft, pose: Pose) -> tuple[float, float]:
    """Return the stretch of its wall that a unit takes."""
    half = 0.5 * unit.size_m[1]
    return shell.along(pose) - half, shell.along(pose) + half


def _corners(shell: Shell, standing: Sequence[tuple[Draft, Pose]], wall: int) -> Iterator[tuple[float, float]]:
    """Yield the stretches of a wall that units in corners take whose backs are at the other wall."""
    row = shell.wall[wall]
    for unit, pose in standing:
        if unit_rule(unit).turns and pose[3] not in (wall, OFF_WALL):
            dx, dy = pose[0] - row[START_X], pose[1] - row[START_Y]
            along, into = dx * row[ALONG_X] + dy * row[ALONG_Y], dx * row[NORMAL_X] + dy * row[NORMAL_Y]
            if into < 0.5 * unit.size_m[0] + _JOIN_M:
                yield float(along) - 0.5 * unit.size_m[0], float(along) + 0.5 * unit.size_m[0]


def _joined(spans: Sequence[tuple[float, float]]) -> Iterator[tuple[float, float]]:
    """Yield stretches joined where they touch."""
    ordered = sorted(spans)
    while ordered:
        low, high = ordered.pop(0)
        while ordered and ordered[0][0] < high + _JOIN_M:
            high = max(high, ordered.pop(0)[1])
        yield low, high


def _place(left: Sequence[Stretch], draft: Draft, most_m: float) -> tuple[int, float, float] | None:
    """Return wall, lower end and width of the first place where something fits as wide as it is, else of the widest place to cut it to."""
    least = draft.rule.low_m[1]
    width = max(min(draft.size_m[1], most_m), least)
    whole = next((one for one in left if one.high - one.low >= width - _TOUCH_M), None)
    if whole is None:
        whole = max(left, key=lambda one: one.high - one.low, default=None)
        if whole is None or whole.high - whole.low < least:
            return None
        width = whole.high - whole.low
    return whole.wall, (whole.high - width if whole.from_high else whole.low), width


def _less(left: Sequence[Stretch], shell: Shell, hung: Draft) -> list[Stretch]:
    """Return what is left of the stretches beside something that hangs; where it hung comes first, so that the row goes on there."""
    assert hung.pinned is not None
    box = box_of(hung, (hung.pinned.x_m, hung.pinned.y_m, hung.pinned.yaw_rad, OFF_WALL))
    box[0, HALF_WIDTH] -= _TOUCH_M
    corners, rest = outlines(box), []
    for one in left:
        for span in spans_of(shell.wall, one.wall, corners, hung.size_m[0]):
            low, high = max(one.low, span.low), min(one.high, span.high)
            if high > low + 10.0 * _TOUCH_M:
                rest.append(one._replace(low=low, high=high))
    return sorted(rest, key=lambda one: one.wall != hung.pinned.wall if hung.pinned else False)


def _pinned(shell: Shell, wall: int, along: float, depth_m: float, bottom_m: float) -> Pinned:
    row = shell.wall[wall]
    x = row[START_X] + along * row[ALONG_X] + 0.5 * depth_m * row[NORMAL_X]
    y = row[START_Y] + along * row[ALONG_Y] + 0.5 * depth_m * row[NORMAL_Y]
    return Pinned(float(x), float(y), bottom_m, float(row[WALL_YAW]), wall=wall)


def _build_in(draft: Draft, standing: Sequence[tuple[Draft, Pose]], row: Sequence[Draft], bottom_m: float) -> None:
    """Make something as flat as it is below a row, if the row goes past the unit that it hangs above."""
    flat = draft.rule.below_row_m
    under = [(unit, pose) for unit, pose in standing if unit.symbol in (draft.rule.cores or ())]
    if flat is None or not any(_covers(hung, unit, pose) for hung in row for unit, pose in under):
        return
    depth = min(draft.size_m[0], *(hung.size_m[0] for hung in row))
    middle = bottom_m - 0.5 * flat
    low = min(draft.rule.low_m[0], depth), draft.rule.low_m[1], min(draft.rule.low_m[2], flat)
    height = TruncatedNormal(mean=middle, sd=_BUILT_IN_SD_M, low=middle, high=middle)
    draft.rule = replace(draft.rule, low_m=low, centre_height_m=height, heights=())
    draft.size_m, draft.drawn_axes = (depth, draft.size_m[1], flat), ()


def _covers(hung: Draft, unit: Draft, pose: Pose) -> bool:
    """Return whether something that hangs is above a part of a unit at the same wall."""
    assert hung.pinned is not None
    if hung.pinned.wall != pose[3]:
        return False
    dx, dy = hung.pinned.x_m - pose[0], hung.pinned.y_m - pose[1]
    aside = abs(dy * math.cos(pose[2]) - dx * math.sin(pose[2]))
    return aside < 0.5 * (hung.size_m[1] + unit.size_m[1])
