"""Work space and settings of the layout chain's proposals, and the placements that they share."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from grammar.geometry import walls
from grammar.geometry.arrays import Floats, Ints
from grammar.geometry.kernels import inlined, kernel
from grammar.layout import columns as col
from grammar.layout.frames import point_at_wall, surface_owner, wrap
from grammar.spec.rules import MOVES, MoveRule


class MoveSettings(NamedTuple):
    """:class:`grammar.spec.rules.MoveRule` for compiled code.

    cumulative: running sum of the moves' probabilities, in the order of ``MOVES``; translate_sd_m, rotate_sd_rad: (k,) standard deviations,
    each filled up by repetition to a common length; the rest as the rule has it.
    """

    cumulative: Floats
    translate_sd_m: Floats
    rotate_sd_rad: Floats
    carry: float
    quarter_turn: float
    relocate_uniform: float
    relocate_wall: float
    relocate_around: float
    relocate_beside: float
    wall_gap_sd_m: float
    wall_orientation_sd_rad: float
    around_sd_m: float
    around_orientation_sd_rad: float
    place_sd_m: float


class Proposal(NamedTuple):
    """Work space for one proposal: the objects that lead it (one, or two that swap) and where they go.

    pose: (2, 3) new x, y, yaw; tag: (2, 3) object index, new support surface, new wall.
    """

    pose: Floats
    tag: Ints


def move_settings(rule: MoveRule) -> MoveSettings:
    """Return the settings of the compiled moves."""
    size = math.lcm(len(rule.translate_sd_m), len(rule.rotate_sd_rad))
    return MoveSettings(
        np.cumsum([getattr(rule, name) for name in MOVES]),
        np.resize(rule.translate_sd_m, size),
        np.resize(rule.rotate_sd_rad, size),
        *(float(getattr(rule, name)) for name in MoveSettings._fields[3:]),
    )


def empty_proposal() -> Proposal:
    """Return work space for proposals."""
    return Proposal(np.zeros((2, 3)), np.zeros((2, 3), np.int64))


@kernel
def pick(rng, count):  # type: ignore[no-untyped-def]
    """Return a uniform index below ``count``."""
    return min(int(rng.random() * count), count - 1)


@inlined
def start_from(state, proposal, place, i):  # type: ignore[no-untyped-def]
    """Begin a proposal for object ``i`` with the pose that it has."""
    proposal.tag[place, col.LEADER], proposal.tag[place, col.NEW_SURFACE] = i, state.hold[i, col.SURFACE]
    proposal.tag[place, col.NEW_WALL] = state.hold[i, col.ON_WALL]
    copy_pose(state, i, proposal, place)


@inlined
def copy_pose(state, i, proposal, place):  # type: ignore[no-untyped-def]
    """Propose the pose that object ``i`` has."""
    proposal.pose[place, col.X], proposal.pose[place, col.Y] = state.where[i, col.X], state.where[i, col.Y]
    proposal.pose[place, col.YAW] = state.where[i, col.YAW]


@kernel
def hang(problem, proposal, place, i, w, along):  # type: ignore[no-untyped-def]
    """Put object ``i`` with its back to wall ``w``, its middle ``along`` metres from the wall's start."""
    x, y = point_at_wall(problem.wall, w, along, problem.object[i, col.HALF_DEPTH])
    proposal.tag[place, col.NEW_WALL] = w
    proposal.pose[place, col.X], proposal.pose[place, col.Y] = x, y
    proposal.pose[place, col.YAW] = problem.wall[w, walls.WALL_YAW]


@kernel
def put_on_surface(problem, state, proposal, k, u, v, turn):  # type: ignore[no-untyped-def]
    """Put the leading object on support surface ``k`` at u, v in its frame, turned by ``turn`` against its owner."""
    where, owner = state.where, surface_owner(problem, k)
    yaw = where[owner, col.YAW]
    c, s = math.cos(yaw), math.sin(yaw)
    u, v = u + problem.surface[k, col.SURFACE_X], v + problem.surface[k, col.SURFACE_Y]
    proposal.tag[0, col.NEW_SURFACE] = k
    proposal.pose[0, col.X] = where[owner, col.X] + u * c - v * s
    proposal.pose[0, col.Y] = where[owner, col.Y] + u * s + v * c
    proposal.pose[0, col.YAW] = wrap(yaw + turn)


@kernel
def uniform_on_surface(rng, problem, k):  # type: ignore[no-untyped-def]
    """Draw a uniform place on support surface ``k``, in its frame."""
    u = problem.surface[k, col.SURFACE_HALF_DEPTH] * (2.0 * rng.random() - 1.0)
    return u, problem.surface[k, col.SURFACE_HALF_WIDTH] * (2.0 * rng.random() - 1.0)
