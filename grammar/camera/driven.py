"""Motions of a base with two driven wheels: straight lines and turns on the spot over the free floor, and of a turntable.

Every line and every turn is the polynomial of least jerk from rest to rest (T. Flash and N. Hogan, "The coordination of arm movements", J.
Neurosci. 5, 1985), slow enough for the limits; its samples are control points, whose curve has smaller derivatives still.  Lines and turns
are apart by as much as the curve reaches, so that the base is on its lines exactly.
"""

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from grammar.camera.motion_config import MotionConfig
from grammar.camera.motion_plan import REACH, MotionPlan, camera_turn, control_times, ease, eased_time
from grammar.camera.walk import Ground, Routes, choose_ground, find_routes, is_free_line, leg_between
from grammar.geometry.arrays import Floats, Ints
from grammar.spec.rules import GrammarError
from scene_description.motion import Drive, Motion
from scene_description.types import SKIRTING_DEPTH_M, SKIRTING_HEIGHT_M

SPACING_S = 0.05
_GAP_S = 2.0 * REACH * SPACING_S
_GOALS = 12
_LINE_STEP_M = 0.01
_FINER, _SMALL_M2 = 0.25, 36.0
"""Size of the cells of a base that explores, in those of walks, in rooms that fit into a rectangle of so much floor."""
_LANE_SHARE = 0.9
"""Share of the footprint's radius within which a cell counts as passed by a lane of a base that explores."""
_NO_TURN_RAD = 1e-6


class _Action(NamedTuple):
    """A part of a drive: metres forward or radians to the left, when it begins and how long it takes."""

    metres: float
    radians: float
    start_s: float
    seconds: float


def driven_motion(rng: np.random.Generator, plan: MotionPlan) -> Motion:
    """Sample the drive of a base from place to place, and back at the end if asked.

    Raises:
        GrammarError: the base stands free nowhere in the room.
    """
    lens_m = _lens_height_m(rng, plan)
    ground = _ground(plan, lens_m)
    routes = find_routes(ground, _lane_ends(plan, ground) if plan.config.explore else _spread(rng, ground))
    heading_rad = float(rng.uniform(-math.pi, math.pi))
    points = _tour(plan, rng, ground, routes, heading_rad)
    actions = list(_actions(plan.config, points, heading_rad))
    times = control_times(plan.duration_s, SPACING_S)
    distances, headings = np.zeros(len(times)), np.full(len(times), heading_rad)
    for action in actions:
        share = ease(times, action.start_s, action.seconds)
        distances, headings = distances + action.metres * share, headings + action.radians * share
    drive = Drive(start_m=_pair(points[0]), distances_m=tuple(distances.tolist()), headings_rad=tuple(headings.tolist()))
    return _on_base(plan, lens_m, drive)


def turned_motion(rng: np.random.Generator, plan: MotionPlan) -> Motion:
    """Sample the motion of a turntable, at the roomiest of some places: a steady turn, smoothly begun.

    Raises:
        GrammarError: it stands free nowhere in the room.
    """
    config, times = plan.config, control_times(plan.duration_s, SPACING_S)
    lens_m = _lens_height_m(rng, plan)
    ground = _ground(plan, lens_m)
    place = ground.cells_m[_spread(rng, ground)[0]]
    ramp_s = max(1.875 * config.turn_rad_s / config.turn_acceleration_rad_s2, 0.2)
    headings = rng.uniform(-math.pi, math.pi) + config.turn_rad_s * eased_time(times, config.rest_s + REACH * SPACING_S, ramp_s)
    drive = Drive(start_m=_pair(place), distances_m=(0.0,) * len(times), headings_rad=tuple(headings.tolist()))
    return _on_base(plan, lens_m, drive)


def _on_base(plan: MotionPlan, lens_m: float, drive: Drive) -> Motion:
    ahead, left, _ = plan.config.camera_m
    return Motion(
        kind=plan.config.kind,  # type: ignore[arg-type]
        spacing_s=SPACING_S,
        drive=drive,
        camera_m=(ahead, left, lens_m),
        camera_turn=camera_turn(plan.config.camera_pitch_rad),
    )


def _lens_height_m(rng: np.random.Generator, plan: MotionPlan) -> float:
    """Return the height of the lens: as asked for, else drawn from the lowest mount of walks; below the ceiling in any case."""
    lowest = min(plan.path.mounts.values(), key=lambda mount: mount.height_m)
    drawn = float(rng.uniform(*lowest.height_m))
    return min(plan.config.camera_m[2] or drawn, plan.space.height_m - plan.path.clearance_m)


