"""The relocation: a pose drawn afresh from a mixture of a uniform pose, poses at walls and poses around the core or on a top.

An object's modes are drawn by their probabilities, and widths grow with a mode's spread.  The mixture's
density is computed for any pose, which the Hastings ratio needs.  A pose's base measure is area times angle (length along the walls for
what hangs there), over the bounding box of the room, the walls, or the tops.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from grammar.geometry.kernels import INNER
from grammar.layout.energies import in_slot, place_target, wrap
from grammar.layout.problem import (
    ACTIVE,
    AROUND,
    BOUNDS,
    CANDIDATE,
    CEILING,
    CENTRE,
    CORE,
    FLOOR,
    HALF_DEPTH,
    HALF_WIDTH,
    MIDDLE,
    MODE_END,
    MOUNT,
    NEAR,
    OBJECT,
    PLACE,
    SHARE,
    SLOT_HALF_DEPTH,
    SLOT_HALF_WIDTH,
    SLOT_OWNER,
    STRAIGHT,
    WALL,
    WALL_MODE,
)
from grammar.layout.proposal import (
    AROUND_SD,
    AROUND_YAW_SD,
    AT_CORE,
    AT_WALL,
    NEW_SLOT,
    NEW_WALL,
    PLACE_SD,
    UNIFORM,
    WALL_GAP_SD,
    WALL_YAW_SD,
    along_wall,
    hang,
    pick,
    put_on_slot,
    wall_of_core,
)

_TWO_PI = 2.0 * math.pi
_LEAST_LENGTH_M = 1e-9


@njit(**INNER)
def _normal_density(x, sd):  # type: ignore[no-untyped-def]
    return math.exp(-0.5 * (x / sd) ** 2) / (sd * math.sqrt(_TWO_PI))


@njit(**INNER)
def _yaw_density(angle, mean, sd):  # type: ignore[no-untyped-def]
    """Return the density of a wrapped normal (narrow: sd is far below pi), or of a uniform angle where the mean is NaN."""
    return 1.0 / _TWO_PI if math.isnan(mean) else _normal_density(wrap(angle - mean), sd)


@njit(**INNER)
def _draw_yaw(rng, mean, sd):  # type: ignore[no-untyped-def]
    return _TWO_PI * rng.random() if math.isnan(mean) else mean + sd * rng.standard_normal()


@njit(**INNER)
def _draw_mode(rng, mode, first, end):  # type: ignore[no-untyped-def]
    """Draw one of an object's modes by their probabilities; there is at least one."""
    u, k = rng.random(), first
    while k < end - 1 and u >= mode[k, SHARE]:
        u -= mode[k, SHARE]
        k += 1
    return k


@njit(**INNER)
def _free_length(problem, i):  # type: ignore[no-untyped-def]
    """Return the summed length of wall that the middle of object ``i`` can take."""
    total = 0.0
    for w in range(len(problem.wall)):
        total += max(problem.wall[w, 4] - 2.0 * problem.object[i, HALF_WIDTH], 0.0)
    return total


@njit(**INNER)
def _follows(problem, core):  # type: ignore[no-untyped-def]
    """Return whether what hangs and belongs to ``core`` stays on the wall behind that."""
    return core >= 0 and problem.link[core, MOUNT] == FLOOR


@njit(**INNER)
def _draw_wall(rng, problem, margin):  # type: ignore[no-untyped-def]
    """Draw a wall with probability in proportion to its length less ``margin``, and a place that far from the wall's start and end."""
    total, longest = 0.0, 0
    for w in range(len(problem.wall)):
        total += max(problem.wall[w, 4] - margin, 0.0)
        if problem.wall[w, 4] > problem.wall[longest, 4]:
            longest = w
    u, chosen = rng.random() * total, longest
    for w in range(len(problem.wall)):
        u -= max(problem.wall[w, 4] - margin, 0.0)
        if u < 0.0:
            chosen = w
            break
    return chosen, 0.5 * margin + max(problem.wall[chosen, 4] - margin, 0.0) * rng.random()


@njit(**INNER)
def _shares(problem, state, settings, i):  # type: ignore[no-untyped-def]
    """Return the mixture's shares for object ``i``: uniform, wall, around."""
    link, number, core, mount = problem.link, settings.number, problem.link[i, CORE], problem.link[i, MOUNT]
    wall = number[AT_WALL] if link[i, AROUND] > link[i, WALL_MODE] else 0.0
    near = (core >= 0 and state.hold[core, ACTIVE]) or mount == OBJECT or (mount == CEILING and problem.object[i, CENTRE] > 0.0)
    around = number[AT_CORE] if near else 0.0
    total = number[UNIFORM] + wall + around
    return number[UNIFORM] / total, wall / total, around / total


