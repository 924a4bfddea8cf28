"""Faults of use about chairs at tables and desks: a place of its own for everyone, and room to sit down at it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from grammar.checks.furnished import Furnished, in_boxes, outside, whole_box
from grammar.checks.use_of_seats import chair_at_no_table
from grammar.geometry.arrays import Boxes, Floats
from grammar.geometry.boxes import COS_YAW, HALF_DEPTH, HALF_WIDTH, SIN_YAW, Z_HIGH, Z_LOW, X, Y, footprint_penetration
from scene_description import SceneObject

NEAR_M, ASKEW_RAD = 0.6, math.radians(35.0)
ELBOWS_M, PLACE_DEPTH_M, SHARED_M = 0.5, 0.2, 0.12
CORNER_M = 0.17
SEATED_M, BODY_M, SEATED_SHARE, SHIN_M = 0.5, 0.4, 0.1, 0.3
OFF_SOFA_M = 0.15
BEFORE_M, FILLER_M = 0.4, 0.08


class Place(NamedTuple):
    """Where a chair is drawn up to a table: middles of its place and of that edge of the table, yaw out of the table, the edge's length."""

    chair: SceneObject
    table: SceneObject
    at_m: tuple[float, float]
    edge_at_m: tuple[float, float]
    out_rad: float
    edge_m: float

    @property
    def to_end_m(self) -> float:
        """How far the middle of the place is from the nearer end of the edge."""
        return 0.5 * self.edge_m - math.dist(self.at_m, self.edge_at_m)

    def strip(self, from_m: float, to_m: float, width_m: float) -> Boxes:
        """Return a box (8,) from ``from_m`` to ``to_m`` out of the table, about the middle of the place."""
        return _strip(self.at_m, self.out_rad, (from_m, to_m), width_m)


def _strip(at_m: tuple[float, float], out_rad: float, reach_m: tuple[float, float], width_m: float) -> Boxes:
    c, s, middle = math.cos(out_rad), math.sin(out_rad), 0.5 * sum(reach_m)
    return np.array([at_m[0] + middle * c, at_m[1] + middle * s, 0.0, 1.0, 0.5 * (reach_m[1] - reach_m[0]), 0.5 * width_m, c, s])


def places(found: Furnished) -> Iterator[Place]:
    """Yield the places of chairs and stools that face a table or desk within ``NEAR_M``."""
    tables = found.standing("table")
    for chair in found.standing("pulled_up"):
        best, least = None, 0.5 * chair.size_m[0] + NEAR_M
        for table in tables:
            met = _met(chair, table)
            if met is not None and met[0] < least:
                least, best = met[0], met[1]
        if best is not None:
            yield best


def _met(chair: SceneObject, table: SceneObject) -> tuple[float, Place] | None:
    """Return how far before a chair's middle its line of sight enters a table, and its place there; None if it misses the table."""
    box = whole_box(table)
    dx, dy = chair.position_m[0] - box[X], chair.position_m[1] - box[Y]
    start = (dx * box[COS_YAW] + dy * box[SIN_YAW], dy * box[COS_YAW] - dx * box[SIN_YAW])
    turn = chair.yaw_rad - table.yaw_rad
    ray, half = (math.cos(turn), math.sin(turn)), (box[HALF_DEPTH], box[HALF_WIDTH])
    enter, leave, side = -math.inf, math.inf, 0
    for axis in (0, 1):
        if abs(ray[axis]) < 1e-9:
            if abs(start[axis]) >= half[axis]:
                return None
            continue
        near, far = sorted(((-half[axis] - start[axis]) / ray[axis], (half[axis] - start[axis]) / ray[axis]))
        if near > enter:
            enter, side = near, axis
        leave = min(leave, far)
    if enter >= leave or leave <= 0.0:
        return None
    at, edge = [start[0] + enter * ray[0], start[1] + enter * ray[1]], [0.0, 0.0]
    edge[side] = at[side]
    out = table.yaw_rad + (0.5 * math.pi if side else 0.0) + (math.pi if ray[side] > 0.0 else 0.0)
    middles = [
        (float(box[X] + u * box[COS_YAW] - v * box[SIN_YAW]), float(box[Y] + u * box[SIN_YAW] + v * box[COS_YAW])) for u, v in (at, edge)
    ]
    return float(enter), Place(chair, table, middles[0], middles[1], out, float(2.0 * half[1 - side]))


