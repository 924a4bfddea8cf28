"""Proposals of the layout chain, each with its Hastings ratio.

- translate, rotate (now and then by a quarter turn), slide along the direction of a random wall: symmetric diffusions
- swap: two objects exchange position and orientation; symmetric
- repoint: an object goes to a uniform place on another top that can carry it, keeping its yaw there; the ratio is that of the areas
- relocate: an object is drawn afresh from a mixture of a uniform pose, poses at walls (snap to wall) and poses around its core or on a
  top, whose density is computed for the old pose and the new one

The first four are the paper's (Jiang et al., IJCV 2018, section 3.2), the mixture takes the place of its random restarts.  A pose's base
measure is area times angle (length along the walls for what hangs there), over the bounding box of the room, the walls, or the tops.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from grammar.energies import in_slot, place_target, wrap
from grammar.layout import CEILING, FIXED, FLOOR, OBJECT, WALL, Floats, Ints
from grammar.rules import MOVES, MoveRule

TRANSLATE, ROTATE, SLIDE, SWAP, REPOINT, RELOCATE = range(len(MOVES))

_TWO_PI = 2.0 * math.pi


class MoveSettings(NamedTuple):
    """:class:`grammar.rules.MoveRule` for compiled code; ``cumulative``: (6,) running sum of the moves' probabilities."""

    cumulative: Floats
    carry: float
    translate_sd: Floats
    rotate_sd: Floats
    quarter_turn: float
    uniform: float
    wall: float
    around: float
    wall_gap_sd: float
    wall_yaw_sd: float
    around_sd: float
    around_yaw_sd: float
    place_sd: float


class Proposal(NamedTuple):
    """Work space for one proposal: the objects that lead it (one, or two that swap) and where they go.

    who: (2,) object indices; pose: (2, 3) new x, y, yaw; slot, on_wall: (2,) new tops and walls.
    """

    who: Ints
    pose: Floats
    slot: Ints
    on_wall: Ints


def move_settings(rule: MoveRule) -> MoveSettings:
    """Return the settings of the compiled moves."""
    return MoveSettings(
        cumulative=np.cumsum([getattr(rule, name) for name in MOVES]),
        carry=rule.carry,
        translate_sd=np.array(rule.translate_sd_m),
        rotate_sd=np.array(rule.rotate_sd_rad),
        quarter_turn=rule.quarter_turn,
        uniform=rule.relocate_uniform,
        wall=rule.relocate_wall,
        around=rule.relocate_around,
        wall_gap_sd=rule.wall_gap_sd_m,
        wall_yaw_sd=rule.wall_orientation_sd_rad,
        around_sd=rule.around_sd_m,
        around_yaw_sd=rule.around_orientation_sd_rad,
        place_sd=rule.place_sd_m,
    )


def empty_proposal() -> Proposal:
    """Return work space for proposals."""
    return Proposal(np.zeros(2, np.int64), np.zeros((2, 3)), np.zeros(2, np.int64), np.zeros(2, np.int64))


@njit(cache=True)
def _normal_density(x, sd):  # type: ignore[no-untyped-def]
    return math.exp(-0.5 * (x / sd) ** 2) / (sd * math.sqrt(_TWO_PI))


@njit(cache=True)
def _yaw_density(angle, mean, sd):  # type: ignore[no-untyped-def]
    """Return the density of a wrapped normal (narrow: sd is far below pi), or of a uniform angle where the mean is NaN."""
    return 1.0 / _TWO_PI if math.isnan(mean) else _normal_density(wrap(angle - mean), sd)


@njit(cache=True)
def _draw_yaw(rng, mean, sd):  # type: ignore[no-untyped-def]
    return _TWO_PI * rng.random() if math.isnan(mean) else mean + sd * rng.standard_normal()


@njit(cache=True)
def _pick(rng, count):  # type: ignore[no-untyped-def]
    return min(int(rng.random() * count), count - 1)


@njit(cache=True)
def _start(state, proposal, place, i):  # type: ignore[no-untyped-def]
    proposal.who[place] = i
    proposal.pose[place] = state.pose[i]
    proposal.slot[place] = state.slot[i]
    proposal.on_wall[place] = state.on_wall[i]


