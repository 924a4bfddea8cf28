"""The nodes of the And-Or graph and their branches."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from grammar.spec.run_rules import UnitRowRule
from grammar.spec.values import Probability, Symbol
from scene_description import Limits


@dataclass(frozen=True, slots=True, kw_only=True)
class Branch:
    """One branch of a node.

    Branches of an Or node have a ``probability``, those of a Set node the probabilities of 0, 1, ... copies (``multiplicity``), those of an
    And node neither.
    """

    symbol: Symbol
    probability: Probability | None = None
    multiplicity: Annotated[tuple[Probability, ...], Limits(min_length=1, max_length=64)] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Node:
    """An And, Or or Set node; with ``run`` the objects below it that stand on the floor make a run."""

    kind: Literal["and", "or", "set"]
    branches: Annotated[tuple[Branch, ...], Limits(min_length=1, max_length=256)]
    run: UnitRowRule | None = None