def _ground(plan: MotionPlan, lens_m: float) -> Ground:
    """Return where the middle of the base may be: its whole footprint, and the mast above it, stand free."""
    config = plan.config
    radius = max(config.body_radius_m, math.hypot(*config.camera_m[:2]))
    views = plan.space.views(plan.path, lens_m)
    whole, solids = ((1.0, 1.0),), np.concatenate([plan.space.solids, _skirting(views.polygon)])
    ground = choose_ground(views.polygon, solids, lens_m, 0.0, radius, radius, _resolution_m(plan), whole)
    if ground.wall_keep_m < radius:
        expected = f"motion.body_radius_m: expected a base that stands free somewhere in the room, got a radius of {radius:g} m"
        raise GrammarError(f"{expected}; make it smaller or choose another room")
    return ground


def _skirting(polygon: Floats) -> Floats:
    """Return boxes (n, 8) along the walls of an outline (n, 2), as deep and high as skirting boards, and beyond its corners."""
    along = np.roll(polygon, -1, axis=0) - polygon
    lengths = np.hypot(*along.T)
    fixed = np.tile((0.0, SKIRTING_HEIGHT_M, SKIRTING_DEPTH_M), (len(polygon), 1))
    turned = np.column_stack([along[:, 1], -along[:, 0]]) / lengths[:, None]
    return np.column_stack([polygon + 0.5 * along, fixed, 0.5 * lengths + SKIRTING_DEPTH_M, turned])


def _resolution_m(plan: MotionPlan) -> float:
    """Return the size of the floor's cells, m: finer for a base that explores a small room, so that narrow passages count."""
    wide, deep = np.ptp(np.asarray(plan.space.polygon_m, np.float64), axis=0)
    return plan.path.resolution_m * (_FINER if plan.config.explore and wide * deep <= _SMALL_M2 else 1.0)


def _spread(rng: np.random.Generator, ground: Ground) -> Ints:
    """Return a few cells that lie far from each other, the first drawn: farthest-point sampling (T. Gonzalez, 1985)."""
    chosen = [int(rng.integers(len(ground.cells_m)))]
    nearest = np.full(len(ground.cells_m), np.inf)
    while len(chosen) < min(_GOALS, len(ground.cells_m)):
        apart = ground.cells_m - ground.cells_m[chosen[-1]]
        nearest = np.minimum(nearest, apart[:, 0] * apart[:, 0] + apart[:, 1] * apart[:, 1])
        chosen.append(int(np.argmax(nearest)))
    return np.array(chosen, np.int64)


def _lane_ends(plan: MotionPlan, ground: Ground) -> Ints:
    """Return the cells at both ends of all lanes, one pair after the other.

    Lanes are straight lines along the longer side of the floor, as far apart as a footprint is wide, and between them where cells are left
    (H. Choset, "Coverage for robotics - a survey of recent results", Annals of Mathematics and Artificial Intelligence 31, 2001).
    """
    cells = np.rint((ground.cells_m - ground.cells_m.min(axis=0)) / _resolution_m(plan)).astype(np.int64)
    along, across = (0, 1) if np.ptp(cells[:, 0]) >= np.ptp(cells[:, 1]) else (1, 0)
    reach_m = _LANE_SHARE * plan.config.body_radius_m
    apart = max(int(2.0 * reach_m / _resolution_m(plan)), 1)
    ends: list[int] = []
    passed = np.zeros(len(cells), np.bool_)
    for row in sorted(range(int(cells[:, across].max()) + 1), key=lambda row: (row % apart > 0, row)):
        here = np.flatnonzero((cells[:, across] == row) & ~passed)
        here = here[np.argsort(cells[here, along], kind="stable")]
        for lane in np.split(here, np.flatnonzero(np.diff(cells[here, along]) > 1) + 1):
            if len(lane):
                ends += [int(lane[0]), int(lane[-1])]
                off = ground.cells_m - np.clip(ground.cells_m, ground.cells_m[lane[0]], ground.cells_m[lane[-1]])
                passed |= off[:, 0] * off[:, 0] + off[:, 1] * off[:, 1] <= reach_m * reach_m
    return np.array(ends, np.int64)


def _lane_by_lane(routes: Routes, first: int) -> list[int]:
    """Return the order in which ends of lanes are visited, from one on: along its lane, then to the nearest end of one that is left."""
    visited, left = [first, first ^ 1], np.ones(len(routes.viewpoints), np.bool_)
    left[visited] = False
    while left.any():
        nearest = int(np.argmin(np.where(left, routes.costs[visited[-1]], np.inf)))
        visited += [nearest, nearest ^ 1]
        left[visited[-2:]] = False
    return visited


