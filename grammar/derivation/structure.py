"""The structure of a derivation: Or choices and Set multiplicities, drawn from the root down."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal, NamedTuple, Protocol

import numpy as np

from grammar.derivation.densities import draw_index
from grammar.spec.rules import Branch, Grammar, Node

Kind = Literal["and", "or", "set", "terminal"]


class Choice(NamedTuple):
    """One vertex of the derivation: symbol, kind, index of its parent (-1: the scene), the branch taken and its log-probability."""

    symbol: str
    kind: Kind
    parent: int
    choice: str
    log_probability: float


class Chooser(Protocol):
    """Makes the choices of a derivation, in depth-first order, and is told what comes when."""

    def leaf(self, symbol: str) -> None:
        """An object was reached."""

    def branch(self, node: Node) -> int:
        """Return the branch of an Or node."""

    def copies(self, branch: Branch) -> int:
        """Return the number of copies of a Set node's branch."""

    def begin(self, following: Sequence[Branch]) -> None:
        """A branch of an And or Set node comes; ``following`` come after it."""

    def begin_copy(self, symbol: str, following: int) -> None:
        """A copy of a Set node's branch comes; so many come after it."""

    def end(self) -> None:
        """What the last beginning announced is done."""


class _Free:
    """Chooses by the grammar's probabilities alone."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng

    def leaf(self, symbol: str) -> None:
        """Objects make no difference."""

    def branch(self, node: Node) -> int:
        return draw_index(self._rng, [branch.probability or 0.0 for branch in node.branches])

    def copies(self, branch: Branch) -> int:
        return draw_index(self._rng, branch.multiplicity or ())

    def begin(self, following: Sequence[Branch]) -> None:
        """What follows makes no difference."""

    def begin_copy(self, symbol: str, following: int) -> None:
        """What follows makes no difference."""

    def end(self) -> None:
        """Nothing was begun."""


def draw_structure(grammar: Grammar, rng: np.random.Generator) -> list[Choice]:
    """Return the vertices of one structure in depth-first order; its terminals are the objects of the room."""
    vertices: list[Choice] = []
    expand(grammar, _Free(rng), grammar.root, -1, vertices)
    return vertices


def expand(grammar: Grammar, chooser: Chooser, symbol: str, parent: int, out: list[Choice]) -> None:
    """Append the vertices below and with ``symbol`` to ``out``, with the grammar's log-probabilities of the choices made."""
    node = grammar.nodes.get(symbol)
    index = len(out)
    if node is None:
        chooser.leaf(symbol)
        out.append(Choice(symbol, "terminal", parent, grammar.objects[symbol].category, 0.0))
        return
    if node.kind == "or":
        branch = node.branches[chooser.branch(node)]
        out.append(Choice(symbol, "or", parent, branch.symbol, math.log(branch.probability or 1.0)))
        expand(grammar, chooser, branch.symbol, index, out)
        return
    out.append(Choice(symbol, node.kind, parent, "", 0.0))
    for place, branch in enumerate(node.branches):
        chooser.begin(node.branches[place + 1 :])
        if branch.multiplicity is None:
            expand(grammar, chooser, branch.symbol, index, out)
        else:
            _expand_copies(grammar, chooser, branch, index, out)
        chooser.end()


def _expand_copies(grammar: Grammar, chooser: Chooser, branch: Branch, parent: int, out: list[Choice]) -> None:
    assert branch.multiplicity is not None
    copies = chooser.copies(branch)
    index = len(out)
    out.append(Choice(branch.symbol, "set", parent, str(copies), math.log(branch.multiplicity[copies])))
    for copy in range(copies):
        chooser.begin_copy(branch.symbol, copies - 1 - copy)
        expand(grammar, chooser, branch.symbol, index, out)
        chooser.end()
