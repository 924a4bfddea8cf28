"""The Metropolis-Hastings chain over layouts: one compiled loop, each proposal judged by the cliques that it touches.

A proposal is accepted with probability ``min(1, exp(beta (E_old - E_new)) q(old | new) / q(new | old))`` (Jiang et al., IJCV 2018, section
3.2).  What stands on a moved object moves along rigidly, and, when the draw says so, what is grouped around it too; a rigid motion
keeps volume, so it adds nothing to the ratio.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from grammar.energies import full_energy, local_energy, place_object, wrap
from grammar.layout import FIXED, FLOOR, OBJECT, WALL
from grammar.moves import RELOCATE, empty_proposal, propose
from grammar.rules import HARD_TERMS


class Goal(NamedTuple):
    """How a chain runs and what it keeps.

    Tidiness grows geometrically from ``beta_first`` to ``beta_last``; a layout is feasible when none of its hard losses exceeds
    ``tolerance``; ``keep_best``: of the feasible layouts the one of least energy is kept, else the last one.
    """

    beta_first: float
    beta_last: float
    tolerance: float
    keep_best: bool


make_proposal = njit(cache=True)(empty_proposal)


@njit(cache=True)
def gather(problem, state, i, leader, carry, members, leader_of, count, marked):  # type: ignore[no-untyped-def]
    """Append object ``i`` and everything that moves along with it to ``members``; return their new count, or -1 if two leaders meet."""
    if marked[i]:
        return -1
    first = count
    members[count], leader_of[count], marked[i] = i, leader, True
    count += 1
    while first < count:
        owner = members[first]
        first += 1
        for j in range(len(problem.mount)):
            if not state.active[j] or problem.mount[j] == FIXED:
                continue
            stands = problem.mount[j] == OBJECT and problem.slot_owner[state.slot[j]] == owner
            grouped = carry and problem.mount[j] == FLOOR and problem.core[j] == owner
            if stands or grouped:
                if marked[j]:
                    return -1
                members[count], leader_of[count], marked[j] = j, leader, True
                count += 1
    return count


@njit(cache=True)
def apply_proposal(problem, state, proposal, members, leader_of, count):  # type: ignore[no-untyped-def]
    """Write the leaders' new poses and move their followers rigidly."""
    old = np.empty((2, 4))
    for m in range(count):
        i, place = members[m], leader_of[m]
        if proposal.who[place] == i:
            old[place, :3], old[place, 3] = state.pose[i], state.z[i]
            state.pose[i] = proposal.pose[place]
            state.on_wall[i] = proposal.on_wall[place]
            state.slot[i] = proposal.slot[place]
            if problem.mount[i] == OBJECT:
                state.z[i] = state.z[problem.slot_owner[state.slot[i]]] + problem.slot[state.slot[i], 2]
        else:
            new = proposal.pose[place]
            turn = new[2] - old[place, 2]
            c, s = math.cos(turn), math.sin(turn)
            dx, dy = state.pose[i, 0] - old[place, 0], state.pose[i, 1] - old[place, 1]
            state.pose[i, 0], state.pose[i, 1] = new[0] + dx * c - dy * s, new[1] + dx * s + dy * c
            state.pose[i, 2] = wrap(state.pose[i, 2] + turn)
            state.z[i] += state.z[proposal.who[place]] - old[place, 3]
        place_object(problem, state, i)


@njit(cache=True)
def copy_layout(source, target):  # type: ignore[no-untyped-def]
    """Copy the poses of one state into another (not the boxes that follow from them)."""
    target.pose[:] = source.pose
    target.z[:] = source.z
    target.slot[:] = source.slot
    target.on_wall[:] = source.on_wall
    target.active[:] = source.active


@njit(cache=True)
def enter(rng, problem, state, settings, i, starts):  # type: ignore[no-untyped-def]
    """Bring object ``i`` in at the best of ``starts`` poses drawn from the relocation's mixture; return whether any was possible."""
    n = len(problem.mount)
    marked, members, proposal = np.zeros(n, np.bool_), np.array([i]), make_proposal()
    leader_of, energy = np.zeros(1, np.int64), np.zeros(len(problem.weight))
    best_pose, best_slot, best_wall, best = np.zeros(3), -1, -1, np.inf
    marked[i], state.active[i] = True, True
    move, count = np.int64(RELOCATE), len(members)
    if problem.mount[i] == OBJECT:
        state.slot[i] = problem.candidate[problem.candidate_first[i]]
    if problem.mount[i] == WALL:
        state.on_wall[i] = 0
    for _ in range(starts):
        if propose(rng, problem, state, settings, move, i, members, proposal)[0] == 0:
            continue
        apply_proposal(problem, state, proposal, members, leader_of, count)
        local_energy(problem, state, members, count, marked, energy)
        total = (energy * problem.weight).sum()
        if total < best:
            best, best_slot, best_wall = total, state.slot[i], state.on_wall[i]
            best_pose[:] = state.pose[i]
    if best == np.inf:
        state.active[i] = False
        return False
    proposal.who[0], proposal.slot[0], proposal.on_wall[0] = i, best_slot, best_wall
    proposal.pose[0] = best_pose
    apply_proposal(problem, state, proposal, members, leader_of, count)
    return True


