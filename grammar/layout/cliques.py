"""How many cliques of each kind a layout problem has, which tells what an observed room can teach."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from grammar.layout import columns as col
from grammar.layout.problem import Problem
from grammar.spec.energy_terms import Cliques


def _walls(problem: Problem) -> int:
    """Return the number of objects with modes at walls."""
    return int((problem.link[:, col.AROUND_MODES] > problem.link[:, col.WALL_MODES]).sum())


def _groups(problem: Problem) -> int:
    """Return the number of objects with a core object."""
    return int((problem.core >= 0).sum())


def _supports(problem: Problem) -> int:
    """Return the number of objects that may stand on an object."""
    return int((problem.link[:, col.MODE_END] > problem.link[:, col.TARGETS]).sum())


def _zones(problem: Problem) -> int:
    """Return the number of zones to be kept free."""
    return int((problem.link[:, col.STRIPS] - problem.link[:, col.ZONES]).sum())


def _centres(problem: Problem) -> int:
    """Return the number of objects that are drawn to the centroid of the floor."""
    return int((problem.object[:, col.CENTRED] > 0.0).sum())


COUNTERS: Mapping[Cliques, Callable[[Problem], int]] = {
    "wall": _walls,
    "group": _groups,
    "support": _supports,
    "zone": _zones,
    "centre": _centres,
}
"""Kind of clique -> its number in a problem."""
