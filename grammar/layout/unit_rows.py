"""Rows of units along walls in the chain: where the units stand, what their order costs, and how a row moves.

The state of a row is its slot, how far it is shifted along that, and which unit stands in which place.  The measure over these that the
energy weighs is uniform over the slots, over the shift as a share of what the slot allows, and over the orders, so a slot without room to
shift counts as much as one with it.  All moves draw as likely there as back: slot and shift afresh and uniform; a normal step of the shift,
refused beyond its bounds; two units that exchange their places, refused where that would change the length of a leg.
"""

import math

from grammar.geometry import walls
from grammar.geometry.kernels import entry, inlined, kernel
from grammar.layout import columns as col
from grammar.layout.frames import along_wall, pick, point_at_wall, wall_of_core, wrap
from grammar.layout.losses import loss
from grammar.spec.energy_terms import TERM

_SAME_WIDTH_M = 1e-6


@inlined
def is_head(problem, i):  # type: ignore[no-untyped-def]
    """Return whether object ``i`` stands for its row in moves."""
    return problem.link[i, col.ROW] >= 0 and problem.row[problem.link[i, col.ROW], col.ROW_HEAD] == i


@kernel
def unit_at(problem, state, row, place):  # type: ignore[no-untyped-def]
    """Return the unit in a place of a row, -1 where there is no such place."""
    for i in range(len(problem.link)):
        if problem.link[i, col.ROW] == row and state.hold[i, col.PLACE] == place:
            return i
    return -1


@kernel
def half_along(problem, i):  # type: ignore[no-untyped-def]
    """Return half of what a unit takes of its line, in metres."""
    return problem.object[i, col.HALF_DEPTH] if problem.link[i, col.END_ON] else problem.object[i, col.HALF_WIDTH]


@kernel
def shift_of(problem, state, row):  # type: ignore[no-untyped-def]
    """Return how far a row is shifted along its slot, in metres."""
    first = unit_at(problem, state, row, 0)
    slot, k = problem.slot, state.hold[first, col.SLOT]
    if slot[k, col.SLIDE] <= 0.0:
        return 0.0
    yaw = slot[k, col.LEG_YAW]
    along = (state.where[first, col.X] - slot[k, col.LEG_X]) * math.sin(yaw) - (state.where[first, col.Y] - slot[k, col.LEG_Y]) * math.cos(
        yaw
    )
    return slot[k, col.DIRECTION] * along - half_along(problem, first)


@entry
def arrange(problem, state, row, shift):  # type: ignore[no-untyped-def]
    """Write the poses of all units of a row, which is shifted by ``shift`` metres along its slot."""
    slot, k = problem.slot, state.hold[problem.row[row, col.ROW_HEAD], col.SLOT]
    first, leg, walked = 0, -1, 0.0
    for place in range(problem.row[row, col.ROW_UNITS]):
        # Legs belong to places; the rows of the units in the order of their indices tell them.
        while problem.link[first, col.ROW] != row:
            first += 1
        if problem.link[first, col.LEG] != leg:
            leg, walked = problem.link[first, col.LEG], shift if problem.link[first, col.LEG] == 0 else 0.0
        first += 1
        # Put the unit beside the one before it.
        i, yaw = unit_at(problem, state, row, place), slot[k, col.LEG_YAW + col.LEG_COLUMNS * leg]
        c, s = math.cos(yaw), math.sin(yaw)
        aside = problem.link[i, col.END_ON] or (problem.link[i, col.TURNS] and slot[k, col.DIRECTION] < 0.0)
        half = problem.object[i, col.HALF_DEPTH] if aside else problem.object[i, col.HALF_WIDTH]
        along = slot[k, col.DIRECTION] * (walked + half)
        across = slot[k, col.ROW_GAP] + problem.object[i, col.BEHIND]
        across += problem.object[i, col.HALF_WIDTH] if aside else problem.object[i, col.HALF_DEPTH]
        walked += 2.0 * half + slot[k, col.ROW_JOINT]
        state.where[i, col.X] = slot[k, col.LEG_X + col.LEG_COLUMNS * leg] + along * s + across * c
        state.where[i, col.Y] = slot[k, col.LEG_Y + col.LEG_COLUMNS * leg] - along * c + across * s
        state.where[i, col.YAW] = yaw
        if problem.link[i, col.TURNS] and slot[k, col.DIRECTION] < 0.0:
            state.where[i, col.YAW] = wrap(yaw - 0.5 * math.pi)
        elif problem.link[i, col.END_ON]:
            to_start = 2 * place + 2 <= problem.row[row, col.ROW_UNITS]
            quarter = 0.5 * math.pi * slot[k, col.DIRECTION]
            state.where[i, col.YAW] = wrap(yaw + (quarter if to_start else -quarter))