@njit(cache=True)
def _hang(problem, proposal, place, i, w, along):  # type: ignore[no-untyped-def]
    """Put object ``i`` with its back to wall ``w``, its middle ``along`` metres from the wall's start."""
    wall = problem.wall[w]
    proposal.on_wall[place] = w
    proposal.pose[place, 0] = wall[0] + wall[2] * along + wall[5] * problem.half[i, 0]
    proposal.pose[place, 1] = wall[1] + wall[3] * along + wall[6] * problem.half[i, 0]
    proposal.pose[place, 2] = problem.wall_yaw[w]


@njit(cache=True)
def _along(problem, w, x, y):  # type: ignore[no-untyped-def]
    return (x - problem.wall[w, 0]) * problem.wall[w, 2] + (y - problem.wall[w, 1]) * problem.wall[w, 3]


@njit(cache=True)
def in_domain(problem, state, proposal, place):  # type: ignore[no-untyped-def]
    """Return whether a proposed pose lies in the space of poses: the room's bounding box, a wall's length, or a top."""
    i, x, y = proposal.who[place], proposal.pose[place, 0], proposal.pose[place, 1]
    if problem.mount[i] == WALL:
        along, half, w = _along(problem, proposal.on_wall[place], x, y), problem.half[i, 1], proposal.on_wall[place]
        return half <= along <= problem.wall[w, 4] - half
    if problem.mount[i] == OBJECT:
        slot = proposal.slot[place]
        u, v = in_slot(state.pose, problem.slot_owner[slot], problem.slot, slot, x, y)
        return abs(u) <= problem.slot[slot, 3] and abs(v) <= problem.slot[slot, 4]
    return problem.bounds[0] <= x <= problem.bounds[2] and problem.bounds[1] <= y <= problem.bounds[3]


@njit(cache=True)
def _put_on_slot(problem, state, proposal, slot, u, v, turn):  # type: ignore[no-untyped-def]
    owner = problem.slot_owner[slot]
    yaw = state.pose[owner, 2]
    c, s = math.cos(yaw), math.sin(yaw)
    u, v = u + problem.slot[slot, 0], v + problem.slot[slot, 1]
    proposal.slot[0] = slot
    proposal.pose[0, 0] = state.pose[owner, 0] + u * c - v * s
    proposal.pose[0, 1] = state.pose[owner, 1] + u * s + v * c
    proposal.pose[0, 2] = wrap(yaw + turn)


@njit(cache=True)
def propose(rng, problem, state, settings, move, i, movable, proposal):  # type: ignore[no-untyped-def]
    """Fill ``proposal`` with move number ``move`` of object ``i``.

    Returns:
        count: number of objects that lead the move, 0 when it does not apply to them.
        log_q_ratio: log q(old | new) - log q(new | old).
    """
    _start(state, proposal, 0, i)
    mount, count, log_q_ratio = problem.mount[i], 1, 0.0
    if mount == FIXED:
        return 0, 0.0
    if mount == WALL and (move == TRANSLATE or move == SLIDE):
        step = settings.translate_sd[_pick(rng, len(settings.translate_sd))] * rng.standard_normal()
        w = state.on_wall[i]
        _hang(problem, proposal, 0, i, w, _along(problem, w, state.pose[i, 0], state.pose[i, 1]) + step)
    elif move == TRANSLATE:
        sd = settings.translate_sd[_pick(rng, len(settings.translate_sd))]
        proposal.pose[0, 0] += sd * rng.standard_normal()
        proposal.pose[0, 1] += sd * rng.standard_normal()
    elif move == ROTATE:
        if mount != FLOOR and mount != OBJECT:
            return 0, 0.0
        if rng.random() < settings.quarter_turn:
            turn = 0.5 * math.pi * (1 + _pick(rng, 3))
        else:
            turn = settings.rotate_sd[_pick(rng, len(settings.rotate_sd))] * rng.standard_normal()
        proposal.pose[0, 2] = wrap(proposal.pose[0, 2] + turn)
    elif move == SLIDE:
        step = settings.translate_sd[_pick(rng, len(settings.translate_sd))] * rng.standard_normal()
        yaw = problem.wall_yaw[_pick(rng, len(problem.wall_yaw))]
        if mount == OBJECT:
            yaw = state.pose[problem.slot_owner[state.slot[i]], 2] + 0.5 * math.pi * _pick(rng, 2)
        proposal.pose[0, 0] -= step * math.sin(yaw)
        proposal.pose[0, 1] += step * math.cos(yaw)
    elif move == SWAP:
        count = _swap(rng, problem, state, i, movable, proposal)
    elif move == REPOINT:
        count, log_q_ratio = _repoint(rng, problem, state, i, proposal)
    else:
        old = relocation_density(problem, state, settings, i, proposal)
        _relocate(rng, problem, state, settings, i, proposal)
        log_q_ratio = math.log(max(old, 1e-300)) - math.log(max(relocation_density(problem, state, settings, i, proposal), 1e-300))
    for place in range(count):
        if not in_domain(problem, state, proposal, place):
            return 0, 0.0
    return count, log_q_ratio


