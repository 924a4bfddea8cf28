"""The losses of single cliques: kernels that each add theirs to an energy vector ``out``, one column for a term.

Columns are found by the terms' names (:data:`grammar.spec.energy_terms.TERMS`).  Losses are never below zero.
"""

import math
from collections.abc import Callable
from typing import Any, Literal, NamedTuple

import numpy as np

from grammar.geometry import boxes, walls
from grammar.geometry.boxes import row_penetration
from grammar.geometry.kernels import inlined, kernel
from grammar.geometry.slopes import above_slopes
from grammar.geometry.walls import rectangle_outside
from grammar.geometry.zones import ACCESS, APART, GLARE, SWING, VIEW
from grammar.layout import columns as col
from grammar.layout.frames import aslant, in_surface_frame, placement_target, surface_owner, wrap
from grammar.spec.energy_terms import TERM

_TOUCH_M = 1e-6
_VIEW_RAD = math.radians(25.0)
"""Beyond this a screen costs.  The fault ``screen_aside`` begins at 40 degrees: people mind less than the grammar does."""


@kernel
def _angle(turn, mean):  # type: ignore[no-untyped-def]
    """Return how far an angle is off a mean, 0 where the mean is NaN."""
    return 0.0 if math.isnan(mean) else abs(wrap(turn - mean))