def place_shared(found: Furnished) -> list[int]:
    """Return chairs too close to another one of their table.

    Those at one edge are nearer than ``ELBOWS_M``; those at two edges share more than ``SHARED_M`` of their places, each ``ELBOWS_M`` of
    the edge and ``PLACE_DEPTH_M`` deep.
    """
    taken = [(place, place.strip(-PLACE_DEPTH_M, 0.0, ELBOWS_M)) for place in places(found)]
    bad = set()
    for k, (place, box) in enumerate(taken):
        for other, another in taken[:k]:
            if other.table is not place.table:
                continue
            beside = math.dist(place.edge_at_m, other.edge_at_m) < 1e-6
            if math.dist(place.at_m, other.at_m) < ELBOWS_M if beside else footprint_penetration(box, another) > SHARED_M:
                bad |= {place.chair.id, other.chair.id}
    return sorted(bad)


def chair_at_corner(found: Furnished) -> list[int]:
    """Return chairs drawn up to a corner of their table.

    They are nearer than ``CORNER_M`` to the end of its edge, aslant by ``ASKEW_RAD``, or look past it straight ahead.
    """
    bad = []
    drawn_up = list(places(found))
    for place in drawn_up:
        aslant = abs(math.remainder(place.out_rad + math.pi - place.chair.yaw_rad, math.tau))
        if place.to_end_m < min(CORNER_M, 0.4 * place.edge_m) or aslant > ASKEW_RAD:
            bad.append(place.chair.id)
    at_none = {item.id for item in found.standing("pulled_up")} - {place.chair.id for place in drawn_up}
    return sorted([*bad, *at_none.difference(chair_at_no_table(found))])


def chair_wedged(found: Furnished) -> list[int]:
    """Return chairs that nobody can sit down on: less than ``SEATED_M`` between the edge of the table and what stands behind."""
    chairs = [item.id for item in found.standing("pulled_up")]
    solid = (found.boxes[:, Z_HIGH] > SHIN_M) & (found.boxes[:, Z_LOW] < 1.0) & ~np.isin(found.owner, chairs)
    bad = []
    for place in places(found):
        points = _grid(place.strip(0.03, SEATED_M, BODY_M))
        others = found.boxes[solid & (found.owner != place.table.id)]
        if (in_boxes(points, others) | outside(found, points)).mean() > SEATED_SHARE:
            bad.append(place.chair.id)
    return bad


def filler_at_table(found: Furnished) -> list[int]:
    """Return plants, bins and lamps on the floor within ``BEFORE_M`` of an edge of a table that a chair is drawn up to."""
    fillers = [(item.id, whole_box(item)) for item in found.standing("filler")]
    bad: set[int] = set()
    for place in places(found) if fillers else ():
        strip = _strip(place.edge_at_m, place.out_rad, (0.0, BEFORE_M), place.edge_m)
        bad.update(number for number, box in fillers if footprint_penetration(strip, box) > FILLER_M)
    return sorted(bad)


def table_at_sofa(found: Furnished) -> list[int]:
    """Return tables for meals that stand within ``OFF_SOFA_M`` of a sofa, an armchair or a low table."""
    near = [whole_box(item) for item in found.standing("lounge", "low_table")]
    tables = found.standing("dining")
    return [item.id for item in tables if any(footprint_penetration(whole_box(item), box) > -OFF_SOFA_M for box in near)]


def _grid(box: Boxes) -> Floats:
    """Return (144, 2) points of a box's footprint."""
    steps = (np.arange(12) + 0.5) / 6.0 - 1.0
    u, v = (grid.ravel() for grid in np.meshgrid(box[HALF_DEPTH] * steps, box[HALF_WIDTH] * steps))
    return np.column_stack([box[X] + u * box[COS_YAW] - v * box[SIN_YAW], box[Y] + u * box[SIN_YAW] + v * box[COS_YAW]])