@njit(**INNER)
def relocate(rng, problem, state, settings, i, proposal):  # type: ignore[no-untyped-def]
    """Draw a pose for object ``i``."""
    link, mode, number, pose, mount = problem.link, problem.mode, settings.number, proposal.pose, problem.link[i, MOUNT]
    core, first, end = link[i, CORE], link[i, AROUND], link[i, PLACE]
    half_d, half_w = problem.object[i, HALF_DEPTH], problem.object[i, HALF_WIDTH]
    uniform, wall, _ = _shares(problem, state, settings, i)
    if mount == OBJECT:
        _relocate_on_top(rng, problem, state, settings, i, proposal, uniform)
        return
    u = rng.random()
    if mount == WALL:
        if u < uniform and _follows(problem, core):
            w = wall_of_core(problem, state, core)
            along = half_w + max(problem.wall[w, 4] - 2.0 * half_w, 0.0) * rng.random()
        elif u < uniform:
            w, along = _draw_wall(rng, problem, 2.0 * half_w)
        else:
            w, k = wall_of_core(problem, state, core), _draw_mode(rng, mode, first, end)
            along = along_wall(problem.wall, w, state.where[core, 0], state.where[core, 1]) - mode[k, 1]
            along += number[AROUND_SD] / mode[k, NEAR] * rng.standard_normal()
        hang(problem, proposal, np.int64(0), i, w, along)
    elif u < uniform:
        low_x, low_y = problem.number[BOUNDS], problem.number[BOUNDS + 1]
        pose[0, 0] = low_x + (problem.number[BOUNDS + 2] - low_x) * rng.random()
        pose[0, 1] = low_y + (problem.number[BOUNDS + 3] - low_y) * rng.random()
        if mount == FLOOR:
            pose[0, 2] = wrap(_TWO_PI * rng.random())
    elif u < uniform + wall:
        w, along = _draw_wall(rng, problem, 0.0)
        k = _draw_mode(rng, mode, link[i, WALL_MODE], first)
        turn = _draw_yaw(rng, mode[k, 1], number[WALL_YAW_SD] / mode[k, STRAIGHT])
        across = mode[k, 0] + number[WALL_GAP_SD] / mode[k, NEAR] * rng.standard_normal()
        across += half_d * abs(math.cos(turn)) + half_w * abs(math.sin(turn))
        pose[0, 0] = problem.wall[w, 0] + problem.wall[w, 2] * along + problem.wall[w, 5] * across
        pose[0, 1] = problem.wall[w, 1] + problem.wall[w, 3] * along + problem.wall[w, 6] * across
        pose[0, 2] = wrap(problem.wall[w, 7] + turn)
    elif mount == CEILING:
        pose[0, 0] = problem.number[MIDDLE] + number[AROUND_SD] * rng.standard_normal()
        pose[0, 1] = problem.number[MIDDLE + 1] + number[AROUND_SD] * rng.standard_normal()
    else:
        k = _draw_mode(rng, mode, first, end)
        sd = number[AROUND_SD] / mode[k, NEAR]
        x, y = mode[k, 0] + sd * rng.standard_normal(), mode[k, 1] + sd * rng.standard_normal()
        yaw = state.where[core, 2]
        c, s = math.cos(yaw), math.sin(yaw)
        pose[0, 0], pose[0, 1] = state.where[core, 0] + x * c - y * s, state.where[core, 1] + x * s + y * c
        pose[0, 2] = wrap(yaw + _draw_yaw(rng, mode[k, 2], number[AROUND_YAW_SD] / mode[k, STRAIGHT]))


@njit(**INNER)
def _relocate_on_top(rng, problem, state, settings, i, proposal, uniform):  # type: ignore[no-untyped-def]
    link, number, first = problem.link, settings.number, problem.link[i, CANDIDATE]
    slot = int(problem.mode[first + pick(rng, link[i, MODE_END] - first), 0])
    u = problem.slot[slot, SLOT_HALF_DEPTH] * (2.0 * rng.random() - 1.0)
    v = problem.slot[slot, SLOT_HALF_WIDTH] * (2.0 * rng.random() - 1.0)
    if rng.random() < uniform:
        turn = _TWO_PI * rng.random()
    else:
        k = _draw_mode(rng, problem.mode, link[i, PLACE], first)
        x, y = place_target(problem, i, k, slot)
        sd = number[PLACE_SD] / problem.mode[k, NEAR]
        if not math.isnan(x):
            u = x + sd * rng.standard_normal()
        if not math.isnan(y):
            v = y + sd * rng.standard_normal()
        turn = _draw_yaw(rng, problem.mode[k, 2], number[AROUND_YAW_SD] / problem.mode[k, STRAIGHT])
    put_on_slot(problem, state, proposal, slot, u, v, turn)