@njit(cache=True)
def followers_in_room(problem, state, members, count):  # type: ignore[no-untyped-def]
    """Return whether what was carried along is still in the space of poses, the room's bounding box."""
    for m in range(count):
        i = members[m]
        if problem.mount[i] == FLOOR:
            x, y = state.pose[i, 0], state.pose[i, 1]
            if not (problem.bounds[0] <= x <= problem.bounds[2] and problem.bounds[1] <= y <= problem.bounds[3]):
                return False
    return True


@njit(cache=True)
def run_chain(rng, problem, state, settings, goal, movable, proposals, kept, counts):  # type: ignore[no-untyped-def]
    """Run the chain and keep a feasible layout.

    Args:
        rng: np.random.Generator, advanced.
        problem: the layout problem.
        state: written in place.
        settings: of the moves.
        goal: tidiness and what to keep.
        movable: (k,) int64 indices of the objects that lead moves.
        proposals: how many.
        kept: state that receives its poses.
        counts: (6, 2) int64, proposals and acceptances by move are added.

    Returns:
        whether ``kept`` was written; energy: (t,) losses of ``state`` as the steps added them up.
    """
    n, found, best = len(problem.mount), False, np.inf
    energy = full_energy(problem, state)
    before, after = np.zeros(len(energy)), np.zeros(len(energy))
    members, leader_of, marked = np.zeros(n, np.int64), np.zeros(n, np.int64), np.zeros(n, np.bool_)
    saved_pose, saved_z, saved_slot, saved_wall = np.zeros((n, 3)), np.zeros(n), np.zeros(n, np.int64), np.zeros(n, np.int64)
    proposal = make_proposal()
    ratio = (goal.beta_last / goal.beta_first) ** (1.0 / max(proposals - 1, 1))
    beta, fresh = goal.beta_first, True
    for step in range(proposals):
        if step > 0:
            beta *= ratio
        move = min(np.searchsorted(settings.cumulative, rng.random(), side="right"), len(settings.cumulative) - 1)
        i = movable[min(int(rng.random() * len(movable)), len(movable) - 1)]
        carry = rng.random() < settings.carry
        threshold = math.log(max(rng.random(), 1e-300))
        counts[move, 0] += 1
        leaders, log_q_ratio = propose(rng, problem, state, settings, move, i, movable, proposal)
        count = 0
        for place in range(leaders):
            if count >= 0:
                count = gather(problem, state, proposal.who[place], place, carry, members, leader_of, count, marked)
        if leaders > 0 and count > 0:
            local_energy(problem, state, members, count, marked, before)
            for m in range(count):
                k = members[m]
                saved_pose[m], saved_z[m], saved_slot[m], saved_wall[m] = state.pose[k], state.z[k], state.slot[k], state.on_wall[k]
            apply_proposal(problem, state, proposal, members, leader_of, count)
            local_energy(problem, state, members, count, marked, after)
            change = ((after - before) * problem.weight).sum()
            if threshold < log_q_ratio - beta * change and followers_in_room(problem, state, members, count):
                counts[move, 1] += 1
                energy += after - before
                fresh = True
            else:
                for m in range(count):
                    k = members[m]
                    state.pose[k], state.z[k], state.slot[k], state.on_wall[k] = saved_pose[m], saved_z[m], saved_slot[m], saved_wall[m]
                    place_object(problem, state, k)
        marked[:] = False
        if fresh:
            fresh = False
            feasible = True
            for term in range(HARD_TERMS):
                feasible &= energy[term] <= goal.tolerance
            if feasible:
                total = (energy * problem.weight).sum() if goal.keep_best else 0.0
                if not goal.keep_best or total < best:
                    found, best = True, total
                    copy_layout(state, kept)
    return found, energy