@njit(cache=True)
def _swap(rng, problem, state, i, movable, proposal):  # type: ignore[no-untyped-def]
    j = movable[_pick(rng, len(movable))]
    if i == j or problem.mount[i] != problem.mount[j] or (problem.mount[i] != FLOOR and problem.mount[i] != WALL):
        return 0
    _start(state, proposal, 1, j)
    if problem.mount[i] == WALL:
        for place, mover, other in ((0, i, j), (1, j, i)):
            w = state.on_wall[other]
            _hang(problem, proposal, place, mover, w, _along(problem, w, state.pose[other, 0], state.pose[other, 1]))
    else:
        proposal.pose[0] = state.pose[j]
        proposal.pose[1] = state.pose[i]
    return 2


@njit(cache=True)
def _repoint(rng, problem, state, i, proposal):  # type: ignore[no-untyped-def]
    first, last = problem.candidate_first[i], problem.candidate_first[i + 1]
    if last - first < 2:
        return 0, 0.0
    old, new = state.slot[i], problem.candidate[first + _pick(rng, last - first)]
    turn = state.pose[i, 2] - state.pose[problem.slot_owner[old], 2]
    u = problem.slot[new, 3] * (2.0 * rng.random() - 1.0)
    v = problem.slot[new, 4] * (2.0 * rng.random() - 1.0)
    _put_on_slot(problem, state, proposal, new, u, v, turn)
    return 1, math.log(problem.slot[new, 3] * problem.slot[new, 4]) - math.log(problem.slot[old, 3] * problem.slot[old, 4])


@njit(cache=True)
def _shares(problem, state, settings, i):  # type: ignore[no-untyped-def]
    """Return the mixture's shares for object ``i``: uniform, wall, around."""
    wall = settings.wall if problem.wall_mode_first[i + 1] > problem.wall_mode_first[i] else 0.0
    core = problem.core[i]
    around = settings.around if core >= 0 and state.active[core] else 0.0
    if problem.mount[i] == OBJECT:
        around = settings.around
    if problem.mount[i] == CEILING and problem.centre[i] > 0.0:
        around = settings.around
    total = settings.uniform + wall + around
    return settings.uniform / total, wall / total, around / total


