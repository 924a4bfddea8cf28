"""A run that is to be placed at walls, and how much of a corner of the room its units take."""

from __future__ import annotations

from typing import NamedTuple

from grammar.derivation.drafts import Draft
from grammar.derivation.run_shell import Aisle, Shell
from grammar.derivation.run_units import reach_m
from grammar.spec.run_rules import HANGING_LOW_M, RunRule

_DEEPER_M = 0.03
"""By how much a unit beside a corner may reach further into the room than the one that fills it."""

_EVEN_M, _ROUNDING_M = 0.0005, 1e-9


class WallRun(NamedTuple):
    """A run that is to be placed: its units at walls, those of them that turn, and those that jut out.

    taken: what other runs keep free; hanging: all that hangs in line above some run.
    """

    rule: RunRule
    shell: Shell
    units: list[Draft]
    turning: list[Draft]
    juts: list[Draft]
    taken: tuple[Aisle, ...]
    hanging: list[Draft]

    @property
    def corner_m(self) -> float:
        """Return how far a leg keeps off a corner on that side where the units of the other leg pass: the reach of the deepest of them."""
        side = self.side_m
        deeper = (reach_m(unit) for unit in self.units if unit.size_m[2] < HANGING_LOW_M)
        return max((reach for reach in deeper if side + _EVEN_M < reach < side + _DEEPER_M), default=side) if self.turning else 0.0

    @property
    def side_m(self) -> float:
        """Return the depth of the units that turn."""
        return max((unit.size_m[0] for unit in self.turning), default=0.0)

    @property
    def corners_m(self) -> tuple[float, float]:
        """Return how far from a corner the leg after it begins where the walk follows the numbers of the walls, and where it does not."""
        return self.corner_m, self.corner_m if self.is_square else max(unit.size_m[1] for unit in self.turning)

    @property
    def is_square(self) -> bool:
        """Return whether both sides of all units that turn take as much of the walls, so that the run can be walked either way."""
        return all(abs(unit.size_m[1] - self.corner_m) < _ROUNDING_M for unit in self.turning)

    @property
    def jut_m(self) -> float:
        """Return the depth of the units that jut out."""
        return max((unit.size_m[0] for unit in self.juts), default=0.0)