@njit(**INNER)
def relocation_density(problem, state, settings, i, proposal):  # type: ignore[no-untyped-def]
    """Return the density with which a relocation of object ``i`` draws the pose in ``proposal``."""
    link, mode, number, mount = problem.link, problem.mode, settings.number, problem.link[i, MOUNT]
    core, first, last = link[i, CORE], link[i, AROUND], link[i, PLACE]
    uniform, wall, around = _shares(problem, state, settings, i)
    if mount == OBJECT:
        return _top_density(problem, state, settings, i, proposal, uniform)
    x, y, yaw = proposal.pose[0, 0], proposal.pose[0, 1], proposal.pose[0, 2]
    if mount == WALL:
        w = proposal.tag[0, NEW_WALL]
        length = problem.wall[w, 4] - 2.0 * problem.object[i, HALF_WIDTH] if _follows(problem, core) else _free_length(problem, i)
        density = uniform / max(length, _LEAST_LENGTH_M)
        if around > 0.0 and wall_of_core(problem, state, core) == w:
            off = along_wall(problem.wall, w, x, y) - along_wall(problem.wall, w, state.where[core, 0], state.where[core, 1])
            for k in range(first, last):
                density += around * mode[k, SHARE] * _normal_density(off + mode[k, 1], number[AROUND_SD] / mode[k, NEAR])
        return density
    bounds = problem.number
    area = (bounds[BOUNDS + 2] - bounds[BOUNDS]) * (bounds[BOUNDS + 3] - bounds[BOUNDS + 1])
    if mount == CEILING:
        dx, dy = x - bounds[MIDDLE], y - bounds[MIDDLE + 1]
        return uniform / area + around * _normal_density(dx, number[AROUND_SD]) * _normal_density(dy, number[AROUND_SD])
    density = uniform / (area * _TWO_PI)
    if wall > 0.0:
        density += wall * _at_wall_density(problem, settings, i, x, y, yaw)
    if around > 0.0:
        dx, dy, core_yaw = x - state.where[core, 0], y - state.where[core, 1], state.where[core, 2]
        c, s = math.cos(core_yaw), math.sin(core_yaw)
        for k in range(first, last):
            u, v = dx * c + dy * s - mode[k, 0], dy * c - dx * s - mode[k, 1]
            sd = number[AROUND_SD] / mode[k, NEAR]
            near = around * mode[k, SHARE] * _normal_density(math.sqrt(u * u + v * v), sd) / (sd * math.sqrt(_TWO_PI))
            if near > 0.0:
                density += near * _yaw_density(yaw - core_yaw, mode[k, 2], number[AROUND_YAW_SD] / mode[k, STRAIGHT])
    return density


@njit(**INNER)
def _at_wall_density(problem, settings, i, x, y, yaw):  # type: ignore[no-untyped-def]
    wall, mode, first, last = problem.wall, problem.mode, problem.link[i, WALL_MODE], problem.link[i, AROUND]
    density, length, c, s = 0.0, 0.0, math.cos(yaw), math.sin(yaw)
    gap_sd, yaw_sd = settings.number[WALL_GAP_SD], settings.number[WALL_YAW_SD]
    for w in range(len(wall)):
        nx, ny = wall[w, 5], wall[w, 6]
        length += wall[w, 4]
        if 0.0 <= along_wall(wall, w, x, y) <= wall[w, 4]:
            across = (x - wall[w, 0]) * nx + (y - wall[w, 1]) * ny
            gap = across - problem.object[i, HALF_DEPTH] * abs(c * nx + s * ny) - problem.object[i, HALF_WIDTH] * abs(s * nx - c * ny)
            for k in range(first, last):
                off, sd = gap - mode[k, 0], gap_sd / mode[k, NEAR]
                if abs(off) < 40.0 * sd:
                    turn = _yaw_density(yaw - wall[w, 7], mode[k, 1], yaw_sd / mode[k, STRAIGHT])
                    density += mode[k, SHARE] * _normal_density(off, sd) * turn
    return density / length


@njit(**INNER)
def _top_density(problem, state, settings, i, proposal, uniform):  # type: ignore[no-untyped-def]
    link, number, slot = problem.link, settings.number, proposal.tag[0, NEW_SLOT]
    half_d, half_w = problem.slot[slot, SLOT_HALF_DEPTH], problem.slot[slot, SLOT_HALF_WIDTH]
    u, v = in_slot(problem, state, slot, proposal.pose[0, 0], proposal.pose[0, 1])
    turn = proposal.pose[0, 2] - state.where[int(problem.slot[slot, SLOT_OWNER]), 2]
    density, mode = uniform / (4.0 * half_d * half_w * _TWO_PI), problem.mode
    for k in range(link[i, PLACE], link[i, CANDIDATE]):
        x, y = place_target(problem, i, k, slot)
        sd = number[PLACE_SD] / mode[k, NEAR]
        across = 0.5 / half_d if math.isnan(x) else _normal_density(u - x, sd)
        along = 0.5 / half_w if math.isnan(y) else _normal_density(v - y, sd)
        turned = _yaw_density(turn, mode[k, 2], number[AROUND_YAW_SD] / mode[k, STRAIGHT])
        density += (1.0 - uniform) * mode[k, SHARE] * across * along * turned
    return density / (link[i, MODE_END] - link[i, CANDIDATE])