@njit(cache=True)
def _relocate(rng, problem, state, settings, i, proposal):  # type: ignore[no-untyped-def]
    if problem.mount[i] == WALL:
        _relocate_on_wall(rng, problem, state, settings, i, proposal)
        return
    if problem.mount[i] == OBJECT:
        _relocate_on_top(rng, problem, state, settings, i, proposal)
        return
    pose = proposal.pose[0]
    uniform, wall, _ = _shares(problem, state, settings, i)
    u = rng.random()
    if u < uniform:
        pose[0] = problem.bounds[0] + (problem.bounds[2] - problem.bounds[0]) * rng.random()
        pose[1] = problem.bounds[1] + (problem.bounds[3] - problem.bounds[1]) * rng.random()
        if problem.mount[i] == FLOOR:
            pose[2] = wrap(_TWO_PI * rng.random())
    elif u < uniform + wall:
        w = _wall_by_length(rng, problem.wall[:, 4])
        first = problem.wall_mode_first[i]
        mode = problem.wall_mode[first + _pick(rng, problem.wall_mode_first[i + 1] - first)]
        turn = _draw_yaw(rng, mode[1], settings.wall_yaw_sd)
        gap = mode[0] + settings.wall_gap_sd * rng.standard_normal()
        across = gap + problem.half[i, 0] * abs(math.cos(turn)) + problem.half[i, 1] * abs(math.sin(turn))
        along = problem.wall[w, 4] * rng.random()
        pose[0] = problem.wall[w, 0] + problem.wall[w, 2] * along + problem.wall[w, 5] * across
        pose[1] = problem.wall[w, 1] + problem.wall[w, 3] * along + problem.wall[w, 6] * across
        pose[2] = wrap(problem.wall_yaw[w] + turn)
    elif problem.mount[i] == CEILING:
        pose[0] = problem.middle[0] + settings.around_sd * rng.standard_normal()
        pose[1] = problem.middle[1] + settings.around_sd * rng.standard_normal()
    else:
        first, core = problem.around_first[i], state.pose[problem.core[i]]
        mode = problem.around[first + _pick(rng, problem.around_first[i + 1] - first)]
        x = mode[0] + settings.around_sd * rng.standard_normal()
        y = mode[1] + settings.around_sd * rng.standard_normal()
        c, s = math.cos(core[2]), math.sin(core[2])
        pose[0], pose[1] = core[0] + x * c - y * s, core[1] + x * s + y * c
        pose[2] = wrap(core[2] + _draw_yaw(rng, mode[2], settings.around_yaw_sd))


@njit(cache=True)
def _wall_by_length(rng, lengths):  # type: ignore[no-untyped-def]
    """Draw a wall with probability in proportion to its (free) length."""
    u = rng.random() * lengths.sum()
    for w in range(len(lengths)):
        u -= lengths[w]
        if u < 0.0:
            return w
    return np.argmax(lengths)


@njit(cache=True)
def _relocate_on_wall(rng, problem, state, settings, i, proposal):  # type: ignore[no-untyped-def]
    uniform = _shares(problem, state, settings, i)[0]
    half = problem.half[i, 1]
    if rng.random() < uniform:
        free = np.maximum(problem.wall[:, 4] - 2.0 * half, 0.0)
        w = _wall_by_length(rng, free)
        _hang(problem, proposal, 0, i, w, half + free[w] * rng.random())
    else:
        core, first = problem.core[i], problem.around_first[i]
        w = state.on_wall[core]
        mode = problem.around[first + _pick(rng, problem.around_first[i + 1] - first)]
        along = _along(problem, w, state.pose[core, 0], state.pose[core, 1]) - mode[1]
        _hang(problem, proposal, 0, i, w, along + settings.around_sd * rng.standard_normal())


@njit(cache=True)
def _relocate_on_top(rng, problem, state, settings, i, proposal):  # type: ignore[no-untyped-def]
    first = problem.candidate_first[i]
    slot = problem.candidate[first + _pick(rng, problem.candidate_first[i + 1] - first)]
    u = problem.slot[slot, 3] * (2.0 * rng.random() - 1.0)
    v = problem.slot[slot, 4] * (2.0 * rng.random() - 1.0)
    if rng.random() < _shares(problem, state, settings, i)[0]:
        _put_on_slot(problem, state, proposal, slot, u, v, _TWO_PI * rng.random())
        return
    k = problem.place_first[i] + _pick(rng, problem.place_first[i + 1] - problem.place_first[i])
    x, y = place_target(problem.place, k, problem.slot[slot, 3], problem.slot[slot, 4], problem.half[i, 0], problem.half[i, 1])
    u = u if math.isnan(x) else x + settings.place_sd * rng.standard_normal()
    v = v if math.isnan(y) else y + settings.place_sd * rng.standard_normal()
    _put_on_slot(problem, state, proposal, slot, u, v, _draw_yaw(rng, problem.place[k, 2], settings.around_yaw_sd))


