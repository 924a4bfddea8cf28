"""The structure of a derivation: branches of Or nodes and multiplicities of Set nodes, drawn from the root down."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal, NamedTuple, Protocol

import numpy as np

from grammar.derivation.densities import draw_index
from grammar.spec.rules import Branch, Grammar, Node

Kind = Literal["and", "or", "set", "terminal"]


class Vertex(NamedTuple):
    """One vertex of the derivation: symbol, kind, index of its parent (-1: the scene), the choice made and its log-probability."""

    symbol: str
    kind: Kind
    parent: int
    choice: str
    log_probability: float


class Chooser(Protocol):
    """Makes the choices of a derivation in depth-first order, and is told when a branch or a copy begins and ends."""

    def terminal(self, symbol: str) -> None:
        """Note that a regular terminal was reached."""

    def branch(self, node: Node) -> int:
        """Return the branch of an Or node."""

    def copies(self, branch: Branch) -> int:
        """Return the number of copies of a Set node's branch."""

    def begin(self, following: Sequence[Branch]) -> None:
        """Note that a branch of an And or Set node begins; ``following`` come after it."""

    def begin_copy(self, symbol: str, following: int) -> None:
        """Note that a copy of a Set node's branch begins; ``following`` more copies come after it."""

    def end(self) -> None:
        """Note that the branch or copy that began last has ended."""


class _Unconditional:
    """Draws by the grammar's probabilities alone."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng

    def terminal(self, symbol: str) -> None:
        """Do nothing: the probabilities do not depend on what was drawn."""

    def branch(self, node: Node) -> int:
        return draw_index(self._rng, [branch.probability or 0.0 for branch in node.branches])

    def copies(self, branch: Branch) -> int:
        return draw_index(self._rng, branch.multiplicity or ())

    def begin(self, following: Sequence[Branch]) -> None:
        """Do nothing: the probabilities do not depend on what follows."""

    def begin_copy(self, symbol: str, following: int) -> None:
        """Do nothing: the probabilities do not depend on what follows."""

    def end(self) -> None:
        """Do nothing."""


def draw_structure(grammar: Grammar, rng: np.random.Generator) -> list[Vertex]:
    """Return the vertices of one structure in depth-first order; its terminals are the objects of the room."""
    vertices: list[Vertex] = []
    expand(grammar, _Unconditional(rng), grammar.root, -1, vertices)
    return vertices


def expand(grammar: Grammar, chooser: Chooser, symbol: str, parent: int, out: list[Vertex]) -> None:
    """Append the vertex of ``symbol`` and all below it to ``out``, with the grammar's log-probabilities of the choices made."""
    node = grammar.nodes.get(symbol)
    index = len(out)
    if node is None:
        chooser.terminal(symbol)
        out.append(Vertex(symbol, "terminal", parent, grammar.objects[symbol].category, 0.0))
        return
    if node.kind == "or":
        branch = node.branches[chooser.branch(node)]
        out.append(Vertex(symbol, "or", parent, branch.symbol, math.log(branch.probability or 1.0)))
        expand(grammar, chooser, branch.symbol, index, out)
        return
    out.append(Vertex(symbol, node.kind, parent, "", 0.0))
    for place, branch in enumerate(node.branches):
        chooser.begin(node.branches[place + 1 :])
        if branch.multiplicity is None:
            expand(grammar, chooser, branch.symbol, index, out)
        else:
            _expand_copies(grammar, chooser, branch, index, out)
        chooser.end()


def _expand_copies(grammar: Grammar, chooser: Chooser, branch: Branch, parent: int, out: list[Vertex]) -> None:
    """Draw the multiplicity of a Set node's branch and expand each copy."""
    assert branch.multiplicity is not None
    copies = chooser.copies(branch)
    index = len(out)
    out.append(Vertex(branch.symbol, "set", parent, str(copies), math.log(branch.multiplicity[copies])))
    for copy in range(copies):
        chooser.begin_copy(branch.symbol, copies - 1 - copy)
        expand(grammar, chooser, branch.symbol, index, out)
        chooser.end()
