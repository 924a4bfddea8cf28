"""Work space and settings of the layout chain's proposals, and the placements that they share."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from grammar.geometry.arrays import Floats, Ints
from grammar.geometry.kernels import INNER
from grammar.layout.energies import wrap
from grammar.layout.problem import FLOOR, HALF_DEPTH, MOUNT, ON_WALL, SLOT, SLOT_OWNER
from grammar.spec.rules import MOVES, MoveRule

CARRY, QUARTER_TURN, UNIFORM, AT_WALL, AT_CORE, WALL_GAP_SD, WALL_YAW_SD, AROUND_SD, AROUND_YAW_SD, PLACE_SD = range(10)
"""Places in ``MoveSettings.number``."""

LEADER, NEW_SLOT, NEW_WALL = range(3)
"""Columns of ``Proposal.tag``."""

_TWO_PI = 2.0 * math.pi
_TURN_M = 10.0


class MoveSettings(NamedTuple):
    """:class:`grammar.spec.rules.MoveRule` for compiled code.

    cumulative: (6,) running sum of the moves' probabilities; sd: (2, k) standard deviations of translations and of rotations, each row
    filled up by repetition; number: (10,) the places above.
    """

    cumulative: Floats
    sd: Floats
    number: Floats


class Proposal(NamedTuple):
    """Work space for one proposal: the objects that lead it (one, or two that swap) and where they go.

    pose: (2, 3) new x, y, yaw; tag: (2, 3) object index, new top, new wall.
    """

    pose: Floats
    tag: Ints


def move_settings(rule: MoveRule) -> MoveSettings:
    """Return the settings of the compiled moves."""
    size = math.lcm(len(rule.translate_sd_m), len(rule.rotate_sd_rad))
    number = (
        rule.carry,
        rule.quarter_turn,
        rule.relocate_uniform,
        rule.relocate_wall,
        rule.relocate_around,
        rule.wall_gap_sd_m,
        rule.wall_orientation_sd_rad,
        rule.around_sd_m,
        rule.around_orientation_sd_rad,
        rule.place_sd_m,
    )
    return MoveSettings(
        cumulative=np.cumsum([getattr(rule, name) for name in MOVES]),
        sd=np.array([np.resize(rule.translate_sd_m, size), np.resize(rule.rotate_sd_rad, size)]),
        number=np.array(number),
    )


def empty_proposal() -> Proposal:
    """Return work space for proposals."""
    return Proposal(np.zeros((2, 3)), np.zeros((2, 3), np.int64))


@njit(**INNER)
def pick(rng, count):  # type: ignore[no-untyped-def]
    """Return a uniform index below ``count``."""
    return min(int(rng.random() * count), count - 1)


@njit(**INNER)
def start_from(state, proposal, place, i):  # type: ignore[no-untyped-def]
    """Begin a proposal for object ``i`` with the pose that it has."""
    proposal.tag[place, LEADER], proposal.tag[place, NEW_SLOT] = i, state.hold[i, SLOT]
    proposal.tag[place, NEW_WALL] = state.hold[i, ON_WALL]
    for k in range(3):
        proposal.pose[place, k] = state.where[i, k]


@njit(**INNER)
def hang(problem, proposal, place, i, w, along):  # type: ignore[no-untyped-def]
    """Put object ``i`` with its back to wall ``w``, its middle ``along`` metres from the wall's start."""
    wall, half = problem.wall, problem.object[i, HALF_DEPTH]
    proposal.tag[place, NEW_WALL] = w
    proposal.pose[place, 0] = wall[w, 0] + wall[w, 2] * along + wall[w, 5] * half
    proposal.pose[place, 1] = wall[w, 1] + wall[w, 3] * along + wall[w, 6] * half
    proposal.pose[place, 2] = wall[w, 7]


@njit(**INNER)
def along_wall(wall, w, x, y):  # type: ignore[no-untyped-def]
    """Return how far along wall ``w`` a point lies, in metres from its start."""
    return (x - wall[w, 0]) * wall[w, 2] + (y - wall[w, 1]) * wall[w, 3]


@njit(**INNER)
def wall_of_core(problem, state, core):  # type: ignore[no-untyped-def]
    """Return the wall on which what belongs to ``core`` hangs: the core's own, or the one at the back of a core that stands.

    That is the nearest one, where a metre counts as much as a turn of the wall's normal against the core's front whose cosine is 0.1 less.
    """
    if problem.link[core, MOUNT] != FLOOR:
        return state.hold[core, ON_WALL]
    x, y, yaw = state.where[core, 0], state.where[core, 1], state.where[core, 2]
    best, least = 0, np.inf
    for w in range(len(problem.wall)):
        along = min(max(along_wall(problem.wall, w, x, y), 0.0), problem.wall[w, 4])
        dx, dy = x - problem.wall[w, 0] - problem.wall[w, 2] * along, y - problem.wall[w, 1] - problem.wall[w, 3] * along
        cost = math.sqrt(dx * dx + dy * dy) + _TURN_M * (1.0 - math.cos(yaw - problem.wall[w, 7]))
        if cost < least:
            best, least = w, cost
    return np.int64(best)


@njit(**INNER)
def put_on_slot(problem, state, proposal, slot, u, v, turn):  # type: ignore[no-untyped-def]
    """Put the leading object on top ``slot`` at u, v in its frame, turned by ``turn`` against its owner."""
    owner = int(problem.slot[slot, SLOT_OWNER])
    yaw = state.where[owner, 2]
    c, s = math.cos(yaw), math.sin(yaw)
    u, v = u + problem.slot[slot, 0], v + problem.slot[slot, 1]
    proposal.tag[0, NEW_SLOT] = slot
    proposal.pose[0, 0] = state.where[owner, 0] + u * c - v * s
    proposal.pose[0, 1] = state.where[owner, 1] + u * s + v * c
    proposal.pose[0, 2] = wrap(yaw + turn)