def _tour(plan: MotionPlan, rng: np.random.Generator, ground: Ground, routes: Routes, heading_rad: float) -> list[Floats]:
    """Return the corners of a tour to all goals, again and again until the time is over, in another order or, if asked, lane by lane.

    One that shall end where it began leaves out what there is no time for, and goes home; where there is time for no goal, it turns
    back on the way to one.
    """
    config, here = plan.config, 0
    points = [ground.cells_m[routes.viewpoints[0]]]
    if len(np.unique(routes.viewpoints)) == 1:
        return points
    while True:
        went = False
        for there in _lane_by_lane(routes, here) if config.explore else rng.permutation(len(routes.viewpoints)).tolist():
            longer = [*points, *_straightened(ground, _cells(ground, routes, here, there))]
            home = [*longer, *_straightened(ground, _cells(ground, routes, there, 0))]
            late = config.loop and _end_s(config, home, heading_rad) > plan.duration_s
            if late and config.explore:
                went = False
                break
            if there == here or late:
                continue
            points, here, went = longer, there, True
            if not config.loop and _end_s(config, points, heading_rad) > plan.duration_s:
                return points
        if not went and len(points) == 1:
            return _out_and_back(plan, ground, _cells(ground, routes, 0, int(rng.integers(1, len(routes.viewpoints)))), heading_rad)
        if not went:
            return [*points, *_straightened(ground, _cells(ground, routes, here, 0))]


def _out_and_back(plan: MotionPlan, ground: Ground, cells: Floats, heading_rad: float) -> list[Floats]:
    """Return the corners of the longest way along cells that there is time to come back from."""
    found, low, high = [cells[0]], 0, len(cells)
    while high - low > 1:
        middle = (low + high) // 2
        way = [cells[0], *_straightened(ground, cells[: middle + 1])]
        both = [*way, *way[-2::-1]]
        if _end_s(plan.config, both, heading_rad) > plan.duration_s:
            high = middle
        else:
            found, low = both, middle
    return found


def _end_s(config: MotionConfig, points: list[Floats], heading_rad: float) -> float:
    """Return when a base is at the end of a polyline."""
    return max((action.start_s + action.seconds for action in _actions(config, points, heading_rad)), default=0.0)


def _cells(ground: Ground, routes: Routes, here: int, there: int) -> Floats:
    return ground.cells_m[leg_between(routes, here, there)]


def _straightened(ground: Ground, cells: Floats) -> list[Floats]:
    """Return the corners after the first of a way along cells, each as far as can be seen from the one before."""
    corners, at = [], 0
    while at < len(cells) - 1:
        low, high = at + 1, len(cells) - 1
        if not _sees(ground, cells[at], cells[high]):
            while high - low > 1:
                middle = (low + high) // 2
                low, high = (middle, high) if _sees(ground, cells[at], cells[middle]) else (low, middle)
            high = low
        corners.append(cells[high])
        at = high
    return corners


def _sees(ground: Ground, a: Floats, b: Floats) -> bool:
    return bool(is_free_line(ground.polygon, ground.boxes, ground.keep_m, ground.wall_keep_m, *a, *b, _LINE_STEP_M))


def _actions(config: MotionConfig, points: list[Floats], heading_rad: float) -> Iterator[_Action]:
    """Yield the turns and lines along a polyline, from a heading."""
    now_s, heading = config.rest_s + REACH * SPACING_S, heading_rad
    for a, b in pairwise(points):
        turn = math.remainder(math.atan2(b[1] - a[1], b[0] - a[0]) - heading, math.tau)
        length, heading = math.dist(a, b), heading + turn
        for metres, radians, seconds in ((0.0, turn, _turn_s(config, turn)), (length, 0.0, _line_s(config, length))):
            if metres or abs(radians) > _NO_TURN_RAD:
                yield _Action(metres, radians, now_s, seconds)
                now_s += seconds + _GAP_S


def _line_s(config: MotionConfig, metres: float) -> float:
    return _seconds(metres, config.speed_m_s, config.acceleration_m_s2, config.jerk_m_s3)


def _turn_s(config: MotionConfig, radians: float) -> float:
    return _seconds(abs(radians), config.turn_rad_s, config.turn_acceleration_rad_s2, math.inf)


def _seconds(way: float, speed: float, acceleration: float, jerk: float) -> float:
    """Return the least time for a way from rest to rest: 10 x^3 - 15 x^4 + 6 x^5 has derivatives of at most 1.875, 5.7735 and 60."""
    cubic_s = math.pow(60.0 * way / jerk, 1.0 / 3.0)
    return max(1.875 * way / speed, math.sqrt(10.0 / math.sqrt(3.0) * way / acceleration), cubic_s)


def _pair(point: Floats) -> tuple[float, float]:
    return float(point[0]), float(point[1])