@entry
def hang_in_line(problem, state, i):  # type: ignore[no-untyped-def]
    """Write the pose of what hangs in line: above the middle of its core, on the wall at the core's back."""
    where, core = state.where, problem.link[i, col.CORE]
    w = wall_of_core(problem, state, core)
    along = along_wall(problem.wall, w, where[core, col.X], where[core, col.Y])
    where[i, col.X], where[i, col.Y] = point_at_wall(problem.wall, w, along, problem.object[i, col.HALF_DEPTH])
    where[i, col.YAW], state.hold[i, col.ON_WALL] = problem.wall[w, walls.WALL_YAW], w


@inlined
def _leg_of(problem, row, place):  # type: ignore[no-untyped-def]
    """Return the number of the leg that a place belongs to."""
    for i in range(len(problem.link)):
        if problem.link[i, col.ROW] == row:
            if place == 0:
                return problem.link[i, col.LEG]
            place -= 1
    return -1


@kernel
def propose_row(rng, problem, state, settings, i, kind, proposal):  # type: ignore[no-untyped-def]
    """Fill ``proposal`` with a move of the row that unit ``i`` heads; return 1, or 0 where the move does not apply.

    ``kind``: 0 slide (an exchange where the slot leaves no room for it), 1 exchange of two units, 2 a slot drawn afresh.
    """
    row, slot = problem.link[i, col.ROW], state.hold[i, col.SLOT]
    proposal.tag[0, col.LEADER], proposal.tag[0, col.NEW_SLOT] = i, slot
    proposal.tag[1, col.FIRST_UNIT], proposal.tag[1, col.SECOND_UNIT] = i, i
    if kind == 2:
        first, end = problem.row[row, col.ROW_SLOTS], problem.row[row, col.ROW_SLOTS_END]
        slot = first + pick(rng, end - first)
        proposal.tag[0, col.NEW_SLOT] = slot
        proposal.pose[0, col.NEW_SLIDE] = problem.slot[slot, col.SLIDE] * rng.random()
        return 1
    shift = shift_of(problem, state, row)
    if kind == 0 and problem.slot[slot, col.SLIDE] > 0.0:
        shift += settings.translate_sd_m[pick(rng, len(settings.translate_sd_m))] * rng.standard_normal()
        proposal.pose[0, col.NEW_SLIDE] = shift
        return 1 if 0.0 <= shift <= problem.slot[slot, col.SLIDE] else 0
    proposal.pose[0, col.NEW_SLIDE] = shift
    units = problem.row[row, col.ROW_UNITS]
    p, q = pick(rng, units), pick(rng, units)
    a, b = unit_at(problem, state, row, p), unit_at(problem, state, row, q)
    proposal.tag[1, col.FIRST_UNIT], proposal.tag[1, col.SECOND_UNIT] = a, b
    if a == b or problem.link[a, col.TURNS] or problem.link[b, col.TURNS] or problem.link[a, col.JUTS] != problem.link[b, col.JUTS]:
        return 0
    alike = abs(half_along(problem, a) - half_along(problem, b)) <= _SAME_WIDTH_M
    return 1 if alike or _leg_of(problem, row, p) == _leg_of(problem, row, q) else 0