@njit(cache=True)
def relocation_density(problem, state, settings, i, proposal):  # type: ignore[no-untyped-def]
    """Return the density with which a relocation of object ``i`` draws the pose in ``proposal``."""
    uniform, wall, around = _shares(problem, state, settings, i)
    x, y, yaw = proposal.pose[0]
    mount, density = problem.mount[i], 0.0
    if mount == WALL:
        free = np.maximum(problem.wall[:, 4] - 2.0 * problem.half[i, 1], 0.0).sum()
        density = uniform / free
        if around > 0.0 and state.on_wall[problem.core[i]] == proposal.on_wall[0]:
            core, w, first, last = problem.core[i], proposal.on_wall[0], problem.around_first[i], problem.around_first[i + 1]
            off = _along(problem, w, x, y) - _along(problem, w, state.pose[core, 0], state.pose[core, 1])
            for k in range(first, last):
                density += around / (last - first) * _normal_density(off + problem.around[k, 1], settings.around_sd)
        return density
    if mount == OBJECT:
        return _top_density(problem, state, settings, i, proposal, uniform)
    area = (problem.bounds[2] - problem.bounds[0]) * (problem.bounds[3] - problem.bounds[1])
    if mount == CEILING:
        near = _normal_density(x - problem.middle[0], settings.around_sd) * _normal_density(y - problem.middle[1], settings.around_sd)
        return uniform / area + around * near
    density = uniform / (area * _TWO_PI)
    if wall > 0.0:
        density += wall * _at_wall_density(problem, settings, i, x, y, yaw)
    if around > 0.0:
        first, last, core = problem.around_first[i], problem.around_first[i + 1], state.pose[problem.core[i]]
        c, s = math.cos(core[2]), math.sin(core[2])
        u, v = (x - core[0]) * c + (y - core[1]) * s, (y - core[1]) * c - (x - core[0]) * s
        for k in range(first, last):
            mode = problem.around[k]
            near = _normal_density(u - mode[0], settings.around_sd) * _normal_density(v - mode[1], settings.around_sd)
            density += around / (last - first) * near * _yaw_density(yaw - core[2], mode[2], settings.around_yaw_sd)
    return density


@njit(cache=True)
def _at_wall_density(problem, settings, i, x, y, yaw):  # type: ignore[no-untyped-def]
    density = 0.0
    for w in range(len(problem.wall)):
        wall, turn = problem.wall[w], yaw - problem.wall_yaw[w]
        if 0.0 <= _along(problem, w, x, y) <= wall[4]:
            across = (x - wall[0]) * wall[5] + (y - wall[1]) * wall[6]
            gap = across - problem.half[i, 0] * abs(math.cos(turn)) - problem.half[i, 1] * abs(math.sin(turn))
            for k in range(problem.wall_mode_first[i], problem.wall_mode_first[i + 1]):
                mode = problem.wall_mode[k]
                density += _normal_density(gap - mode[0], settings.wall_gap_sd) * _yaw_density(turn, mode[1], settings.wall_yaw_sd)
    count = problem.wall_mode_first[i + 1] - problem.wall_mode_first[i]
    return density / (count * problem.wall[:, 4].sum())


@njit(cache=True)
def _top_density(problem, state, settings, i, proposal, uniform):  # type: ignore[no-untyped-def]
    slot = proposal.slot[0]
    half_d, half_w = problem.slot[slot, 3], problem.slot[slot, 4]
    u, v = in_slot(state.pose, problem.slot_owner[slot], problem.slot, slot, proposal.pose[0, 0], proposal.pose[0, 1])
    turn = proposal.pose[0, 2] - state.pose[problem.slot_owner[slot], 2]
    density, modes = uniform / (4.0 * half_d * half_w * _TWO_PI), problem.place_first[i + 1] - problem.place_first[i]
    for k in range(problem.place_first[i], problem.place_first[i + 1]):
        x, y = place_target(problem.place, k, problem.slot[slot, 3], problem.slot[slot, 4], problem.half[i, 0], problem.half[i, 1])
        across = 0.5 / half_d if math.isnan(x) else _normal_density(u - x, settings.place_sd)
        along = 0.5 / half_w if math.isnan(y) else _normal_density(v - y, settings.place_sd)
        density += (1.0 - uniform) / modes * across * along * _yaw_density(turn, problem.place[k, 2], settings.around_yaw_sd)
    return density / (problem.candidate_first[i + 1] - problem.candidate_first[i])
