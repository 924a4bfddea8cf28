"""How an object comes into a layout: at the best of some poses drawn from the relocation's mixture."""

from __future__ import annotations

import numpy as np

from grammar.geometry.kernels import kernel, making_arrays
from grammar.layout import columns as col
from grammar.layout.energies import local_energy
from grammar.layout.moves import RELOCATE, propose
from grammar.layout.problem import Problem, State
from grammar.layout.proposal import MoveSettings, empty_proposal
from grammar.layout.rigid_moves import apply_move, nothing_moved

_FURTHER = 200
"""Poses that are drawn for an object of which none lay in the room before it counts as one that cannot come in."""


def enter(rng: np.random.Generator, problem: Problem, state: State, settings: MoveSettings, i: int, starts: int) -> bool:
    """Bring object ``i`` in at the best of ``starts`` poses drawn from the relocation's mixture; return whether any was possible.

    Beside a core at the edge of the room, or at the end of its wall, most poses lie outside; where all do, more are drawn until one
    does not.
    """
    work = empty_proposal(), nothing_moved(problem), np.zeros(len(problem.weight))
    return bool(_enter(rng, problem, state, settings, int(i), starts, *work))


@making_arrays
def _enter(rng, problem, state, settings, i, starts, proposal, moved, energy):  # type: ignore[no-untyped-def]
    """Put object ``i`` at the best of ``starts`` poses; the best one so far is kept in the proposal's second place."""
    members, best, one = moved.members, np.inf, np.int64(1)
    members[0], moved.leader[0], moved.mark[i], state.hold[i, col.ACTIVE] = i, 0, 1, 1
    # A relocation's density is asked for the pose at hand too, so the object needs some support or wall to begin with.
    if problem.link[i, col.MOUNT] == col.OBJECT:
        state.hold[i, col.SURFACE] = int(problem.mode[problem.link[i, col.TARGETS], col.TARGET])
    if problem.link[i, col.MOUNT] == col.WALL:
        state.hold[i, col.ON_WALL] = 0
    # Draw poses, and keep the one of least energy.
    for drawn in range(starts + _FURTHER):
        if drawn >= starts and best < np.inf:
            break
        if propose(rng, problem, state, settings, np.int64(RELOCATE), i, members, proposal)[0] == 0:
            continue
        apply_move(problem, state, proposal, one, moved)
        total = local_energy(problem, state, members, one, moved.mark, best, energy)
        if total < best:
            best = total
            _copy_place(proposal, 0, 1)
    moved.mark[i] = 0
    if best == np.inf:
        state.hold[i, col.ACTIVE] = 0
        return False
    _copy_place(proposal, 1, 0)
    apply_move(problem, state, proposal, one, moved)
    return True


@kernel
def _copy_place(proposal, source, target):  # type: ignore[no-untyped-def]
    """Copy one of the two poses of a proposal over the other."""
    for k in range(3):
        proposal.pose[target, k], proposal.tag[target, k] = proposal.pose[source, k], proposal.tag[source, k]