@kernel
def move_row(problem, state, proposal):  # type: ignore[no-untyped-def]
    """Write the order, the slot and the poses that a proposal gives to all units of a row."""
    row, hold = problem.link[proposal.tag[0, col.LEADER], col.ROW], state.hold
    a, b = proposal.tag[1, col.FIRST_UNIT], proposal.tag[1, col.SECOND_UNIT]
    hold[a, col.PLACE], hold[b, col.PLACE] = hold[b, col.PLACE], hold[a, col.PLACE]
    for i in range(len(problem.link)):
        if problem.link[i, col.ROW] == row:
            hold[i, col.SLOT] = proposal.tag[0, col.NEW_SLOT]
    arrange(problem, state, row, proposal.pose[0, col.NEW_SLIDE])


@kernel
def _below_window(problem, state, i):  # type: ignore[no-untyped-def]
    """Return whether the middle of a unit is below a window of the wall at its back."""
    x, y, yaw = state.where[i, col.X], state.where[i, col.Y], state.where[i, col.YAW]
    c, s = math.cos(yaw), math.sin(yaw)
    for j in range(len(problem.link)):
        if problem.link[j, col.MOUNT] == col.FIXED and problem.object[j, col.BOTTOM] > 0.0:
            dx, dy = state.where[j, col.X] - x, state.where[j, col.Y] - y
            beside, behind = abs(dy * c - dx * s), -(dx * c + dy * s)
            if beside <= problem.object[j, col.HALF_WIDTH] and 0.0 <= behind <= 2.0 * problem.object[i, col.HALF_DEPTH]:
                if math.cos(yaw - state.where[j, col.YAW]) > 0.5:
                    return True
    return False


@kernel
def _beside_window(problem, state, i):  # type: ignore[no-untyped-def]
    """Return whether the room has a window in a wall at right angles to the one at a unit's back."""
    for j in range(len(problem.link)):
        if problem.link[j, col.MOUNT] == col.FIXED and problem.object[j, col.BOTTOM] > 0.0:
            if abs(math.cos(state.where[i, col.YAW] - state.where[j, col.YAW])) < 0.5:
                return True
    return False


@kernel
def _only_alike(problem, state, row, first, end):  # type: ignore[no-untyped-def]
    """Return whether all units in the places ``first`` to ``end - 1`` of a row like its end."""
    for place in range(first, end):
        if problem.link[unit_at(problem, state, row, place), col.LIKES_END] == 0:
            return False
    return True


@loss("object", "run_order")
@kernel
def add_row_order(problem, state, head, out):  # type: ignore[no-untyped-def]
    """Add what the wishes of the units cost that the order of the row headed by an object does not meet."""
    if not is_head(problem, head):
        return
    row = problem.link[head, col.ROW]
    last = problem.row[row, col.ROW_UNITS] - 1
    for i in range(len(problem.link)):
        if problem.link[i, col.ROW] != row or problem.link[i, col.WISH_END] == problem.link[i, col.MODE_END]:
            continue
        place = state.hold[i, col.PLACE]
        before, after = unit_at(problem, state, row, place - 1), unit_at(problem, state, row, place + 1)
        for k in range(problem.link[i, col.MODE_END], problem.link[i, col.WISH_END]):
            target = int(problem.mode[k, col.WISH_TARGET])
            if target == col.END:
                met = _only_alike(problem, state, row, 0, place) or _only_alike(problem, state, row, place + 1, last + 1)
            elif target == col.WINDOW:
                met = _below_window(problem, state, i)
            elif target == col.SIDE_WINDOW:
                met = _beside_window(problem, state, i)
            elif target == col.LINE:
                met = (before >= 0 and problem.link[before, col.FILLS] > 0) or (after >= 0 and problem.link[after, col.FILLS] > 0)
            elif target == col.CORNER_UNIT:
                met = (before >= 0 and problem.link[before, col.TURNS] > 0) or (after >= 0 and problem.link[after, col.TURNS] > 0)
            else:
                met = (before >= 0 and problem.link[before, col.UNIT_KIND] == target) or (
                    after >= 0 and problem.link[after, col.UNIT_KIND] == target
                )
            if met != (problem.mode[k, col.WISH_NEAR] > 0.0):
                out[TERM.run_order] += problem.mode[k, col.WISH_COST]