class Loss(NamedTuple):
    """A kernel that adds the losses of one kind of cliques to an energy vector, and the terms that it adds to.

    scope: "object": the cliques of one object, or of it with walls: ``kernel(problem, state, i, out)``; "partner": of an object with
    the one that ``partner(problem, state, i)`` names (-1: none), the same arguments; "pair": of any two objects: ``kernel(problem, state,
    i, j, squared, out)``, ``squared``: distance of their origins; "room": read off the raster of the floor, apart from these.
    """

    kernel: Any
    scope: Literal["object", "partner", "pair", "room"]
    terms: tuple[str, ...]
    partner: Any = None

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns of :mod:`grammar.layout.columns` that the kernel itself reads."""
        return tuple(name for name in vars(col) if name.isupper() and name in self.kernel.py_func.__code__.co_names)


LOSSES: list[Loss] = []
"""All rows; kernels of one scope add in this order."""


def loss(scope: Literal["object", "partner", "pair", "room"], *terms: str, partner: Any = None) -> Callable[[Any], Any]:
    """Register the kernel below as one that adds to these terms."""

    def register(adding: Any) -> Any:
        LOSSES.append(Loss(adding, scope, terms, partner))
        return adding

    return register


@loss("object", "wall_distance", "wall_orientation", "relation_odds")
@kernel
def add_wall(problem, state, i, out):  # type: ignore[no-untyped-def]
    """Add the losses of object ``i`` to the wall and mode that it fits best.

    The gap is that between wall and footprint along the wall's normal; beyond a wall's ends the distance to its nearer end takes its place.
    """
    wall, mode, weight = problem.wall, problem.mode, problem.weight
    first, last = problem.link[i, col.WALL_MODES], problem.link[i, col.AROUND_MODES]
    if first == last:
        return
    x, y, yaw = state.where[i, col.X], state.where[i, col.Y], state.where[i, col.YAW]
    half_d, half_w, c, s = problem.object[i, col.HALF_DEPTH], problem.object[i, col.HALF_WIDTH], math.cos(yaw), math.sin(yaw)
    best, distance, orientation, odds = np.inf, 0.0, 0.0, 0.0
    for w in range(len(wall)):
        # Measure the gap between footprint and wall.
        dx, dy = x - wall[w, walls.START_X], y - wall[w, walls.START_Y]
        nx, ny = wall[w, walls.NORMAL_X], wall[w, walls.NORMAL_Y]
        along, across = dx * wall[w, walls.ALONG_X] + dy * wall[w, walls.ALONG_Y], dx * nx + dy * ny
        beyond = max(-along, along - wall[w, walls.LENGTH], 0.0)
        if beyond > 0.0:
            across = math.sqrt(across * across + beyond * beyond)
        gap = across - half_d * abs(c * nx + s * ny) - half_w * abs(s * nx - c * ny)
        # Keep the mode that costs least; the angle is left out of what costs too much already.
        for k in range(first, last):
            off = abs(gap - mode[k, col.GAP]) * mode[k, col.NEAR]
            cost = weight[TERM.wall_distance] * off + weight[TERM.relation_odds] * mode[k, col.ODDS_COST]
            if cost < best:
                angle = _angle(yaw - wall[w, walls.WALL_YAW], mode[k, col.MODE_YAW]) * mode[k, col.STRAIGHT]
                cost += weight[TERM.wall_orientation] * angle
                if cost < best:
                    best, distance, orientation, odds = cost, off, angle, mode[k, col.ODDS_COST]
    out[TERM.wall_distance] += distance
    out[TERM.wall_orientation] += orientation
    out[TERM.relation_odds] += odds


@inlined
def _core_of(problem, state, i):  # type: ignore[no-untyped-def]
    return problem.link[i, col.CORE]


@loss("partner", "group_distance", "group_orientation", "relation_odds", partner=_core_of)
@kernel
def add_group(problem, state, i, out):  # type: ignore[no-untyped-def]
    """Add the losses of object ``i`` to the mode around its core that it fits best."""
    where, mode, weight, core = state.where, problem.mode, problem.weight, problem.link[i, col.CORE]
    dx, dy = where[i, col.X] - where[core, col.X], where[i, col.Y] - where[core, col.Y]
    yaw = where[core, col.YAW]
    c, s = math.cos(yaw), math.sin(yaw)
    x, y, turn = dx * c + dy * s, dy * c - dx * s, where[i, col.YAW] - yaw
    best, distance, orientation, odds = np.inf, 0.0, 0.0, 0.0
    for k in range(problem.link[i, col.AROUND_MODES], problem.link[i, col.PLACEMENTS]):
        off = math.sqrt((x - mode[k, col.MODE_X]) ** 2 + (y - mode[k, col.MODE_Y]) ** 2) * mode[k, col.NEAR]
        angle = _angle(turn, mode[k, col.MODE_YAW]) * mode[k, col.STRAIGHT]
        cost = (
            weight[TERM.group_distance] * off + weight[TERM.group_orientation] * angle + weight[TERM.relation_odds] * mode[k, col.ODDS_COST]
        )
        if cost < best:
            best, distance, orientation, odds = cost, off, angle, mode[k, col.ODDS_COST]
    out[TERM.group_distance] += distance
    out[TERM.group_orientation] += orientation
    out[TERM.relation_odds] += odds


@inlined
def _holder_of(problem, state, i):  # type: ignore[no-untyped-def]
    return surface_owner(problem, state.hold[i, col.SURFACE]) if problem.link[i, col.MOUNT] == col.OBJECT else -1


@loss("partner", "overhang", "support_position", "support_orientation", "support_address", "relation_odds", partner=_holder_of)
@kernel
def add_support(problem, state, i, out):  # type: ignore[no-untyped-def]
    """Add overhang, address, and the losses to the placement that object ``i`` fits best on its support surface.

    The distances to two opposite edges change by the same amount, so the sum over four edges is twice that over the axes.
    """
    link, mode, surface, weight, k = problem.link, problem.mode, problem.surface, problem.weight, state.hold[i, col.SURFACE]
    x, y = in_surface_frame(problem, state, k, state.where[i, col.X], state.where[i, col.Y])
    turn = state.where[i, col.YAW] - state.where[surface_owner(problem, k), col.YAW]
    half_d, half_w = problem.object[i, col.HALF_DEPTH], problem.object[i, col.HALF_WIDTH]
    c, s = abs(math.cos(turn)), abs(math.sin(turn))
    out[TERM.overhang] += max(abs(x) + half_d * c + half_w * s - surface[k, col.SURFACE_HALF_DEPTH], 0.0)
    out[TERM.overhang] += max(abs(y) + half_d * s + half_w * c - surface[k, col.SURFACE_HALF_WIDTH], 0.0)
    best, position, orientation, odds = np.inf, 0.0, 0.0, 0.0
    for m in range(link[i, col.PLACEMENTS], link[i, col.TARGETS]):
        mean_x, mean_y = placement_target(problem, i, m, k)
        off = 0.0 if math.isnan(mean_x) else 2.0 * abs(x - mean_x)
        off += 0.0 if math.isnan(mean_y) else 2.0 * abs(y - mean_y)
        off, angle = off * mode[m, col.NEAR], _angle(turn, mode[m, col.MODE_YAW]) * mode[m, col.STRAIGHT]
        cost = weight[TERM.support_position] * off + weight[TERM.support_orientation] * angle
        cost += weight[TERM.relation_odds] * mode[m, col.ODDS_COST]
        if cost < best:
            best, position, orientation, odds = cost, off, angle, mode[m, col.ODDS_COST]
    out[TERM.support_position] += position
    out[TERM.support_orientation] += orientation
    out[TERM.relation_odds] += odds
    for m in range(link[i, col.TARGETS], link[i, col.MODE_END]):
        if int(mode[m, col.TARGET]) == k:
            out[TERM.support_address] += mode[m, col.ADDRESS_COST]


@inlined
def _heights_meet(placed, a, b):  # type: ignore[no-untyped-def]
    high, low = min(placed[a, boxes.Z_HIGH], placed[b, boxes.Z_HIGH]), max(placed[a, boxes.Z_LOW], placed[b, boxes.Z_LOW])
    return high - low > _TOUCH_M


@loss("pair", "overlap")
@kernel
def add_overlap(problem, state, i, j, squared, out):  # type: ignore[no-untyped-def]
    """Add the summed depth of the footprints of the solids of two objects, where their heights meet."""
    link, placed = problem.link, state.placed
    if squared >= (problem.object[i, col.INNER_RADIUS] + problem.object[j, col.INNER_RADIUS]) ** 2:
        return
    for a in range(link[i, col.SOLIDS], link[i, col.ZONES]):
        for b in range(link[j, col.SOLIDS], link[j, col.ZONES]):
            if _heights_meet(placed, a, b):
                out[TERM.overlap] += max(row_penetration(placed, a, placed, b), 0.0)


@loss("pair", "occlusion", "blocked")
@inlined
def add_zones(problem, state, i, j, squared, out):  # type: ignore[no-untyped-def]
    """Add occlusion and blocked depth between two objects, either way."""
    for turn in range(2):
        owner, other = (i, j) if turn == 0 else (j, i)
        reach = problem.object[owner, col.OUTER_RADIUS] + problem.object[other, col.INNER_RADIUS]
        if problem.link[owner, col.STRIPS] > problem.link[owner, col.ZONES] and squared < reach * reach:
            _add_taken(problem, state, owner, other, out)


@kernel
def _add_taken(problem, state, i, j, out):  # type: ignore[no-untyped-def]
    """Add occlusion and blocked depth: what the solids of object ``j`` take from the zones of object ``i``.

    What belongs to an object may stand in its access space, as a chair at a desk, or hang before it, as a curtain before its window; its
    own core may not, as a bed before a wardrobe.
    """
    link, placed, mount = problem.link, state.placed, problem.link[j, col.MOUNT]
    belongs = link[j, col.CORE] == i
    for k in range(link[i, col.ZONES], link[i, col.STRIPS]):
        # Pass over zones that nothing mounted as object j can block.
        kind = int(problem.box[k, col.ZONE_KIND])
        if kind == ACCESS:
            blocks = mount == col.FLOOR and not belongs
        elif kind == GLARE:
            blocks = link[j, col.WATCHED] >= 0
        elif kind == APART:
            blocks = link[j, col.LOUNGES] > 0
        else:
            blocks = kind == SWING or (mount == col.FLOOR if kind == VIEW else mount == col.WALL and not belongs)
        if not blocks:
            continue
        deepest = 0.0
        for b in range(link[j, col.SOLIDS], link[j, col.ZONES]):
            if _heights_meet(placed, k, b):
                deepest = max(deepest, row_penetration(placed, k, placed, b))
        if kind in (ACCESS, GLARE, APART):
            out[TERM.occlusion] += min(deepest / problem.box[k, col.ZONE_DEPTH], 1.0)
        else:
            out[TERM.blocked] += deepest


@loss("object", "out_of_room")
@inlined
def add_out_of_room(problem, state, i, out):  # type: ignore[no-untyped-def]
    """Add how far the footprint of object ``i`` sticks out of the room; what stands on an object is held to that."""
    if problem.link[i, col.MOUNT] == col.OBJECT:
        return
    x, y, yaw = state.where[i, col.X], state.where[i, col.Y], state.where[i, col.YAW]
    half_d, half_w = problem.object[i, col.HALF_DEPTH], problem.object[i, col.HALF_WIDTH]
    out[TERM.out_of_room] += rectangle_outside(problem.wall, x, y, math.cos(yaw), math.sin(yaw), half_d, half_w)


@loss("object", "out_of_room")
@kernel
def add_above_slopes(problem, state, i, out):  # type: ignore[no-untyped-def]
    """Add how deep the solids of object ``i`` reach through a sloped ceiling."""
    if len(problem.slope) == 0:
        return
    deepest = 0.0
    for k in range(problem.link[i, col.SOLIDS], problem.link[i, col.ZONES]):
        deepest = max(deepest, above_slopes(problem.slope, state.placed, k))
    out[TERM.out_of_room] += deepest


@loss("object", "occlusion")
@inlined
def add_occlusion_by_walls(problem, state, i, out):  # type: ignore[no-untyped-def]
    """Add what walls take from the access spaces of object ``i``."""
    placed = state.placed
    for k in range(problem.link[i, col.ZONES], problem.link[i, col.STRIPS]):
        if problem.box[k, col.ZONE_KIND] == ACCESS:
            x, y, c, s = placed[k, boxes.X], placed[k, boxes.Y], placed[k, boxes.COS_YAW], placed[k, boxes.SIN_YAW]
            outside = rectangle_outside(problem.wall, x, y, c, s, placed[k, boxes.HALF_DEPTH], placed[k, boxes.HALF_WIDTH])
            out[TERM.occlusion] += min(outside / problem.box[k, col.ZONE_DEPTH], 1.0)


@loss("object", "off_wall")
@kernel
def add_off_wall(problem, state, i, out):  # type: ignore[no-untyped-def]
    """Add how far object ``i`` is from walls beyond its greatest gaps: its back, and the side that is nearer to one.

    Gaps are those of the faults ``..._off_wall``, which measure them from the middle of the back; here the further end of it counts.
    """
    half_d, half_w = problem.object[i, col.HALF_DEPTH], problem.object[i, col.HALF_WIDTH]
    back_gap, side_gap = problem.object[i, col.BACK_GAP], problem.object[i, col.SIDE_GAP]
    if back_gap < np.inf:
        out[TERM.off_wall] += max(_edge_gap(problem, state, i, -half_d, -half_w, -half_d, half_w) - back_gap, 0.0)
    if side_gap < np.inf:
        left = _edge_gap(problem, state, i, -half_d, half_w, half_d, half_w)
        right = _edge_gap(problem, state, i, -half_d, -half_w, half_d, -half_w)
        out[TERM.off_wall] += max(min(left, right) - side_gap, 0.0)


@kernel
def _edge_gap(problem, state, i, u0, v0, u1, v1):  # type: ignore[no-untyped-def]
    """Return how far the further end of an edge of object ``i``, given in its frame, is from the wall that the edge is nearest to.

    Beyond a wall's ends the distance to its nearer end takes the place of that to the wall.
    """
    wall, x, y, yaw = problem.wall, state.where[i, col.X], state.where[i, col.Y], state.where[i, col.YAW]
    c, s = math.cos(yaw), math.sin(yaw)
    nearest = np.inf
    for w in range(len(wall)):
        furthest = 0.0
        for u, v in ((u0, v0), (u1, v1)):
            dx = x + u * c - v * s - wall[w, walls.START_X]
            dy = y + u * s + v * c - wall[w, walls.START_Y]
            along = dx * wall[w, walls.ALONG_X] + dy * wall[w, walls.ALONG_Y]
            across = abs(dx * wall[w, walls.NORMAL_X] + dy * wall[w, walls.NORMAL_Y])
            beyond = max(-along, along - wall[w, walls.LENGTH], 0.0)
            furthest = max(furthest, math.sqrt(across * across + beyond * beyond))
        nearest = min(nearest, furthest)
    return nearest


@inlined
def _watcher_of(problem, state, i):  # type: ignore[no-untyped-def]
    return problem.link[i, col.WATCHED]


@loss("partner", "screen_aside", partner=_watcher_of)
@kernel
def add_view(problem, state, i, out):  # type: ignore[no-untyped-def]
    """Add by how much more than ``_VIEW_RAD`` screen ``i`` and the seat that it is watched from look past each other."""
    where, seat = state.where, problem.link[i, col.WATCHED]
    off = aslant(where[seat, col.X] - where[i, col.X], where[seat, col.Y] - where[i, col.Y], where[i, col.YAW], where[seat, col.YAW])
    out[TERM.screen_aside] += max(off - _VIEW_RAD, 0.0)


@loss("object", "room_centre")
@inlined
def add_room_centre(problem, state, i, out):  # type: ignore[no-untyped-def]
    """Add the distance of object ``i`` to the centroid of the floor, if it is drawn there."""
    if problem.object[i, col.CENTRED] > 0.0:
        out[TERM.room_centre] += math.hypot(state.where[i, col.X] - problem.x_centre, state.where[i, col.Y] - problem.y_centre)
